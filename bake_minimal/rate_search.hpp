// SPDX-License-Identifier: MIT
#pragma once

#include <functional>

#include "container/base/result.hpp"

namespace relit::bake {

/// Rate factors between `finest` and `coarsest`, which are multiples of `step` apart.
struct RateRange {
  double finest = 0, coarsest = 51;
  double step = 0.25;
};

struct RateChoice {
  double crf = 0;
  double psnr_db = 0;
  int tries = 0;
};

/// The coarsest rate factor with at least `target_db`, by trying a few: as many as it takes to be
/// within 0.15 dB above, or to know that the next coarser step falls below. `begin` is tried first.
/// `psnr_db` tells what a factor gives, which falls with it, but for the noise of an encoder.
/// Errors: kInvalid where even the finest falls short; those of `psnr_db`.
[[nodiscard]] Result<RateChoice> search_rate(
    double target_db, const RateRange& range, double begin,
    const std::function<Result<double>(double crf)>& psnr_db);

}  // namespace relit::bake
