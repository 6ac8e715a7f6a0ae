// SPDX-License-Identifier: MIT
#include "container/writer.hpp"

#include <algorithm>
#include <array>

#include "container/base/limits.hpp"
#include "container/record_checks.hpp"
#include "container/record_codec.hpp"

namespace relit::container {

using namespace checks;

Result<Writer> Writer::create(ByteSink& sink, const std::string& program,
                              const WriterOptions& options) {
  Writer writer(sink, options);
  const HeaderRecord header{kVersionMajor, kVersionMinor, program};
  const auto write = [&]() -> Status {
    RELIT_TRY(validate(header));
    RELIT_TRY(writer.write_bytes(kSignature));
    RELIT_TRY(writer.enter(order_of(types::kHeader)));
    return writer.write_static(types::kHeader, serialize(header));
  };
  RELIT_TRY(writer.settle(write(), "header"));
  return writer;
}

template <class R>
Status Writer::add_static(RecordType type, const R& record) {
  const auto write = [&]() -> Status {
    RELIT_TRY(enter(order_of(type)));
    RELIT_TRY(validate(record));
    RELIT_TRY(references_.add(record));
    auto payload = serialize(record);
    static_bytes_ += payload.size();
    RELIT_TRY(at_most(static_bytes_, limits::kStaticBytes, "size of all records before segments"));
    return write_static(type, std::move(payload));
  };
  return settle(write(), type_name(type).c_str());
}

Status Writer::write_static(RecordType type, std::vector<std::uint8_t> payload) {
  RELIT_TRY(write_record(type, payload));
  if (options_.copies) statics_.push_back({type, std::move(payload)});
  return {};
}

Status Writer::add(const ClipRecord& record) { return add_static(types::kClip, record); }
Status Writer::add(const ImageRecord& record) { return add_static(types::kImage, record); }
Status Writer::add(const MaterialRecord& record) { return add_static(types::kMaterial, record); }
Status Writer::add(const MeshRecord& record) { return add_static(types::kMesh, record); }
Status Writer::add(const SkeletonRecord& record) { return add_static(types::kSkeleton, record); }
Status Writer::add(const PoseTrackRecord& record) { return add_static(types::kPoseTrack, record); }
Status Writer::add(const ModelRecord& record) { return add_static(types::kModel, record); }
Status Writer::add(const LayerRecord& record) { return add_static(types::kLayer, record); }

Status Writer::add_ancillary(RecordType type, std::span<const std::uint8_t> payload) {
  const auto write = [&]() -> Status {
    if (closed_) return enter(order_);
    RELIT_REQUIRE(is_well_formed(type) && !is_critical(type),
                  "'" + type_name(type) + "' is not the type of an ancillary record");
    return write_record(type, payload);
  };
  return settle(write(), "ancillary record");
}

Status Writer::check_tracks(std::uint32_t clip_id, const std::vector<ChunkRecord>& chunks) const {
  const auto tracks = references_.tracks(clip_id);
  for (const ChunkRecord& chunk : chunks)
    RELIT_REQUIRE(std::ranges::find(tracks, chunk.track_id) != tracks.end(),
                  "track " + std::to_string(chunk.track_id) + " is not one of the clip's");
  for (const std::uint32_t track : tracks) {
    const auto count = std::ranges::count(chunks, track, &ChunkRecord::track_id);
    RELIT_REQUIRE(count == 1 || (count == 0 && options_.gaps),
                  "the segment needs exactly one chunk for track " + std::to_string(track));
  }
  return {};
}

/// What has been written of a clip, for the segment that comes next.
Result<SegmentOrder*> Writer::order_of_clip(std::uint32_t clip_id) {
  const auto frames = references_.frame_count(clip_id);
  const auto ticks = references_.duration_ticks(clip_id);
  RELIT_REQUIRE(frames && ticks, "clip " + std::to_string(clip_id) + " does not exist");
  return &written_.try_emplace(clip_id, *frames, *ticks).first->second;
}

Status Writer::write_segment(const SegmentInfo& info, std::vector<ChunkRecord> chunks) {
  const auto write = [&]() -> Status {
    if (order_ < order_of(types::kSegment)) RELIT_TRY(references_.finish());
    RELIT_TRY(enter(order_of(types::kSegment)));
    RELIT_ASSIGN(SegmentOrder* const written, order_of_clip(info.clip_id));
    RELIT_TRY(check_tracks(info.clip_id, chunks));
    const auto tracks = references_.tracks(info.clip_id);
    const auto place = [&](const ChunkRecord& c) { return std::ranges::find(tracks, c.track_id); };
    std::ranges::sort(chunks, {}, place);

    SegmentRecord segment;
    segment.index = static_cast<std::uint32_t>(index_.segments.size());
    segment.clip_id = info.clip_id;
    segment.first_frame = info.first_frame;
    segment.frame_count = info.frame_count;
    segment.first_tick = info.first_tick.value_or(written->next_tick());
    segment.durations = info.durations;
    // What it says without a list need not be listed.
    if (std::ranges::all_of(segment.durations, [](std::uint32_t t) { return t == 1; }) &&
        segment.durations.size() == segment.frame_count)
      segment.durations.clear();
    std::vector<std::vector<std::uint8_t>> payloads;
    for (ChunkRecord& chunk : chunks) {
      chunk.segment_index = segment.index;
      RELIT_TRY(validate(chunk));
      RELIT_TRY(check_chunk(segment, chunk));
      payloads.push_back(serialize(chunk));
      segment.chunks.push_back({chunk.track_id, record_bytes(payloads.back().size())});
      chunk.data = {};
    }
    RELIT_TRY(validate(segment));
    RELIT_TRY(written->check(segment));
    RELIT_REQUIRE(options_.gaps || segment.first_frame == written->next_frame(),
                  "the segment starts with frame " + std::to_string(segment.first_frame) +
                      ", the next one of its clip is " + std::to_string(written->next_frame()));
    index_.segments.push_back({segment.index, segment.clip_id, segment.first_frame,
                               segment.frame_count, offset_, segment.first_tick});
    RELIT_TRY(write_record(types::kSegment, serialize(segment)));
    for (const auto& payload : payloads) RELIT_TRY(write_record(types::kChunk, payload));
    written->accept(segment);
    return {};
  };
  return settle(write(), "segment");
}

Status Writer::finish() {
  const auto write = [&]() -> Status {
    if (order_ < order_of(types::kSegment)) RELIT_TRY(references_.finish());
    RELIT_TRY(enter(order_of(types::kIndex)));
    RELIT_TRY(check_complete());
    EndRecord end;
    end.copies_offset = statics_.empty() ? 0 : offset_;
    for (const Stored& record : statics_)
      RELIT_TRY(write_record(record.type, record.payload, flags::kCopy));
    end.index_offset = offset_;
    RELIT_TRY(validate(index_));
    RELIT_TRY(write_record(types::kIndex, serialize(index_)));
    end.file_bytes = offset_ + record_bytes(kEndPayloadBytes);
    RELIT_TRY(enter(order_of(types::kEnd)));
    return write_record(types::kEnd, serialize(end));
  };
  RELIT_TRY(settle(write(), "end of the file"));
  closed_ = true;
  return {};
}

Status Writer::check_complete() const {
  if (options_.gaps) return {};
  for (const std::uint32_t clip : references_.clips()) {
    if (references_.tracks(clip).empty()) continue;
    const auto done = written_.find(clip);
    const std::uint64_t frames = done == written_.end() ? 0 : done->second.next_frame();
    RELIT_REQUIRE(frames == references_.frame_count(clip),
                  "clip " + std::to_string(clip) + " has segments for " + std::to_string(frames) +
                      " of its " + std::to_string(*references_.frame_count(clip)) + " frames");
  }
  return {};
}

Status Writer::write_record(RecordType type, std::span<const std::uint8_t> payload,
                            std::uint32_t record_flags) {
  RELIT_TRY(at_most(payload.size(), limits::kRecordBytes, "size of the record"));
  RELIT_TRY(write_bytes(encode_header({type, record_flags, payload.size(), crc32(payload)})));
  RELIT_TRY(write_bytes(payload));
  constexpr std::array<std::uint8_t, kRecordAlignment> kZeros{};
  return write_bytes(std::span(kZeros).first(padding_after(payload.size())));
}

Status Writer::write_bytes(std::span<const std::uint8_t> bytes) {
  RELIT_TRY(sink_->write(bytes));
  offset_ += bytes.size();
  return {};
}

Status Writer::enter(int order) {
  if (closed_) return fail(ErrorCode::kInvalid, "the writer is finished, or failed before");
  const bool once = order == order_of(types::kSkeleton) && order_ == order;
  RELIT_REQUIRE(order >= order_ && !once, once ? "a file has one skeleton"
                                               : "this record comes too late: the order is "
                                                 "CLIP IMAG MATL MESH SKEL POSE MODL LAYR SEGM");
  order_ = order;
  return {};
}

Status Writer::settle(Status status, const char* doing) {
  if (status) return status;
  closed_ = true;
  Error error = std::move(status).error();
  if (error.code == ErrorCode::kCorrupt) error.code = ErrorCode::kInvalid;
  return fail(error.code, std::string("writing ") + doing + ": " + error.message);
}

}  // namespace relit::container
