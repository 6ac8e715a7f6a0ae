// SPDX-License-Identifier: MIT
#include "player/recover.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "container/record_codec.hpp"
#include "container/references.hpp"
#include "container/segment_order.hpp"
#include "player/recover_static.hpp"
#include "player/rewrite.hpp"

namespace relit::player {
namespace {

using namespace container;

/// A segment with those of its chunks that have been found.
struct Gathered {
  SegmentRecord segment;
  bool from_index = false;  ///< its record was hit: what tracks it had is not known
  std::vector<ChunkRecord> chunks;

  [[nodiscard]] bool has(std::uint32_t track) const {
    return std::ranges::find(chunks, track, &ChunkRecord::track_id) != chunks.end();
  }
  [[nodiscard]] bool announces(std::uint32_t track) const {
    return from_index ||
           std::ranges::find(segment.chunks, track, &SegmentRecord::ChunkSize::track_id) !=
               segment.chunks.end();
  }
};

/// The frames of a track that are in the output.
struct Coverage {
  std::vector<FrameRun> spans;  ///< rising, joined where they touch
  void add(std::uint64_t first, std::uint64_t last) {
    if (!spans.empty() && spans.back().last + 1 == first)
      spans.back().last = last;
    else
      spans.push_back({first, last});
  }
  [[nodiscard]] std::vector<FrameRun> missing(std::uint64_t frames) const {
    std::vector<FrameRun> gaps;
    std::uint64_t next = 0;
    for (const FrameRun& s : spans) {
      if (s.first > next) gaps.push_back({next, s.first - 1});
      next = s.last + 1;
    }
    if (next < frames) gaps.push_back({next, frames - 1});
    return gaps;
  }
};

/// The second half of recover(): carries segments over. Without a writer it only finds out which
/// clips have any.
class SegmentRecovery {
 public:
  SegmentRecovery(RecordScan& scan, const Survey& found, const FileContents& contents,
                  Writer* writer)
      : scan_(scan), found_(found), contents_(contents), writer_(writer) {
    for (const ClipRecord& clip : contents.clips)
      orders_.emplace(clip.id, SegmentOrder(clip.frame_count, clip.duration_ticks));
    if (found.index)
      for (const auto& entry : found.index->segments) index_.emplace(entry.segment_index, entry);
  }

  Status run() {
    for (;;) {
      RELIT_ASSIGN(const auto record, scan_.next());
      if (!record || record->offset_bytes >= found_.end_bytes) break;
      RELIT_TRY(take(*record));
    }
    RELIT_TRY(flush());
    note_end();
    return {};
  }

  [[nodiscard]] const std::set<std::uint32_t>& clips() const { return clips_; }
  [[nodiscard]] bool announced_lost() const { return announced_lost_; }

  void fill(RecoverReport& report) const {
    report.segments = segments_;
    report.partial_segments = partial_;
    report.lost_segments = lost_segments_;
    for (const ClipRecord& clip : contents_.clips) {
      for (const PoseTrackRecord& pose : contents_.pose_tracks)
        if (pose.clip_id == clip.id) add_loss(report, clip, pose.track_id, "pose");
      for (const ModelRecord& model : contents_.models)
        if (model.clip_id == clip.id) add_layers(report, clip, model.id);
    }
    report.frames_lost = announced_lost_ || lost_segments_ > 0;
  }

 private:
  void add_layers(RecoverReport& report, const ClipRecord& clip, std::uint32_t model_id) const {
    for (const LayerRecord& layer : contents_.layers) {
      if (layer.model_id != model_id) continue;
      const std::string name = "layer " + std::to_string(layer.id);
      add_loss(report, clip, layer.mantissa_track, name);
      if (layer.has_exponents) add_loss(report, clip, layer.exponent_track, "exponents of " + name);
    }
  }

  void add_loss(RecoverReport& report, const ClipRecord& clip, std::uint32_t track,
                std::string what) const {
    const auto covered = covered_.find(track);
    auto gaps =
        (covered == covered_.end() ? Coverage{} : covered->second).missing(clip.frame_count);
    if (gaps.empty()) return;
    report.tracks.push_back({clip.id, clip.name, track, std::move(what), std::move(gaps)});
  }

  Status take(const FoundRecord& record) {
    const RecordType type = record.header.type;
    if (type == types::kSegment) return take_segment(record);
    if (type == types::kChunk) return record.intact ? take_chunk() : Status{};
    const bool plain = (record.header.flags & flags::kCriticalMask) == 0;
    if (!may_be_copied(type) || !plain || !record.intact) return {};
    RELIT_TRY(flush());
    return writer_ == nullptr ? Status{} : writer_->add_ancillary(type, scan_.payload());
  }

  Status take_segment(const FoundRecord& record) {
    if ((record.header.flags & flags::kCriticalMask) != 0) return {};
    RELIT_TRY(flush());
    if (!record.intact) return {};
    auto segment = parse_segment(scan_.payload());
    if (segment) begin(std::move(*segment), false);
    return {};
  }

  Status take_chunk() {
    auto chunk = parse_chunk(scan_.payload());
    if (!chunk) return {};
    if (!current_ || current_->segment.index != chunk->segment_index) {
      const auto entry = index_.find(chunk->segment_index);
      if (entry == index_.end() || chunk->segment_index < next_index_) return {};
      RELIT_TRY(flush());
      if (auto segment = rebuild(entry->second)) begin(std::move(*segment), true);
    }
    if (!current_ || !current_->announces(chunk->track_id) || current_->has(chunk->track_id) ||
        !check_chunk(current_->segment, *chunk))
      return {};
    current_->chunks.push_back(std::move(*chunk));
    return {};
  }

  /// A segment whose record was hit, from what the index says; nothing if the durations of its
  /// frames stood there alone.
  [[nodiscard]] std::optional<SegmentRecord> rebuild(const IndexRecord::Entry& entry) const {
    const auto clip = std::ranges::find(contents_.clips, entry.clip_id, &ClipRecord::id);
    if (clip == contents_.clips.end() || clip->duration_ticks != clip->frame_count)
      return std::nullopt;
    SegmentRecord segment;
    segment.index = entry.segment_index;
    segment.clip_id = entry.clip_id;
    segment.first_frame = entry.first_frame;
    segment.frame_count = entry.frame_count;
    segment.first_tick = entry.first_tick;
    return segment;
  }

  void begin(SegmentRecord segment, bool from_index) {
    if (segment.index < next_index_) {
      announced_lost_ = true;
      return;
    }
    lost_segments_ += segment.index - next_index_;
    next_index_ = segment.index + std::uint64_t{1};
    current_ = Gathered{std::move(segment), from_index, {}};
  }

  /// Writes the segment that has been gathered, as far as it can be shown.
  Status flush() {
    if (!current_) return {};
    Gathered gathered = std::move(*current_);
    current_.reset();
    const SegmentRecord& segment = gathered.segment;
    const auto order = orders_.find(segment.clip_id);
    const std::size_t announced =
        gathered.from_index ? gathered.chunks.size() + 1 : segment.chunks.size();
    if (order != orders_.end()) drop_unusable(gathered);
    if (order == orders_.end() || gathered.chunks.empty() || !can_be_shown(gathered) ||
        !order->second.check(segment)) {
      ++lost_segments_;
      return {};
    }
    order->second.accept(segment);
    clips_.insert(segment.clip_id);
    ++segments_;
    const bool partial = gathered.chunks.size() < announced;
    partial_ += partial;
    announced_lost_ |= partial;
    for (const ChunkRecord& chunk : gathered.chunks)
      covered_[chunk.track_id].add(segment.first_frame,
                                   segment.first_frame + segment.frame_count - 1);
    if (writer_ == nullptr) return {};
    return writer_->write_segment({segment.clip_id, segment.first_frame, segment.frame_count,
                                   segment.durations, segment.first_tick},
                                  std::move(gathered.chunks));
  }

  /// Chunks of tracks that are not declared, and mantissas and exponents without each other.
  void drop_unusable(Gathered& gathered) const {
    std::set<std::uint32_t> usable;
    for (const PoseTrackRecord& pose : contents_.pose_tracks)
      if (pose.clip_id == gathered.segment.clip_id) usable.insert(pose.track_id);
    for (const LayerRecord& layer : layers_of_clip(gathered.segment.clip_id)) {
      if (!gathered.has(layer.mantissa_track)) continue;
      if (layer.has_exponents && !gathered.has(layer.exponent_track)) continue;
      usable.insert(layer.mantissa_track);
      if (layer.has_exponents) usable.insert(layer.exponent_track);
    }
    std::erase_if(gathered.chunks,
                  [&](const ChunkRecord& c) { return !usable.contains(c.track_id); });
  }

  /// Whether pose and first layer are there, or never were.
  [[nodiscard]] bool can_be_shown(const Gathered& gathered) const {
    for (const PoseTrackRecord& pose : contents_.pose_tracks) {
      if (pose.clip_id == gathered.segment.clip_id && gathered.announces(pose.track_id) &&
          !gathered.has(pose.track_id))
        return false;
    }
    const auto layers = layers_of_clip(gathered.segment.clip_id);
    return layers.empty() || !gathered.announces(layers.front().mantissa_track) ||
           gathered.has(layers.front().mantissa_track);
  }

  [[nodiscard]] std::vector<LayerRecord> layers_of_clip(std::uint32_t clip_id) const {
    std::vector<LayerRecord> layers;
    for (const ModelRecord& model : contents_.models)
      if (model.clip_id == clip_id)
        std::ranges::move(contents_.layers_of(model.id), std::back_inserter(layers));
    return layers;
  }

  /// Segments behind the last one found: the index counts them; without one, frames that are
  /// missing from a file with damage are taken for lost.
  void note_end() {
    if (found_.index) {
      if (!found_.index->segments.empty()) {
        const std::uint64_t end = found_.index->segments.back().segment_index + std::uint64_t{1};
        lost_segments_ += end - std::min(end, next_index_);
      }
      return;
    }
    if (found_.finished && found_.damaged_bytes == 0) return;
    for (const auto& [clip, order] : orders_) {
      const auto record = std::ranges::find(contents_.clips, clip, &ClipRecord::id);
      announced_lost_ |= has_tracks(clip) && order.next_frame() < record->frame_count;
    }
  }

  [[nodiscard]] bool has_tracks(std::uint32_t clip) const {
    const auto of_clip = [&](const auto& r) { return r.clip_id == clip; };
    return std::ranges::any_of(contents_.pose_tracks, of_clip) || !layers_of_clip(clip).empty();
  }

  RecordScan& scan_;
  const Survey& found_;
  const FileContents& contents_;
  Writer* writer_;
  std::map<std::uint32_t, SegmentOrder> orders_;
  std::map<std::uint32_t, IndexRecord::Entry> index_;
  std::optional<Gathered> current_;
  std::uint64_t next_index_ = 0;
  std::map<std::uint32_t, Coverage> covered_;  ///< by track
  std::set<std::uint32_t> clips_;              ///< with a segment
  std::uint64_t segments_ = 0;
  std::uint64_t partial_ = 0;
  std::uint64_t lost_segments_ = 0;
  bool announced_lost_ = false;
};

/// Clips of which no frame is left would only be names.
Status drop_empty_clips(ByteSource& source, const Survey& found, StaticPart& part) {
  FileContents& contents = part.contents;
  if (contents.pose_tracks.empty() && contents.layers.empty()) {
    // Still meshes; or a file that was cut before it came to more.
    const bool whole = found.finished || found.index || !found.copies.empty();
    if (whole && !contents.meshes.empty()) return {};
    return fail(ErrorCode::kCorrupt, "neither a segment nor a still mesh is left");
  }
  RELIT_ASSIGN(RecordScan scan, RecordScan::create(source));
  SegmentRecovery trial(scan, found, contents, nullptr);
  RELIT_TRY(trial.run());
  std::vector<std::uint32_t> empty;
  for (const ClipRecord& clip : contents.clips)
    if (!trial.clips().contains(clip.id)) empty.push_back(clip.id);
  if (empty.size() == contents.clips.size()) return fail(ErrorCode::kCorrupt, "no segment is left");
  for (const std::uint32_t id : empty) {
    const ClipRecord& clip = *contents.find_clip(id);
    part.lost.push_back("clip " + std::to_string(id) + " \"" + clip.name +
                        "\": no segment of it is left");
    drop_clip(contents, id);
  }
  return {};
}

Result<RecoverReport> run(ByteSource& source, ByteSink& sink) {
  RELIT_ASSIGN(RecordScan first, RecordScan::create(source));
  RELIT_ASSIGN(const Survey found, survey(first));
  if (found.originals.empty() && found.copies.empty())
    return fail(ErrorCode::kCorrupt, "nothing in it is a record of a .relit file");
  RELIT_ASSIGN(StaticPart part, recover_static(first, found));
  RELIT_TRY(drop_empty_clips(source, found, part));

  const std::string& program = part.contents.header.writer;
  RELIT_ASSIGN(Writer writer, Writer::create(sink, program, {.copies = true, .gaps = true}));
  RELIT_TRY(write_static(writer, part.contents));
  RELIT_ASSIGN(RecordScan second, RecordScan::create(source));
  SegmentRecovery segments(second, found, part.contents, &writer);
  RELIT_TRY(segments.run());
  RELIT_TRY(writer.finish());

  RecoverReport report;
  report.source_bytes = first.size_bytes();
  report.damaged_bytes = found.damaged_bytes;
  report.repaired = std::move(part.repaired);
  report.lost = std::move(part.lost);
  segments.fill(report);
  return report;
}

}  // namespace

Result<RecoverReport> recover(ByteSource& source, ByteSink& sink) {
  auto report = run(source, sink);
  if (report || report.error().code != ErrorCode::kCorrupt) return report;
  return fail(ErrorCode::kCorrupt, "nothing usable: " + report.error().message);
}

}  // namespace relit::player
