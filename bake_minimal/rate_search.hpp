// SPDX-License-Identifier: MIT
#pragma once

#include <functional>

#include "container/base/result.hpp"

namespace relit::bake {

/// What a step of one in the rate factor costs in decibels, about: six double the quantiser's.
inline constexpr double kRateSlope_db = 0.55;

/// Rate factors between `finest` and `coarsest`, which are multiples of `step` apart.
struct RateRange {
  double finest = 0, coarsest = 51;
  double step = 0.25;
};

struct RateChoice {
  double crf = 0;
  double score_db = 0;
  int tries = 0;
  bool reached = true;  ///< else `crf` is the finest
};

/// The coarsest rate factor with at least `target_db`, by trying a few: as many as it takes to be
/// within 0.15 dB above, or to know that the next coarser step falls below. `begin` is tried first.
/// `score_db` tells what a factor gives, in decibels or what behaves like them: it falls by about
/// kRateSlope_db a step, but for the noise of an encoder. Errors: those of `score_db`.
[[nodiscard]] Result<RateChoice> search_rate(
    double target_db, const RateRange& range, double begin,
    const std::function<Result<double>(double crf)>& score_db);

}  // namespace relit::bake
