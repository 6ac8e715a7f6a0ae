// SPDX-License-Identifier: MIT
#include "container/timeline.hpp"

#include <algorithm>

namespace relit::container {

std::uint64_t Timeline::Run::end(std::uint64_t number) const {
  return ends.empty() ? first_tick + number + 1 : ends[static_cast<std::size_t>(number)];
}

std::uint64_t Timeline::Run::start(std::uint64_t number) const {
  return number == 0 ? first_tick : end(number - 1);
}

void Timeline::add(const SegmentRecord& segment) {
  if (even_ || segment.first_frame >= frames_) return;
  const auto [at, fresh] = runs_.try_emplace(segment.first_tick);
  Run& run = at->second;
  if (!fresh) {
    const auto known = ticks_.find(run.first_frame);
    if (known != ticks_.end() && known->second == run.first_tick) ticks_.erase(known);
  }
  run.first_frame = segment.first_frame;
  run.first_tick = segment.first_tick;
  run.frame_count = static_cast<std::uint32_t>(
      std::min<std::uint64_t>(segment.frame_count, frames_ - segment.first_frame));
  run.ends.clear();
  if (!segment.durations.empty()) {
    run.ends.reserve(run.frame_count);
    std::uint64_t tick = segment.first_tick;
    for (std::uint32_t i = 0; i < run.frame_count; ++i)
      run.ends.push_back(tick += segment.durations[i]);
  }
  run.end_tick = run.end(std::uint64_t{run.frame_count} - 1);
  ticks_.insert_or_assign(segment.first_frame, segment.first_tick);
}

std::optional<std::uint64_t> Timeline::frame_at(std::uint64_t tick) const {
  if (even_) return tick < duration_ ? std::optional(tick) : std::nullopt;
  auto next = runs_.upper_bound(tick);
  if (next == runs_.begin()) return std::nullopt;
  const Run& run = std::prev(next)->second;
  if (tick >= run.end_tick) return std::nullopt;
  if (run.ends.empty()) return run.first_frame + (tick - run.first_tick);
  const auto shown = std::ranges::upper_bound(run.ends, tick);
  return run.first_frame + static_cast<std::uint64_t>(shown - run.ends.begin());
}

const Timeline::Run* Timeline::run_of(std::uint64_t frame) const {
  const auto next = ticks_.upper_bound(frame);
  if (next == ticks_.begin()) return nullptr;
  const Run& run = runs_.at(std::prev(next)->second);
  return frame - run.first_frame < run.frame_count ? &run : nullptr;
}

std::optional<std::uint64_t> Timeline::first_tick(std::uint64_t frame) const {
  if (even_) return frame < duration_ ? std::optional(frame) : std::nullopt;
  const Run* run = run_of(frame);
  if (run == nullptr) return std::nullopt;
  return run->start(frame - run->first_frame);
}

std::optional<std::uint32_t> Timeline::ticks_of(std::uint64_t frame) const {
  if (even_) return frame < duration_ ? std::optional<std::uint32_t>(1) : std::nullopt;
  const Run* run = run_of(frame);
  if (run == nullptr) return std::nullopt;
  const std::uint64_t number = frame - run->first_frame;
  return static_cast<std::uint32_t>(run->end(number) - run->start(number));
}

}  // namespace relit::container
