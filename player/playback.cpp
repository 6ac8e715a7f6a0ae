// SPDX-License-Identifier: MIT
#include "player/playback.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "player/playback_units.hpp"

namespace relit::player {
namespace {

// One update moves at most a year: 2^55 ns · 100 · 2^32 · a scale of 2^31 stays below 2^125.
constexpr std::int64_t kMostNanoseconds = std::int64_t{366} * 86400 * 1'000'000'000;

}  // namespace

PlaybackClip playback_clip(const container::ClipRecord& clip) {
  return {clip.tick_rate, clip.frame_count, clip.duration_ticks, clip.loop};
}

std::optional<FrameSpan> span_of_frame(const container::Timeline& timeline, std::uint64_t frame) {
  const auto first = timeline.first_tick(frame);
  const auto ticks = timeline.ticks_of(frame);
  if (!first || !ticks) return std::nullopt;
  return FrameSpan{frame, *first, *ticks};
}

std::optional<FrameSpan> span_at_tick(const container::Timeline& timeline, std::uint64_t tick) {
  const auto frame = timeline.frame_at(tick);
  return frame ? span_of_frame(timeline, *frame) : std::nullopt;
}

bool Playback::loops() const {
  return loop_mode_ == LoopMode::kOn || (loop_mode_ == LoopMode::kAsGiven && program_.loop);
}

double Playback::speed() const { return std::ldexp(static_cast<double>(speed_), -kSpeedBits); }

Status Playback::set_speed(double speed) {
  if (!(std::abs(speed) <= kLargestSpeed)) {
    return fail(ErrorCode::kInvalid,
                "a speed of " + std::to_string(speed) + "; it must lie between -100 and 100");
  }
  speed_ = std::llround(std::ldexp(speed, kSpeedBits));
  return {};
}

double Playback::duration_s() const {
  return static_cast<double>(round()) / static_cast<double>(program_.scale * kSecondUnits);
}

// ---- the clock

// The length of one time through: where it goes round, the last item overlaps the first.
Playback::Int Playback::round() const {
  return loops() ? program_.end - program_.items[0].fade : program_.end;
}

void Playback::wrap() {
  if (!loops()) {
    position_ = std::clamp(position_, Int{0}, program_.end);
    return;
  }
  const Int passed = floor_div(position_, round());
  rounds_ += passed;
  position_ -= passed * round();
}

void Playback::advance(Int delta) {
  position_ += delta * program_.scale;
  wrap();
  if (!outgoing_) return;
  outgoing_->faded += delta < 0 ? -delta : delta;
  if (outgoing_->faded >= outgoing_->fade) {
    outgoing_.reset();
    return;
  }
  Place& place = outgoing_->place;
  const Int length = static_cast<Int>(clips_[place.clip].duration_ticks) * place.tick;
  place.x += delta * outgoing_->scale;
  place.x = place.goes_round ? place.x - floor_div(place.x, length) * length
                             : std::clamp(place.x, Int{0}, length);
}

Moment Playback::at(std::int64_t now_ns) {
  const Int passed = last_ns_ ? static_cast<Int>(now_ns) - *last_ns_ : Int{0};
  last_ns_ = now_ns;
  if (!paused_ && passed > 0) advance(std::min(passed, Int{kMostNanoseconds}) * speed_);
  return look();
}

// ---- what is shown

std::optional<FrameSpan> Playback::span_at(std::size_t clip, std::uint64_t tick) const {
  if (clips_[clip].duration_ticks == clips_[clip].frame_count) return FrameSpan{tick, tick, 1};
  return times_->at_tick(clip, tick);
}

std::optional<FrameSpan> Playback::span_of(std::size_t clip, std::uint64_t frame) const {
  if (clips_[clip].duration_ticks == clips_[clip].frame_count) return FrameSpan{frame, frame, 1};
  return times_->of_frame(clip, frame);
}

std::size_t Playback::item_at(Int position) const {
  const auto& items = program_.items;
  const auto after =
      std::upper_bound(items.begin(), items.end(), position,
                       [](Int wanted, const Scheduled& item) { return wanted < item.start; });
  return after == items.begin() ? 0 : static_cast<std::size_t>(after - items.begin()) - 1;
}

std::size_t Playback::item_before(std::size_t item) const {
  return item == 0 ? program_.items.size() - 1 : item - 1;
}

Playback::Int Playback::repeat_at(const Scheduled& item, Int offset) const {
  const Int length = static_cast<Int>(clips_[item.clip].duration_ticks) * item.tick;
  return std::min(offset * item.factor / length, Int{item.repeats} - 1);
}

// Whether the clip begins anew without a seam when this repeat of it is over.
bool Playback::goes_round(std::size_t item, Int repeat) const {
  const Scheduled& played = program_.items[item];
  if (!clips_[played.clip].loop) return false;
  if (repeat + 1 < played.repeats) return true;
  const bool last = item + 1 == program_.items.size();
  if (last && !loops()) return false;
  const Scheduled& next = program_.items[last ? 0 : item + 1];
  return next.clip == played.clip && next.fade == 0;
}

// Where a tick of a repeat of an item is, in the program.
Playback::Int Playback::position_of(const Scheduled& item, Int repeat, Int tick) const {
  const Int ticks = repeat * static_cast<Int>(clips_[item.clip].duration_ticks) + tick;
  return item.start + ceil_div(ticks * item.tick, item.factor);
}

Playback::Place Playback::place_in(std::size_t item, Int offset) const {
  const Scheduled& played = program_.items[item];
  const Int repeat = repeat_at(played, offset);
  Place place;
  place.clip = played.clip;
  place.tick = played.tick;
  place.x = offset * played.factor -
            repeat * static_cast<Int>(clips_[played.clip].duration_ticks) * played.tick;
  place.goes_round = goes_round(item, repeat);
  return place;
}

FramePosition Playback::locate(const Place& place) {
  const PlaybackClip& clip = clips_[place.clip];
  FramePosition at;
  at.clip = place.clip;
  const Int last_tick = static_cast<Int>(clip.duration_ticks) - 1;
  at.tick = static_cast<std::uint64_t>(std::min(place.x / place.tick, last_tick));
  const std::optional<FrameSpan> span = span_at(place.clip, at.tick);
  std::uint64_t& held = held_[place.clip];
  if (span && span->frame < clip.frame_count) held = span->frame;
  at.frame = at.next_frame = held;
  at.known = span && span->frame == held;
  if (!at.known) return at;
  if (held + 1 < clip.frame_count) {
    at.next_frame = held + 1;
  } else if (place.goes_round) {
    at.next_frame = 0;
  } else {
    return at;
  }
  // Exact but for the last rounding, which must not make it 1.
  const Int passed = place.x - static_cast<Int>(span->first_tick) * place.tick;
  const double fraction = static_cast<double>(passed) / static_cast<double>(place.tick) /
                          static_cast<double>(std::max(span->ticks, 1u));
  at.fraction = std::clamp(fraction, 0.0, std::nextafter(1.0, 0.0));
  return at;
}

Moment Playback::look() {
  wrap();  // the loop mode may have changed
  Moment moment;
  moment.item = item_at(position_);
  const Scheduled& item = program_.items[moment.item];
  const Int offset = position_ - item.start;
  if (outgoing_) {
    moment.secondary = locate(outgoing_->place);
    moment.secondary_weight =
        1 - static_cast<double>(outgoing_->faded) / static_cast<double>(outgoing_->fade);
  } else if (offset < item.fade && (moment.item > 0 || rounds_ != 0)) {
    const std::size_t before = item_before(moment.item);
    moment.secondary = locate(place_in(before, program_.items[before].length - item.fade + offset));
    moment.secondary_weight = 1 - static_cast<double>(offset) / static_cast<double>(item.fade);
  }
  moment.primary = locate(place_in(moment.item, offset));
  moment.ended = !loops() && (speed_ < 0 ? position_ == 0 : position_ == program_.end);
  moment.time_s =
      static_cast<double>(position_) / static_cast<double>(program_.scale * kSecondUnits);
  moment.next_frame_ns = next_change(moment.primary);
  return moment;
}

std::optional<std::int64_t> Playback::next_change(const FramePosition& shown) const {
  if (paused_ || speed_ == 0 || !shown.known) return std::nullopt;
  const std::optional<FrameSpan> span = span_at(shown.clip, shown.tick);
  if (!span) return std::nullopt;
  const std::size_t index = item_at(position_);
  const Scheduled& item = program_.items[index];
  const Int repeat = repeat_at(item, position_ - item.start);
  const auto first = static_cast<Int>(span->first_tick);
  const bool last = index + 1 == program_.items.size();
  Int wait = 0;
  if (speed_ > 0) {
    const Int end = last ? round() : program_.items[index + 1].start;
    const Int change = position_of(item, repeat, first + span->ticks);
    if (last && !loops() && change >= end) return std::nullopt;
    wait = std::min(change, end) - position_;
  } else {
    const Int change = position_of(item, repeat, first);
    if (change <= 0 && !loops()) return std::nullopt;
    wait = position_ - std::max(change, item.start) + 1;
  }
  const Int speed = speed_ < 0 ? -Int{speed_} : Int{speed_};
  const Int nanoseconds = ceil_div(wait, program_.scale * speed);
  if (nanoseconds > kMostNanoseconds) return std::nullopt;
  return static_cast<std::int64_t>(std::max(nanoseconds, Int{0}));
}

}  // namespace relit::player
