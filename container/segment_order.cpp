// SPDX-License-Identifier: MIT
#include "container/segment_order.hpp"

#include <string>

#include "container/record_checks.hpp"

namespace relit::container {

using namespace checks;

namespace {

/// Every frame lasts at least a tick, and no frames last none.
bool can_last(std::uint64_t frames, std::uint64_t ticks) {
  return frames == 0 ? ticks == 0 : ticks >= frames;
}

}  // namespace

Status SegmentOrder::check(const SegmentRecord& segment) const {
  const std::uint64_t first = segment.first_frame;
  const std::uint64_t end = first + segment.frame_count;
  const std::uint64_t end_tick = segment.first_tick + duration_ticks(segment);
  RELIT_REQUIRE(first >= next_frame_, "the segment starts with frame " + std::to_string(first) +
                                          ", the next one of its clip is " +
                                          std::to_string(next_frame_));
  RELIT_REQUIRE(end <= frame_count_,
                "the segment goes beyond the clip's " + std::to_string(frame_count_) + " frames");
  RELIT_REQUIRE(segment.first_tick >= next_tick_ &&
                    can_last(first - next_frame_, segment.first_tick - next_tick_),
                "the segment starts at tick " + std::to_string(segment.first_tick) +
                    ", which does not fit frame " + std::to_string(first));
  RELIT_REQUIRE(
      end_tick <= duration_ticks_ && can_last(frame_count_ - end, duration_ticks_ - end_tick),
      "the segment ends at tick " + std::to_string(end_tick) + ", which does not fit the clip's " +
          std::to_string(duration_ticks_));
  return {};
}

void SegmentOrder::accept(const SegmentRecord& segment) {
  next_frame_ = segment.first_frame + segment.frame_count;
  next_tick_ = segment.first_tick + duration_ticks(segment);
}

}  // namespace relit::container
