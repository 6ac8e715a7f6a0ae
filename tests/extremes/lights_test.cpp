// SPDX-License-Identifier: MIT
// Lights of every size, shape and sign.
#include <algorithm>
#include <cmath>
#include <limits>

#include "player/relighter.hpp"
#include "tests/extremes/lit_clip.hpp"
#include "tests/results.hpp"

using namespace relit;
using namespace relit::test;

namespace {

/// A sky of radiance `sky` with a sun of one pixel.
decoders::Light sun_and_sky(float sun, float sky, int order) {
  decoders::Environment picture{64, 32, std::vector<float>(3 * 64 * 32, sky)};
  for (std::size_t c = 0; c < 3; ++c) picture.rgb[3 * (5 * 64 + 9) + c] = sun;
  return take(decoders::project_environment(picture, order));
}

}  // namespace

TEST_CASE("lights from 1e-6 to 1e6 are as exact as lights of 1") {
  const LitClip::Shape shape{2, 32, 32};
  const LitClip clip(shape, 1.0f / 128, random_samples(shape, 1));
  std::vector<decoders::Light> lights;
  for (const double size : {1e-6, 1e-3, 1.0, 1e3, 1e6}) lights.push_back(random_light(2, size, 3));
  Observed observed;
  composite_everywhere(clip, lights, observed);
  hold("lights of 1e-6, 1e-3, 1, 1e3, 1e6, of the largest S", observed);
}

TEST_CASE("a sun of 1e9 in a dim sky") {
  const LitClip::Shape shape{3, 32, 32};
  const LitClip clip(shape, 1.0f / 128, random_samples(shape, 2));
  std::vector<decoders::Light> lights{sun_and_sky(1e9f, 1e-3f, 3), sun_and_sky(1e9f, 1e-3f, 3)};
  decoders::window_light(lights[1]);
  Observed observed;
  composite_everywhere(clip, lights, observed);
  hold("sun of 1e9, sky of 1e-3, with and without window, of the largest S", observed);
}

TEST_CASE("terms that cancel to a millionth are exact to their sizes") {
  const LitClip::Shape shape{1, 32, 32};
  const LitClip::Source source = random_samples(shape, 3);
  // All coefficients alike, and a light whose rows all but cancel.
  const LitClip clip(shape, 1.0f / 128, [&](int, int x, int y) { return source(0, x, y); });
  decoders::Light light;
  light.sh = {{1, 0.7, 0.4}, {0.37, -0.21, 0.83}, {0.29, 0.13, 0.91}, {}};
  for (std::size_t c = 0; c < 3; ++c)
    light.sh[3][c] = (1e-6 - 1) * (light.sh[0][c] + light.sh[1][c] + light.sh[2][c]);
  double largest = 0, sum = 0;
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 32; ++x) {
      for (const LitClip::Term& term : clip.at(light, x, y)) {
        largest = std::max(largest, std::abs(term.value));
        sum = std::max(sum, term.sum);
      }
    }
  }
  REQUIRE(largest < 1e-6 * sum);
  Observed observed;
  composite_everywhere(clip, {&light, 1}, observed);
  hold("coefficients that cancel to 1e-6 of S, of the largest S", observed);
}

TEST_CASE("where a light has no coefficient nothing is seen") {
  const LitClip::Shape shape{2, 32, 32, 8, true};
  const LitClip clip(shape, 1, random_samples(shape, 4));
  std::vector<decoders::Light> lights(5);
  lights[0].sh.assign(9, {0, 0, 0});
  lights[1].sh.assign(9, {-0.0, 0, -0.0});
  for (std::size_t c = 0; c < 3; ++c) {
    lights[2 + c] = random_light(2, 1, 5);
    for (auto& row : lights[2 + c].sh)
      for (std::size_t other = 0; other < 3; ++other)
        if (other != c) row[other] = 0;
  }
  Observed observed;
  composite_everywhere(clip, lights, observed);
  hold("no light, or one channel (the others exactly 0), of the largest S", observed);
}

TEST_CASE("a light that is no number is refused and leaves the map black") {
  const LitClip::Shape shape{2, 8, 8};
  const LitClip clip(shape, 1.0f / 128, random_samples(shape, 6));
  const decoders::FrameView frame(0, clip.views_);
  long wrong = 0;
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
        -std::numeric_limits<double>::infinity(), 1e39}) {
    auto relighter = take(player::Relighter::create(clip.model_, clip.layers_, {}));
    require(relighter->set_light(random_light(2, 1, 7)));
    decoders::Light light = random_light(2, 1, 8);
    light.sh[7][1] = bad;
    wrong += relighter->set_light(light).has_value();
    require(relighter->composite({&frame}));
    std::vector<float> values(3 * 8 * 8, 1.0f);
    require(relighter->read(values));
    for (const float value : values) wrong += value != 0;
  }
  hold_exact("NaN, inf, -inf, 1e39 in a light", "taken, or seen in the map", wrong);
}
