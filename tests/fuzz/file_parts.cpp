// SPDX-License-Identifier: MIT
#include "tests/fuzz/file_parts.hpp"

#include <utility>

#include "container/record_codec.hpp"

namespace relit::fuzz {
namespace {

using namespace relit::container;

/// Makes the segment's announcements those of the chunks that follow it.
void mend_segment(std::vector<Part>& parts, std::size_t at) {
  auto segment = parse_segment(parts[at].payload);
  if (!segment) return;
  for (std::size_t i = 0; i < segment->chunks.size() && at + 1 + i < parts.size(); ++i) {
    const Part& chunk = parts[at + 1 + i];
    if (chunk.type != types::kChunk) break;
    segment->chunks[i].chunk_bytes = record_bytes(chunk.payload.size());
  }
  parts[at].payload = serialize(*segment);
}

struct Offsets {
  std::vector<std::uint64_t> segments;
  std::uint64_t index = 0;
  std::uint64_t copies = 0;
};

void mend_index(Part& part, const Offsets& offsets) {
  auto index = parse_index(part.payload);
  if (!index) return;
  const std::size_t known = std::min(index->segments.size(), offsets.segments.size());
  for (std::size_t i = 0; i < known; ++i) index->segments[i].offset = offsets.segments[i];
  part.payload = serialize(*index);
}

void mend_end(Part& part, const Offsets& offsets, std::uint64_t at) {
  if (!parse_end(part.payload)) return;
  part.payload =
      serialize(EndRecord{offsets.index, at + record_bytes(kEndPayloadBytes), offsets.copies});
}

bool plausible(RecordType type) { return is_well_formed(type) && order_of(type) >= 0; }

}  // namespace

std::vector<Part> split(Input file) {
  std::vector<Part> parts;
  std::size_t at = kSignature.size();
  while (at + kRecordHeaderBytes <= file.size()) {
    const auto bytes = file.subspan(at).first<kRecordHeaderBytes>();
    const auto header = decode_header(bytes, false);
    const std::size_t left = file.size() - at - kRecordHeaderBytes;
    if (!header || !plausible(header->type) || header->payload_bytes > left) {
      at += kRecordAlignment;
      continue;
    }
    const auto size = static_cast<std::size_t>(header->payload_bytes);
    parts.push_back(
        {header->type, header->flags, copy(file.subspan(at + kRecordHeaderBytes, size))});
    at += static_cast<std::size_t>(record_bytes(size));
  }
  return parts;
}

Bytes join(std::vector<Part> parts) {
  Bytes file(kSignature.begin(), kSignature.end());
  Offsets offsets;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    Part& part = parts[i];
    if (part.type == types::kSegment) {
      mend_segment(parts, i);
      offsets.segments.push_back(file.size());
    }
    if (part.type == types::kIndex) {
      mend_index(part, offsets);
      offsets.index = file.size();
    }
    const bool first_copy = part.flags == flags::kCopy && offsets.copies == 0;
    if (first_copy && !offsets.segments.empty()) offsets.copies = file.size();
    if (part.type == types::kEnd) mend_end(part, offsets, file.size());
    const Bytes record = frame_record(part.type, part.payload, part.flags);
    file.insert(file.end(), record.begin(), record.end());
  }
  return file;
}

}  // namespace relit::fuzz
