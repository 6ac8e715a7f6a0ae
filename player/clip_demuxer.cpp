// SPDX-License-Identifier: MIT
#include "player/clip_demuxer.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "container/base/out_of_memory.hpp"
#include "player/video_tracks.hpp"

namespace relit::player {

Unexpected ClipDemuxer::in_file(const Error& error) const {
  return fail(error.code, name_ + ": " + error.message);
}

Result<ClipDemuxer> ClipDemuxer::open(std::unique_ptr<container::ByteSource> source,
                                      const std::string& name, const DemuxOptions& options) {
  return catch_out_of_memory("opening a clip",
                             [&] { return open_clip(std::move(source), name, options, nullptr); });
}

Result<ClipDemuxer> ClipDemuxer::another(std::unique_ptr<container::ByteSource> source,
                                         const DemuxOptions& options) const {
  return catch_out_of_memory("opening another clip", [&] {
    return open_clip(std::move(source), name_, options, statics_);
  });
}

Result<ClipDemuxer> ClipDemuxer::open_clip(std::unique_ptr<container::ByteSource> source,
                                           const std::string& name, const DemuxOptions& options,
                                           std::shared_ptr<const Statics> statics) {
  container::ReaderOptions reading;
  reading.sparing = options.sparing;
  auto reader = container::Reader::open(std::move(source), reading);
  if (!reader) return fail(reader.error().code, name + ": " + reader.error().message);
  ClipDemuxer demuxer(std::move(*reader), name, options);
  if (statics) {
    demuxer.statics_ = std::move(statics);
    RELIT_TRY(demuxer.pass_statics());
  } else {
    RELIT_ASSIGN(demuxer.statics_, demuxer.load_statics());
  }
  RELIT_TRY(demuxer.choose_clip());
  demuxer.want_layers({});
  return demuxer;
}

Result<std::shared_ptr<const ClipDemuxer::Statics>> ClipDemuxer::load_statics() {
  auto statics = std::make_shared<Statics>();
  auto contents = container::load_static(reader_);
  if (!contents) return in_file(contents.error());
  statics->contents = std::move(*contents);
  const container::SkeletonRecord& skeleton = statics->contents.skeleton;
  for (const container::MeshRecord& record : statics->contents.meshes) {
    auto mesh = decoders::decode_mesh(record, skeleton.palette.size(), skeleton.morph_weight_count);
    if (!mesh) return in_file(mesh.error());
    statics->meshes.push_back(std::move(*mesh));
  }
  return std::shared_ptr<const Statics>(std::move(statics));
}

// To the first segment of a file whose static part is known.
Status ClipDemuxer::pass_statics() {
  if (reader_.header() != contents().header) {
    return fail(ErrorCode::kInvalid, name_ + ": this source holds another file");
  }
  const auto index = reader_.read_index();
  if (index && !index->segments.empty()) {
    if (reader_.seek_to_segment(index->segments.front())) return {};
  }
  auto contents = container::load_static(reader_);
  if (!contents) return in_file(contents.error());
  return {};
}

Status ClipDemuxer::choose_clip() {
  RELIT_ASSIGN(const container::ClipRecord* clip, find_clip(contents(), options_.clip, name_));
  clip_ = *clip;
  timeline_ = container::Timeline(clip_);
  const auto& models = contents().models;
  const auto& poses = contents().pose_tracks;
  const auto model = std::ranges::find(models, clip_.id, &container::ModelRecord::clip_id);
  const auto pose = std::ranges::find(poses, clip_.id, &container::PoseTrackRecord::clip_id);
  if (model == models.end() || pose == poses.end()) {
    return fail(ErrorCode::kUnsupported,
                name_ + ": clip \"" + clip_.name + "\" has no appearance model or no pose track");
  }
  model_ = *model;
  pose_ = *pose;
  layers_ = contents().layers_of(model_.id);
  return {};
}

Result<decoders::PoseTrack> ClipDemuxer::open_poses() const {
  auto track = decoders::PoseTrack::create(contents().skeleton, pose_, meshes());
  if (!track) return in_file(track.error());
  return track;
}

void ClipDemuxer::want_layers(std::span<const std::uint8_t> wanted) {
  want_poses_alone();
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    if (!wanted.empty() && (i >= wanted.size() || wanted[i] == 0)) continue;
    tracks_.push_back(layers_[i].mantissa_track);
    if (layers_[i].has_exponents) tracks_.push_back(layers_[i].exponent_track);
  }
  std::ranges::sort(tracks_);
  reader_.set_wanted_tracks(tracks_);
  find_last_chunk();
}

void ClipDemuxer::want_poses_alone() {
  tracks_.assign(1, pose_.track_id);
  reader_.set_wanted_tracks(tracks_);
  find_last_chunk();
}

// Chunks come in the order that the segment lists: after the last one it need not be waited for.
void ClipDemuxer::find_last_chunk() {
  last_chunk_.reset();
  if (!segment_) return;
  for (const auto& chunk : segment_->chunks) {
    if (std::ranges::binary_search(tracks_, chunk.track_id)) last_chunk_ = chunk.track_id;
  }
}

void ClipDemuxer::recycle(container::ChunkRecord&& chunk) { reader_.recycle(std::move(chunk)); }

// Damage costs the frames it hit; what comes from the source itself ends playback.
Status ClipDemuxer::note_damage(const Error& error) {
  if (error.code == ErrorCode::kIo || error.code == ErrorCode::kCancelled ||
      error.code == ErrorCode::kUnsupported) {
    return in_file(error);
  }
  if (first_loss_.empty()) first_loss_ = name_ + ": " + error.message;
  return {};
}

PlaybackLoss ClipDemuxer::loss() const {
  PlaybackLoss loss;
  loss.first = first_loss_;
  const container::ReaderLoss lost = reader_.loss();
  loss.records =
      lost.damaged_records - std::min<std::uint64_t>(lost.damaged_records, contents().repaired);
  loss.segments = lost.missing_segments;
  return loss;
}

void ClipDemuxer::note_segment(const container::IndexRecord::Entry& entry) {
  segments_.insert_or_assign(entry.first_frame, entry);
  first_frames_.insert_or_assign(entry.first_tick, entry.first_frame);
}

ClipDemuxer::Event ClipDemuxer::take_segment(container::SegmentRecord segment,
                                             std::uint64_t offset_bytes, std::uint64_t target) {
  if (segment_) complete_end_ = segment_->first_frame + segment_->frame_count;
  segment_.reset();
  const std::uint64_t end = segment.first_frame + segment.frame_count;
  const bool ours = segment.clip_id == clip_.id;
  if (ours) {
    // A source that only goes forward needs no map of what lies behind.
    if (reader_.seekable()) {
      note_segment({segment.index, segment.clip_id, segment.first_frame, segment.frame_count,
                    offset_bytes, segment.first_tick});
    }
    timeline_.add(segment);
    complete_end_ = std::max(complete_end_, segment.first_frame);
  }
  // On the way to a frame further on nothing of what lies before its segment is needed.
  if (ours && end > target) {
    segment_.swap_in(segment);
    find_last_chunk();
    if (!last_chunk_) complete_end_ = end;
  } else {
    if (ours) complete_end_ = end;
    reader_.skip_segment();
  }
  reader_.recycle(std::move(segment));
  return Event::kSegment;
}

ClipDemuxer::Event ClipDemuxer::take(container::Record record, std::uint64_t target,
                                     container::ChunkRecord& chunk) {
  if (auto* segment = std::get_if<container::SegmentRecord>(&record.body)) {
    return take_segment(std::move(*segment), record.offset_bytes, target);
  }
  auto* came = std::get_if<container::ChunkRecord>(&record.body);
  if (came == nullptr || !segment_) return Event::kNothing;
  if (came->track_id == last_chunk_) {
    complete_end_ = segment_->first_frame + segment_->frame_count;
  }
  chunk = std::move(*came);
  return Event::kChunk;
}

Result<ClipDemuxer::Event> ClipDemuxer::step(std::uint64_t target, container::ChunkRecord& chunk) {
  return catch_out_of_memory("reading a clip", [&]() -> Result<Event> {
    if (ended_) return Event::kEnd;
    auto record = reader_.next();
    if (!record) return pass_damage(record.error());
    if (*record) return take(std::move(**record), target, chunk);
    ended_ = true;
    return Event::kEnd;
  });
}

Result<ClipDemuxer::Event> ClipDemuxer::pass_damage(const Error& error) {
  RELIT_TRY(note_damage(error));
  if (reader_.can_continue()) return Event::kNothing;
  segment_.reset();
  auto found = reader_.resync();
  if (!found) return in_file(found.error());
  ended_ = !*found;
  return ended_ ? Event::kEnd : Event::kNothing;
}

void ClipDemuxer::skip_segment() {
  if (!segment_) return;
  complete_end_ = std::max(complete_end_, segment_->first_frame + segment_->frame_count);
  segment_.reset();
  reader_.skip_segment();
}

// A file without an index was cut, or is still being written: what has been read so far serves as
// one.
Status ClipDemuxer::load_index() {
  if (index_loaded_ || !reader_.seekable()) return {};
  const auto found = reader_.read_index();
  if (!found &&
      (found.error().code == ErrorCode::kIo || found.error().code == ErrorCode::kCancelled)) {
    return in_file(found.error());
  }
  index_loaded_ = true;
  if (!found) return {};
  for (const auto& entry : found->segments)
    if (entry.clip_id == clip_.id) note_segment(entry);
  return {};
}

// Goes to the segment of a frame that is not the next one, where the source can seek and the place
// is known.
Result<bool> ClipDemuxer::jump(std::uint64_t frame) {
  return catch_out_of_memory("going to a frame", [&]() -> Result<bool> {
    if (!reader_.seekable()) return false;
    RELIT_TRY(load_index());
    const auto next = segments_.upper_bound(frame);
    if (next == segments_.begin()) return false;
    const container::IndexRecord::Entry target = std::prev(next)->second;
    if (frame >= target.first_frame + target.frame_count) return false;
    if (const Status status = reader_.seek_to_segment(target); !status) {
      RELIT_TRY(note_damage(status.error()));
      auto found = reader_.resync();
      if (!found) return in_file(found.error());
    }
    segment_.reset();
    ended_ = false;
    complete_end_ = target.first_frame;
    return true;
  });
}

Result<bool> ClipDemuxer::jump_to_tick(std::uint64_t tick) {
  RELIT_TRY(load_index());
  const auto next = first_frames_.upper_bound(tick);
  if (next == first_frames_.begin()) return false;
  return jump(std::prev(next)->second);
}

Status ClipDemuxer::check_tick(std::uint64_t tick) const {
  if (tick < clip_.duration_ticks) return {};
  const double end_s = static_cast<double>(tick) * static_cast<double>(clip_.tick_rate.den) /
                       static_cast<double>(clip_.tick_rate.num);
  return fail(ErrorCode::kNotFound,
              name_ + ": clip \"" + clip_.name + "\" has ended at " + std::to_string(end_s) + " s");
}

Unexpected ClipDemuxer::missing_tick(std::uint64_t tick) const {
  return fail(ErrorCode::kNotFound, name_ + ": the segment of tick " + std::to_string(tick) +
                                        " of clip \"" + clip_.name + "\" is missing");
}

Status ClipDemuxer::check_frame(std::uint64_t frame) const {
  if (frame < clip_.frame_count) return {};
  return fail(ErrorCode::kNotFound, name_ + ": no frame " + std::to_string(frame) + "; clip \"" +
                                        clip_.name + "\" has " + std::to_string(clip_.frame_count) +
                                        " frames, from 0 on");
}

Unexpected ClipDemuxer::gone_by(std::uint64_t frame) const {
  return fail(ErrorCode::kNotFound, name_ + ": frame " + std::to_string(frame) +
                                        " has gone by, and this source cannot go back");
}

}  // namespace relit::player
