// SPDX-License-Identifier: MIT
#include "container/writer.hpp"

#include <algorithm>

#include "container/base/limits.hpp"
#include "container/record_codec.hpp"
#include "tests/container/sample.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::container;

namespace {

struct Fixture {
  MemorySink sink;
  Writer writer = Writer::create(sink, "test").value();
};

/// Accepts some bytes, then fails.
class SmallSink final : public ByteSink {
 public:
  explicit SmallSink(std::size_t capacity) : left_(capacity) {}
  Status write(std::span<const std::uint8_t> bytes) override {
    if (bytes.size() > left_) return fail(ErrorCode::kIo, "No space left on device");
    left_ -= bytes.size();
    return {};
  }

 private:
  std::size_t left_;
};

}  // namespace

TEST_CASE("the same calls give the same bytes") { CHECK(sample::file() == sample::file()); }

TEST_CASE("records start at multiples of eight, chunks in the order of their tracks") {
  Fixture f;
  sample::add_static(f.writer);
  auto chunks = sample::chunks(0, 5);
  std::ranges::reverse(chunks);
  REQUIRE(f.writer.write_segment({7, 0, 5}, chunks));
  REQUIRE(f.writer.finish());
  CHECK(f.writer.bytes_written() == f.sink.bytes().size());
  for (const auto offset : sample::record_offsets(f.sink.bytes())) CHECK(offset % 8 == 0);
  const auto all = sample::read_everything(sample::memory(f.sink.take()));
  REQUIRE(all);
  CHECK(all->errors.empty());
  std::vector<std::uint32_t> tracks;
  for (const auto& body : all->rest)
    if (const auto* chunk = std::get_if<ChunkRecord>(&body)) tracks.push_back(chunk->track_id);
  CHECK(tracks == std::vector<std::uint32_t>{1, 2, 3, 4});
}

TEST_CASE("the segment record tells the byte range of every chunk") {
  const auto file = sample::file();
  const auto all = sample::read_everything(sample::memory(file)).value();
  const auto& segment = std::get<SegmentRecord>(all.rest[0]);
  auto offset = sample::offset_of(file, types::kChunk, 0);
  for (int i = 0; i < 4; ++i) {
    CHECK(offset == sample::offset_of(file, types::kChunk, i));
    offset += segment.chunks[static_cast<std::size_t>(i)].chunk_bytes;
  }
  CHECK(offset == sample::offset_of(file, types::kSegment, 1));
}

TEST_CASE("the writer keeps the order of the records") {
  Fixture f;
  REQUIRE(f.writer.add(sample::clip()));
  REQUIRE(f.writer.add(sample::image()));
  const auto late = f.writer.add(sample::clip(8));
  REQUIRE_FALSE(late);
  CHECK(late.error().code == ErrorCode::kInvalid);
  CHECK(late.error().message.find("writing CLIP") != std::string::npos);
  // After an error nothing more is taken.
  CHECK_FALSE(f.writer.add(sample::material()));
  CHECK_FALSE(f.writer.finish());

  Fixture g;
  REQUIRE(g.writer.add(sample::clip()));
  REQUIRE(g.writer.add(SkeletonRecord{}));
  REQUIRE(g.writer.add_ancillary(record_type("noTe"), {}));
  CHECK_FALSE(g.writer.add(SkeletonRecord{}));
}

TEST_CASE("the writer refuses records that no reader would take") {
  Fixture f;
  auto clip = sample::clip();
  clip.tick_rate.den = 0;
  const auto bad = f.writer.add(clip);
  REQUIRE_FALSE(bad);
  CHECK(bad.error().code == ErrorCode::kInvalid);

  Fixture g;
  REQUIRE(g.writer.add(sample::clip()));
  CHECK(g.writer.add(sample::material()).error().message.find("image 3") != std::string::npos);

  Fixture h;
  CHECK(h.writer.finish().error().message.find("no clip") != std::string::npos);

  Fixture k;
  CHECK_FALSE(k.writer.add_ancillary(record_type("NOTE"), {}));
  MemorySink sink;
  CHECK_FALSE(Writer::create(sink, std::string(limits::kStringBytes + 1, 'x')));
}

TEST_CASE("the writer refuses segments that do not fit their clip") {
  const auto refused = [](const SegmentInfo& info, std::vector<ChunkRecord> chunks) {
    Fixture f;
    sample::add_static(f.writer);
    REQUIRE(f.writer.write_segment({7, 0, 2}, sample::chunks(0, 2)));
    const auto status = f.writer.write_segment(info, std::move(chunks));
    return status ? std::string() : status.error().message;
  };
  CHECK(refused({7, 2, 2}, sample::chunks(2, 2)) == "");
  CHECK(refused({8, 2, 2}, sample::chunks(2, 2)).find("clip 8") != std::string::npos);
  CHECK(refused({7, 3, 2}, sample::chunks(3, 2)).find("the next one of its clip is 2") !=
        std::string::npos);
  CHECK(refused({7, 2, 4}, sample::chunks(2, 4)).find("beyond the clip") != std::string::npos);
  CHECK(refused({7, 2, 0}, sample::chunks(2, 1)) != "");
  auto chunks = sample::chunks(2, 2);
  chunks.pop_back();
  CHECK(refused({7, 2, 2}, chunks).find("chunk for track 4") != std::string::npos);
  chunks = sample::chunks(2, 2);
  chunks[3].track_id = 5;
  CHECK(refused({7, 2, 2}, chunks).find("track 5") != std::string::npos);
  chunks = sample::chunks(2, 2);
  chunks[1] = sample::chunk(2, 2, 3);
  CHECK(refused({7, 2, 2}, chunks).find("outside the segment") != std::string::npos);
  chunks = sample::chunks(2, 2);
  chunks[1].packets[0].key = false;
  CHECK(refused({7, 2, 2}, chunks).find("key") != std::string::npos);
}

TEST_CASE("a clip must be complete before the file is finished") {
  Fixture f;
  sample::add_static(f.writer);
  REQUIRE(f.writer.write_segment({7, 0, 4}, sample::chunks(0, 4)));
  const auto status = f.writer.finish();
  REQUIRE_FALSE(status);
  CHECK(status.error().message.find("4 of its 5 frames") != std::string::npos);
}

TEST_CASE("the segments of several clips may be mixed") {
  Fixture f;
  REQUIRE(f.writer.add(sample::clip(1, 4)));
  REQUIRE(f.writer.add(sample::clip(2, 2)));
  for (const std::uint32_t clip : {1u, 2u}) {
    PoseTrackRecord pose;
    pose.track_id = 100 + clip;
    pose.clip_id = clip;
    REQUIRE(f.writer.add(pose));
  }
  REQUIRE(f.writer.write_segment({1, 0, 2}, {sample::chunk(101, 0, 1)}));
  REQUIRE(f.writer.write_segment({2, 0, 2}, {sample::chunk(102, 0, 1)}));
  REQUIRE(f.writer.write_segment({1, 2, 2}, {sample::chunk(101, 2, 1)}));
  REQUIRE(f.writer.finish());
  const auto all = sample::read_everything(sample::memory(f.sink.take()));
  REQUIRE(all);
  CHECK(all->errors.empty());
  CHECK(all->rest.size() == 8);
}

TEST_CASE("ancillary records of the writer are passed over by the reader") {
  Fixture f;
  REQUIRE(f.writer.add_ancillary(record_type("noTe"), std::vector<std::uint8_t>{1, 2, 3}));
  sample::add_static(f.writer);
  REQUIRE(f.writer.write_segment({7, 0, 5}, sample::chunks(0, 5)));
  REQUIRE(f.writer.add_ancillary(record_type("noTe"), {}));
  REQUIRE(f.writer.finish());
  const auto all = sample::read_everything(sample::memory(f.sink.take()));
  REQUIRE(all);
  CHECK(all->errors.empty());
  CHECK(all->finished);
}

TEST_CASE("a sink that fails at any byte fails the writer") {
  const auto size = sample::file().size();
  for (std::size_t capacity = 0; capacity < size; capacity += 13) {
    SmallSink sink(capacity);
    const auto write = [&]() -> Status {
      RELIT_ASSIGN(auto writer, Writer::create(sink, "sample 1"));
      RELIT_TRY(writer.add(sample::clip()));
      RELIT_TRY(writer.add(sample::image()));
      RELIT_TRY(writer.add(sample::material()));
      RELIT_TRY(writer.add(sample::mesh()));
      RELIT_TRY(writer.add(sample::skeleton()));
      RELIT_TRY(writer.add(sample::pose_track()));
      RELIT_TRY(writer.add(sample::model()));
      RELIT_TRY(writer.add(sample::layer()));
      RELIT_TRY(writer.add(sample::second_layer()));
      RELIT_TRY(writer.write_segment({7, 0, 2}, sample::chunks(0, 2)));
      RELIT_TRY(writer.write_segment({7, 2, 2}, sample::chunks(2, 2)));
      RELIT_TRY(writer.write_segment({7, 4, 1}, sample::chunks(4, 1)));
      return writer.finish();
    };
    const auto status = write();
    REQUIRE_FALSE(status);
    REQUIRE(status.error().code == ErrorCode::kIo);
  }
}
