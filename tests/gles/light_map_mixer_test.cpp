// SPDX-License-Identifier: MIT
#include "gles/light_map_mixer.hpp"

#include <cmath>

#include "tests/gles/backends.hpp"
#include "tests/results.hpp"
#include "tests/test.hpp"

namespace {

using namespace relit;
using namespace relit::gles;
using namespace relit::test;

// [3][side][side], linear in x and y: what bilinear filtering reproduces.
std::vector<float> ramp(int side, float base, float slope) {
  std::vector<float> values;
  for (int c = 0; c < 3; ++c)
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) {
        const float at = (static_cast<float>(x) + 0.5f) / static_cast<float>(side);
        const float down = (static_cast<float>(y) + 0.5f) / static_cast<float>(side);
        values.push_back(base + slope * (at + 0.5f * down) * static_cast<float>(c + 1));
      }
  return values;
}

}  // namespace

TEST_CASE("two light maps fade into each other", "[gles][es2]") {
  const std::vector<float> a = ramp(16, 0.2f, 0.1f), b = ramp(16, 0.1f, 0.25f);
  on_each_backend([&](const Device& device, const Backend&) {
    auto first = take(LightMapUploader::create(device, 16, 16));
    auto second = take(LightMapUploader::create(device, 16, 16));
    auto mixer = take(LightMapMixer::create(device, 16, 16));
    const LightMap from = take(first.upload(a, 2)), to = take(second.upload(b, 3));
    for (const float weight : {0.0f, 0.25f, 1.0f}) {
      const LightMap mixed = take(mixer.mix(from, to, weight));
      CHECK(mixed.magnitude == 2);
      std::vector<float> values(a.size());
      REQUIRE(mixer.read_back(values));
      double worst = 0, peak = 0;
      for (std::size_t i = 0; i < values.size(); ++i) {
        const double w = static_cast<double>(weight);
        const double expected =
            (1 - w) * static_cast<double>(a[i]) * 2 + w * static_cast<double>(b[i]) * 3;
        worst = std::max(worst, std::abs(static_cast<double>(values[i]) * 2 - expected));
        peak = std::max(peak, expected);
      }
      // Rounded to a half float when it was uploaded (2^-11), in mediump twice in the sum (2^-11
      // each, shares included four times), and truncated by the target (2^-10).
      const bool mediump = device.profile() == Profile::kEs2Mediump;
      CHECK(worst <= (std::exp2(-11) + std::exp2(-10) + (mediump ? 4 * std::exp2(-11) : 0)) * peak);
    }
    CHECK_FALSE(mixer.mix(from, to, 1.01f));
    CHECK_FALSE(mixer.mix(from, to, -0.01f));
    CHECK_FALSE(mixer.mix(from, to, NAN));
    CHECK_FALSE(mixer.mix(from, LightMap{}, 0.5f));
  });
}

TEST_CASE("light maps of other sizes are filtered when they are mixed", "[gles][es2]") {
  const std::vector<float> a = ramp(16, 0.2f, 0), b = ramp(8, 0.1f, 0.2f);
  on_each_backend([&](const Device& device, const Backend&) {
    auto first = take(LightMapUploader::create(device, 16, 16));
    auto second = take(LightMapUploader::create(device, 8, 8));
    auto mixer = take(LightMapMixer::create(device, 16, 16));
    const LightMap from = take(first.upload(a, 1)), to = take(second.upload(b, 1));
    take(mixer.mix(from, to, 0.5f));
    std::vector<float> values(a.size());
    REQUIRE(mixer.read_back(values));
    double worst = 0;
    for (int c = 0; c < 3; ++c)
      for (int y = 1; y < 15; ++y)
        for (int x = 1; x < 15; ++x) {
          const double ramp_at = 0.1 + 0.2 * ((x + 0.5) / 16 + 0.5 * (y + 0.5) / 16) * (c + 1);
          const auto i = static_cast<std::size_t>((c * 16 + y) * 16 + x);
          worst = std::max(worst, std::abs(static_cast<double>(values[i]) - (0.1 + ramp_at / 2)));
        }
    // As above, at a peak of 0.6, and filters with weights of 8 bits: 2^-9 of what neighbours
    // differ by, 0.2 · 1.5/8 · 3 = 0.11; mediump coordinates are exact here.
    CHECK(worst <= 0.6 * 6 * std::exp2(-11) + 0.11 * std::exp2(-9) +
                       (device.profile() == Profile::kEs2Mediump ? 4e-3 : 0));
  });
}

TEST_CASE("a light map of half size stays one when another is mixed in", "[gles][es2]") {
  const std::vector<float> a = ramp(8, 0.2f, 0.1f), b = ramp(16, 0.1f, 0.2f);
  on_each_backend([&](const Device& device, const Backend&) {
    auto first = take(LightMapUploader::create(device, 8, 8));
    auto second = take(LightMapUploader::create(device, 16, 16));
    auto mixer = take(LightMapMixer::create(device, 8, 8));
    LightMap from = take(first.upload(a, 1));
    from.place = half_place(16, 16);
    const LightMap to = take(second.upload(b, 1));
    const LightMap mixed = take(mixer.mix(from, to, 0.5f));
    CHECK(mixed.place == from.place);
    std::vector<float> values(a.size());
    REQUIRE(mixer.read_back(values));
    double worst = 0;
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t y = 0; y < 8; ++y)
        for (std::size_t x = 0; x < 8; ++x) {
          const std::size_t i = (c * 8 + y) * 8 + x, full = (c * 16 + 2 * y) * 16 + 2 * x;
          const double expected = 0.5 * (static_cast<double>(a[i]) + static_cast<double>(b[full]));
          worst = std::max(worst, std::abs(static_cast<double>(values[i]) - expected));
        }
    // As above; the texels of `b` are met at their centres to within 2^-8 of a texel.
    CHECK(worst <= 0.7 * 6 * std::exp2(-11) + 0.06 * std::exp2(-8) +
                       (device.profile() == Profile::kEs2Mediump ? 4e-3 : 0));
  });
}

TEST_CASE("square roots mix into square roots and into half floats", "[gles]") {
  const std::vector<float> a = ramp(16, 0.2f, 0.1f), b = ramp(16, 0.1f, 0.25f);
  on_each_backend([&](const Device& device, const Backend&) {
    auto first = take(LightMapUploader::create(device, 16, 16, LightMapFormat::kSquareRoot8));
    auto second = take(LightMapUploader::create(device, 16, 16, LightMapFormat::kSquareRoot8));
    const LightMap from = take(first.upload(a, 1)), to = take(second.upload(b, 1));
    for (const LightMapFormat format : {LightMapFormat::kSquareRoot8, LightMapFormat::kHalfFloat}) {
      auto mixer = take(LightMapMixer::create(device, 16, 16, format));
      const LightMap mixed = take(mixer.mix(from, to, 0.5f));
      CHECK(mixed.square_root == (format == LightMapFormat::kSquareRoot8));
      std::vector<float> values(a.size());
      REQUIRE(mixer.read_back(values));
      double worst = 0;
      for (std::size_t i = 0; i < values.size(); ++i) {
        const double mean = 0.5 * (static_cast<double>(a[i]) + static_cast<double>(b[i]));
        worst = std::max(worst, std::abs(static_cast<double>(values[i]) - mean));
      }
      // A root is dithered by a step of 1/255 of the peak's root, here and where it was uploaded:
      // 2 r dr + dr², r² the value over the scale, which is 1 or less.
      const double step = 1.0 / 255, scale = 1.3;
      CHECK(worst <= 2 * (2 * step + step * step) * scale + 6 * std::exp2(-11));
    }
    auto floats = take(LightMapUploader::create(device, 16, 16, LightMapFormat::kHalfFloat));
    auto mixer = take(LightMapMixer::create(device, 16, 16, LightMapFormat::kSquareRoot8));
    const auto refused = mixer.mix(from, take(floats.upload(a, 1)), 0.5f);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == ErrorCode::kUnsupported);
  });
}
