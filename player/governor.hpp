// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "container/base/result.hpp"

/// What a player gives up when frames are late, and how it takes it back. No clock, no threads.
namespace relit::player {

/// What is done for a display frame. Everything that the ladder gives up is here.
struct Quality {
  int light_map_every = 1;  ///< the light map is composited for every nth display frame
  double planes_share = 1;  ///< of the planes, from the front, that are composited; > 0
  bool half_size = false;   ///< the light map has half its width and height
  int frames_every = 1;     ///< only every nth frame of the clip is decoded and shown
  bool operator==(const Quality&) const = default;
};

/// The ladder: each rung gives up what it says and all that the rungs before it did.
///
/// | rung | quality | gives up |
/// |---|---|---|
/// | 0 | 1   | nothing |
/// | 1 | 6/7 | light map for every 2nd display frame |
/// | 2 | 5/7 | light map for every 3rd display frame |
/// | 3 | 4/7 | planes: 3/4 of them stay |
/// | 4 | 3/7 | planes: 1/2 |
/// | 5 | 2/7 | planes: 1/4 |
/// | 6 | 1/7 | light map at half its width and height |
/// | 7 | 0   | every 2nd frame of the clip is not decoded |
///
/// Poses follow the display all the while: light is what the eye misses least.
inline constexpr int kLowestRung = 7;

/// Of a rung, 0..kLowestRung; fractions belong to the rung before them, save that the share of
/// planes falls evenly from rung 2 to rung 5.
[[nodiscard]] Quality quality_at_rung(double rung);
/// Of a quality 0..1: quality_at_rung(7·(1 − quality)).
[[nodiscard]] Quality fixed_quality(double quality);

/// How a display frame went: what was spent on it, without waiting for the display.
struct StageTimes {
  std::int64_t now_ns = 0;   ///< when it was done; any monotonic clock
  double decode_wait_s = 0;  ///< waiting for decoded frames
  double composite_s = 0;    ///< uploads and composite
  double draw_s = 0;
  double total_s = 0;  ///< all of it
  /// Its picture came too late whatever it cost, because a frame was not decoded in time. Not where
  /// the source stalled: giving up quality does not mend a network.
  bool missed = false;
};

struct GovernorOptions {
  double target_fps = 60;         ///< 1..1000; the deadline of a display frame is 1 / target_fps
  std::optional<double> quality;  ///< 0..1: fixed; none: chosen
};

/// Chooses a rung from how display frames went.
///
/// Late is a frame that took longer than the deadline or was `missed`. A bucket takes 1 for each
/// late frame and leaks 1/64 for each other, so single spikes and 1.5 % of late frames cost
/// nothing. When it holds 4 the governor goes down one rung, and 4 more make the next one, but
/// there are at least 0.25 s between two switches.
///
/// Up it goes after the bucket has held less than 2 and the mean load of the last frames was at
/// most 3/4 of the deadline, both for as long as the rung above asks: 1 s at first. A rung that is
/// left downwards within 5 s of going up to it has failed, and asks for twice as long, at most
/// 64 s; one that holds for 16 s asks for 1 s again.
///
/// Deterministic: the same numbers give the same decisions. A second without frames forgets what
/// was gathered. Times that are negative or not finite count as no frame. One thread at a time.
class Governor {
 public:
  /// Errors: kInvalid for a target or quality out of range.
  static Result<Governor> create(const GovernorOptions& options = {});

  /// Takes how a display frame went and says what to do for the next one.
  Quality update(const StageTimes& times);

  /// Errors, changing nothing: kInvalid out of range.
  Status set_target_fps(double fps);
  /// None: chosen from now on, beginning at the nearest rung.
  Status set_quality(std::optional<double> quality);

  [[nodiscard]] Quality quality() const;
  /// 0..1, where 1 is everything.
  [[nodiscard]] double value() const;
  [[nodiscard]] int rung() const { return rung_; }
  [[nodiscard]] std::uint64_t late_frames() const { return late_frames_; }
  [[nodiscard]] std::uint64_t switches() const { return switches_; }

 private:
  Governor() = default;
  void forget(std::int64_t now_ns);
  void go_down(std::int64_t now_ns);
  void go_up(std::int64_t now_ns);

  double deadline_s_ = 1.0 / 60;
  std::optional<double> fixed_;
  int rung_ = 0;
  double bucket_ = 0;
  double load_ = 0;  ///< mean of total / deadline
  std::optional<std::int64_t> last_ns_;
  std::int64_t switched_ns_ = 0;
  std::int64_t calm_ns_ = 0;                          ///< since when nothing spoke against going up
  bool went_up_ = false;                              ///< the last switch
  std::array<std::int64_t, kLowestRung> retry_ns_{};  ///< by rung: calm that it asks for
  std::uint64_t late_frames_ = 0;
  std::uint64_t switches_ = 0;
};

}  // namespace relit::player
