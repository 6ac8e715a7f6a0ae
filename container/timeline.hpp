// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "container/records.hpp"

namespace relit::container {

/// When the frames of a clip are shown (FORMAT.md, section 3.1), as far as its segments are known.
/// An evenly spaced clip needs none of them. Takes no more memory than the segments' records, and
/// finds frames in logarithmic time, whatever the segments say.
class Timeline {
 public:
  Timeline() = default;
  explicit Timeline(const ClipRecord& clip)
      : even_(clip.duration_ticks == clip.frame_count),
        frames_(clip.frame_count),
        duration_(clip.duration_ticks) {}

  /// What a segment of the clip says, but for frames that the clip does not have. A segment that
  /// starts at the same tick is replaced.
  void add(const SegmentRecord& segment);

  /// The frame shown at `tick`; nothing where its segment is not known.
  [[nodiscard]] std::optional<std::uint64_t> frame_at(std::uint64_t tick) const;
  /// When `frame` begins to be shown.
  [[nodiscard]] std::optional<std::uint64_t> first_tick(std::uint64_t frame) const;
  /// How long `frame` is shown: at least one tick.
  [[nodiscard]] std::optional<std::uint32_t> ticks_of(std::uint64_t frame) const;

  [[nodiscard]] bool even() const { return even_; }
  [[nodiscard]] std::uint64_t duration_ticks() const { return duration_; }

 private:
  struct Run {
    std::uint64_t first_frame = 0;
    std::uint64_t first_tick = 0;
    std::uint64_t end_tick = 0;
    std::uint32_t frame_count = 0;
    std::vector<std::uint64_t> ends;  ///< tick at which each frame ends; empty: each lasts one
    /// Of the frame of that number in the run.
    [[nodiscard]] std::uint64_t end(std::uint64_t number) const;
    [[nodiscard]] std::uint64_t start(std::uint64_t number) const;
  };
  [[nodiscard]] const Run* run_of(std::uint64_t frame) const;

  bool even_ = true;
  std::uint64_t frames_ = 0;
  std::uint64_t duration_ = 0;
  std::map<std::uint64_t, Run> runs_;             ///< by first tick
  std::map<std::uint64_t, std::uint64_t> ticks_;  ///< first tick of a run by its first frame
};

}  // namespace relit::container
