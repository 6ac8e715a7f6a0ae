// SPDX-License-Identifier: MIT
// What a sparing reader tells its source, and that it then reads nothing else.
#include <algorithm>

#include "container/reader.hpp"
#include "tests/container/sample.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::container;

namespace {

/// What became of each byte of a file.
struct Traffic {
  std::vector<std::uint8_t> announced, read;
  std::uint64_t expectations = 0;
  std::uint64_t unannounced = 0;  ///< bytes that were read without having been announced
};

class WatchedSource final : public ByteSource {
 public:
  WatchedSource(sample::Bytes bytes, Traffic& traffic)
      : inner_(bytes), traffic_(&traffic), bytes_(bytes.size()) {
    traffic.announced.assign(bytes_, 0);
    traffic.read.assign(bytes_, 0);
  }
  Result<std::size_t> read(std::span<std::uint8_t> out) override {
    RELIT_ASSIGN(const std::size_t n, inner_.read(out));
    for (std::size_t i = at_; i < at_ + n; ++i) {
      traffic_->unannounced += traffic_->announced[i] == 0;
      traffic_->read[i] = 1;
    }
    at_ += n;
    return n;
  }
  [[nodiscard]] std::optional<std::uint64_t> size() const override { return inner_.size(); }
  [[nodiscard]] bool seekable() const override { return true; }
  Status seek(std::uint64_t offset_bytes) override {
    at_ = static_cast<std::size_t>(offset_bytes);
    return inner_.seek(offset_bytes);
  }
  void expect(std::uint64_t begin, std::uint64_t end) override {
    CHECK(begin < end);
    CHECK(end <= bytes_);
    ++traffic_->expectations;
    for (std::uint64_t i = begin; i < std::min<std::uint64_t>(end, bytes_); ++i)
      traffic_->announced[static_cast<std::size_t>(i)] = 1;
  }

 private:
  MemorySource inner_;
  Traffic* traffic_;
  std::size_t bytes_;
  std::size_t at_ = 0;
};

constexpr std::uint32_t kLargeBytes = 20'000;

/// Segments of one frame, in which the chunks of tracks 2, 3 and 4 are large.
sample::Bytes large_file(bool copies) {
  MemorySink sink;
  auto writer = Writer::create(sink, "test", {copies});
  REQUIRE(writer);
  sample::add_static(*writer);
  for (std::uint64_t frame = 0; frame < 5; ++frame) {
    auto chunks = sample::chunks(frame, 1);
    for (auto& chunk : chunks) {
      if (chunk.track_id == 1) continue;
      chunk.packets.back().size += kLargeBytes;
      chunk.data.resize(chunk.data.size() + kLargeBytes, 7);
    }
    REQUIRE(writer->write_segment({7, frame, 1}, std::move(chunks)));
  }
  REQUIRE(writer->finish());
  return sink.take();
}

struct Part {
  RecordType type{};
  std::uint32_t track_id = 0;  ///< of chunks
  std::size_t begin = 0, end = 0;
};

std::vector<Part> parts_of(const sample::Bytes& file) {
  std::vector<Part> parts;
  auto reader = Reader::open(sample::memory(file));
  REQUIRE(reader);
  for (;;) {
    const auto record = reader->next();
    REQUIRE(record);
    if (!*record) return parts;
    const auto* chunk = std::get_if<ChunkRecord>(&(*record)->body);
    parts.push_back({(*record)->type, chunk != nullptr ? chunk->track_id : 0,
                     static_cast<std::size_t>((*record)->offset_bytes),
                     static_cast<std::size_t>(reader->offset_bytes())});
  }
}

/// Reads all that comes out of a reader for the given tracks.
Traffic read_tracks(const sample::Bytes& file, std::vector<std::uint32_t> tracks) {
  Traffic traffic;
  ReaderOptions options;
  options.sparing = true;
  auto reader = Reader::open(std::make_unique<WatchedSource>(file, traffic), options);
  REQUIRE(reader);
  REQUIRE(load_static(*reader));
  reader->set_wanted_tracks(std::move(tracks));
  auto record = reader->next();
  while (record && *record) record = reader->next();
  REQUIRE(record);
  CHECK(reader->finished());
  return traffic;
}

std::size_t count(const std::vector<std::uint8_t>& bytes, const Part& part) {
  return static_cast<std::size_t>(
      std::count(bytes.begin() + static_cast<std::ptrdiff_t>(part.begin),
                 bytes.begin() + static_cast<std::ptrdiff_t>(part.end), 1));
}

bool is(std::vector<std::uint32_t> tracks, std::uint32_t track) {
  return std::find(tracks.begin(), tracks.end(), track) != tracks.end();
}

}  // namespace

TEST_CASE("a sparing reader announces what it reads, and no tracks that are not wanted") {
  const auto file = large_file(true);
  const auto parts = parts_of(file);
  using Tracks = std::vector<std::uint32_t>;
  for (const Tracks& tracks : {Tracks{1}, Tracks{1, 2}, Tracks{1, 2, 3}, Tracks{1, 4}, Tracks{3}}) {
    INFO(tracks.size() << " tracks, the last " << tracks.back());
    const Traffic traffic = read_tracks(file, tracks);
    // Signature and header, before which nothing is known.
    CHECK(traffic.unannounced == parts.front().begin);
    for (const Part& part : parts) {
      INFO(part.begin);
      if (part.type != types::kChunk || is(tracks, part.track_id)) {
        CHECK(count(traffic.read, part) == part.end - part.begin);
      } else {
        CHECK(count(traffic.read, part) == 0);
        // Only the guess at the first segment may be wrong.
        CHECK(count(traffic.announced, part) < 512);
      }
    }
  }
}

TEST_CASE("a sparing reader gets along without copies, and with everything wanted") {
  const auto file = large_file(false);
  CHECK(read_tracks(file, {1, 2, 3, 4}).read == std::vector<std::uint8_t>(file.size(), 1));
  Traffic traffic;
  ReaderOptions options;
  options.sparing = true;
  const auto all = sample::read_everything(std::make_unique<WatchedSource>(file, traffic), options);
  REQUIRE(all);
  CHECK(all->errors.empty());
  CHECK(all->finished);
}

TEST_CASE("neighbouring tracks are announced as one, distant ones apart") {
  const auto file = large_file(true);
  // End record, static part, and for each of five segments its guess and the rest of it; then
  // copies, index and end.
  const auto one = read_tracks(file, {1, 2}).expectations;
  CHECK(read_tracks(file, {1, 2, 3}).expectations == one);
  CHECK(read_tracks(file, {1, 4}).expectations > one);
}

TEST_CASE("only a sparing reader announces") {
  Traffic traffic;
  auto reader = Reader::open(std::make_unique<WatchedSource>(large_file(true), traffic));
  REQUIRE(reader);
  auto record = reader->next();
  while (record && *record) record = reader->next();
  REQUIRE(record);
  CHECK(traffic.expectations == 0);
}
