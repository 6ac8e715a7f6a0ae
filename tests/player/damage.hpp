// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "container/framing.hpp"
#include "container/reader.hpp"
#include "container/record_codec.hpp"
#include "tests/test.hpp"

/// Files as bytes: their records, and means to hurt them.
namespace relit::player::test {

using Bytes = std::vector<std::uint8_t>;

/// Where a record stands.
struct Placed {
  container::RecordHeader header;
  std::uint64_t offset = 0;
  std::uint64_t end = 0;
  [[nodiscard]] bool copy() const { return (header.flags & container::flags::kCopy) != 0; }
};

/// All records of an intact file.
inline std::vector<Placed> records_of(const Bytes& file) {
  std::vector<Placed> records;
  for (std::uint64_t at = container::kSignature.size(); at < file.size();) {
    const auto header = container::decode_header(
        std::span(file).subspan(at).first<container::kRecordHeaderBytes>());
    REQUIRE(header);
    const std::uint64_t end = at + container::record_bytes(header->payload_bytes);
    records.push_back({*header, at, end});
    at = end;
  }
  return records;
}

/// A segment with its chunks: the bytes that it consists of.
struct PlacedSegment {
  container::SegmentRecord segment;
  std::uint64_t begin = 0, end = 0;
  std::vector<container::ChunkRecord> chunks;
};

/// All that a Reader finds behind the static part; fails the test on any error.
struct Read {
  container::FileContents contents;
  std::vector<PlacedSegment> segments;
  bool finished = false;
};
inline Read read_all(const Bytes& file) {
  auto reader = container::Reader::open(std::make_unique<container::MemorySource>(file));
  if (!reader) FAIL(reader.error().message);
  auto contents = container::load_static(*reader);
  if (!contents) FAIL(contents.error().message);
  Read read{std::move(*contents), {}, false};
  for (;;) {
    auto record = reader->next();
    if (!record) FAIL(record.error().message);
    if (!*record) break;
    if (auto* segment = std::get_if<container::SegmentRecord>(&(*record)->body)) {
      read.segments.push_back(
          {std::move(*segment), (*record)->offset_bytes, reader->offset_bytes(), {}});
    } else if (auto* chunk = std::get_if<container::ChunkRecord>(&(*record)->body)) {
      read.segments.back().chunks.push_back(std::move(*chunk));
      read.segments.back().end = reader->offset_bytes();
    }
  }
  read.finished = reader->finished();
  CHECK(reader->loss().damaged_records == 0);
  CHECK(reader->loss().missing_segments == 0);
  return read;
}

/// Bytes [first, second) of a file.
using Burst = std::pair<std::uint64_t, std::uint64_t>;

/// Overwrites the burst with noise; every byte changes.
inline void damage(Bytes& file, const Burst& burst, std::mt19937& random) {
  for (std::uint64_t at = burst.first; at < burst.second; ++at)
    file[at] = static_cast<std::uint8_t>(file[at] ^ (1 + random() % 255));
}

}  // namespace relit::player::test
