// SPDX-License-Identifier: MIT
// Light maps of every size, clips of every length.
#include <cmath>
#include <random>

#include "container/timeline.hpp"
#include "player/playback.hpp"
#include "tests/extremes/lit_clip.hpp"

using namespace relit;
using namespace relit::test;

namespace {

__extension__ typedef __int128 Wide;
constexpr Wide kSecond = 1'000'000'000;
constexpr std::uint64_t kFrames = 100'000;

player::Playback playback_of(std::uint64_t frames, container::Rational rate, bool loop) {
  const player::PlaybackClip clip{rate, frames, frames, loop};
  auto playback = player::Playback::create({&clip, 1}, nullptr);
  REQUIRE(playback);
  return std::move(*playback);
}

void hold_size(int width, int height) {
  const LitClip::Shape shape{0, width, height, 8, false, 1};
  const LitClip clip(shape, 1.0f / 128, [](int, int x, int y) {
    return LitClip::Sample{(x * 37 + y * 101 + x * y) % 256, 0};
  });
  decoders::Light light;
  light.sh = {{1, 0.7, -0.3}};
  Observed observed;
  composite_everywhere(clip, {&light, 1}, observed);
  hold("a map of " + std::to_string(width) + "x" + std::to_string(height) + ", of the largest S",
       observed);
}

}  // namespace

TEST_CASE("the smallest and the thinnest maps are composited on every path") {
  hold_size(1, 1);
  hold_size(2048, 1);
  hold_size(1, 2048);
}

TEST_CASE("the largest map is composited on every path", "[long]") { hold_size(2048, 2048); }

TEST_CASE("a clip of one frame shows it for ever") {
  long wrong = 0;
  for (const bool loop : {false, true}) {
    player::Playback playback = playback_of(1, {24000, 1001}, loop);
    for (std::int64_t now = 0; now < 10'000'000'000; now += 7'777'777) {
      const player::Moment moment = playback.at(now);
      wrong += moment.primary.frame != 0 || moment.primary.next_frame != 0 || moment.secondary;
    }
  }
  hold_exact("one frame, 10 s, looping and not", "frame 0", wrong);
}

TEST_CASE("each of 100 000 frames comes at its nanosecond") {
  for (const container::Rational rate :
       {container::Rational{24000, 1001}, {50, 1}, {1'000'003, 7}}) {
    player::Playback playback = playback_of(kFrames, rate, true);
    long wrong = 0;
    playback.at(0);
    for (std::uint64_t k = 1; k < kFrames; ++k) {
      // Frame k begins at k · den / num seconds: at the first nanosecond that is not before it.
      const auto start =
          static_cast<std::int64_t>((Wide{k} * rate.den * kSecond + rate.num - 1) / rate.num);
      wrong += playback.at(start - 1).primary.frame != k - 1;
      wrong += playback.at(start).primary.frame != k;
    }
    hold_exact("100 000 frames at " + std::to_string(rate.num) + "/" + std::to_string(rate.den) +
                   " Hz, shown a nanosecond early or late",
               "exact rationals", wrong);
  }
}

TEST_CASE("100 000 uneven time stamps are found again") {
  container::ClipRecord record;
  record.frame_count = kFrames;
  record.duration_ticks = 8 * kFrames;
  container::Timeline timeline(record);
  std::mt19937 random(41);
  std::vector<std::uint64_t> starts{0};
  for (std::uint64_t first = 0; first < kFrames; first += 1000) {
    container::SegmentRecord segment;
    segment.first_frame = first;
    segment.first_tick = starts.back();
    segment.frame_count = 1000;
    for (int i = 0; i < 1000; ++i) {
      segment.durations.push_back(1 + static_cast<std::uint32_t>(random() % 8));
      starts.push_back(starts.back() + segment.durations.back());
    }
    timeline.add(segment);
  }
  long wrong = 0;
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    wrong += timeline.first_tick(k) != starts[k];
    wrong += timeline.frame_at(starts[k]) != k;
    wrong += timeline.frame_at(starts[k + 1] - 1) != k;
  }
  hold_exact("100 000 frames of 1 to 8 ticks, found by frame and by tick", "integers", wrong);
}

TEST_CASE("a look each second for 49 days sees no drift") {
  const container::Rational rate{24000, 1001};
  player::Playback playback = playback_of(kFrames, rate, true);
  long wrong = 0;
  Worst fraction;
  for (std::int64_t second = 0; second <= 49 * 86400; ++second) {
    const player::Moment moment = playback.at(second * static_cast<std::int64_t>(kSecond));
    const Wide ticks = Wide{second} * rate.num;
    wrong += moment.primary.frame != static_cast<std::uint64_t>(ticks / rate.den % kFrames);
    // An exact quotient, rounded thrice: both numbers and their ratio.
    fraction.add(std::abs(moment.primary.fraction - static_cast<double>(ticks % rate.den) / 1001),
                 3 * std::exp2(-53) + std::exp2(-53));
  }
  hold_exact("49 days at 24000/1001 Hz, a look each second", "the frame that integers give", wrong);
  hold("the same, how far on to the next frame", "4 roundings of 2^-53", fraction);
}
