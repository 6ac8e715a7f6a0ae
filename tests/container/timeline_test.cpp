// SPDX-License-Identifier: MIT
#include "container/timeline.hpp"

#include "container/reader.hpp"
#include "container/writer.hpp"
#include "tests/container/sample.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::container;

namespace {

ClipRecord uneven_clip(std::uint64_t ticks) {
  ClipRecord clip = sample::clip();
  clip.duration_ticks = ticks;
  return clip;
}

/// The sample file with frames of 3, 1, 1, 7 and 2 ticks.
sample::Bytes uneven_file(std::uint64_t claimed_ticks, Status* status = nullptr) {
  MemorySink sink;
  auto writer = Writer::create(sink, "sample 1").value();
  REQUIRE(writer.add(uneven_clip(claimed_ticks)));
  REQUIRE(writer.add(sample::image()));
  REQUIRE(writer.add(sample::material()));
  REQUIRE(writer.add(sample::mesh()));
  REQUIRE(writer.add(sample::skeleton()));
  REQUIRE(writer.add(sample::pose_track()));
  REQUIRE(writer.add(sample::model()));
  REQUIRE(writer.add(sample::layer()));
  REQUIRE(writer.add(sample::second_layer()));
  REQUIRE(writer.write_segment({7, 0, 2, {3, 1}}, sample::chunks(0, 2)));
  REQUIRE(writer.write_segment({7, 2, 1, {1}}, sample::chunks(2, 1)));
  Status finished = writer.write_segment({7, 3, 2, {7, 2}}, sample::chunks(3, 2));
  if (finished) finished = writer.finish();
  if (status != nullptr) *status = finished;
  return sink.take();
}

}  // namespace

TEST_CASE("frames without durations last one tick") {
  const Timeline timeline(sample::clip(7, 5));
  CHECK(timeline.even());
  for (std::uint64_t k = 0; k < 5; ++k) {
    CHECK(timeline.frame_at(k) == k);
    CHECK(timeline.first_tick(k) == k);
    CHECK(timeline.ticks_of(k) == 1u);
  }
  CHECK_FALSE(timeline.frame_at(5));
  CHECK_FALSE(timeline.first_tick(5));
}

TEST_CASE("uneven frames are found by their ticks, as far as their segments are known") {
  const auto all = sample::read_everything(sample::memory(uneven_file(14))).value();
  CHECK(all.errors.empty());
  Timeline timeline(all.contents.clips[0]);
  CHECK_FALSE(timeline.even());
  std::vector<SegmentRecord> segments;
  for (const auto& body : all.rest)
    if (const auto* segment = std::get_if<SegmentRecord>(&body)) segments.push_back(*segment);
  REQUIRE(segments.size() == 3);
  CHECK(segments[1].durations.empty());  // one tick each needs no list
  CHECK(segments[1].first_tick == 4);
  CHECK(segments[2].first_tick == 5);

  timeline.add(segments[2]);
  CHECK_FALSE(timeline.frame_at(4));
  CHECK(timeline.frame_at(5) == 3u);
  timeline.add(segments[0]);
  CHECK_FALSE(timeline.frame_at(4));  // between what is known
  timeline.add(segments[1]);
  const std::uint64_t shown[] = {0, 0, 0, 1, 2, 3, 3, 3, 3, 3, 3, 3, 4, 4};
  for (std::uint64_t tick = 0; tick < 14; ++tick) CHECK(timeline.frame_at(tick) == shown[tick]);
  CHECK_FALSE(timeline.frame_at(14));
  const std::uint64_t starts[] = {0, 3, 4, 5, 12};
  const std::uint32_t lasts[] = {3, 1, 1, 7, 2};
  for (std::uint64_t k = 0; k < 5; ++k) {
    CHECK(timeline.first_tick(k) == starts[k]);
    CHECK(timeline.ticks_of(k) == lasts[k]);
  }
}

TEST_CASE("the writer holds a clip to its duration") {
  Status status;
  uneven_file(14, &status);
  CHECK(status);
  uneven_file(15, &status);
  REQUIRE_FALSE(status);
  CHECK(status.error().message.find(
            "the segment ends at tick 14, which does not fit the clip's 15") != std::string::npos);
  MemorySink sink;
  auto writer = Writer::create(sink, "sample 1").value();
  CHECK_FALSE(writer.add(uneven_clip(4)));  // fewer ticks than frames
}

TEST_CASE("the index knows when its segments begin") {
  auto reader = Reader::open(sample::memory(uneven_file(14))).value();
  const auto index = reader.read_index();
  REQUIRE(index);
  REQUIRE(index->segments.size() == 3);
  CHECK(index->segments[2].first_tick == 5);
  REQUIRE(load_static(reader));
  IndexRecord::Entry lie = index->segments[2];
  lie.first_tick = 6;
  REQUIRE(reader.seek_to_segment(lie));
  CHECK_FALSE(reader.next());
}

TEST_CASE("segments of many frames cost no more than their records") {
  // As ticks of each frame these would take 32 GiB.
  constexpr std::uint64_t kSegments = 1 << 16;
  ClipRecord clip = uneven_clip(limits::kTicks + 1);
  clip.frame_count = kSegments * limits::kFramesPerSegment;
  Timeline timeline(clip);
  SegmentRecord segment;
  segment.frame_count = limits::kFramesPerSegment;
  for (std::uint64_t i = 0; i < kSegments; ++i) {
    segment.first_frame = segment.first_tick = i * limits::kFramesPerSegment;
    timeline.add(segment);
  }
  for (const std::uint64_t frame :
       {std::uint64_t{0}, std::uint64_t{65535}, std::uint64_t{65536}, (kSegments << 16) - 1}) {
    CHECK(timeline.frame_at(frame) == frame);
    CHECK(timeline.first_tick(frame) == frame);
    CHECK(timeline.ticks_of(frame) == 1u);
  }
  CHECK_FALSE(timeline.frame_at(kSegments << 16));
  CHECK_FALSE(timeline.first_tick(kSegments << 16));
}

TEST_CASE("a segment that starts at the same tick takes the place of the other") {
  Timeline timeline(uneven_clip(14));
  SegmentRecord segment;
  segment.frame_count = 2;
  timeline.add(segment);
  CHECK(timeline.first_tick(1) == 1u);
  segment.first_frame = 3;
  segment.durations = {4, 5};
  timeline.add(segment);
  CHECK_FALSE(timeline.first_tick(1));
  CHECK(timeline.first_tick(4) == 4u);
  CHECK(timeline.ticks_of(4) == 5u);
  CHECK(timeline.frame_at(3) == 3u);
  CHECK(timeline.frame_at(8) == 4u);
  CHECK_FALSE(timeline.frame_at(9));
}

TEST_CASE("frames that the clip does not have are not shown") {
  Timeline timeline(uneven_clip(14));
  SegmentRecord segment;
  segment.first_frame = 1'409'286'144;
  segment.frame_count = 2;
  timeline.add(segment);
  CHECK_FALSE(timeline.frame_at(0));
  CHECK_FALSE(timeline.first_tick(1'409'286'144));
  // Of a segment that reaches beyond, what lies before the end.
  const std::uint64_t frames = uneven_clip(14).frame_count;
  segment.first_frame = frames - 1;
  segment.first_tick = 9;
  segment.durations = {2, 3};
  timeline.add(segment);
  CHECK(timeline.frame_at(10) == frames - 1);
  CHECK_FALSE(timeline.frame_at(11));
  CHECK_FALSE(timeline.ticks_of(frames));
}
