// SPDX-License-Identifier: MIT
#include "bake_minimal/rate_search.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include "tests/test.hpp"

using namespace relit;
using namespace relit::bake;

namespace {

/// A curve like an encoder's: about half a decibel a step, flatter at the fine end.
double curve(double crf) { return 58 - 0.5 * crf - 0.004 * crf * crf; }

}  // namespace

TEST_CASE("a search ends just above its target, in a few tries, wherever it begins") {
  for (const double target : {30.0, 36.0, 40.0, 44.0, 50.0}) {
    for (const double begin : {0.0, 18.0, 24.0, 51.0}) {
      INFO("target " << target << ", from " << begin);
      int tries = 0;
      const auto found = search_rate(target, {0, 51, 0.25}, begin, [&](double crf) {
        ++tries;
        CHECK(std::abs(crf * 4 - std::round(crf * 4)) < 1e-9);
        return Result<double>(curve(crf));
      });
      REQUIRE(found);
      CHECK(found->score_db >= target);
      // A step of 0.25 is at most 0.23 dB here.
      CHECK(found->score_db <= target + 0.24);
      CHECK(found->score_db == curve(found->crf));
      CHECK(found->tries == tries);
      CHECK(tries <= 8);
    }
  }
}

TEST_CASE("whole steps, noise and stairs of an encoder are got along with") {
  // MPEG-4's quantiser has whole steps, so that several factors give the same.
  const auto stairs = search_rate(40, {0, 51, 1}, 22, [](double crf) {
    return Result<double>(curve(std::floor(crf / 3) * 3));
  });
  REQUIRE(stairs);
  CHECK(stairs->score_db >= 40);
  CHECK(stairs->crf + 1 <= 51);
  CHECK(curve(std::floor((stairs->crf + 1) / 3) * 3) < 40);
  int tries = 0;
  const auto noisy = search_rate(40, {0, 51, 0.25}, 24, [&](double crf) {
    return Result<double>(curve(crf) + (++tries % 2 == 0 ? 0.05 : -0.05));
  });
  REQUIRE(noisy);
  CHECK(noisy->score_db >= 40);
  CHECK(noisy->score_db < 40.4);
}

TEST_CASE("a target out of reach gives the finest factor, and one that all reach the coarsest") {
  const auto beyond =
      search_rate(70, {0, 51, 0.25}, 24, [](double crf) { return Result<double>(curve(crf)); });
  REQUIRE(beyond);
  CHECK_FALSE(beyond->reached);
  CHECK(beyond->crf == 0);
  CHECK(beyond->score_db == 58);
  const auto all =
      search_rate(10, {0, 51, 0.25}, 24, [](double crf) { return Result<double>(curve(crf)); });
  REQUIRE(all);
  CHECK(all->crf == 51);
  const auto exact = search_rate(40, {0, 51, 0.25}, 24, [](double) {
    return Result<double>(std::numeric_limits<double>::infinity());
  });
  REQUIRE(exact);
  CHECK(exact->crf == 51);
  const auto failing = search_rate(40, {0, 51, 0.25}, 24, [](double) -> Result<double> {
    return fail(ErrorCode::kEnvironment, "no encoder");
  });
  REQUIRE(!failing);
  CHECK(failing.error().message == "no encoder");
}
