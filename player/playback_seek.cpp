// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <string>

#include "player/playback.hpp"
#include "player/playback_units.hpp"

// Going elsewhere: seeks and steps.
namespace relit::player {
namespace {

Unexpected unknown_frame(std::size_t clip) {
  return fail(ErrorCode::kNotFound, "clip " + std::to_string(clip) +
                                        ": it is not known yet when the frame is to be shown");
}

}  // namespace

Status Playback::seek(double time_s) {
  if (!std::isfinite(time_s)) {
    return fail(ErrorCode::kInvalid, "a time to seek to that is not a finite number");
  }
  outgoing_.reset();
  const double length_s = duration_s();
  rounds_ = loops() && time_s >= length_s ? 1 : 0;
  if (time_s >= length_s) {
    position_ = program_.end;
    if (!loops()) return {};
    time_s = std::fmod(time_s, length_s);
  }
  if (time_s <= 0) time_s = 0;
  const Scheduled& first = program_.items[0];
  if (program_.items.size() == 1 && first.factor == 1) {
    const container::Rational& rate = clips_[first.clip].tick_rate;
    const double ticks = time_s * static_cast<double>(rate.num) / static_cast<double>(rate.den);
    const double nearest = std::round(ticks);
    const bool exact = std::abs(ticks - nearest) <= 1e-6;
    const double whole = exact ? nearest : std::floor(ticks);
    const double rest = exact ? 0.0 : ticks - whole;
    position_ = static_cast<Int>(whole) * first.tick +
                static_cast<Int>(rest * static_cast<double>(first.tick));
  } else {
    const double whole = std::floor(time_s);
    position_ = (static_cast<Int>(whole) * kSecondUnits +
                 static_cast<Int>((time_s - whole) * static_cast<double>(kSecondUnits))) *
                program_.scale;
  }
  position_ = std::min(position_, program_.end);
  return {};
}

void Playback::seek_tick(std::uint64_t tick) {
  const std::size_t clip = program_.items[item_at(position_)].clip;
  outgoing_.reset();
  if (!program_.is_clip()) lay_out(clip, program_);
  rounds_ = 0;
  position_ =
      static_cast<Int>(std::min(tick, clips_[clip].duration_ticks - 1)) * program_.items[0].tick;
}

Status Playback::seek_frame(std::uint64_t frame) {
  const std::size_t clip = program_.items[item_at(position_)].clip;
  const auto span = span_of(clip, std::min(frame, clips_[clip].frame_count - 1));
  if (!span) return unknown_frame(clip);
  seek_tick(span->first_tick);
  return {};
}

Status Playback::step(std::int64_t frames) {
  wrap();
  if (program_.is_clip()) {
    RELIT_TRY(step_in_clip(frames));
  } else {
    if (std::abs(static_cast<double>(frames)) > static_cast<double>(kMostSteps)) {
      return fail(ErrorCode::kLimit, "more than a million steps in a sequence");
    }
    const Int position = position_;
    const Int rounds = rounds_;
    for (std::int64_t i = 0; i < std::abs(frames); ++i) {
      const Result<bool> moved = frames > 0 ? step_on() : step_back();
      if (!moved) {
        position_ = position, rounds_ = rounds;
        return Unexpected{moved.error()};
      }
      if (!*moved) break;
    }
  }
  outgoing_.reset();
  paused_ = true;
  return {};
}

Status Playback::step_in_clip(std::int64_t frames) {
  const Scheduled& item = program_.items[0];
  const PlaybackClip& clip = clips_[item.clip];
  const auto tick =
      std::min(static_cast<std::uint64_t>(position_ / item.tick), clip.duration_ticks - 1);
  const auto shown = span_at(item.clip, tick);
  if (!shown) return unknown_frame(item.clip);
  const Int count = static_cast<Int>(clip.frame_count);
  Int target = static_cast<Int>(shown->frame) + frames;
  const Int rounds = loops() ? floor_div(target, count) : Int{0};
  target = loops() ? target - rounds * count : std::clamp(target, Int{0}, count - 1);
  const auto span = span_of(item.clip, static_cast<std::uint64_t>(target));
  if (!span) return unknown_frame(item.clip);
  position_ = static_cast<Int>(span->first_tick) * item.tick;
  rounds_ += rounds;
  return {};
}

Result<FrameSpan> Playback::span_in(std::size_t item, Int offset) const {
  const Place place = place_in(item, offset);
  const auto last_tick = static_cast<Int>(clips_[place.clip].duration_ticks) - 1;
  const auto span =
      span_at(place.clip, static_cast<std::uint64_t>(std::min(place.x / place.tick, last_tick)));
  if (!span) return unknown_frame(place.clip);
  return *span;
}

// One frame of the primary on, or into the next item; false at the end.
Result<bool> Playback::step_on() {
  const std::size_t index = item_at(position_);
  const Scheduled& item = program_.items[index];
  const bool last = index + 1 == program_.items.size();
  RELIT_ASSIGN(const FrameSpan shown, span_in(index, position_ - item.start));
  const bool anew = shown.frame + 1 >= clips_[item.clip].frame_count;
  const Int repeat = repeat_at(item, position_ - item.start) + (anew ? 1 : 0);
  const Int end = last ? round() : program_.items[index + 1].start;
  Int target = end;
  if (repeat < item.repeats) {
    const auto span = span_of(item.clip, anew ? 0 : shown.frame + 1);
    if (!span) return unknown_frame(item.clip);
    target = std::min(end, position_of(item, repeat, static_cast<Int>(span->first_tick)));
  }
  if (last && !loops() && target >= end) return false;
  position_ = target;
  wrap();
  return true;
}

// One frame of the primary back, or into the item before; false at the beginning.
Result<bool> Playback::step_back() {
  const std::size_t index = item_at(position_);
  const Scheduled& item = program_.items[index];
  RELIT_ASSIGN(const FrameSpan shown, span_in(index, position_ - item.start));
  const Int repeat = repeat_at(item, position_ - item.start);
  if (shown.frame > 0 || repeat > 0) {
    const bool anew = shown.frame == 0;
    const auto span =
        span_of(item.clip, anew ? clips_[item.clip].frame_count - 1 : shown.frame - 1);
    if (!span) return unknown_frame(item.clip);
    position_ = position_of(item, repeat - (anew ? 1 : 0), static_cast<Int>(span->first_tick));
    return true;
  }
  if (index == 0 && !loops()) {
    position_ = 0;
    return false;
  }
  const Int end = index == 0 ? round() : item.start;
  const std::size_t previous = item_before(index);
  const Scheduled& before = program_.items[previous];
  const Int offset = end - 1 - before.start;
  RELIT_ASSIGN(const FrameSpan span, span_in(previous, offset));
  if (index == 0) --rounds_;
  const Int start =
      position_of(before, repeat_at(before, offset), static_cast<Int>(span.first_tick));
  position_ = std::max(before.start, start);
  return true;
}

}  // namespace relit::player
