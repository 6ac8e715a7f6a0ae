// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "container/base/result.hpp"
#include "container/records.hpp"

namespace relit::container {

/// Which segments of a clip may follow one another: frames and ticks rise together, and leave room
/// for what is missing. Gaps are allowed; a segment that overlaps an earlier one is not.
class SegmentOrder {
 public:
  /// Of a clip that has so many frames and ticks.
  SegmentOrder(std::uint64_t frame_count, std::uint64_t duration_ticks)
      : frame_count_(frame_count), duration_ticks_(duration_ticks) {}

  /// Whether a segment, valid by itself, may follow those that were accepted. Errors: kCorrupt.
  [[nodiscard]] Status check(const SegmentRecord& segment) const;
  /// Notes a segment that passed check().
  void accept(const SegmentRecord& segment);

  [[nodiscard]] std::uint64_t next_frame() const { return next_frame_; }
  [[nodiscard]] std::uint64_t next_tick() const { return next_tick_; }

 private:
  std::uint64_t frame_count_;
  std::uint64_t duration_ticks_;
  std::uint64_t next_frame_ = 0;  ///< behind the last one accepted
  std::uint64_t next_tick_ = 0;
};

}  // namespace relit::container
