// SPDX-License-Identifier: MIT
#include "gles/compositor.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/gles/backends.hpp"
#include "tests/gles/plane_scene.hpp"
#include "tests/test.hpp"

namespace {

using namespace relit;
using namespace relit::gles;
using namespace relit::test;

// Highp: sums in floats are exact to n·2^-24 of Σ|terms|; then a half-float target truncates to 11
// bits, a relative error of 2^-10 = 9.8e-4 at the peak. Mediump: a term is rounded when its weight
// becomes a half (2^-11), when it is multiplied (twice with an exponent) and in each of the sums
// after it, which grow to Σ|terms| at most; every pass truncates once more. The worst of all these
// roundings at once:
double bound(const Device& device, double passes, const Scene::Reference& r, std::size_t planes) {
  if (device.profile() != Profile::kEs2Mediump)
    return passes * std::exp2(-10) * r.peak +
           static_cast<double>(planes + 8) * std::exp2(-24) * r.absolute_sum;
  return (static_cast<double>(planes) / passes + 4) * std::exp2(-11) * r.absolute_sum +
         passes * std::exp2(-10) * r.absolute_sum;
}

void check_case(const Case& c, const BackendOptions& options = {}) {
  const Scene scene(c);
  const Scene::Reference reference = scene.reference();
  on_each_backend(
      [&](const Device& device, const Backend& backend) {
        INFO(c.name);
        auto compositor = Compositor::create(device, scene.description_);
        if (!compositor) FAIL(compositor.error().message);
        REQUIRE((*compositor)->format() == LightMapFormat::kHalfFloat);
        // Twice, so that both sets of textures are seen.
        for (int i = 0; i < 2; ++i) {
          auto uploaded = (*compositor)->upload(scene.views_);
          if (!uploaded) FAIL(uploaded.error().message);
        }
        auto map = (*compositor)->composite(scene.light_);
        if (!map) FAIL(map.error().message);
        CHECK(map->magnitude == scene.light_.magnitude);
        std::vector<float> values(reference.values.size());
        REQUIRE((*compositor)->read_back(values));
        const double error = largest_difference(values, reference.values);
        std::printf("composite %-36s %-17s %d pass(es): error/peak %.2e\n", c.name, backend.name,
                    (*compositor)->pass_count(), error / reference.peak);
        CHECK(error <= bound(device, (*compositor)->pass_count(), reference, scene.views_.size()));
        CHECK(error <= required(device) * reference.peak);
      },
      options);
}

}  // namespace

TEST_CASE("composite agrees with double precision for 9 tiles of 8 bits", "[gles][es2]") {
  check_case({"8 bit 4:4:4", 64, 64, 9, 8, false, -1});
}

TEST_CASE("composite agrees with double precision with an exponent per texel", "[gles][es2]") {
  check_case({"8 bit 4:4:4, exponent per texel", 64, 64, 9, 8, false, 0});
}

TEST_CASE("composite agrees with double precision for 4:2:0 and exponent blocks", "[gles][es2]") {
  check_case({"8 bit 4:2:0, exponent block 16", 64, 64, 9, 8, true, 4});
}

TEST_CASE("composite agrees with double precision for 10 bits", "[gles][es2]") {
  check_case({"10 bit 4:4:4", 64, 64, 9, 10, false, -1});
  check_case({"10 bit 4:2:0, exponent block 8", 64, 64, 9, 10, true, 3});
}

TEST_CASE("composite agrees with double precision for 16 tiles", "[gles][es2]") {
  check_case({"16 tiles, 8 bit, exponent per texel", 64, 64, 16, 8, false, 0});
  check_case({"16 tiles, 10 bit 4:2:0", 64, 64, 16, 10, true, -1});
}

TEST_CASE("composite agrees with double precision for odd sizes", "[gles][es2]") {
  check_case({"33x47, 10 bit 4:2:0, block 32", 33, 47, 9, 10, true, 5});
  check_case({"5x1, 8 bit 4:2:0, block 2", 5, 1, 4, 8, true, 1});
}

TEST_CASE("composite agrees where nothing is known of the pictures", "[gles][es2]") {
  check_case({"no hints, 8 bit 4:2:0, block 16", 37, 41, 9, 8, true, 4, false});
}

TEST_CASE("composite agrees without row lengths and without sharing", "[gles][es2]") {
  check_case({"rows copied together", 40, 24, 4, 10, true, 2}, {"GL_EXT_unpack_subimage", false});
}

TEST_CASE("composite addresses texels exactly in wide sheets", "[gles][es2]") {
  // A sheet of 2048 texels: a coordinate rounded to a half float near 1 is off by up to half a
  // texel.
  check_case({"64 planes in 2048 texels", 256, 16, 64, 8, false, -1});
}

TEST_CASE("a blend of two frames is the composite of both, each with its share", "[gles][es2]") {
  for (const Case& c : {Case{"blend, 8 bit 4:4:4", 64, 64, 9, 8, false, -1},
                        Case{"blend, 10 bit 4:2:0, block 8", 33, 47, 9, 10, true, 3}}) {
    Case second = c;
    second.seed = 1;
    const Scene from(c), to(second);
    const Scene::Reference a = from.reference(), b = to.reference();
    const float blend = 0.3f;
    Scene::Reference mixed = a;
    mixed.peak = 0;
    for (std::size_t i = 0; i < mixed.values.size(); ++i) {
      mixed.values[i] = (1 - double{blend}) * a.values[i] + double{blend} * b.values[i];
      mixed.peak = std::max(mixed.peak, std::abs(mixed.values[i]));
    }
    mixed.absolute_sum = std::max(a.absolute_sum, b.absolute_sum);
    on_each_backend([&](const Device& device, const Backend& backend) {
      auto created = Compositor::create(device, from.description_);
      if (!created) FAIL(created.error().message);
      Compositor& compositor = **created;
      REQUIRE(compositor.slot_count() == 2);
      REQUIRE(compositor.upload(from.views_, 0));
      REQUIRE(compositor.upload(to.views_, 1));
      auto map = compositor.composite(from.light_, {0, 1, blend});
      if (!map) FAIL(map.error().message);
      std::vector<float> values(a.values.size());
      REQUIRE(compositor.read_back(values));
      const double error = largest_difference(values, mixed.values);
      std::printf("%-36s %-17s %d pass(es): error/peak %.2e\n", c.name, backend.name,
                  compositor.blend_pass_count(), error / mixed.peak);
      // The sum has twice the terms and its own number of passes.
      CHECK(error <= bound(device, compositor.blend_pass_count(), mixed, 2 * from.views_.size()));
      CHECK(error <= required(device) * mixed.peak);

      // The ends are the frames alone, by whichever slots.
      std::vector<float> alone(values.size()), end(values.size());
      REQUIRE(compositor.composite(from.light_, {1, -1, 0}));
      REQUIRE(compositor.read_back(alone));
      REQUIRE(compositor.composite(from.light_, {0, 1, 1}));
      REQUIRE(compositor.read_back(end));
      CHECK(end == alone);
      REQUIRE(compositor.composite(from.light_, {1, 0, 0}));
      REQUIRE(compositor.read_back(end));
      CHECK(end == alone);
      CHECK_FALSE(compositor.composite(from.light_, {0, 2, blend}));
      CHECK_FALSE(compositor.composite(from.light_, {0, 1, 1.5f}));
      CHECK_FALSE(compositor.upload(from.views_, 2));
    });
  }
}

TEST_CASE("a blend works where the target cannot add up passes", "[gles][es2]") {
  const Case c{"square roots", 48, 40, 3, 8, false, -1};
  Case second = c;
  second.seed = 1;
  const Scene from(c), to(second);
  const Scene::Reference a = from.reference(), b = to.reference();
  on_each_backend(
      [&](const Device& device, const Backend&) {
        auto created = Compositor::create(device, from.description_);
        if (!created) FAIL(created.error().message);
        Compositor& compositor = **created;
        REQUIRE(compositor.upload(from.views_, 0));
        REQUIRE(compositor.upload(to.views_, 1));
        auto map = compositor.composite(from.light_, {0, 1, 0.5f});
        if (!map) FAIL(map.error().message);
        std::vector<float> values(a.values.size());
        REQUIRE(compositor.read_back(values));
        // Negative values are lost where frames are composited apart before they are mixed, or
        // where the mean is negative: compare where neither frame has any.
        double worst = 0;
        for (std::size_t i = 0; i < values.size(); ++i)
          if (a.values[i] >= 0 && b.values[i] >= 0)
            worst = std::max(worst, std::abs(values[i] - (a.values[i] + b.values[i]) / 2));
        // A root is dithered by a step of 1/255 at most, twice where frames are mixed afterwards,
        // which moves a value at the peak by 2 steps of its root and the scale (see below).
        const double step = 1.0 / 255, scale = map->scale;
        const double mediump =
            device.profile() == Profile::kEs2Mediump ? 2e-2 * std::max(a.peak, b.peak) : 1e-4;
        CHECK(worst <= 2 * (2 * step + step * step) * scale + mediump);
      },
      {"GL_OES_texture_half_float GL_EXT_color_buffer_half_float", false});
}

TEST_CASE("a light map of half size is every second texel of the full one", "[gles][es2]") {
  for (const Case& c : {Case{"half of 64x64", 64, 64, 9, 8, true, 0},
                        Case{"half of 33x47", 33, 47, 4, 10, false, 5}}) {
    const Scene scene(c);
    const Scene::Reference full = scene.reference();
    const int width = half_side(c.width), height = half_side(c.height);
    std::vector<double> expected;
    for (std::size_t channel = 0; channel < 3; ++channel)
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
          expected.push_back(full.values[channel * static_cast<std::size_t>(c.width * c.height) +
                                         static_cast<std::size_t>(2 * y * c.width + 2 * x)]);
    on_each_backend([&](const Device& device, const Backend&) {
      auto compositor = Compositor::create(device, scene.description_);
      REQUIRE(compositor);
      REQUIRE((*compositor)->upload(scene.views_, 0));
      auto map = (*compositor)->composite(scene.light_, {0, -1, 0}, true);
      if (!map) FAIL(map.error().message);
      CHECK(map->width == width);
      CHECK(map->height == height);
      // Texel (x+½)/width of the half map lies at (2x+½)/c.width of the full one.
      CHECK(map->place[0] * (8.5f / static_cast<float>(c.width)) + map->place[2] ==
            Approx(4.5f / static_cast<float>(width)));
      std::vector<float> values(expected.size());
      REQUIRE((*compositor)->read_back(values));
      CHECK(largest_difference(values, expected) <=
            bound(device, (*compositor)->pass_count(), full, scene.views_.size()));
    });
  }
}

TEST_CASE("planes of one channel are added to that channel", "[gles][es2]") {
  for (const int exponent_shift : {-1, 2}) {
    Scene scene({"one channel", 32, 24, 9, 8, false, exponent_shift});
    for (std::size_t k = 0; k < scene.weights_.size(); ++k) {
      Rgb weight{};
      weight[k % 3] = scene.weights_[k][k % 3];
      scene.weights_[k] = weight;
      scene.description_.planes[k].channels = 1u << k % 3;
    }
    const Scene::Reference reference = scene.reference();
    on_each_backend([&](const Device& device, const Backend&) {
      auto compositor = Compositor::create(device, scene.description_);
      if (!compositor) FAIL(compositor.error().message);
      REQUIRE((*compositor)->upload(scene.views_));
      REQUIRE((*compositor)->composite(scene.light_));
      std::vector<float> values(reference.values.size());
      REQUIRE((*compositor)->read_back(values));
      CHECK(largest_difference(values, reference.values) <=
            bound(device, (*compositor)->pass_count(), reference, scene.views_.size()));
      std::vector<Rgb> weights = scene.weights_;
      weights[1][0] = 0.1f;
      FoldedLight light = scene.light_;
      light.weights = weights;
      CHECK((*compositor)->composite(light).error().code == ErrorCode::kInvalid);
    });
  }
}

TEST_CASE("planes are added to a frame that is already there", "[gles][es2]") {
  const Scene scene({"added", 32, 32, 6, 8, true, 0});
  const Scene::Reference reference = scene.reference();
  std::vector<std::uint8_t> some(scene.views_.size());
  for (std::size_t k = 0; k < some.size(); ++k) some[k] = k % 5 < 2;
  std::vector<Rgb> weights = scene.weights_;
  for (std::size_t k = 0; k < some.size(); ++k)
    if (some[k] == 0) weights[k] = {};
  on_each_backend([&](const Device& device, const Backend&) {
    auto created = Compositor::create(device, scene.description_);
    REQUIRE(created);
    Compositor& compositor = **created;
    REQUIRE(compositor.upload(scene.views_, 0));
    FoldedLight light = scene.light_;
    light.weights = weights;
    std::vector<float> expected(reference.values.size()), values(expected.size());
    REQUIRE(compositor.composite(light, {0, -1, 0}));
    REQUIRE(compositor.read_back(expected));
    // Planes that are not there count as zero …
    REQUIRE(compositor.upload(scene.views_, 1, some));
    CHECK(compositor.holds(0, 1));
    CHECK_FALSE(compositor.holds(2, 1));
    REQUIRE(compositor.composite(scene.light_, {1, -1, 0}));
    REQUIRE(compositor.read_back(values));
    double worst = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      worst = std::max(worst, std::abs(static_cast<double>(values[i]) - double{expected[i]}));
    CHECK(worst <= required(device) * reference.peak);
    // … until they come.
    REQUIRE(compositor.upload(scene.views_, 1, {}, true));
    CHECK(compositor.holds(2, 1));
    REQUIRE(compositor.composite(scene.light_, {1, -1, 0}));
    REQUIRE(compositor.read_back(values));
    CHECK(largest_difference(values, reference.values) <= required(device) * reference.peak);
  });
}

TEST_CASE("composite leaves out planes without a weight", "[gles][es2]") {
  Scene scene({"partial", 32, 32, 9, 8, false, 0});
  // Every second group is silent and its planes are not there at all.
  for (std::size_t k = 0; k < scene.views_.size(); ++k)
    if (k / 3 % 2 == 1) scene.weights_[k] = {};
  const Scene::Reference reference = scene.reference();
  std::vector<PlaneView> views = scene.views_;
  for (std::size_t k = 0; k < views.size(); ++k)
    if (k / 3 % 2 == 1) views[k] = {};
  on_each_backend([&](const Device& device, const Backend&) {
    auto compositor = Compositor::create(device, scene.description_);
    REQUIRE(compositor);
    REQUIRE((*compositor)->upload(views));
    auto map = (*compositor)->composite(scene.light_);
    if (!map) FAIL(map.error().message);
    std::vector<float> values(reference.values.size());
    REQUIRE((*compositor)->read_back(values));
    CHECK(largest_difference(values, reference.values) <= required(device) * reference.peak);

    std::vector<Rgb> none(views.size());
    FoldedLight light = scene.light_;
    light.weights = none;
    REQUIRE((*compositor)->composite(light));
    REQUIRE((*compositor)->read_back(values));
    // One value of 11 bits.
    for (std::size_t c = 0; c < 3; ++c)
      CHECK(values[c * 32 * 32 + 5] == Approx(light.constant[c]).epsilon(std::exp2(-10)));
  });
}

TEST_CASE("composite keeps 8-bit square roots of the light where there are no half floats",
          "[gles][es2]") {
  Scene scene({"square roots", 48, 40, 3, 8, false, -1});
  const Scene::Reference reference = scene.reference();
  double highest = 0;
  for (const double v : reference.values) highest = std::max(highest, v);
  on_each_backend(
      [&](const Device& device, const Backend& backend) {
        auto compositor = Compositor::create(device, scene.description_);
        if (!compositor) FAIL(compositor.error().message);
        REQUIRE((*compositor)->format() == LightMapFormat::kSquareRoot8);
        REQUIRE((*compositor)->upload(scene.views_));
        auto map = (*compositor)->composite(scene.light_);
        REQUIRE(map);
        CHECK(map->square_root);
        // The peak's margin of 1.5 holds between the samples of this smooth scene.
        CHECK(map->scale >= highest);
        std::vector<float> values(reference.values.size());
        REQUIRE((*compositor)->read_back(values));
        double worst = 0;
        for (std::size_t i = 0; i < values.size(); ++i)
          worst = std::max(worst, std::abs(values[i] - std::max(reference.values[i], 0.0)));
        std::printf("composite to square roots %-17s error/peak %.2e\n", backend.name,
                    worst / highest);
        // Dithering moves the root by one step of 1/255 at most, and d(r²) = 2 r dr (+ dr²) times
        // the scale, at the peak r = √(highest / scale). Mediump adds its own 2e-2.
        const double step = 1.0 / 255;
        const double root = std::sqrt(highest / map->scale);
        const double mediump =
            device.profile() == Profile::kEs2Mediump ? 2e-2 * reference.peak : 1e-4;
        CHECK(worst <= (2 * root * step + step * step) * map->scale + mediump);
      },
      {"GL_OES_texture_half_float GL_EXT_color_buffer_half_float", false});
}

TEST_CASE("composite in 32-bit floats is exact to rounding", "[gles]") {
  Scene scene({"floats", 64, 64, 9, 10, true, 4});
  scene.description_.format = LightMapFormat::kFloat;
  const Scene::Reference reference = scene.reference();
  on_each_backend([&](const Device& device, const Backend& backend) {
    if (!device.is_es3()) return;
    auto compositor = Compositor::create(device, scene.description_);
    if (!compositor) FAIL(compositor.error().message);
    REQUIRE((*compositor)->upload(scene.views_));
    REQUIRE((*compositor)->composite(scene.light_));
    std::vector<float> values(reference.values.size());
    REQUIRE((*compositor)->read_back(values));
    const double error = largest_difference(values, reference.values);
    std::printf("composite in floats %-17s error/peak %.2e\n", backend.name,
                error / reference.peak);
    // 27 terms of a few roundings of 2^-24 each, and exp2() of integers, which ES 3 allows 3 ulp.
    CHECK(error <= 40 * std::exp2(-24) * reference.absolute_sum);
  });
}

TEST_CASE("composite survives scales and exponents far from one", "[gles][es2]") {
  Scene scene({"scales", 32, 32, 2, 8, false, 0});
  for (const float factor : {1e-12f, 1e12f}) {
    Scene scaled = scene;
    for (PlaneView& view : scaled.views_) view.scale *= factor;
    scaled.light_.weights = scaled.weights_;
    scaled.light_.constant = {};
    const Scene::Reference reference = scaled.reference();
    on_each_backend([&](const Device& device, const Backend&) {
      auto compositor = Compositor::create(device, scaled.description_);
      REQUIRE(compositor);
      REQUIRE((*compositor)->upload(scaled.views_));
      REQUIRE((*compositor)->composite(scaled.light_));
      std::vector<float> values(reference.values.size());
      REQUIRE((*compositor)->read_back(values));
      CHECK(largest_difference(values, reference.values) <= required(device) * reference.peak);
    });
  }
}

TEST_CASE("compositor refuses what was not described", "[gles][es2]") {
  Scene scene({"refusals", 32, 32, 2, 8, false, 0});
  on_each_backend([&](const Device& device, const Backend&) {
    auto compositor = Compositor::create(device, scene.description_);
    REQUIRE(compositor);
    Compositor& c = **compositor;
    std::vector<float> values(3 * 32 * 32);
    CHECK_FALSE(c.read_back(values));
    CHECK_FALSE(c.composite(scene.light_));  // nothing uploaded yet

    std::vector<PlaneView> views = scene.views_;
    CHECK_FALSE(c.upload(std::span(views).first(3)));
    views[1].mantissa.width = 31;
    CHECK(c.upload(views).error().code == ErrorCode::kInvalid);
    views = scene.views_;
    views[2].exponent = {};
    CHECK_FALSE(c.upload(views));
    views = scene.views_;
    views[0].scale = std::nanf("");
    CHECK_FALSE(c.upload(views));
    views = scene.views_;
    views[0].mantissa_zero = 512;
    CHECK_FALSE(c.upload(views));

    REQUIRE(c.upload(scene.views_));
    FoldedLight light = scene.light_;
    light.prediction_plane = 0;
    CHECK(c.composite(light).error().code == ErrorCode::kInvalid);
    light = scene.light_;
    light.constant[1] = INFINITY;
    CHECK_FALSE(c.composite(light));
    light = scene.light_;
    light.weights = light.weights.first(2);
    CHECK_FALSE(c.composite(light));
    CHECK(c.composite(scene.light_));
    CHECK_FALSE(c.read_back(std::span(values).first(7)));

    PlaneSetDescription wrong = scene.description_;
    wrong.planes[0].bit_depth = 9;
    CHECK(Compositor::create(device, wrong).error().code == ErrorCode::kInvalid);
    wrong = scene.description_;
    wrong.width = 0;
    CHECK_FALSE(Compositor::create(device, wrong));
  });
}

TEST_CASE("compositor says when a plane exceeds the GPU's textures", "[gles]") {
  PlaneSetDescription description;
  description.width = 4096;
  description.height = 8;
  description.planes.resize(1);
  on_each_backend([&](const Device& device, const Backend&) {
    const auto compositor = Compositor::create(device, description);
    REQUIRE_FALSE(compositor);
    CHECK(compositor.error().code == ErrorCode::kLimit);
  });
}
