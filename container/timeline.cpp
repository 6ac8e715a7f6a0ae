// SPDX-License-Identifier: MIT
#include "container/timeline.hpp"

#include <algorithm>

namespace relit::container {

void Timeline::add(const SegmentRecord& segment) {
  if (even_) return;
  Run& run = runs_[segment.first_tick];
  run.first_frame = segment.first_frame;
  run.starts.clear();
  run.starts.reserve(segment.frame_count + std::size_t{1});
  std::uint64_t tick = segment.first_tick;
  for (std::uint32_t i = 0; i < segment.frame_count; ++i) {
    run.starts.push_back(tick);
    tick += segment.durations.empty() ? 1 : segment.durations[i];
  }
  run.starts.push_back(tick);
}

std::optional<std::uint64_t> Timeline::frame_at(std::uint64_t tick) const {
  if (even_) return tick < duration_ ? std::optional(tick) : std::nullopt;
  auto next = runs_.upper_bound(tick);
  if (next == runs_.begin()) return std::nullopt;
  const Run& run = std::prev(next)->second;
  if (tick >= run.starts.back()) return std::nullopt;
  const auto start = std::prev(std::ranges::upper_bound(run.starts, tick));
  return run.first_frame + static_cast<std::uint64_t>(start - run.starts.begin());
}

const Timeline::Run* Timeline::run_of(std::uint64_t frame) const {
  for (const auto& [tick, run] : runs_) {
    if (frame >= run.first_frame && frame - run.first_frame + 1 < run.starts.size()) return &run;
  }
  return nullptr;
}

std::optional<std::uint64_t> Timeline::first_tick(std::uint64_t frame) const {
  if (even_) return frame < duration_ ? std::optional(frame) : std::nullopt;
  const Run* run = run_of(frame);
  if (run == nullptr) return std::nullopt;
  return run->starts[static_cast<std::size_t>(frame - run->first_frame)];
}

std::optional<std::uint32_t> Timeline::ticks_of(std::uint64_t frame) const {
  if (even_) return frame < duration_ ? std::optional<std::uint32_t>(1) : std::nullopt;
  const Run* run = run_of(frame);
  if (run == nullptr) return std::nullopt;
  const auto i = static_cast<std::size_t>(frame - run->first_frame);
  return static_cast<std::uint32_t>(run->starts[i + 1] - run->starts[i]);
}

}  // namespace relit::container
