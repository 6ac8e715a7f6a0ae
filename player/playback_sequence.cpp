// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "container/base/limits.hpp"
#include "container/base/out_of_memory.hpp"
#include "player/playback.hpp"
#include "player/playback_units.hpp"

// What a Playback plays: clips and sequences, laid out in units of which every tick has a whole
// number.
namespace relit::player {
namespace {

constexpr Int128 kLongestSequence = kSecondUnits
                                    << 32;  // 136 years; times a scale of 2^31: below 2^125
constexpr double kLongestFade_s = 3600;

Status check_clip(const PlaybackClip& clip, bool has_times) {
  const container::Rational& rate = clip.tick_rate;
  if (rate.num <= 0 || rate.den <= 0) {
    return fail(ErrorCode::kInvalid, "a tick rate of " + std::to_string(rate.num) + "/" +
                                         std::to_string(rate.den) + "; it must be positive");
  }
  if (clip.frame_count == 0 || clip.duration_ticks < clip.frame_count) {
    return fail(ErrorCode::kInvalid, std::to_string(clip.frame_count) + " frames in " +
                                         std::to_string(clip.duration_ticks) +
                                         " ticks; there is at least one, of at least a tick");
  }
  if (rate.num > limits::kRational || rate.den > limits::kRational ||
      clip.duration_ticks > limits::kTicks || clip.frame_count > limits::kFrames) {
    return fail(ErrorCode::kLimit, "beyond the limits of a clip");
  }
  if (clip.duration_ticks != clip.frame_count && !has_times) {
    return fail(ErrorCode::kInvalid, "unevenly spaced, and nobody who knows its times");
  }
  return {};
}

Status check_fade(double cross_fade_s) {
  if (std::isfinite(cross_fade_s) && cross_fade_s >= 0) return {};
  return fail(ErrorCode::kInvalid, "a cross-fade of " + std::to_string(cross_fade_s) +
                                       " s; it must be finite and not negative");
}

Int128 fade_units(double cross_fade_s) {
  return static_cast<Int128>(std::min(cross_fade_s, kLongestFade_s) *
                             static_cast<double>(kSecondUnits));
}

Unexpected unknown_clip(std::size_t clip, std::size_t count) {
  return fail(ErrorCode::kNotFound,
              "clip " + std::to_string(clip) + " of " + std::to_string(count) + ", from 0 on");
}

}  // namespace

Result<Playback> Playback::create(std::span<const PlaybackClip> clips, const FrameTimes* times) {
  return catch_out_of_memory("making a clock", [&]() -> Result<Playback> {
    if (clips.empty()) return fail(ErrorCode::kInvalid, "no clips to play");
    Playback playback;
    playback.times_ = times;
    for (std::size_t i = 0; i < clips.size(); ++i) {
      if (const Status status = check_clip(clips[i], times != nullptr); !status) {
        return fail(status.error().code,
                    "clip " + std::to_string(i) + ": " + status.error().message);
      }
      playback.clips_.push_back(clips[i]);
      container::Rational& rate = playback.clips_.back().tick_rate;
      const std::int64_t common = std::gcd(rate.num, rate.den);
      rate.num /= common, rate.den /= common;
    }
    playback.held_.resize(clips.size());
    playback.program_ = playback.program_of(0);
    return playback;
  });
}

Playback::Program Playback::program_of(std::size_t clip) const {
  Program program;
  lay_out(clip, program);
  return program;
}

// Makes a program of one clip; allocates nothing where it had items before.
void Playback::lay_out(std::size_t clip, Program& program) const {
  const PlaybackClip& played = clips_[clip];
  Scheduled item;
  item.clip = clip;
  item.tick = kSecondUnits * played.tick_rate.den;
  item.length = item.tick * static_cast<Int>(played.duration_ticks);
  program.items.resize(1);
  program.items[0] = item;
  program.scale = played.tick_rate.num;
  program.end = item.length;
  program.loop = played.loop;
}

Status Playback::play_clip(std::size_t clip, double cross_fade_s) {
  if (clip >= clips_.size()) return unknown_clip(clip, clips_.size());
  RELIT_TRY(check_fade(cross_fade_s));
  return catch_out_of_memory("changing clips", [&]() -> Status {
    Program program = program_of(clip);
    blend_over(cross_fade_s, program);
    start(std::move(program));
    return {};
  });
}

// What is playing becomes what goes, in units of its own.
void Playback::blend_over(double cross_fade_s, const Program& to) {
  const std::size_t index = item_at(position_);
  const Scheduled& item = program_.items[index];
  Outgoing from;
  from.fade = fade_units(cross_fade_s);
  const bool endless = loop_mode_ == LoopMode::kOn || (loop_mode_ != LoopMode::kOff && to.loop);
  if (!endless) from.fade = std::min(from.fade, to.end / to.scale / 2);
  if (from.fade <= 0) {
    outgoing_.reset();
    return;
  }
  if (outgoing_ && 2 * outgoing_->faded < outgoing_->fade) {  // it still outweighs what comes
    outgoing_->faded = 0, outgoing_->fade = from.fade;
    return;
  }
  const PlaybackClip& clip = clips_[item.clip];
  from.scale = clip.tick_rate.num;
  from.place = place_in(index, position_ - item.start);
  const Int own_tick = kSecondUnits * clip.tick_rate.den;  // item.tick is a multiple of it
  from.place.x /= item.tick / own_tick;
  from.place.tick = own_tick;
  from.place.goes_round = clip.loop || (program_.is_clip() && loops());
  outgoing_ = from;
}

Status Playback::play_sequence(std::span<const SequenceItem> items, bool loop) {
  return catch_out_of_memory("making a sequence", [&]() -> Status {
    RELIT_ASSIGN(Program program, schedule(items));
    program.loop = loop;
    outgoing_.reset();
    start(std::move(program));
    return {};
  });
}

Status Playback::choose_units(std::span<const SequenceItem> items, Program& program) const {
  if (items.empty()) return fail(ErrorCode::kInvalid, "a sequence without items");
  for (const SequenceItem& item : items) {
    if (item.clip >= clips_.size()) return unknown_clip(item.clip, clips_.size());
    RELIT_TRY(check_fade(item.cross_fade_s));
    if (item.repeats == 0) return fail(ErrorCode::kInvalid, "an item that is repeated 0 times");
    const std::int64_t num = clips_[item.clip].tick_rate.num;
    if (program.scale > 0)
      program.scale *= num / std::gcd(num, static_cast<std::int64_t>(program.scale));
    if (program.scale > Int{limits::kRational}) program.scale = 0;
  }
  if (program.scale == 0) program.scale = 1;
  return {};
}

Result<Playback::Program> Playback::schedule(std::span<const SequenceItem> items) const {
  Program program;
  RELIT_TRY(choose_units(items, program));
  for (const SequenceItem& item : items) {
    const PlaybackClip& clip = clips_[item.clip];
    Scheduled next;
    next.clip = item.clip, next.repeats = item.repeats;
    const Int num = clip.tick_rate.num;
    const bool exact = program.scale % num == 0;
    next.tick = kSecondUnits * clip.tick_rate.den;
    if (exact) next.tick *= program.scale / num;
    next.factor = exact ? Int{1} : num;
    // At most 2^32 ticks · 2^32 repeats, which fits; in the program's units it may not.
    const Int ticks = static_cast<Int>(clip.duration_ticks) * item.repeats;
    const Int longest = kLongestSequence * program.scale;
    if (ticks > longest * next.factor / next.tick) {
      return fail(ErrorCode::kLimit, "a sequence of more than 136 years");
    }
    next.length = ceil_div(ticks * next.tick, next.factor);
    next.fade = fade_units(item.cross_fade_s) * program.scale;
    program.items.push_back(next);
  }
  for (std::size_t i = 0; i < program.items.size(); ++i) {
    Scheduled& item = program.items[i];
    const Scheduled& before = program.items[i == 0 ? program.items.size() - 1 : i - 1];
    item.fade = std::min(item.fade, std::min(item.length, before.length) / 2);
    if (i > 0) item.start = before.start + before.length - item.fade;
    program.end = item.start + item.length;
    if (program.end > kLongestSequence * program.scale) {
      return fail(ErrorCode::kLimit, "a sequence of more than 136 years");
    }
  }
  return program;
}

void Playback::start(Program program) {
  program_ = std::move(program);
  position_ = 0;
  rounds_ = 0;
}

}  // namespace relit::player
