// SPDX-License-Identifier: MIT
// Signed RGBE over the whole range of its exponents, as it is decoded and composited.
#include <algorithm>
#include <array>
#include <bit>
#include <cfloat>
#include <cmath>

#include "decoders/plane_decoder.hpp"
#include "tests/extremes/lit_clip.hpp"
#include "tests/results.hpp"

using namespace relit;
using namespace relit::test;

TEST_CASE("every mantissa with every exponent decodes to the float it stands for") {
  LitClip::Shape shape{0, 256, 256, 8, true, 1};
  const LitClip clip(shape, 1, [](int, int x, int y) { return LitClip::Sample{y, x}; });
  std::vector<float> out(3 * 256 * 256);
  require(decoders::reconstruct(clip.views_, clip.model_, clip.layers_, out));
  long wrong = 0;
  for (int m = 0; m < 256; ++m) {
    for (int e = 0; e < 256; ++e) {
      const auto expected = e == 0 ? 0.0f : static_cast<float>(std::ldexp(m - 128, e - 135));
      // Bit for bit: there is no negative zero.
      wrong += std::bit_cast<std::uint32_t>(out[static_cast<std::size_t>(m * 256 + e)]) !=
               std::bit_cast<std::uint32_t>(expected);
    }
  }
  CHECK(*std::max_element(out.begin(), out.begin() + 65536) == std::ldexp(127.0f, 120));
  hold_exact("RGBE, each of 65 536 pairs (m, E), decoded",
             "m - 128 times a power of two is a float", wrong);
}

TEST_CASE("exponents from 255 to 0 in one map are composited on every path") {
  for (const int depth : {8, 10}) {
    const int zero = 1 << (depth - 1), top = zero - 1;
    // By rows: the largest of both signs, what only lossy coding yields, the least, and zero.
    const std::array<int, 6> mantissas{zero + top, zero - top, 0, zero + 1, zero - 1, zero};
    const LitClip::Shape shape{0, 256, 6, depth, true, 1};
    const LitClip clip(shape, 1, [&](int, int x, int y) {
      return LitClip::Sample{mantissas[static_cast<std::size_t>(y)], x};
    });
    decoders::Light light;
    light.sh = {{1, 1, 1}};
    Observed observed;
    composite_everywhere(clip, {&light, 1}, observed);
    hold("E from 255 to 0 at once, " + std::to_string(depth) + " bits, of the peak 2^127",
         observed);
  }
}

TEST_CASE("the least exponents of all are composited as well as the largest") {
  // Down to E = 32, as the GPU's maps are scaled by no less than 2^-126.
  Observed observed;
  for (const int most : {255, 200, 128, 60, 32}) {
    const LitClip::Shape shape{1, 24, 16, 8, true, 2};
    const LitClip clip(shape, 1, [&](int n, int x, int y) {
      LitClip::Sample sample = random_samples(shape, 7)(n, x, y);
      sample.exponent += most - 135;
      return sample;
    });
    // Folded, its largest coefficient is 1: the terms of the largest exponent sum to 2^127 at most.
    decoders::Light light;
    light.sh = {{1, 0.5, 0.25}, {0, -0.5, 0.25}, {0, 0, -0.25}, {0, 0, 0.25}};
    composite_everywhere(clip, {&light, 1}, observed);
  }
  hold("random blocks up to E = 255, 200, 128, 60, 32, of the largest S", observed);
}
