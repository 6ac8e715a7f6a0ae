// SPDX-License-Identifier: MIT
#include "player/clip_demuxer.hpp"

#include <set>

#include "tests/player/coded_file.hpp"
#include "tests/player/prefetch_clip.hpp"

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;

namespace {

struct Read {
  std::vector<std::uint64_t> segments;  ///< first frames
  std::set<std::uint32_t> tracks;
  std::size_t chunks = 0;
};

Read read_to_end(ClipDemuxer& demuxer, std::uint64_t target = 0) {
  Read read;
  container::ChunkRecord chunk;
  for (;;) {
    const auto event = demuxer.step(target, chunk);
    REQUIRE(event);
    if (*event == ClipDemuxer::Event::kEnd) return read;
    if (*event == ClipDemuxer::Event::kSegment && demuxer.segment() != nullptr) {
      read.segments.push_back(demuxer.segment()->first_frame);
    }
    if (*event != ClipDemuxer::Event::kChunk) continue;
    read.tracks.insert(chunk.track_id);
    ++read.chunks;
    demuxer.recycle(std::move(chunk));
  }
}

}  // namespace

TEST_CASE("a demuxer gives segments and the chunks of the tracks that are wanted") {
  auto demuxer = ClipDemuxer::open(memory_source(read_bytes(shipped_clip())), "clip", {});
  REQUIRE(demuxer);
  const auto& layers = demuxer->layers();
  REQUIRE(layers.size() > 1);
  const auto all = read_to_end(*demuxer);
  CHECK(all.segments.front() == 0);
  CHECK(all.tracks.count(demuxer->pose_record().track_id) == 1);
  for (const auto& layer : layers) CHECK(all.tracks.count(layer.mantissa_track) == 1);
  CHECK(demuxer->ended());
  CHECK(demuxer->complete_end() == demuxer->clip().frame_count);
  std::vector<std::uint8_t> second(layers.size(), 0);
  second[1] = 1;
  demuxer->want_layers(second);
  const std::uint64_t middle = all.segments[1];
  REQUIRE(demuxer->jump(middle + 1).value());
  CHECK(demuxer->complete_end() == middle);
  const auto one = read_to_end(*demuxer);
  CHECK(one.segments == std::vector<std::uint64_t>(all.segments.begin() + 1, all.segments.end()));
  CHECK(one.tracks.count(layers[0].mantissa_track) == 0);
  CHECK(one.tracks.count(layers[1].mantissa_track) == 1);
  demuxer->want_poses_alone();
  REQUIRE(demuxer->jump(0).value());
  CHECK(read_to_end(*demuxer).tracks == std::set<std::uint32_t>{demuxer->pose_record().track_id});
  CHECK_FALSE(demuxer->loss().any());
}

TEST_CASE("segments before the target are passed over") {
  auto demuxer = ClipDemuxer::open(std::make_unique<PipeSource>(coded_file()), "clip", {});
  REQUIRE(demuxer);
  CHECK_FALSE(demuxer->jump(2).value());
  CHECK(read_to_end(*demuxer, 3).segments == std::vector<std::uint64_t>{2});
}

TEST_CASE("a tick leads to its segment") {
  CodedFile how;
  how.uneven = true;
  auto demuxer = ClipDemuxer::open(memory_source(coded_file(how)), "clip", {});
  REQUIRE(demuxer);
  // Frames of 1 and 2 ticks in turn: the third begins at tick 3, the fourth at 4, the end is 6.
  CHECK_FALSE(demuxer->timeline().frame_at(5));
  REQUIRE(demuxer->jump_to_tick(5).value());
  container::ChunkRecord chunk;
  REQUIRE(demuxer->step(0, chunk));
  REQUIRE(demuxer->segment() != nullptr);
  CHECK(demuxer->segment()->first_frame == 2);
  CHECK(demuxer->timeline().frame_at(5) == std::uint64_t{3});
  CHECK(demuxer->check_tick(6).error().code == ErrorCode::kNotFound);
}

TEST_CASE("a demuxer finds its way over damage") {
  auto file = read_bytes(shipped_clip());
  auto reader = container::Reader::open(memory_source(file));
  const auto index = reader->read_index();
  REQUIRE(index);
  file[index->segments[1].offset + 30] ^= 1;
  auto demuxer = ClipDemuxer::open(memory_source(file), "clip", {});
  REQUIRE(demuxer);
  const auto read = read_to_end(*demuxer);
  CHECK(read.segments.size() == index->segments.size() - 1);
  CHECK(read.segments[1] == index->segments[2].first_frame);
  CHECK(demuxer->loss().any());
  CHECK(demuxer->loss().segments == 1);
  CHECK(demuxer->loss().first.find("clip: ") == 0);
}
