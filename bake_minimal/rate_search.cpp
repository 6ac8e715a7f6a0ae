// SPDX-License-Identifier: MIT
#include "bake_minimal/rate_search.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace relit::bake {
namespace {

constexpr double kEnough_db = 0.15;

}  // namespace

Result<RateChoice> search_rate(double target_db, const RateRange& range, double begin,
                               const std::function<Result<double>(double crf)>& score_db) {
  std::optional<RateChoice> good;        // the coarsest that reaches the target
  std::optional<RateChoice> too_coarse;  // the finest that does not
  const auto on_grid = [&](double crf) {
    const double steps = std::floor((crf - range.finest) / range.step + 1e-9);
    return std::clamp(range.finest + steps * range.step, range.finest, range.coarsest);
  };
  double crf = on_grid(begin);
  for (int tries = 1;; ++tries) {
    RELIT_ASSIGN(const double found_db, score_db(crf));
    (found_db >= target_db ? good : too_coarse) = RateChoice{crf, found_db, tries};
    if (good) good->tries = tries;
    const bool close = good && good->score_db <= target_db + kEnough_db;
    const bool at_end = good && (good->crf >= range.coarsest ||
                                 (too_coarse && too_coarse->crf - good->crf <= range.step * 1.01));
    if (close || at_end) return *good;
    if (too_coarse && too_coarse->crf <= range.finest) {
      return RateChoice{too_coarse->crf, too_coarse->score_db, tries, false};
    }
    const double wanted_db = target_db + kEnough_db / 3;
    if (!good || !too_coarse) {
      // Infinite where nothing differs.
      const double excess_db = std::clamp(found_db - wanted_db, -40.0, 40.0);
      const double next = on_grid(crf + excess_db / kRateSlope_db);
      crf = good ? std::max(next, good->crf + range.step)
                 : std::min(next, too_coarse->crf - range.step);
    } else {
      // Between the two, straight; every third time in the middle, which no curve can hold up.
      const double low_db = std::min(good->score_db, target_db + 40);
      const double share =
          tries % 3 == 0 ? 0.5 : (low_db - wanted_db) / (low_db - too_coarse->score_db);
      crf = std::clamp(on_grid(std::lerp(good->crf, too_coarse->crf, share)),
                       good->crf + range.step, too_coarse->crf - range.step);
    }
    crf = std::clamp(crf, range.finest, range.coarsest);
  }
}

}  // namespace relit::bake
