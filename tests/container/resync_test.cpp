// SPDX-License-Identifier: MIT
#include "container/reader.hpp"
#include "container/record_codec.hpp"
#include "tests/container/sample.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::container;
using sample::Bytes;

namespace {

std::unique_ptr<ByteSource> source_of(const Bytes& bytes, bool pipe) {
  if (pipe) return std::make_unique<sample::Pipe>(bytes, 61);
  return sample::memory(bytes);
}

sample::Everything read(const Bytes& bytes, bool pipe) {
  auto all = sample::read_everything(source_of(bytes, pipe));
  if (!all) FAIL(all.error().message);
  return std::move(*all);
}

std::vector<std::uint32_t> segments_of(const sample::Everything& all) {
  std::vector<std::uint32_t> indices;
  for (const auto& body : all.rest)
    if (const auto* segment = std::get_if<SegmentRecord>(&body)) indices.push_back(segment->index);
  return indices;
}

std::size_t chunks_of(const sample::Everything& all) {
  std::size_t n = 0;
  for (const auto& body : all.rest) n += std::holds_alternative<ChunkRecord>(body);
  return n;
}

using Indices = std::vector<std::uint32_t>;

}  // namespace

TEST_CASE("a damaged chunk costs itself alone") {
  const Bytes file = sample::file();
  for (const bool pipe : {false, true}) {
    Bytes damaged = file;
    damaged[sample::offset_of(file, types::kChunk, 5) + 40] ^= 4;
    const auto all = read(damaged, pipe);
    REQUIRE(all.errors.size() == 1);
    CHECK(all.errors[0].code == ErrorCode::kCorrupt);
    CHECK(all.errors[0].message.find("'CHNK' at byte ") != std::string::npos);
    CHECK(segments_of(all) == Indices{0, 1, 2});
    CHECK(chunks_of(all) == 11);
    CHECK(all.finished);
    CHECK(all.loss.damaged_records == 1);
    CHECK(all.loss.dropped_bytes ==
          sample::offset_of(file, types::kChunk, 6) - sample::offset_of(file, types::kChunk, 5));
    CHECK(all.loss.missing_segments == 0);
  }
}

TEST_CASE("a damaged record header costs the rest of its segment") {
  const Bytes file = sample::file();
  for (const bool pipe : {false, true}) {
    Bytes damaged = file;
    damaged[sample::offset_of(file, types::kChunk, 1) + 9] ^= 0x40;  // the length
    const auto all = read(damaged, pipe);
    REQUIRE(all.errors.size() == 1);
    CHECK(segments_of(all) == Indices{0, 1, 2});
    CHECK(chunks_of(all) == 9);
    CHECK(all.finished);
    CHECK(all.loss.dropped_bytes ==
          sample::offset_of(file, types::kSegment, 1) - sample::offset_of(file, types::kChunk, 1));
  }
}

TEST_CASE("a damaged segment record costs its segment") {
  const Bytes file = sample::file();
  // In the header, in the marker, in the fields.
  for (const std::uint64_t where : {2ull, 30ull, 50ull}) {
    for (const bool pipe : {false, true}) {
      Bytes damaged = file;
      damaged[sample::offset_of(file, types::kSegment, 1) + where] ^= 1;
      const auto all = read(damaged, pipe);
      CHECK(all.errors.size() == 1);
      CHECK(segments_of(all) == Indices{0, 2});
      CHECK(chunks_of(all) == 8);
      CHECK(all.finished);
      CHECK(all.loss.missing_segments == 1);
      CHECK(all.loss.dropped_bytes == sample::offset_of(file, types::kSegment, 2) -
                                          sample::offset_of(file, types::kSegment, 1));
    }
  }
}

TEST_CASE("damage of the first segment leaves the static part usable") {
  const Bytes file = sample::file();
  Bytes damaged = file;
  damaged[sample::offset_of(file, types::kSegment, 0)] ^= 1;
  const auto all = read(damaged, true);
  CHECK(all.contents.layers.size() == 2);
  CHECK(all.errors.size() == 1);
  CHECK(segments_of(all) == Indices{1, 2});
  CHECK(all.loss.missing_segments == 1);
}

TEST_CASE("segments that a cut record swallowed are found again") {
  const Bytes file = sample::file();
  const auto from = sample::offset_of(file, types::kChunk, 1) + 32;
  for (const std::uint64_t missing : {8ull, 16ull}) {
    for (const bool pipe : {false, true}) {
      // Bytes are missing inside a chunk, so that it reaches into its neighbours.
      Bytes shorter = file;
      shorter.erase(shorter.begin() + static_cast<std::ptrdiff_t>(from),
                    shorter.begin() + static_cast<std::ptrdiff_t>(from + missing));
      const auto all = read(shorter, pipe);
      CHECK(segments_of(all) == Indices{0, 1, 2});
      CHECK(all.loss.missing_segments == 0);
    }
  }
}

TEST_CASE("a large chunk that lost its end gives back the segment it swallowed") {
  MemorySink sink;
  auto writer = Writer::create(sink, "large").value();
  sample::add_static(writer);
  auto chunks = sample::chunks(0, 3);
  chunks[3].data.resize(300000, 0x5A);
  chunks[3].packets.back().size = chunks[3].data.size() - chunks[3].packets.back().offset;
  REQUIRE(writer.write_segment({7, 0, 3}, chunks));
  REQUIRE(writer.write_segment({7, 3, 2}, sample::chunks(3, 2)));
  REQUIRE(writer.finish());
  Bytes file = sink.take();
  const auto at = sample::offset_of(file, types::kChunk, 3) + 1000;
  file.erase(file.begin() + static_cast<std::ptrdiff_t>(at),
             file.begin() + static_cast<std::ptrdiff_t>(at + 200000));
  for (const bool pipe : {false, true}) {
    const auto all = read(file, pipe);
    // The chunk takes all that is left of the file, and does not get enough.
    REQUIRE(all.errors.size() >= 1);
    CHECK(all.errors[0].code == ErrorCode::kTruncated);
    CHECK(segments_of(all) == Indices{0, 1});
  }
}

TEST_CASE("a hole of zeros, as an interrupted download leaves, costs what it covers") {
  Bytes file = sample::file();
  const auto from = sample::offset_of(file, types::kChunk, 1);
  const auto to = sample::offset_of(file, types::kSegment, 2);
  std::fill(file.begin() + static_cast<std::ptrdiff_t>(from),
            file.begin() + static_cast<std::ptrdiff_t>(to), std::uint8_t{0});
  const auto all = read(file, true);
  CHECK(segments_of(all) == Indices{0, 2});
  CHECK(all.loss.missing_segments == 1);
  CHECK(all.loss.dropped_bytes == to - from);
  CHECK(all.finished);
}

TEST_CASE("without another segment resync says that the end is reached") {
  Bytes file = sample::file();
  file[sample::offset_of(file, types::kChunk, 10)] ^= 1;
  auto reader = Reader::open(sample::memory(file)).value();
  REQUIRE(load_static(reader));
  while (reader.next()) {
  }
  CHECK_FALSE(reader.can_continue());
  const auto found = reader.resync();
  REQUIRE(found);
  CHECK_FALSE(*found);
  const auto end = reader.next();
  REQUIRE(end);
  CHECK_FALSE(*end);
  CHECK_FALSE(reader.finished());
}

TEST_CASE("resync without damage goes on to the next segment") {
  auto reader = Reader::open(sample::memory(sample::file())).value();
  REQUIRE(load_static(reader));
  REQUIRE(reader.next().value());  // segment 0
  REQUIRE(reader.next().value());  // its first chunk
  REQUIRE(reader.resync().value());
  CHECK(std::get<SegmentRecord>(reader.next().value()->body).index == 1);
}

TEST_CASE("a framing error stays until it is dealt with") {
  Bytes file = sample::file();
  file[sample::offset_of(file, types::kChunk, 0)] ^= 1;
  auto reader = Reader::open(sample::memory(file)).value();
  REQUIRE(load_static(reader));
  REQUIRE(reader.next());
  const auto first = reader.next();
  REQUIRE_FALSE(first);
  const auto second = reader.next();
  REQUIRE_FALSE(second);
  CHECK(first.error().message == second.error().message);
  CHECK(reader.loss().damaged_records == 1);
}
