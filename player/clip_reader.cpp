// SPDX-License-Identifier: MIT
#include "player/clip_reader.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "container/base/out_of_memory.hpp"
#include "player/video_tracks.hpp"

namespace relit::player {

Unexpected ClipReader::in_file(const Error& error) const {
  return fail(error.code, name_ + ": " + error.message);
}

Status ClipReader::choose_clip(const std::string& wanted) {
  RELIT_ASSIGN(const container::ClipRecord* clip, find_clip(contents_, wanted, name_));
  clip_ = *clip;
  timeline_ = container::Timeline(clip_);
  const auto model =
      std::find_if(contents_.models.begin(), contents_.models.end(),
                   [&](const container::ModelRecord& m) { return m.clip_id == clip_.id; });
  const auto pose =
      std::find_if(contents_.pose_tracks.begin(), contents_.pose_tracks.end(),
                   [&](const container::PoseTrackRecord& p) { return p.clip_id == clip_.id; });
  if (model == contents_.models.end() || pose == contents_.pose_tracks.end()) {
    return fail(ErrorCode::kUnsupported,
                name_ + ": clip \"" + clip_.name + "\" has no appearance model or no pose track");
  }
  model_ = *model;
  layers_ = contents_.layers_of(model_.id);
  pose_track_ = pose->track_id;
  for (const container::MeshRecord& record : contents_.meshes) {
    auto mesh = decoders::decode_mesh(record, contents_.skeleton.palette.size(),
                                      contents_.skeleton.morph_weight_count);
    if (!mesh) return in_file(mesh.error());
    meshes_.push_back(std::move(*mesh));
  }
  auto track = decoders::PoseTrack::create(contents_.skeleton, *pose, meshes_);
  if (!track) return in_file(track.error());
  poses_ = std::move(*track);
  return {};
}

Result<ClipReader> ClipReader::open(std::unique_ptr<container::ByteSource> source,
                                    const std::string& name, const ClipOptions& options) {
  return catch_out_of_memory("opening a clip",
                             [&] { return open_clip(std::move(source), name, options); });
}

Result<ClipReader> ClipReader::open_clip(std::unique_ptr<container::ByteSource> source,
                                         const std::string& name, const ClipOptions& options) {
  container::ReaderOptions reading;
  reading.sparing = options.spares_bytes();
  auto reader = container::Reader::open(std::move(source), reading);
  if (!reader) return fail(reader.error().code, name + ": " + reader.error().message);
  ClipReader clip(std::move(*reader), name);
  auto contents = container::load_static(clip.reader_);
  if (!contents) return clip.in_file(contents.error());
  clip.contents_ = std::move(*contents);
  RELIT_TRY(clip.choose_clip(options.clip));
  std::vector<std::uint32_t> tracks{clip.pose_track_};
  if (options.planes) {
    std::vector<std::uint8_t> wanted(clip.layers_.size(), 1);
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      if (options.layers >= 0 && i >= static_cast<std::size_t>(options.layers)) wanted[i] = 0;
      if (wanted[i] == 0) continue;
      tracks.push_back(clip.layers_[i].mantissa_track);
      if (clip.layers_[i].has_exponents) tracks.push_back(clip.layers_[i].exponent_track);
    }
    auto planes =
        decoders::PlaneDecoder::open(clip.model_, clip.layers_, {options.threads, wanted});
    if (!planes) return clip.in_file(planes.error());
    clip.planes_ = std::move(*planes);
  }
  // Pose, mantissas and exponents of the most important layer.
  clip.impatient_ = options.impatient;
  const bool exponents = tracks.size() > 1 && clip.layers_.front().has_exponents;
  clip.first_picture_.assign(
      tracks.begin(),
      tracks.begin() + std::min<std::ptrdiff_t>(std::ssize(tracks), exponents ? 3 : 2));
  std::sort(tracks.begin(), tracks.end());
  clip.tracks_ = tracks;
  clip.reader_.set_wanted_tracks(std::move(tracks));
  return clip;
}

// Damage costs the frames it hit; what comes from the source itself ends playback.
Status ClipReader::note_damage(const Error& error) {
  if (error.code == ErrorCode::kIo || error.code == ErrorCode::kCancelled ||
      error.code == ErrorCode::kUnsupported) {
    return in_file(error);
  }
  if (loss_.first.empty()) loss_.first = name_ + ": " + error.message;
  return {};
}

void ClipReader::note_segment(const container::IndexRecord::Entry& entry) {
  segments_.insert_or_assign(entry.first_frame, entry);
  first_frames_.insert_or_assign(entry.first_tick, entry.first_frame);
}

PlaybackLoss ClipReader::loss() const {
  PlaybackLoss loss = loss_;
  const container::ReaderLoss lost = reader_.loss();
  loss.records =
      lost.damaged_records - std::min<std::uint64_t>(lost.damaged_records, contents_.repaired);
  loss.segments = lost.missing_segments;
  return loss;
}

void ClipReader::note_arrival(std::uint32_t track_id) {
  // Chunks come in the order that the segment lists: after the last one it need not be waited for.
  if (track_id == last_chunk_) complete_end_ = segment_->first_frame + segment_->frame_count;
  std::erase(missing_, track_id);
}

Status ClipReader::take(container::Record record) {
  if (auto* segment = std::get_if<container::SegmentRecord>(&record.body)) {
    if (segment_) complete_end_ = segment_->first_frame + segment_->frame_count;
    segment_.reset();
    const bool ours = segment->clip_id == clip_.id;
    if (ours) {
      note_segment({segment->index, segment->clip_id, segment->first_frame, segment->frame_count,
                    record.offset_bytes, segment->first_tick});
      timeline_.add(*segment);
      complete_end_ = std::max(complete_end_, segment->first_frame);
    }
    // On the way to a frame further on nothing of what lies before its segment is decoded.
    const std::uint64_t end = segment->first_frame + segment->frame_count;
    if (!ours || end <= wanted_frame_) {
      if (ours) complete_end_ = end;
      reader_.skip_segment();
      return {};
    }
    segment_ = std::move(*segment);
    missing_ = first_picture_;
    for (const auto& chunk : segment_->chunks) {
      if (std::binary_search(tracks_.begin(), tracks_.end(), chunk.track_id))
        last_chunk_ = chunk.track_id;
    }
    return {};
  }
  auto* chunk = std::get_if<container::ChunkRecord>(&record.body);
  if (chunk == nullptr || !segment_) return {};
  note_arrival(chunk->track_id);
  if (chunk->track_id != pose_track_) {
    if (!planes_) return {};
    const Status status = planes_->add_chunk(*segment_, std::move(*chunk));
    return status ? status : note_damage(status.error());
  }
  if (chunk->packets.empty()) return {};
  const container::Packet& packet = chunk->packets.front();
  const std::span<const std::uint8_t> bytes(chunk->data.data() + packet.offset, packet.size);
  const Status status = poses_->add_packet(bytes, segment_->first_frame, segment_->frame_count);
  return status ? status : note_damage(status.error());
}

Status ClipReader::read_until(std::uint64_t index) {
  wanted_frame_ = index;
  while (!ended_ && complete_end_ <= index) {
    const bool enough = segment_ && index < segment_->first_frame + segment_->frame_count &&
                        impatient_ && missing_.empty();
    if (enough) break;
    auto record = reader_.next();
    if (record && *record) {
      RELIT_TRY(take(std::move(**record)));
      continue;
    }
    if (record) {
      ended_ = true;
      break;
    }
    RELIT_TRY(note_damage(record.error()));
    if (reader_.can_continue()) continue;
    segment_.reset();
    auto found = reader_.resync();
    if (!found) return in_file(found.error());
    ended_ = !*found;
  }
  return {};
}

// A file without an index was cut, or is still being written: what has been read so far serves as
// one.
Status ClipReader::load_index() {
  if (index_loaded_ || !reader_.seekable()) return {};
  index_loaded_ = true;
  const auto found = reader_.read_index();
  if (!found && found.error().code == ErrorCode::kIo) return in_file(found.error());
  if (!found) return {};
  for (const auto& entry : found->segments)
    if (entry.clip_id == clip_.id) note_segment(entry);
  return {};
}

// Goes to the segment of a frame that is not the next one, where the source can seek and the place
// is known.
Result<bool> ClipReader::jump(std::uint64_t index) {
  if (!reader_.seekable()) return false;
  RELIT_TRY(load_index());
  const auto next = segments_.upper_bound(index);
  if (next == segments_.begin()) return false;
  const container::IndexRecord::Entry target = std::prev(next)->second;
  if (index >= target.first_frame + target.frame_count) return false;
  if (const Status status = reader_.seek_to_segment(target); !status) {
    RELIT_TRY(note_damage(status.error()));
    auto found = reader_.resync();
    if (!found) return in_file(found.error());
  }
  segment_.reset();
  ended_ = false;
  complete_end_ = kept_begin_ = target.first_frame;
  return true;
}

Status ClipReader::decode(std::uint64_t index) {
  RELIT_TRY(poses_->sample(static_cast<double>(index), scratch_.pose));
  if (!planes_) return {};
  Status decoded = planes_->frame(index, scratch_.planes);
  const bool early = std::exchange(impatient_, false) && missing_.empty();
  if (!decoded && decoded.error().code == ErrorCode::kNotFound && early) return {};
  return decoded;
}

Status ClipReader::frame(std::uint64_t index, ClipFrame& out) {
  return catch_out_of_memory("decoding a frame", [&] { return decode_frame(index, out); });
}

Status ClipReader::decode_frame(std::uint64_t index, ClipFrame& out) {
  if (index >= clip_.frame_count) {
    return fail(ErrorCode::kNotFound, name_ + ": no frame " + std::to_string(index) + "; clip \"" +
                                          clip_.name + "\" has " +
                                          std::to_string(clip_.frame_count) + " frames, from 0 on");
  }
  const bool back = index < kept_begin_;
  const bool ahead = index >= complete_end_ &&
                     !(segment_ && index < segment_->first_frame + segment_->frame_count);
  if (back || (ahead && index > complete_end_)) {
    RELIT_ASSIGN(const bool jumped, jump(index));
    if (back && !jumped) {
      return fail(ErrorCode::kNotFound, name_ + ": frame " + std::to_string(index) +
                                            " has gone by, and this source cannot go back");
    }
  }
  RELIT_TRY(read_until(index));
  const Status decoded = decode(index);
  if (decoded) {
    std::swap(out, scratch_);
    shown_ = true;
    forget_before(index);
    return {};
  }
  RELIT_TRY(note_damage(decoded.error()));
  if (!shown_) return in_file(decoded.error());
  ++loss_.frames;
  return {};
}

Result<std::uint64_t> ClipReader::frame_at(std::uint64_t tick) {
  return catch_out_of_memory("looking for a frame", [&] { return find_frame(tick); });
}

Result<std::uint64_t> ClipReader::find_frame(std::uint64_t tick) {
  if (tick >= clip_.duration_ticks) {
    return fail(ErrorCode::kNotFound, name_ + ": clip \"" + clip_.name + "\" has ended at " +
                                          std::to_string(static_cast<double>(tick) *
                                                         static_cast<double>(clip_.tick_rate.den) /
                                                         static_cast<double>(clip_.tick_rate.num)) +
                                          " s");
  }
  if (const auto known = timeline_.frame_at(tick)) return *known;
  // The segment that begins last before the tick says which of its frames is shown.
  RELIT_TRY(load_index());
  const auto next = first_frames_.upper_bound(tick);
  if (next != first_frames_.begin()) {
    const std::uint64_t first = std::prev(next)->second;
    RELIT_ASSIGN(const bool jumped, jump(first));
    if (jumped) RELIT_TRY(read_until(first));
  }
  for (;;) {
    if (const auto known = timeline_.frame_at(tick)) return *known;
    const std::uint64_t before = complete_end_;
    RELIT_TRY(read_until(complete_end_));
    if (ended_ || complete_end_ == before) break;
  }
  return fail(ErrorCode::kNotFound, name_ + ": the segment of tick " + std::to_string(tick) +
                                        " of clip \"" + clip_.name + "\" is missing");
}

std::uint64_t ClipReader::first_tick(std::uint64_t index) const {
  return timeline_.first_tick(index).value_or(index);
}

std::uint32_t ClipReader::ticks_of(std::uint64_t index) const {
  return timeline_.ticks_of(index).value_or(1);
}

void ClipReader::forget_before(std::uint64_t index) {
  if (!segment_ || segment_->first_frame > index || segment_->first_frame == kept_begin_) return;
  kept_begin_ = segment_->first_frame;
  poses_->forget_before(kept_begin_);
  if (planes_) planes_->forget_before(kept_begin_);
}

}  // namespace relit::player
