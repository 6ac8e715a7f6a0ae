// SPDX-License-Identifier: MIT
#include "bake_minimal/push_pull.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/test.hpp"

using relit::bake::PushPull;

namespace {

std::size_t area(int width, int height) {
  return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

// Two discs, as charts have curved borders.
std::vector<std::uint8_t> two_discs(int width, int height) {
  std::vector<std::uint8_t> valid(area(width, height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double u = (x + 0.5) / width, v = (y + 0.5) / height;
      const bool a = std::hypot(u - 0.3, v - 0.35) < 0.22;
      const bool b = std::hypot(u - 0.72, v - 0.66) < 0.2;
      valid[static_cast<std::size_t>(y * width + x)] = a || b ? 1 : 0;
    }
  }
  return valid;
}

}  // namespace

TEST_CASE("sampled texels keep their bits and holes get finite values between the samples") {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> value(-1.0f, 1.0f);
  const int sizes[][2] = {{1, 1}, {1, 7}, {5, 1}, {17, 31}, {64, 64}, {100, 37}};
  for (const auto& size : sizes) {
    for (int repeat = 0; repeat < 6; ++repeat) {
      std::vector<std::uint8_t> valid(area(size[0], size[1]));
      for (auto& v : valid) v = random() % 5 == 0 ? 1 : 0;
      valid[random() % valid.size()] = 1;
      std::vector<float> plane(valid.size(), std::numeric_limits<float>::quiet_NaN());
      float lo = 2, hi = -2;
      for (std::size_t i = 0; i < plane.size(); ++i) {
        if (valid[i] == 0) continue;
        plane[i] = value(random);
        lo = std::min(lo, plane[i]);
        hi = std::max(hi, plane[i]);
      }
      const std::vector<float> before = plane;
      PushPull(size[0], size[1], valid).fill(plane);
      for (std::size_t i = 0; i < plane.size(); ++i) {
        if (valid[i] != 0) {
          REQUIRE(plane[i] == before[i]);
        } else {
          // Convex combinations, each level rounding by no more than a few units of 2^-24.
          REQUIRE(plane[i] >= lo - 1e-5f);
          REQUIRE(plane[i] <= hi + 1e-5f);
        }
      }
    }
  }
}

TEST_CASE("a constant fills as that constant") {
  const int width = 45, height = 70;
  const auto valid = two_discs(width, height);
  std::vector<float> plane(valid.size(), 0.0f);
  for (std::size_t i = 0; i < plane.size(); ++i) {
    if (valid[i] != 0) plane[i] = 0.2821f;
  }
  PushPull(width, height, valid).fill(plane);
  // Shares of three texels do not sum to 1 in floats: a few roundings a level, 7 levels.
  for (const float v : plane) REQUIRE(std::abs(v - 0.2821f) < 2e-6f);
}

TEST_CASE("without samples the plane becomes zero, without holes it stays") {
  std::vector<float> plane(35, 3.0f);
  PushPull(7, 5, std::vector<std::uint8_t>(35, 1)).fill(plane);
  CHECK(plane == std::vector<float>(35, 3.0f));
  PushPull(7, 5, std::vector<std::uint8_t>(35, 0)).fill(plane);
  CHECK(plane == std::vector<float>(35, 0.0f));
}

TEST_CASE("the fill has no cliffs") {
  const int size = 96;
  const auto valid = two_discs(size, size);
  std::vector<float> plane(valid.size(), 0.0f);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const auto i = static_cast<std::size_t>(y * size + x);
      if (valid[i] != 0) plane[i] = x + y < size ? 1.0f : 3.0f;  // one disc each
    }
  }
  std::vector<float> filled = plane;
  PushPull(size, size, valid).fill(filled);
  const auto steepest = [&](const std::vector<float>& p) {
    float worst = 0;
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const auto i = static_cast<std::size_t>(y * size + x);
        if (x + 1 < size && (valid[i] == 0 || valid[i + 1] == 0)) {
          worst = std::max(worst, std::abs(p[i] - p[i + 1]));
        }
        if (y + 1 < size && (valid[i] == 0 || valid[i + size] == 0)) {
          worst = std::max(worst, std::abs(p[i] - p[i + size]));
        }
      }
    }
    return worst;
  };
  // The discs are 96 · (|(0.42, 0.31)| - 0.42) = 9.8 texels apart, so a straight ramp from 1 to 3
  // has 0.2 a texel; the interpolation of the pyramid may be twice as steep. Left at 0 it would
  // be 3.
  CHECK(steepest(plane) == 3.0f);
  CHECK(steepest(filled) < 0.4f);
}

TEST_CASE("the fill is linear in the samples and does not depend on the scratch") {
  const int width = 33, height = 20;
  const auto valid = two_discs(width, height);
  const PushPull fill(width, height, valid);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> value(-1.0f, 1.0f);
  std::vector<float> a(valid.size()), b(valid.size()), sum(valid.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    a[i] = value(random);
    b[i] = value(random);
    sum[i] = a[i] + b[i];
  }
  std::vector<float> dirty(fill.scratch_size(), std::numeric_limits<float>::quiet_NaN());
  std::vector<float> again = a;
  fill.fill(a);
  fill.fill(again, dirty);
  CHECK(a == again);
  fill.fill(b);
  fill.fill(sum);
  for (std::size_t i = 0; i < a.size(); ++i) REQUIRE(std::abs(a[i] + b[i] - sum[i]) < 1e-5f);
}
