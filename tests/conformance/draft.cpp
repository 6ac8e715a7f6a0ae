// SPDX-License-Identifier: MIT
#include "tests/conformance/draft.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <stdexcept>

#include "container/record_codec.hpp"

namespace relit::conformance {

using namespace container;

namespace {

bool is_static(RecordType type) {
  return order_of(type) >= 0 && order_of(type) < order_of(types::kSegment);
}

template <class R>
void add(std::vector<Piece>& pieces, RecordType type, const R& record) {
  pieces.push_back({type, serialize(record)});
}

void add_segment(std::vector<Piece>& pieces, const DraftSegment& segment) {
  SegmentRecord record = segment.record;
  std::vector<Piece> chunks;
  for (ChunkRecord chunk : segment.chunks) {
    chunk.segment_index = record.index;
    add(chunks, types::kChunk, chunk);
    record.chunks.push_back({chunk.track_id, record_bytes(chunks.back().payload.size())});
  }
  add(pieces, types::kSegment, record);
  pieces.insert(pieces.end(), chunks.begin(), chunks.end());
}

/// Where the pieces come to lie, as far as index and end record care.
struct Places {
  IndexRecord index;
  EndRecord end;

  void note(const Piece& piece, std::uint64_t offset) {
    if (piece.type == types::kSegment) {
      const auto segment = parse_segment(piece.payload);
      if (segment)
        index.segments.push_back({segment->index, segment->clip_id, segment->first_frame,
                                  segment->frame_count, offset, segment->first_tick});
    }
    const bool copy = (piece.flags & flags::kCopy) != 0;
    if (is_static(piece.type) && copy && end.copies_offset == 0) end.copies_offset = offset;
    // Only those behind the last segment, or behind the static part of a file without any, count.
    if ((is_static(piece.type) && !copy) || piece.type == types::kSegment) end.copies_offset = 0;
    if (piece.type == types::kIndex && (piece.flags & flags::kCopy) == 0) end.index_offset = offset;
  }
};

}  // namespace

std::vector<Piece> pieces_of(const Draft& draft) {
  std::vector<Piece> pieces;
  add(pieces, types::kHeader, draft.header);
  for (const auto& record : draft.clips) add(pieces, types::kClip, record);
  for (const auto& record : draft.images) add(pieces, types::kImage, record);
  for (const auto& record : draft.materials) add(pieces, types::kMaterial, record);
  for (const auto& record : draft.meshes) add(pieces, types::kMesh, record);
  if (draft.skeleton) add(pieces, types::kSkeleton, *draft.skeleton);
  for (const auto& record : draft.poses) add(pieces, types::kPoseTrack, record);
  for (const auto& record : draft.models) add(pieces, types::kModel, record);
  for (const auto& record : draft.layers) add(pieces, types::kLayer, record);
  const std::vector<Piece> statics = pieces;
  for (const DraftSegment& segment : draft.segments) add_segment(pieces, segment);
  if (draft.copies) {
    for (const Piece& piece : statics) pieces.push_back({piece.type, piece.payload, flags::kCopy});
  }
  if (draft.index) pieces.push_back({types::kIndex, {}, 0, true});
  if (draft.end) pieces.push_back({types::kEnd, {}, 0, true});
  return pieces;
}

Bytes assemble(const std::vector<Piece>& pieces) {
  Bytes file(kSignature.begin(), kSignature.end());
  Places places;
  for (const Piece& piece : pieces) {
    places.note(piece, file.size());
    Bytes payload = piece.payload;
    if (piece.automatic && piece.type == types::kIndex) payload = serialize(places.index);
    if (piece.automatic && piece.type == types::kEnd) {
      places.end.file_bytes = file.size() + record_bytes(kEndPayloadBytes);
      payload = serialize(places.end);
    }
    const Bytes record = frame_record(piece.type, payload, piece.flags);
    file.insert(file.end(), record.begin(), record.end());
  }
  return file;
}

std::size_t find_piece(const std::vector<Piece>& pieces, RecordType type, int n) {
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (pieces[i].type == type && n-- == 0) return i;
  }
  throw std::runtime_error("no piece " + type_name(type));
}

std::size_t offset_of(const Bytes& file, RecordType type, int n) {
  std::size_t at = kSignature.size();
  while (at + kRecordHeaderBytes <= file.size()) {
    const auto header = decode_header(std::span(file).subspan(at).first<kRecordHeaderBytes>());
    if (!header) break;
    if (header->type == type && n-- == 0) return at;
    at += record_bytes(header->payload_bytes);
  }
  throw std::runtime_error("no record " + type_name(type));
}

void seal_header(Bytes& file, std::size_t offset) {
  put_u32(file, offset + 20, crc32(std::span(file).subspan(offset, 20)));
}

namespace {

template <class T>
void put(Bytes& bytes, std::size_t at, T value) {
  for (std::size_t i = 0; i < sizeof(T); ++i)
    bytes.at(at + i) = static_cast<std::uint8_t>(std::uint64_t{value} >> (8 * i));
}

}  // namespace

void put_u16(Bytes& bytes, std::size_t at, std::uint16_t value) { put(bytes, at, value); }
void put_u32(Bytes& bytes, std::size_t at, std::uint32_t value) { put(bytes, at, value); }
void put_u64(Bytes& bytes, std::size_t at, std::uint64_t value) { put(bytes, at, value); }

}  // namespace relit::conformance
