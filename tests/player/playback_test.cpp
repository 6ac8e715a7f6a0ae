// SPDX-License-Identifier: MIT
#include "player/playback.hpp"

#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <string>

#include "tests/test.hpp"

namespace relit::player {
namespace {

__extension__ typedef __int128 Wide;

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t k49Days = std::int64_t{49} * 86400 * kSecond;

PlaybackClip clip_of(std::uint64_t frames, container::Rational rate, bool loop) {
  return {rate, frames, frames, loop};
}

Playback playback_of(std::vector<PlaybackClip> clips, const FrameTimes* times = nullptr) {
  auto playback = Playback::create(clips, times);
  INFO((playback ? "made" : playback.error().message));
  REQUIRE(playback);
  return std::move(*playback);
}

void check_same(const FramePosition& a, const FramePosition& b) {
  CHECK(a.clip == b.clip);
  CHECK(a.frame == b.frame);
  CHECK(a.next_frame == b.next_frame);
  CHECK(a.fraction == b.fraction);
  CHECK(a.tick == b.tick);
  CHECK(a.known == b.known);
}

void check_same(const Moment& a, const Moment& b) {
  check_same(a.primary, b.primary);
  REQUIRE(a.secondary.has_value() == b.secondary.has_value());
  if (a.secondary) check_same(*a.secondary, *b.secondary);
  CHECK(a.secondary_weight == b.secondary_weight);
  CHECK(a.item == b.item);
  CHECK(a.ended == b.ended);
  CHECK(a.time_s == b.time_s);
  CHECK(a.next_frame_ns == b.next_frame_ns);
}

/// Plays up to `end_ns` in random steps, many of them short, some of hours.
Moment in_random_steps(Playback& playback, std::int64_t end_ns, unsigned seed) {
  std::mt19937_64 random(seed);
  playback.at(0);
  std::int64_t now = 0;
  for (int i = 0; i < 20000 && now < end_ns; ++i) {
    const auto longest = std::int64_t{1} << (random() % 48);
    now = std::min(end_ns, now + static_cast<std::int64_t>(random() % 1000) * longest / 1000);
    playback.at(now);
  }
  return playback.at(end_ns);
}

/// Frames that last 1, 2, 3, 1, 2, 3, … ticks; what lies behind `known` frames is not known.
struct Uneven : FrameTimes {
  container::Timeline timeline;
  explicit Uneven(std::uint32_t known) {
    container::ClipRecord clip;
    clip.frame_count = 9, clip.duration_ticks = 18;
    timeline = container::Timeline(clip);
    container::SegmentRecord segment;
    segment.frame_count = known;
    for (std::uint32_t i = 0; i < known; ++i) segment.durations.push_back(1 + i % 3);
    timeline.add(segment);
  }
  std::optional<FrameSpan> at_tick(std::size_t, std::uint64_t tick) const override {
    return span_at_tick(timeline, tick);
  }
  std::optional<FrameSpan> of_frame(std::size_t, std::uint64_t frame) const override {
    return span_of_frame(timeline, frame);
  }
};
const PlaybackClip kUneven{{10, 1}, 9, 18, false};

}  // namespace

TEST_CASE("a clock shows each frame for a tick and says how far the next one is") {
  Playback playback = playback_of({clip_of(5, {25, 1}, false)});
  const Moment first = playback.at(7000);  // whatever the time is: it starts here
  CHECK(first.primary.frame == 0);
  CHECK(first.primary.fraction == 0);
  CHECK(first.next_frame_ns == kSecond / 25);
  const Moment later = playback.at(7000 + 50'000'000);
  CHECK(later.primary.frame == 1);
  CHECK(later.primary.next_frame == 2);
  CHECK(later.primary.fraction == Approx(0.25).epsilon(1e-15));
  CHECK(later.time_s == Approx(0.05).epsilon(1e-15));
  CHECK(later.next_frame_ns == 30'000'000);
  CHECK_FALSE(later.ended);
  CHECK(playback.duration_s() == Approx(0.2).epsilon(1e-15));
}

TEST_CASE("a clip that does not loop stands on its last frame") {
  Playback playback = playback_of({clip_of(5, {25, 1}, false)});
  playback.at(0);
  const Moment last = playback.at(190'000'000);
  CHECK(last.primary.frame == 4);
  CHECK(last.primary.next_frame == 4);
  CHECK(last.primary.fraction == 0);
  CHECK_FALSE(last.ended);
  CHECK_FALSE(last.next_frame_ns);
  const Moment end = playback.at(200'000'000);
  CHECK(end.primary.frame == 4);
  CHECK(end.ended);
  check_same(playback.at(k49Days), end);
}

TEST_CASE("in a loop the frame after the last is the first") {
  Playback playback = playback_of({clip_of(5, {25, 1}, true)});
  playback.at(0);
  const Moment last = playback.at(190'000'000);
  CHECK(last.primary.frame == 4);
  CHECK(last.primary.next_frame == 0);
  CHECK(last.primary.fraction == Approx(0.75).epsilon(1e-15));
  const Moment again = playback.at(200'000'000);
  CHECK(again.primary.frame == 0);
  CHECK(again.time_s == 0);
  CHECK_FALSE(again.ended);
  // Where the user makes a clip go round whose end does not meet its beginning, nothing is blended.
  playback = playback_of({clip_of(5, {25, 1}, false)});
  playback.set_loop(LoopMode::kOn);
  playback.at(0);
  CHECK(playback.at(190'000'000).primary.next_frame == 4);
  CHECK(playback.at(210'000'000).primary.frame == 0);
}

TEST_CASE("49 days in random steps and in one are the same, whatever the rate and the speed") {
  const std::vector<container::Rational> rates{{50, 1},         {24000, 1001},
                                               {60000, 1001},   {12, 1},
                                               {2147483647, 1}, {2147483629, 2147483647},
                                               {1, 2147483647}};
  for (const container::Rational& rate : rates) {
    for (const double speed : {1.0, 0.37, 16.0, 100.0, -1.3}) {
      CAPTURE(rate.num, rate.den, speed);
      Playback steps = playback_of({clip_of(97, rate, true)});
      Playback once = playback_of({clip_of(97, rate, true)});
      REQUIRE(steps.set_speed(speed));
      REQUIRE(once.set_speed(speed));
      once.at(0);
      check_same(in_random_steps(steps, k49Days, 5), once.at(k49Days));
    }
  }
}

TEST_CASE("after 49 days the frame is the one that integers give") {
  for (const container::Rational& rate :
       {container::Rational{50, 1}, {24000, 1001}, {30000, 1001}, {2147483629, 7}}) {
    for (const std::int64_t extra : {std::int64_t{0}, std::int64_t{1}, std::int64_t{123456789}}) {
      CAPTURE(rate.num, rate.den, extra);
      Playback playback = playback_of({clip_of(1000003, rate, true)});
      playback.at(0);
      const Wide ticks = static_cast<Wide>(k49Days + extra) * rate.num;
      const Wide second = static_cast<Wide>(kSecond) * rate.den;
      const Moment moment = playback.at(k49Days + extra);
      CHECK(moment.primary.frame == static_cast<std::uint64_t>(ticks / second % 1000003));
      // Rounded thrice, from exact integers.
      CHECK(std::abs(moment.primary.fraction -
                     static_cast<double>(ticks % second) / static_cast<double>(second)) < 1e-15);
    }
  }
}

TEST_CASE("pausing, another speed and another loop mode keep the place") {
  Playback playback = playback_of({clip_of(100, {25, 1}, true)});
  playback.at(0);
  Moment moment = playback.at(1'234'567'890);
  const double place = moment.time_s;
  playback.set_paused(true);
  CHECK(playback.at(5 * kSecond).time_s == place);
  CHECK_FALSE(playback.at(5 * kSecond).next_frame_ns);
  playback.set_paused(false);
  CHECK(playback.at(5 * kSecond).time_s == place);
  REQUIRE(playback.set_speed(0.5));
  CHECK(playback.now().time_s == place);
  CHECK(playback.at(7 * kSecond).time_s == Approx(place + 1).epsilon(1e-15));
  REQUIRE(playback.set_speed(-2));
  CHECK(playback.at(8 * kSecond).time_s == Approx(place - 1).epsilon(1e-14));
  playback.set_loop(LoopMode::kOff);
  CHECK(playback.now().time_s == Approx(place - 1).epsilon(1e-14));
  moment = playback.at(9 * kSecond);
  CHECK(moment.time_s == 0);
  CHECK(moment.ended);
  playback.set_loop(LoopMode::kOn);
  CHECK_FALSE(playback.now().ended);
  CHECK(playback.at(10 * kSecond).time_s == Approx(2).epsilon(1e-15));
  REQUIRE(playback.set_speed(0));
  CHECK(playback.at(11 * kSecond).time_s == Approx(2).epsilon(1e-15));
  CHECK(playback.speed() == 0);
}

TEST_CASE("speeds that make no sense are refused and change nothing") {
  Playback playback = playback_of({clip_of(100, {25, 1}, true)});
  REQUIRE(playback.set_speed(2));
  for (const double speed : {std::nan(""), HUGE_VAL, -HUGE_VAL, 100.5, -101.0}) {
    const Status status = playback.set_speed(speed);
    REQUIRE_FALSE(status);
    CHECK(status.error().code == ErrorCode::kInvalid);
    CHECK(playback.speed() == 2);
  }
}

TEST_CASE("a host's time may run backwards, stand still or jump") {
  Playback playback = playback_of({clip_of(100, {25, 1}, true)});
  playback.at(kSecond);
  CHECK(playback.at(2 * kSecond).time_s == 1);
  CHECK(playback.at(kSecond / 2).time_s == 1);
  CHECK(playback.at(kSecond).time_s == 1.5);
  playback.skip_to(100 * kSecond);
  CHECK(playback.at(100 * kSecond + kSecond / 2).time_s == 2);
  playback.at(std::numeric_limits<std::int64_t>::min());
  const Moment moment = playback.at(std::numeric_limits<std::int64_t>::max());
  CHECK(moment.time_s >= 0);
  CHECK(moment.time_s < 4);
  REQUIRE(playback.set_speed(-100));
  playback.at(std::numeric_limits<std::int64_t>::min());
  CHECK(playback.at(std::numeric_limits<std::int64_t>::max()).primary.frame < 100);
}

TEST_CASE("a seek lands where it says") {
  Playback playback = playback_of({clip_of(100, {24000, 1001}, false)});
  playback.at(0);
  for (const std::uint64_t frame : {0u, 1u, 7u, 41u, 99u}) {
    CAPTURE(frame);
    // Such a time is no multiple of anything in binary, yet names a frame.
    REQUIRE(playback.seek(static_cast<double>(frame) * 1001 / 24000));
    CHECK(playback.now().primary.frame == frame);
    CHECK(playback.now().primary.fraction == 0);
    REQUIRE(playback.seek((static_cast<double>(frame) + 0.3) * 1001 / 24000));
    CHECK(playback.now().primary.frame == frame);
    CHECK(playback.now().primary.fraction == Approx(frame == 99 ? 0.0 : 0.3).margin(1e-9));
    REQUIRE(playback.seek_frame(frame));
    CHECK(playback.now().primary.frame == frame);
  }
  REQUIRE(playback.seek(-1));
  CHECK(playback.now().time_s == 0);
  for (const double beyond : {playback.duration_s(), 100.0, 1e300}) {
    REQUIRE(playback.seek(beyond));
    CHECK(playback.now().primary.frame == 99);
    CHECK(playback.now().ended);
  }
  REQUIRE(playback.seek_frame(std::numeric_limits<std::uint64_t>::max()));
  CHECK(playback.now().primary.frame == 99);
  CHECK_FALSE(playback.now().ended);
  playback.seek_tick(50);
  CHECK(playback.now().primary.tick == 50);
  playback.seek_tick(std::numeric_limits<std::uint64_t>::max());
  CHECK(playback.now().primary.tick == 99);
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    const Status status = playback.seek(bad);
    REQUIRE_FALSE(status);
    CHECK(status.error().code == ErrorCode::kInvalid);
    CHECK(playback.now().primary.frame == 99);
  }
}

TEST_CASE("beyond the end of a loop is the remainder") {
  Playback playback = playback_of({clip_of(100, {25, 1}, true)});
  REQUIRE(playback.seek(4 + 4 + 1));
  CHECK(playback.now().primary.frame == 25);
  REQUIRE(playback.seek(4));
  CHECK(playback.now().primary.frame == 0);
  REQUIRE(playback.seek(1e300));
  CHECK(playback.now().primary.frame < 100);
}

TEST_CASE("playing goes on from where a seek led") {
  Playback playback = playback_of({clip_of(100, {25, 1}, true)});
  playback.at(0);
  playback.at(kSecond);
  REQUIRE(playback.seek(2));
  CHECK(playback.at(kSecond + kSecond / 2).primary.frame == 62);
}

TEST_CASE("frames of different lengths are found by whoever knows them") {
  const Uneven times(9);
  Playback playback = playback_of({kUneven}, &times);
  playback.at(0);
  CHECK(playback.at(0).next_frame_ns == kSecond / 10);
  CHECK(playback.at(100'000'000).next_frame_ns == 200'000'000);
  const Moment moment = playback.at(450'000'000);  // tick 4.5 of the frame that has 3 to 5
  CHECK(moment.primary.frame == 2);
  CHECK(moment.primary.fraction == Approx(0.5).epsilon(1e-15));
  CHECK(moment.primary.tick == 4);
  REQUIRE(playback.seek_frame(8));
  CHECK(playback.now().primary.tick == 15);
  REQUIRE(playback.step(-2));
  CHECK(playback.now().primary.tick == 12);
  REQUIRE(playback.step(1));
  CHECK(playback.now().primary.tick == 13);
}

TEST_CASE("what is not known yet holds the last frame, and says which tick is wanted") {
  const Uneven times(4);  // up to tick 7
  Playback playback = playback_of({kUneven}, &times);
  playback.at(0);
  CHECK(playback.at(650'000'000).primary.frame == 3);
  const Moment moment = playback.at(750'000'000);
  CHECK_FALSE(moment.primary.known);
  CHECK(moment.primary.frame == 3);
  CHECK(moment.primary.next_frame == 3);
  CHECK(moment.primary.fraction == 0);
  CHECK(moment.primary.tick == 7);
  CHECK_FALSE(moment.next_frame_ns);
  for (const Status& status : {playback.seek_frame(6), playback.step(1)}) {
    REQUIRE_FALSE(status);
    CHECK(status.error().code == ErrorCode::kNotFound);
    CHECK_FALSE(playback.paused());
    check_same(playback.now(), moment);
  }
}

TEST_CASE("steps go frame by frame, round the ends of what loops") {
  Playback playback = playback_of({clip_of(5, {25, 1}, true)});
  playback.at(0);
  playback.at(50'000'000);  // in the middle of frame 1
  REQUIRE(playback.step(1));
  CHECK(playback.paused());
  CHECK(playback.now().primary.frame == 2);
  CHECK(playback.now().primary.fraction == 0);
  REQUIRE(playback.step(4));
  CHECK(playback.now().primary.frame == 1);
  REQUIRE(playback.step(-3));
  CHECK(playback.now().primary.frame == 3);
  REQUIRE(playback.step(std::numeric_limits<std::int64_t>::min()));
  REQUIRE(playback.step(std::numeric_limits<std::int64_t>::max()));
  CHECK(playback.now().primary.frame == 2);  // 3 − 2^63 + 2^63 − 1
  playback.set_loop(LoopMode::kOff);
  REQUIRE(playback.step(100));
  CHECK(playback.now().primary.frame == 4);
  CHECK_FALSE(playback.now().ended);
  REQUIRE(playback.step(-100));
  CHECK(playback.now().primary.frame == 0);
  REQUIRE(playback.step(std::numeric_limits<std::int64_t>::min()));
  CHECK(playback.now().primary.frame == 0);
}

TEST_CASE("a clock refuses clips that cannot be") {
  const auto refused = [](std::vector<PlaybackClip> clips) {
    const auto playback = Playback::create(clips, nullptr);
    REQUIRE_FALSE(playback);
    return playback.error().code;
  };
  CHECK(refused({}) == ErrorCode::kInvalid);
  CHECK(refused({clip_of(0, {25, 1}, true)}) == ErrorCode::kInvalid);
  CHECK(refused({clip_of(5, {0, 1}, true)}) == ErrorCode::kInvalid);
  CHECK(refused({clip_of(5, {25, 0}, true)}) == ErrorCode::kInvalid);
  CHECK(refused({clip_of(5, {-25, 1}, true)}) == ErrorCode::kInvalid);
  CHECK(refused({{{25, 1}, 5, 4, true}}) == ErrorCode::kInvalid);
  CHECK(refused({kUneven}) == ErrorCode::kInvalid);
  CHECK(refused({clip_of(5, {std::int64_t{1} << 31, 1}, true)}) == ErrorCode::kLimit);
  CHECK(refused({clip_of((std::uint64_t{1} << 32) + 1, {25, 1}, true)}) == ErrorCode::kLimit);
}

TEST_CASE("the longest clip there may be does not overflow") {
  const PlaybackClip clip{{1, 2147483647}, 1ull << 32, 1ull << 32, true};
  Playback playback = playback_of({clip});
  REQUIRE(playback.seek(playback.duration_s() * 0.999999));
  REQUIRE(playback.set_speed(100));
  playback.at(std::numeric_limits<std::int64_t>::min());
  const Moment moment = playback.at(std::numeric_limits<std::int64_t>::max());
  CHECK(moment.primary.frame <= 1ull << 32);
  CHECK(moment.primary.frame > 4'294'000'000);
}

TEST_CASE("the frame changes when it was said to, and not a nanosecond before") {
  const std::vector<PlaybackClip> clips{clip_of(7, {24000, 1001}, true),
                                        clip_of(11, {25, 1}, false), clip_of(3, {1, 7}, true)};
  for (const double speed : {1.0, 0.013, 16.0, -1.0, -0.7}) {
    for (const bool sequence : {false, true}) {
      CAPTURE(speed, sequence);
      Playback playback = playback_of(clips);
      const std::vector<SequenceItem> items{{0, 2, 0.1}, {1, 1, 0}, {2, 1, 0.2}};
      if (sequence) REQUIRE(playback.play_sequence(items, true));
      REQUIRE(playback.set_speed(speed));
      std::int64_t now = 0;
      Moment before = playback.at(now);
      std::mt19937 random(3);
      for (int i = 0; i < 300; ++i) {
        REQUIRE(before.next_frame_ns);
        Playback early = playback;
        const std::int64_t wait = *before.next_frame_ns;
        REQUIRE(wait > 0);
        const Moment held = early.at(now + wait - 1);
        CHECK(held.primary.frame == before.primary.frame);
        CHECK(held.item == before.item);
        now += wait;
        const Moment after = playback.at(now);
        CHECK((after.primary.frame != before.primary.frame || after.item != before.item ||
               after.primary.tick != before.primary.tick));
        now += static_cast<std::int64_t>(random() % 3'000'000);
        before = playback.at(now);
      }
    }
  }
}

}  // namespace relit::player
