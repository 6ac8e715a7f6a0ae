// SPDX-License-Identifier: MIT
// SEGM, CHNK, INDX, FEND.
#include <algorithm>
#include <array>

#include "container/base/bytes.hpp"
#include "container/framing.hpp"
#include "container/record_checks.hpp"
#include "container/record_codec.hpp"

namespace relit::container {

using namespace checks;

namespace {

/// Whether no two members are equal. Segments of a usual length need no memory for that.
template <class T, class Member>
bool all_distinct(const std::vector<T>& records, Member T::*member) {
  std::array<Member, 512> few{};
  std::vector<Member> many;
  std::span<Member> values(few);
  if (records.size() > few.size()) {
    many.resize(records.size());
    values = many;
  }
  values = values.first(records.size());
  std::ranges::transform(records, values.begin(), member);
  std::ranges::sort(values);
  return std::ranges::adjacent_find(values) == values.end();
}

constexpr std::size_t kChunkSizeBytes = 16;
constexpr std::size_t kIndexEntryBytes = 40;
constexpr std::size_t kPacketLeastBytes = 2;
/// Two varints of at most ten bytes.
constexpr std::uint64_t kTableBytes = 20 * std::uint64_t{limits::kPacketsPerChunk};

Status frame_range(std::uint64_t first_frame, std::uint32_t frame_count) {
  RELIT_TRY(one_to(frame_count, limits::kFramesPerSegment, "frame_count"));
  if (first_frame >= limits::kFrames || first_frame + frame_count > limits::kFrames)
    return fail(ErrorCode::kLimit, "frames " + std::to_string(first_frame) +
                                       " and following exceed " + "the limit of " +
                                       std::to_string(limits::kFrames));
  return {};
}

}  // namespace

std::vector<std::uint8_t> serialize(const SegmentRecord& record) {
  ByteWriter w;
  w.raw(kSegmentMarker);
  w.u32(record.index);
  w.u32(record.clip_id);
  w.u64(record.first_frame);
  w.u32(record.frame_count);
  w.u64(record.first_tick);
  w.u32(static_cast<std::uint32_t>(record.chunks.size()));
  for (const auto& chunk : record.chunks) {
    w.u32(chunk.track_id);
    w.u32(0);
    w.u64(chunk.chunk_bytes);
  }
  w.u32(static_cast<std::uint32_t>(record.durations.size()));
  for (const std::uint32_t ticks : record.durations) w.u32(ticks);
  return w.take();
}

Result<SegmentRecord> parse_segment(std::span<const std::uint8_t> payload) {
  SegmentRecord record;
  RELIT_TRY(parse_segment_into(payload, record));
  return record;
}

Status parse_segment_into(std::span<const std::uint8_t> payload, SegmentRecord& record) {
  ByteReader r(payload);
  const auto marker = r.raw("marker", kSegmentMarker.size());
  if (r.ok() && !std::ranges::equal(marker, kSegmentMarker))
    r.fail(ErrorCode::kCorrupt, "marker", "not the segment marker");
  record.index = r.u32("index");
  record.clip_id = r.u32("clip_id");
  record.first_frame = r.u64("first_frame");
  record.frame_count = r.u32("frame_count");
  record.first_tick = r.u64("first_tick");
  record.chunks.resize(r.count("chunks", limits::kChunksPerSegment, kChunkSizeBytes));
  for (auto& chunk : record.chunks) {
    chunk.track_id = r.u32("chunk.track_id");
    r.zero_u32("chunk.reserved");
    chunk.chunk_bytes = r.u64("chunk.chunk_bytes");
  }
  record.durations.resize(r.count("durations", limits::kFramesPerSegment, 4));
  for (std::uint32_t& ticks : record.durations) ticks = r.u32("durations");
  RELIT_TRY(r.finish());
  return validate(record);
}

Status validate(const SegmentRecord& record) {
  RELIT_REQUIRE(record.index < limits::kSegments,
                "index is not below " + std::to_string(limits::kSegments));
  RELIT_TRY(frame_range(record.first_frame, record.frame_count));
  RELIT_REQUIRE(record.durations.empty() || record.durations.size() == record.frame_count,
                "there are " + std::to_string(record.durations.size()) + " durations for " +
                    std::to_string(record.frame_count) + " frames");
  RELIT_REQUIRE(std::ranges::find(record.durations, 0u) == record.durations.end(),
                "a frame lasts no tick");
  RELIT_TRY(at_most(record.first_tick, limits::kTicks, "first_tick"));
  RELIT_TRY(at_most(record.first_tick + duration_ticks(record), limits::kTicks, "end in ticks"));
  RELIT_TRY(at_most(record.chunks.size(), limits::kChunksPerSegment, "number of chunks"));
  for (const auto& chunk : record.chunks) {
    RELIT_TRY(at_most(chunk.chunk_bytes, record_bytes(limits::kRecordBytes), "chunk_bytes"));
    RELIT_REQUIRE(
        chunk.chunk_bytes > kRecordHeaderBytes && chunk.chunk_bytes % kRecordAlignment == 0,
        "chunk_bytes " + std::to_string(chunk.chunk_bytes) + " is not the length of a record");
  }
  RELIT_REQUIRE(all_distinct(record.chunks, &SegmentRecord::ChunkSize::track_id),
                "two chunks of the same track");
  return {};
}

std::vector<std::uint8_t> serialize(const ChunkRecord& record) {
  ByteWriter table;
  std::int64_t previous = record.packets.empty() ? 0 : record.packets.front().pts;
  for (const Packet& p : record.packets) {
    table.varint((p.size << 1) | (p.key ? 1 : 0));
    table.zigzag(p.pts - previous);
    previous = p.pts;
  }
  ByteWriter w;
  w.reserve(24 + table.size() + record.data.size());
  w.u32(record.track_id);
  w.u32(record.segment_index);
  w.u64(record.packets.empty() ? 0 : static_cast<std::uint64_t>(record.packets.front().pts));
  w.u32(static_cast<std::uint32_t>(record.packets.size()));
  w.u32(static_cast<std::uint32_t>(table.size()));
  w.raw(table.take());
  w.raw(record.data);
  return w.take();
}

namespace {

/// Reads the packet table; what a later packet says depends on the earlier ones.
void read_packets(ByteReader& r, std::uint64_t first_pts, std::vector<Packet>& packets) {
  std::uint64_t pts = first_pts;
  std::uint64_t offset = 0;
  for (Packet& p : packets) {
    const auto size_and_key = r.varint("packet.size");
    const auto delta = r.zigzag("packet.pts");
    p.key = (size_and_key & 1) != 0;
    p.size = size_and_key >> 1;
    p.offset = offset;
    // Unsigned, so that absurd deltas wrap around into what is refused here.
    pts += static_cast<std::uint64_t>(delta);
    if (pts >= limits::kFrames) r.fail(ErrorCode::kCorrupt, "packet.pts", "outside the clip");
    if (p.size > limits::kRecordBytes) r.fail(ErrorCode::kLimit, "packet.size", "too large");
    if (!r.ok()) return;
    p.pts = static_cast<std::int64_t>(pts);
    offset += p.size;
  }
  if (!packets.empty() && packets.front().pts != static_cast<std::int64_t>(first_pts))
    r.fail(ErrorCode::kCorrupt, "packet.pts", "the first packet's must equal first_pts");
}

}  // namespace

Result<ChunkRecord> parse_chunk(std::span<const std::uint8_t> payload) {
  ChunkRecord record;
  RELIT_TRY(parse_chunk_into(payload, record));
  return record;
}

Status parse_chunk_into(std::span<const std::uint8_t> payload, ChunkRecord& record) {
  ByteReader r(payload);
  record.track_id = r.u32("track_id");
  record.segment_index = r.u32("segment_index");
  const auto first_pts = r.u64("first_pts");
  const auto count = r.u32("packet_count");
  const auto table_bytes = r.u32("table_bytes");
  RELIT_TRY(r.status());
  RELIT_TRY(at_most(count, limits::kPacketsPerChunk, "packet_count"));
  RELIT_TRY(at_most(table_bytes, kTableBytes, "table_bytes"));
  ByteReader table(r.raw("table", table_bytes));
  RELIT_TRY(r.status());
  RELIT_REQUIRE(count <= table.remaining() / kPacketLeastBytes,
                "table_bytes is too small for packet_count");
  record.packets.resize(count);
  read_packets(table, first_pts, record.packets);
  RELIT_TRY(table.finish());
  const auto data = r.raw("data", r.remaining());
  record.data.assign(data.begin(), data.end());
  return validate(record);
}

Status validate(const ChunkRecord& record) {
  RELIT_REQUIRE(record.segment_index < limits::kSegments, "segment_index is too large");
  RELIT_TRY(one_to(record.packets.size(), limits::kPacketsPerChunk, "number of packets"));
  std::uint64_t offset = 0;
  for (const Packet& p : record.packets) {
    RELIT_REQUIRE(p.pts >= 0 && static_cast<std::uint64_t>(p.pts) < limits::kFrames,
                  "packet.pts is outside the clip");
    RELIT_TRY(at_most(p.size, limits::kRecordBytes, "packet.size"));
    RELIT_REQUIRE(p.offset == offset, "packets do not follow one another in the data");
    offset += p.size;
  }
  RELIT_REQUIRE(offset == record.data.size(), "the packets have " + std::to_string(offset) +
                                                  " bytes, the data " +
                                                  std::to_string(record.data.size()));
  RELIT_REQUIRE(all_distinct(record.packets, &Packet::pts), "two packets with the same pts");
  return {};
}

std::vector<std::uint8_t> serialize(const IndexRecord& record) {
  ByteWriter w;
  w.reserve(8 + record.segments.size() * kIndexEntryBytes);
  w.u32(static_cast<std::uint32_t>(record.segments.size()));
  w.u32(0);
  for (const auto& e : record.segments) {
    w.u32(e.segment_index);
    w.u32(e.clip_id);
    w.u64(e.first_frame);
    w.u32(e.frame_count);
    w.u32(0);
    w.u64(e.first_tick);
    w.u64(e.offset);
  }
  return w.take();
}

Result<IndexRecord> parse_index(std::span<const std::uint8_t> payload) {
  ByteReader r(payload);
  IndexRecord record;
  const auto count = r.count("segments", limits::kSegments, kIndexEntryBytes);
  r.zero_u32("reserved");
  if (r.ok()) record.segments.resize(count);
  for (auto& e : record.segments) {
    e.segment_index = r.u32("segment_index");
    e.clip_id = r.u32("clip_id");
    e.first_frame = r.u64("first_frame");
    e.frame_count = r.u32("frame_count");
    r.zero_u32("entry.reserved");
    e.first_tick = r.u64("first_tick");
    e.offset = r.u64("offset");
  }
  RELIT_TRY(r.finish());
  RELIT_TRY(validate(record));
  return record;
}

Status validate(const IndexRecord& record) {
  RELIT_TRY(at_most(record.segments.size(), limits::kSegments, "number of segments"));
  const IndexRecord::Entry* previous = nullptr;
  for (const auto& e : record.segments) {
    RELIT_REQUIRE(e.segment_index < limits::kSegments, "segment_index is too large");
    RELIT_TRY(frame_range(e.first_frame, e.frame_count));
    RELIT_TRY(at_most(e.first_tick, limits::kTicks, "first_tick"));
    RELIT_REQUIRE(e.offset % kRecordAlignment == 0 && e.offset >= kSignature.size(),
                  "offset " + std::to_string(e.offset) + " is not that of a record");
    RELIT_REQUIRE(previous == nullptr ||
                      (previous->segment_index < e.segment_index && previous->offset < e.offset),
                  "segments are not in the order of the file");
    previous = &e;
  }
  return {};
}

std::vector<std::uint8_t> serialize(const EndRecord& record) {
  ByteWriter w;
  w.u64(record.index_offset);
  w.u64(record.copies_offset);
  w.u64(record.file_bytes);
  return w.take();
}

Result<EndRecord> parse_end(std::span<const std::uint8_t> payload) {
  ByteReader r(payload);
  EndRecord record;
  record.index_offset = r.u64("index_offset");
  record.copies_offset = r.u64("copies_offset");
  record.file_bytes = r.u64("file_bytes");
  RELIT_TRY(r.finish());
  RELIT_TRY(validate(record));
  return record;
}

Status validate(const EndRecord& record) {
  RELIT_REQUIRE(record.file_bytes % kRecordAlignment == 0 &&
                    record.file_bytes >= kSignature.size() + record_bytes(kEndPayloadBytes),
                "file_bytes is not the length of a file");
  const std::uint64_t end = record.file_bytes - record_bytes(kEndPayloadBytes);
  RELIT_REQUIRE(record.index_offset % kRecordAlignment == 0 && record.index_offset <= end,
                "index_offset does not lie in the file before the end record");
  RELIT_REQUIRE(record.copies_offset % kRecordAlignment == 0 && record.copies_offset <= end,
                "copies_offset does not lie in the file before the end record");
  return {};
}

}  // namespace relit::container
