// SPDX-License-Identifier: MIT
#include "player/path_chooser.hpp"

#include <cmath>
#include <limits>

#include "tests/test.hpp"

namespace relit::player {
namespace {

constexpr double kMs = 1e-3;

PathChooser all() { return PathChooser({false, true, true, true}); }

/// Calls until a measurement is wanted; -1 after `limit` calls.
int calls_until_wanted(PathChooser& chooser, double pixels, int limit = 100) {
  for (int i = 1; i <= limit; ++i) {
    if (chooser.wants_measuring(pixels)) return i;
  }
  return -1;
}

}  // namespace

TEST_CASE("composite paths have names") {
  for (const CompositePath path : {CompositePath::kAuto, CompositePath::kCpu,
                                   CompositePath::kTexture, CompositePath::kFused}) {
    const auto parsed = parse_composite_path(composite_path_name(path));
    REQUIRE(parsed);
    CHECK(*parsed == path);
  }
  const auto other = parse_composite_path("gpu");
  REQUIRE_FALSE(other);
  CHECK(other.error().code == ErrorCode::kInvalid);
  CHECK(other.error().message.find("fused") != std::string::npos);
}

TEST_CASE("where there is one path nothing is measured") {
  PathChooser chooser;
  CHECK(chooser.path() == CompositePath::kCpu);
  CHECK(calls_until_wanted(chooser, 1e5) == -1);
}

TEST_CASE("the first measurement takes the cheapest path") {
  PathChooser chooser = all();
  CHECK(chooser.path() == CompositePath::kTexture);
  CHECK(chooser.why().find("not measured") != std::string::npos);
  CHECK_FALSE(chooser.wants_measuring(0));
  CHECK_FALSE(chooser.wants_measuring(std::nan("")));
  CHECK(calls_until_wanted(chooser, 5000) == 1);
  chooser.take({0, 2 * kMs, 3.4 * kMs, 1.9 * kMs});
  CHECK(chooser.path() == CompositePath::kFused);
  CHECK(chooser.why() ==
        "fused: measured cpu 2.00 ms, texture 3.40 ms, fused 1.90 ms a frame, at 5000 covered "
        "pixels");
}

TEST_CASE("the path stays unless another is clearly cheaper") {
  PathChooser chooser = all();
  chooser.wants_measuring(5000);
  chooser.take({0, 2 * kMs, 3 * kMs, 1 * kMs});
  REQUIRE(chooser.path() == CompositePath::kFused);
  CHECK(calls_until_wanted(chooser, 20000) == PathChooser::kSettleViews);
  chooser.take({0, 1.8 * kMs, 3 * kMs, 2 * kMs});  // 0.9
  CHECK(chooser.path() == CompositePath::kFused);
  CHECK(chooser.why().find("clearly") != std::string::npos);
  chooser.take({0, 1.6 * kMs, 3 * kMs, 2 * kMs});  // 0.8
  CHECK(chooser.path() == CompositePath::kCpu);
  CHECK(chooser.why().find("clearly") == std::string::npos);
}

TEST_CASE("measuring waits for another coverage to settle") {
  PathChooser chooser = all();
  chooser.wants_measuring(10000);
  chooser.take({0, 1 * kMs, 2 * kMs, 3 * kMs});
  CHECK(calls_until_wanted(chooser, 10000) == -1);
  CHECK(calls_until_wanted(chooser, 19000) == -1);
  CHECK(calls_until_wanted(chooser, 5300) == -1);
  // A zoom that comes back is no reason.
  for (int i = 0; i < 10 * PathChooser::kSettleViews; ++i) {
    const bool away = i % PathChooser::kSettleViews != 0;
    CHECK_FALSE(chooser.wants_measuring(away ? 40000 : 10000));
  }
  CHECK(calls_until_wanted(chooser, 10000) == -1);
  CHECK(calls_until_wanted(chooser, 5000) == PathChooser::kSettleViews);
  chooser.take({0, 1 * kMs, 2 * kMs, 3 * kMs});
  CHECK(calls_until_wanted(chooser, 5000) == -1);
  CHECK(calls_until_wanted(chooser, 10000) == PathChooser::kSettleViews);
}

TEST_CASE("what could not be measured or does not exist is never taken") {
  PathChooser chooser({false, true, true, false});
  chooser.wants_measuring(100);
  chooser.take({1 * kMs, 5 * kMs, 4 * kMs, 1 * kMs});
  CHECK(chooser.path() == CompositePath::kTexture);
  PathChooser failing = all();
  failing.wants_measuring(100);
  failing.take({0, 3 * kMs, 0, std::numeric_limits<double>::infinity()});
  CHECK(failing.path() == CompositePath::kCpu);  // the present one was not measured
  failing.take({0, 0, 0, 0});
  CHECK(failing.path() == CompositePath::kCpu);
}

TEST_CASE("the same numbers give the same decisions") {
  const auto play = [] {
    PathChooser chooser = all();
    std::string decisions;
    for (int i = 0; i < 400; ++i) {
      const double pixels = 1000.0 * (1 + i / 40 % 5);
      if (!chooser.wants_measuring(pixels)) continue;
      chooser.take({0, 2 * kMs, 2.5 * kMs, pixels * 1e-6});
      decisions += chooser.why() + "\n";
    }
    return decisions;
  };
  CHECK(play() == play());
  CHECK(play().find("fused:") != std::string::npos);
  CHECK(play().find("cpu:") != std::string::npos);
}

}  // namespace relit::player
