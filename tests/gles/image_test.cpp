// SPDX-License-Identifier: MIT
#include "gles/image.hpp"

#include <cmath>

#include "tests/test.hpp"

using namespace relit::gles;

TEST_CASE("resampling to the same size changes nothing", "[gles]") {
  std::vector<std::uint8_t> rgba;
  for (int i = 0; i < 4 * 7 * 5; ++i) rgba.push_back(static_cast<std::uint8_t>(37 * i));
  for (const bool smooth : {false, true})
    CHECK(resample({7, 5, rgba}, {7, 5, smooth, true, false}) == rgba);
}

TEST_CASE("shrinking averages in linear light", "[gles]") {
  // Black and white: half the light is sRGB 188; alpha is linear.
  const std::vector<std::uint8_t> rgba{0, 0, 0, 0, 255, 255, 255, 255};
  const std::vector<std::uint8_t> one = resample({2, 1, rgba}, {1, 1, true, false, false});
  CHECK(one == std::vector<std::uint8_t>{188, 188, 188, 128});
  // 3 to 2: each takes one and a half texels.
  const std::vector<std::uint8_t> three{0, 0, 0, 0, 0, 0, 0, 90, 0, 0, 0, 180};
  const std::vector<std::uint8_t> two = resample({3, 1, three}, {2, 1, true, false, false});
  CHECK(two[3] == 30);
  CHECK(two[7] == 150);
}

TEST_CASE("enlarging interpolates, across the edge where it wraps", "[gles]") {
  const std::vector<std::uint8_t> rgba{0, 0, 0, 0, 0, 0, 0, 200};
  const std::vector<std::uint8_t> clamped = resample({2, 1, rgba}, {4, 1, true, false, false});
  CHECK(clamped[3] == 0);
  CHECK(clamped[7] == 50);
  CHECK(clamped[11] == 150);
  CHECK(clamped[15] == 200);
  const std::vector<std::uint8_t> wrapped = resample({2, 1, rgba}, {4, 1, true, true, false});
  CHECK(wrapped[3] == 50);
  CHECK(wrapped[15] == 150);
  const std::vector<std::uint8_t> nearest = resample({2, 1, rgba}, {4, 1, false, false, false});
  CHECK(nearest[7] == 0);
  CHECK(nearest[11] == 200);
}

TEST_CASE("powers of two above", "[gles]") {
  CHECK(power_of_two_above(1) == 1);
  CHECK(power_of_two_above(2) == 2);
  CHECK(power_of_two_above(3) == 4);
  CHECK(power_of_two_above(1025) == 2048);
}
