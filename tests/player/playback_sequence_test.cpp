// SPDX-License-Identifier: MIT
#include <cmath>
#include <random>
#include <set>

#include "player/playback.hpp"
#include "tests/test.hpp"

namespace relit::player {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kMillisecond = 1'000'000;

constexpr std::size_t kWalk = 0, kTurn = 1;

/// Walk: 1 s that loops; turn: 2 s that does not.
Playback walker() {
  const std::vector<PlaybackClip> clips{{{50, 1}, 50, 50, true}, {{25, 1}, 50, 50, false}};
  auto playback = Playback::create(clips, nullptr);
  REQUIRE(playback);
  playback->at(0);
  return std::move(*playback);
}

}  // namespace

TEST_CASE("a sequence plays its items with their repeats, cut after cut") {
  Playback playback = walker();
  const std::vector<SequenceItem> items{{kWalk, 2, 0}, {kTurn, 1, 0}, {kWalk, 1, 0}};
  REQUIRE(playback.play_sequence(items, false));
  CHECK(playback.duration_s() == Approx(5).epsilon(1e-15));
  Moment moment = playback.at(1500 * kMillisecond);
  CHECK(moment.item == 0);
  CHECK(moment.primary.frame == 25);
  moment = playback.at(1990 * kMillisecond);
  CHECK(moment.primary.frame == 49);
  CHECK(moment.primary.next_frame == 49);  // a turn follows, so nothing to blend into
  moment = playback.at(990 * kMillisecond + kSecond);
  moment = playback.at(2 * kSecond);
  CHECK(moment.item == 1);
  CHECK(moment.primary.clip == kTurn);
  CHECK(moment.primary.frame == 0);
  CHECK_FALSE(moment.secondary);
  moment = playback.at(4500 * kMillisecond);
  CHECK(moment.item == 2);
  CHECK(moment.primary.frame == 25);
  moment = playback.at(6 * kSecond);
  CHECK(moment.ended);
  CHECK(moment.primary.frame == 49);
  CHECK(moment.time_s == Approx(5).epsilon(1e-15));
}

TEST_CASE("within an item a loop goes round, and so it does into the same clip again") {
  Playback playback = walker();
  const std::vector<SequenceItem> items{{kWalk, 2, 0}, {kWalk, 1, 0}};
  REQUIRE(playback.play_sequence(items, false));
  CHECK(playback.at(990 * kMillisecond).primary.next_frame == 0);
  CHECK(playback.at(1990 * kMillisecond).primary.next_frame == 0);
  CHECK(playback.at(2990 * kMillisecond).primary.next_frame == 49);
}

TEST_CASE("during a cross-fade both clips move, and the weight falls evenly") {
  Playback playback = walker();
  const std::vector<SequenceItem> items{{kWalk, 2, 0}, {kTurn, 1, 0.5}};
  REQUIRE(playback.play_sequence(items, false));
  CHECK(playback.duration_s() == Approx(3.5).epsilon(1e-15));
  CHECK_FALSE(playback.at(1499 * kMillisecond).secondary);
  Moment moment = playback.at(1500 * kMillisecond);
  CHECK(moment.item == 1);
  CHECK(moment.primary.clip == kTurn);
  CHECK(moment.primary.frame == 0);
  REQUIRE(moment.secondary);
  CHECK(moment.secondary->clip == kWalk);
  CHECK(moment.secondary->frame == 25);
  CHECK(moment.secondary_weight == 1);
  moment = playback.at(1600 * kMillisecond);
  CHECK(moment.primary.frame == 2);
  CHECK(moment.primary.fraction == Approx(0.5).epsilon(1e-14));
  CHECK(moment.secondary->frame == 30);
  CHECK(moment.secondary_weight == Approx(0.8).epsilon(1e-15));
  CHECK(playback.at(1999 * kMillisecond).secondary_weight == Approx(0.002).epsilon(1e-12));
  moment = playback.at(2 * kSecond);
  CHECK_FALSE(moment.secondary);
  CHECK(moment.secondary_weight == 0);
}

TEST_CASE("a sequence that goes round blends its last item into its first") {
  Playback playback = walker();
  const std::vector<SequenceItem> items{{kWalk, 1, 0.25}, {kTurn, 1, 0}};
  REQUIRE(playback.play_sequence(items, true));
  CHECK_FALSE(playback.at(0).secondary);  // nothing came before
  CHECK(playback.duration_s() == Approx(2.75).epsilon(1e-15));
  const Moment moment = playback.at(2850 * kMillisecond);
  CHECK(moment.item == 0);
  CHECK(moment.primary.frame == 5);
  REQUIRE(moment.secondary);
  CHECK(moment.secondary->clip == kTurn);
  CHECK(moment.secondary->frame == 46);  // 1.85 s at 25 a second
  CHECK(moment.secondary_weight == Approx(0.6).epsilon(1e-15));
  CHECK_FALSE(playback.at(3001 * kMillisecond).secondary);
  playback.set_loop(LoopMode::kOff);
  CHECK(playback.at(100 * kSecond).ended);
}

TEST_CASE("a clip can go round by blending into itself") {
  Playback playback = walker();
  const std::vector<SequenceItem> items{{kTurn, 1, 0.4}};
  REQUIRE(playback.play_sequence(items, true));
  CHECK(playback.duration_s() == Approx(1.6).epsilon(1e-15));
  const Moment moment = playback.at(1700 * kMillisecond);
  CHECK(moment.primary.frame == 2);
  REQUIRE(moment.secondary);
  CHECK(moment.secondary->frame == 42);
  CHECK(moment.secondary_weight == Approx(0.75).epsilon(1e-15));
  REQUIRE(playback.step(38));  // of the 40 that are its own
  CHECK(playback.now().primary.frame == 0);
}

TEST_CASE("never more than two clips are seen, however long the fades") {
  Playback playback = walker();
  const std::vector<SequenceItem> items{{kWalk, 1, 1e9}, {kTurn, 1, 1e9}, {kWalk, 1, 1e9}};
  REQUIRE(playback.play_sequence(items, true));
  CHECK(playback.duration_s() == Approx(4 - 3 * 0.5).epsilon(1e-15));
  std::int64_t now = 0;
  double before = 0;
  for (int i = 0; i < 1000; ++i) {
    const Moment moment = playback.at(now += 7 * kMillisecond);
    CHECK(moment.secondary_weight >= 0);
    CHECK(moment.secondary_weight <= 1);
    // It comes in with weight 0: whatever is new has less than the time since then gave it.
    if (before == 0 && moment.secondary) CHECK(moment.secondary_weight > 1 - 0.007 / 0.5 - 1e-12);
    before = moment.secondary_weight;
  }
}

TEST_CASE(
    "a sequence in random steps is the same as in one, also where rates have no common unit") {
  // Two rates with a common multiple below 2^31, and three whose multiple is far beyond.
  const std::vector<std::vector<PlaybackClip>> sets{
      {{{24000, 1001}, 31, 31, true}, {{25, 1}, 12, 12, false}, {{60, 1}, 7, 7, true}},
      {{{2147483647, 89478485}, 31, 31, true},
       {{2147483629, 89478485}, 12, 12, false},
       {{60, 1}, 7, 7, true}}};
  for (const auto& clips : sets) {
    for (const double speed : {1.0, 0.3, -2.5}) {
      const std::vector<SequenceItem> items{{0, 3, 0.2}, {1, 1, 0.1}, {2, 1000, 0}};
      auto steps = Playback::create(clips, nullptr);
      auto once = Playback::create(clips, nullptr);
      for (auto* playback : {&*steps, &*once}) {
        REQUIRE(playback->play_sequence(items, true));
        REQUIRE(playback->set_speed(speed));
        playback->at(0);
      }
      std::mt19937_64 random(9);
      std::int64_t now = 0;
      Moment moment;
      for (int i = 0; i < 20000; ++i) {
        moment = steps->at(now += static_cast<std::int64_t>(random() % 1'000'000'000'000));
      }
      const Moment whole = once->at(now);
      CHECK(moment.item == whole.item);
      CHECK(moment.primary.frame == whole.primary.frame);
      CHECK(moment.primary.fraction == whole.primary.fraction);
      CHECK(moment.secondary_weight == whole.secondary_weight);
      CHECK(moment.time_s == whole.time_s);
    }
  }
}

TEST_CASE("steps walk through a sequence and back again") {
  Playback playback = walker();
  const std::vector<SequenceItem> items{{kWalk, 2, 0.1}, {kTurn, 1, 0.5}, {kWalk, 1, 0}};
  for (const bool loop : {false, true}) {
    CAPTURE(loop);
    REQUIRE(playback.play_sequence(items, loop));
    std::vector<std::pair<std::size_t, std::uint64_t>> shown;
    // Walk until its fade, turn, walk (until the fade into the first item).
    const int count = 75 + 50 + (loop ? 45 : 50);
    for (int i = 0; i < count; ++i) {
      const Moment moment = playback.now();
      CHECK(moment.primary.fraction == 0);
      shown.emplace_back(moment.item, moment.primary.frame);
      REQUIRE(playback.step(1));
    }
    CHECK(shown[50] == std::pair<std::size_t, std::uint64_t>{0, 0});
    CHECK(shown[75] == std::pair<std::size_t, std::uint64_t>{1, 0});
    CHECK(shown[125] == std::pair<std::size_t, std::uint64_t>{2, 0});
    CHECK(shown.back().second == (loop ? 44 : 49));
    const Moment end = playback.now();
    CHECK(end.item == (loop ? 0 : 2));
    if (!loop) CHECK(end.primary.frame == 49);
    if (loop) CHECK(end.secondary);
    for (int i = count - (loop ? 1 : 2); i >= 0; --i) {
      REQUIRE(playback.step(-1));
      const Moment moment = playback.now();
      CHECK(shown[static_cast<std::size_t>(i)] == std::pair{moment.item, moment.primary.frame});
    }
    REQUIRE(playback.step(60));
    CHECK(playback.now().primary.frame == 10);
    CHECK(playback.step(Playback::kMostSteps + 1).error().code == ErrorCode::kLimit);
  }
}

TEST_CASE("sequences that cannot be played are refused and change nothing") {
  Playback playback = walker();
  playback.at(100 * kMillisecond);
  const auto refused = [&](std::vector<SequenceItem> items) {
    const Status status = playback.play_sequence(items, true);
    REQUIRE_FALSE(status);
    CHECK(playback.now().primary.frame == 5);
    return status.error().code;
  };
  CHECK(refused({}) == ErrorCode::kInvalid);
  CHECK(refused({{2, 1, 0}}) == ErrorCode::kNotFound);
  CHECK(refused({{kWalk, 0, 0}}) == ErrorCode::kInvalid);
  CHECK(refused({{kWalk, 1, -1}}) == ErrorCode::kInvalid);
  CHECK(refused({{kWalk, 1, std::nan("")}}) == ErrorCode::kInvalid);
  CHECK(refused({{kWalk, 1, HUGE_VAL}}) == ErrorCode::kInvalid);
  CHECK(refused({{kWalk, 4294967295, 0}, {kTurn, 4294967295, 0}}) == ErrorCode::kLimit);
  CHECK(playback.play_clip(2).error().code == ErrorCode::kNotFound);
  CHECK(playback.play_clip(1, -0.5).error().code == ErrorCode::kInvalid);
}

TEST_CASE("seeking within a sequence finds item and frame; a frame alone ends the sequence") {
  Playback playback = walker();
  const std::vector<SequenceItem> items{{kWalk, 2, 0}, {kTurn, 1, 0.5}};
  REQUIRE(playback.play_sequence(items, false));
  REQUIRE(playback.seek(1.6));
  CHECK(playback.now().item == 1);
  CHECK(playback.now().secondary_weight == Approx(0.8).epsilon(1e-12));
  REQUIRE(playback.seek(100));
  CHECK(playback.now().ended);
  REQUIRE(playback.seek_frame(10));
  CHECK(playback.now().primary.clip == kTurn);
  CHECK(playback.now().primary.frame == 10);
  CHECK(playback.duration_s() == Approx(2).epsilon(1e-15));
}

TEST_CASE("another clip can blend in at any time") {
  Playback playback = walker();
  playback.at(900 * kMillisecond);
  REQUIRE(playback.play_clip(kTurn, 0.5));
  Moment moment = playback.now();
  CHECK(moment.primary.clip == kTurn);
  CHECK(moment.primary.frame == 0);
  REQUIRE(moment.secondary);
  CHECK(moment.secondary->frame == 45);
  CHECK(moment.secondary_weight == 1);
  moment = playback.at(1150 * kMillisecond);
  CHECK(moment.primary.frame == 6);
  CHECK(moment.secondary->frame == 7);  // round its end
  CHECK(moment.secondary_weight == Approx(0.5).epsilon(1e-15));
  CHECK_FALSE(playback.at(1400 * kMillisecond).secondary);

  // From a clip that ends: it stands on its last frame.
  playback.at(3300 * kMillisecond);
  REQUIRE(playback.play_clip(kWalk, 1));
  moment = playback.at(4 * kSecond);
  REQUIRE(moment.secondary);
  CHECK(moment.secondary->frame == 49);
  CHECK(moment.secondary->next_frame == 49);

  // A pause stops the fade too, a seek drops it.
  playback.set_paused(true);
  CHECK(playback.at(9 * kSecond).secondary_weight == moment.secondary_weight);
  REQUIRE(playback.seek(0.5));
  CHECK_FALSE(playback.now().secondary);
}

TEST_CASE("when fades follow each other closely the heavier clip stays") {
  Playback playback = walker();
  playback.at(500 * kMillisecond);
  REQUIRE(playback.play_clip(kTurn, 0.4));
  playback.at(600 * kMillisecond);  // three quarters are walk
  REQUIRE(playback.play_clip(kTurn, 0.4));
  CHECK(playback.now().secondary->clip == kWalk);
  CHECK(playback.now().secondary->frame == 30);
  playback.at(900 * kMillisecond);  // three quarters are turn
  REQUIRE(playback.play_clip(kWalk, 0.4));
  CHECK(playback.now().secondary->clip == kTurn);
  CHECK(playback.now().secondary->frame == 7);
}

}  // namespace relit::player
