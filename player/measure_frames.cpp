// SPDX-License-Identifier: MIT
#include "player/measure_frames.hpp"

#include "player/source.hpp"

namespace relit::player {

Result<TickFrames> TickFrames::open(const std::string& path, const Options& options) {
  ClipOptions clip;
  clip.clip = options.clip;
  clip.layers = options.layers;
  RELIT_ASSIGN(auto source, open_source(path));
  RELIT_ASSIGN(ClipReader reader, ClipReader::open(std::move(source), source_name(path), clip));
  TickFrames frames(std::move(reader), options.every);
  if (options.every > 1 && frames.reader_.clip().loop) RELIT_TRY(frames.fill(frames.first_, 0));
  return frames;
}

Status TickFrames::fill(Slot& slot, std::uint64_t index) {
  if (slot.index == index) return {};
  slot.index.reset();
  RELIT_TRY(reader_.frame(index, slot.frame));
  slot.index = index;
  return {};
}

// from_ is the last decoded frame at or before the tick, to_ the next one if there is one.
Status TickFrames::go_to(std::uint64_t tick) {
  const std::uint64_t count = reader_.clip().frame_count;
  if (!from_.index) RELIT_TRY(fill(from_, 0));
  for (;;) {
    const std::uint64_t next = *from_.index + every_;
    if (next >= count) {
      to_.index.reset();
      return {};
    }
    RELIT_TRY(fill(to_, next));
    if (reader_.first_tick(next) > tick) return {};
    std::swap(from_, to_);
  }
}

Result<FrameMix> TickFrames::at(std::uint64_t tick) {
  RELIT_TRY(go_to(tick));
  const std::uint64_t begin = reader_.first_tick(*from_.index);
  FrameMix mix{&from_.frame.planes, nullptr, 0, &from_.frame.pose};
  const Slot* to = to_.index ? &to_ : first_.index ? &first_ : nullptr;
  if (to == nullptr || tick <= begin) return mix;
  const std::uint64_t end =
      to_.index ? reader_.first_tick(*to_.index) : reader_.clip().duration_ticks;
  mix.to = &to->frame.planes, mix.to_pose = &to->frame.pose;
  mix.blend =
      static_cast<float>(static_cast<double>(tick - begin) / static_cast<double>(end - begin));
  return mix;
}

}  // namespace relit::player
