// SPDX-License-Identifier: MIT
// What is seen: half floats and 8 bits on their way to the screen, and the fused sum.
#include "tests/gles/drawing.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "gles/compositor.hpp"
#include "player/relighter.hpp"
#include "tests/extremes/lit_clip.hpp"
#include "tests/results.hpp"

using namespace relit;
using namespace relit::gles;
using namespace relit::test;

namespace {

constexpr int kSide = 32;

/// The interval in which a texel's radiance may lie.
struct Interval {
  double least = 0;
  double most = 0;
};

/// A level of 255 more for the interval's ends than the reference's own, and what drawing adds:
/// half a level of dither and half of rounding; in mediump, a level for its eight roundings of
/// 2^-11 where the curve climbs by 112 levels an e-fold at most (0.44), and for the logarithm and
/// power of the curve, 2^-8 / 2.4 of an e-fold's 255 levels (0.4).
template <class F>
void compare(const LitClip& clip, const decoders::Light& light, const Picture& picture,
             double exposure, double drawing, F interval, Worst& worst) {
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      // Inside a square of 4x4 alike texels.
      if ((x % 4) % 3 == 0 || (y % 4) % 3 == 0) continue;
      const std::array<LitClip::Term, 3> terms = clip.at(light, x, y);
      for (std::size_t c = 0; c < 3; ++c) {
        const double expected = encode_srgb(exposure * terms[c].value);
        const Interval values = interval(terms[c]);
        const double bound = std::max(encode_srgb(exposure * values.most) - expected,
                                      expected - encode_srgb(exposure * values.least));
        worst.add(std::abs(picture.at(x, y)[c] - expected), bound + drawing);
      }
    }
  }
}
double drawing_of(const Device& device) {
  return device.profile() == Profile::kEs2Mediump ? 2.01 : 1.01;
}

/// Squares whose transfer reaches from 2^-10 to 1, each by an exponent of its own.
LitClip::Source squares_of_all_sizes(const LitClip::Shape& shape) {
  return [source = random_samples(shape, 51)](int n, int x, int y) {
    LitClip::Sample sample = source(n, x, y);
    sample.exponent = 125 + (x * 3 + y * 5) % 11;
    return sample;
  };
}

struct Exposure {
  int ev;
  Worst highp, mediump;
};

/// The composite's own bound, then a step of 1/255 of the root where roots are kept: dither and
/// rounding are half a step each.
Interval interval_of(const LitClip::Term& term, double composite, const LightMap& map) {
  if (!map.square_root) return {term.value - composite, term.value + composite};
  const double unit = static_cast<double>(map.scale) * static_cast<double>(map.magnitude);
  const auto root = [&](double value) { return std::sqrt(std::max(value, 0.0) / unit); };
  const double low = std::max(root(term.value - composite) - 1.0 / 255, 0.0);
  const double high = std::min(root(term.value + composite) + 1.0 / 255, 1.0);
  return {low * low * unit, high * high * unit};
}

void hold_exposures(LightMapFormat format, const std::string& name) {
  const LitClip::Shape shape{1, kSide, kSide, 8, true, 4};
  const LitClip clip(shape, 1.0f / 128, squares_of_all_sizes(shape));
  decoders::Light light;
  light.sh = {{1, 1, -1}, {0.5, 0.3, 0.2}, {-0.25, 0.4, 0.1}, {0.3, -0.2, 0.6}};
  Exposure exposures[] = {{-10, {}, {}}, {-5, {}, {}}, {0, {}, {}}, {5, {}, {}}, {10, {}, {}}};
  on_each_backend([&](const Device& device, const Backend&) {
    PlaneSetDescription description = player::describe_planes(clip.model_, clip.layers_);
    description.format = format;
    auto compositor = take(Compositor::create(device, description));
    require(compositor->upload(clip.views_, 0));
    const decoders::FoldedWeights folded = clip.fold(light);
    LightMap map = take(compositor->composite(folded.view, {0, -1, 0}));
    REQUIRE(map.square_root == (format == LightMapFormat::kSquareRoot8));
    const double step = std::exp2(-24) * static_cast<double>(map.magnitude) *
                        (map.square_root ? 0.0 : static_cast<double>(map.scale));
    const bool half = device.profile() == Profile::kEs2Mediump;
    QuadStage stage(device, Quad(), kSide);  // a pixel for each texel
    for (Exposure& each : exposures) {
      // At 0 EV what is twice the largest transfer of one coefficient is white.
      const double exposure = 0.5 * std::exp2(each.ev);
      const auto interval = [&](const LitClip::Term& term) {
        return interval_of(term, gpu_bound(device, clip, term, compositor->pass_count(), step),
                           map);
      };
      compare(clip, light, stage.draw(map, exposure), exposure, drawing_of(device), interval,
              half ? each.mediump : each.highp);
    }
  });
  for (const Exposure& each : exposures) {
    const std::string row = name + " at " + std::to_string(each.ev) + " EV, levels of 255, ";
    hold(row + "ES 3, ES 2, OSMesa", "interval + 1.01", each.highp);
    hold(row + "ES 2 mediump", "interval + 2.01", each.mediump);
  }
}

}  // namespace

TEST_CASE("half-float light maps at exposures of -10 to +10 EV") {
  hold_exposures(LightMapFormat::kHalfFloat, "half floats");
}

TEST_CASE("8-bit light maps at exposures of -10 to +10 EV") {
  hold_exposures(LightMapFormat::kSquareRoot8, "8-bit roots");
}

TEST_CASE("nine products in half floats keep their bits, the bias inside the sum") {
  // Mantissas a step from zero: with the bias taken out, sums of 128 times their size would be
  // rounded, 128 · 9 · 2^-11 of S in mediump.
  const LitClip::Shape shape{2, 32, 32};
  const LitClip::Source source = random_samples(shape, 52);
  for (const bool faint : {false, true}) {
    const LitClip clip(shape, faint ? 1.0f : 1.0f / 128, [&](int n, int x, int y) {
      LitClip::Sample sample = source(n, x, y);
      if (faint) sample.mantissa = sample.mantissa % 2 != 0 ? 127 : 129;
      return sample;
    });
    const decoders::Light light = random_light(2, 1, 53);
    Observed observed;
    composite_everywhere(clip, {&light, 1}, observed);
    hold(faint ? "9 products of mantissas ±1, of the largest S" : "9 products, of the largest S",
         observed);
  }
}

TEST_CASE("the fused sum is drawn as the reference for every order") {
  for (int order = 0; order <= 3; ++order) {
    Worst worst;
    long between = 0;
    for (const bool exponents : {false, true}) {
      const LitClip::Shape shape{order, kSide, kSide, 8, exponents, 4};
      const LitClip clip(shape, 1.0f / 128, random_samples(shape, 54, 132));
      const decoders::Light light = random_light(order, 1, 55);
      const double exposure = 0.5;
      on_each_backend([&](const Device& device, const Backend&) {
        if (device.profile() == Profile::kEs2Mediump)
          return;  // refused there: fused_light_test.cpp
        auto compositor =
            take(Compositor::create(device, player::describe_planes(clip.model_, clip.layers_)));
        require(compositor->upload(clip.views_, 0));
        const decoders::FoldedWeights folded = clip.fold(light);
        FusedLight& fused = *take(compositor->fuse(folded.view, {0, -1, 0}));
        QuadStage stage(device, Quad(), kSide);  // a pixel for each texel
        const Picture picture = stage.draw(fused, exposure);
        const auto interval = [&](const LitClip::Term& term) {
          // No target in between: the sum of four taps, whose shares are rounded and sum to 1.
          const double error = (clip.terms() + 12) * std::exp2(-24) * (term.sum + 2 * term.bias);
          return Interval{term.value - error, term.value + error};
        };
        compare(clip, light, picture, exposure, drawing_of(device), interval, worst);
        for (int i = 0; i < kSide * kSide; ++i) {
          const int level = picture.rgba[static_cast<std::size_t>(4 * i)];
          between += level > 10 && level < 245;
        }
      });
    }
    CHECK(between > kSide * kSide / 4);  // neither black nor white alone
    hold("fused, order " + std::to_string(order) + ", levels of 255", "interval + 1.01", worst);
  }
}
