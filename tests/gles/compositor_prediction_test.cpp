// SPDX-License-Identifier: MIT
// The composite of models with a prediction, s · E(N).
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "gles/compositor.hpp"
#include "tests/gles/backends.hpp"
#include "tests/gles/predicted_scene.hpp"
#include "tests/results.hpp"
#include "tests/test.hpp"

namespace {

using namespace relit;
using namespace relit::gles;
using namespace relit::test;

std::vector<float> read(Compositor& compositor, std::size_t size) {
  std::vector<float> values(size);
  require(compositor.read_back(values));
  return values;
}

std::vector<double> widened(const std::vector<float>& values) {
  return {values.begin(), values.end()};
}

void check_frame(const char* name, const PredictedScene& scene) {
  const Scene::Reference reference = scene.reference();
  on_each_backend([&](const Device& device, const Backend& backend) {
    INFO(name);
    auto compositor = take(Compositor::create(device, scene.description_));
    // Twice, so that both sets of textures are seen.
    for (int i = 0; i < 2; ++i) require(compositor->upload(scene.views_));
    take(compositor->composite(scene.light_));
    const double error =
        largest_difference(read(*compositor, reference.values.size()), reference.values);
    std::printf("predicted %-36s %-17s %d pass(es): error/peak %.2e\n", name, backend.name,
                compositor->pass_count(), error / reference.peak);
    CHECK(error <= predicted_bound(device, compositor->pass_count(), reference, scene));
    CHECK(error <= required(device) * reference.peak);
  });
}

const Case kPlanes{"planes", 64, 48, 5, 10};
const Case kS8{"s", 64, 48, 1, 8};
const Case kS10{"s", 64, 48, 1, 10};

Case with_seed(Case c, unsigned seed) {
  c.seed = seed;
  return c;
}

}  // namespace

TEST_CASE("a predicted composite agrees with double precision", "[gles][es2]") {
  check_frame("s of 8 bits", PredictedScene(kPlanes, kS8));
  check_frame("s of 10 bits", PredictedScene(kPlanes, kS10));
  check_frame("no hints, 33x47", PredictedScene({"", 33, 47, 4, 10, false, -1, false},
                                                {"", 33, 47, 1, 10, false, -1, false}));
  PredictedScene weighed(kPlanes, kS10);
  weighed.weights_[0] = {0.3f, -0.2f, 0.1f};
  check_frame("s with a weight of its own", weighed);
  check_frame("exponents",
              PredictedScene({"", 64, 48, 4, 8, true, 3}, {"", 64, 48, 1, 10, false, 4}));
}

TEST_CASE("a predicted composite in 32-bit floats is exact to rounding", "[gles]") {
  for (const int bits : {8, 10}) {
    PredictedScene scene(kPlanes, {"", 64, 48, 1, bits});
    scene.description_.format = LightMapFormat::kFloat;
    scene.round_normals();
    const Scene::Reference reference = scene.reference();
    on_each_backend([&](const Device& device, const Backend& backend) {
      if (!device.is_es3()) return;
      auto compositor = take(Compositor::create(device, scene.description_));
      require(compositor->upload(scene.views_));
      take(compositor->composite(scene.light_));
      const double error =
          largest_difference(read(*compositor, reference.values.size()), reference.values);
      std::printf("predicted in floats %-17s error/peak %.2e\n", backend.name,
                  error / reference.peak);
      // As the bound above without half floats; a coordinate's two products and sums are of up to
      // twice its range, and their literals are rounded: 8 roundings more, twice in degree 2.
      const auto roundings = static_cast<double>(scene.model_planes_) + 8 + 17 + 16;
      CHECK(error <= roundings * std::exp2(-24) * reference.absolute_sum);
    });
  }
}

TEST_CASE("a predicted composite of many planes takes the passes it needs", "[gles][es2]") {
  const PredictedScene scene({"", 32, 32, 16, 10}, {"", 32, 32, 1, 8});
  check_frame("48 planes", scene);
  on_each_backend([&](const Device& device, const Backend&) {
    const PlaneSheets sheets = take(PlaneSheets::create(device, scene.description_));
    for (const PlanePass::Limits& limits :
         {PlanePass::Limits{8, 20, 0}, PlanePass::Limits{8, 9, 0}, PlanePass::Limits{8, 64, 16}}) {
      std::size_t vectors = 0;
      for (const PlanePass& pass : PlanePass::plan(scene.description_, sheets, limits)) {
        CHECK(pass.within(limits));
        for (const std::vector<float>& data : pass.make_weights().data) vectors += data.size() / 4;
      }
      CHECK(vectors == 2 * (48 + 9));
    }
  });
}

TEST_CASE("a blend of two predicted frames takes each frame's normals", "[gles][es2]") {
  const PredictedScene from(kPlanes, kS8);
  const PredictedScene to(with_seed(kPlanes, 1), with_seed(kS8, 1));
  const Scene::Reference a = from.reference(), b = to.reference();
  const float blend = 0.3f;
  Scene::Reference mixed = a;
  mixed.peak = 0;
  mixed.absolute_sum = std::max(a.absolute_sum, b.absolute_sum);
  for (std::size_t i = 0; i < mixed.values.size(); ++i) {
    mixed.values[i] = (1 - double{blend}) * a.values[i] + double{blend} * b.values[i];
    mixed.peak = std::max(mixed.peak, std::abs(mixed.values[i]));
  }
  on_each_backend([&](const Device& device, const Backend& backend) {
    auto compositor = take(Compositor::create(device, from.description_));
    require(compositor->upload(from.views_, 0));
    require(compositor->upload(to.views_, 1));
    take(compositor->composite(from.light_, {0, 1, blend}));
    const double error = largest_difference(read(*compositor, mixed.values.size()), mixed.values);
    std::printf("predicted blend %-17s %d pass(es): error/peak %.2e\n", backend.name,
                compositor->blend_pass_count(), error / mixed.peak);
    CHECK(error <= predicted_bound(device, compositor->blend_pass_count(), mixed, from, 2));
    CHECK(error <= required(device) * mixed.peak);
    take(compositor->composite(from.light_, {0, 1, 1}));
    CHECK(largest_difference(read(*compositor, b.values.size()), b.values) <=
          required(device) * b.peak);
  });
}

TEST_CASE("a predicted light map of half size is every second texel", "[gles][es2]") {
  const PredictedScene scene({"", 33, 46, 4, 10}, {"", 33, 46, 1, 10});
  const Scene::Reference full = scene.reference();
  std::vector<double> expected;
  for (std::size_t i = 0; i < full.values.size(); ++i)
    if (i % 33 % 2 == 0 && i / 33 % 2 == 0) expected.push_back(full.values[i]);
  on_each_backend([&](const Device& device, const Backend&) {
    auto compositor = take(Compositor::create(device, scene.description_));
    require(compositor->upload(scene.views_, 0));
    take(compositor->composite(scene.light_, {0, -1, 0}, true));
    CHECK(largest_difference(read(*compositor, expected.size()), expected) <=
          predicted_bound(device, compositor->pass_count(), full, scene));
  });
}

TEST_CASE("square roots of a predicted light reach up to its peak", "[gles][es2]") {
  // s and 9 planes fit one pass of 16 lookups.
  const PredictedScene scene({"", 48, 40, 3, 10}, {"", 48, 40, 1, 10});
  const Scene::Reference reference = scene.reference();
  const double highest = *std::max_element(reference.values.begin(), reference.values.end());
  on_each_backend(
      [&](const Device& device, const Backend& backend) {
        auto compositor = take(Compositor::create(device, scene.description_));
        REQUIRE(compositor->format() == LightMapFormat::kSquareRoot8);
        // The normals come last, and do not take the other planes' samples with them.
        std::vector<PlaneView> model = scene.views_, normals(model.size());
        std::swap_ranges(normals.begin() + static_cast<std::ptrdiff_t>(scene.model_planes_),
                         normals.end(),
                         model.begin() + static_cast<std::ptrdiff_t>(scene.model_planes_));
        require(compositor->upload(model, 0));
        require(compositor->upload(normals, 0, {}, true));
        const LightMap map = take(compositor->composite(scene.light_, {0, -1, 0}));
        CHECK(map.scale >= highest);
        const std::vector<float> values = read(*compositor, reference.values.size());
        double worst = 0;
        for (std::size_t i = 0; i < values.size(); ++i)
          worst = std::max(worst, std::abs(values[i] - std::max(reference.values[i], 0.0)));
        std::printf("predicted square roots %-17s error/peak %.2e\n", backend.name,
                    worst / highest);
        // Dithering moves the root by a step at most, see compositor_test.cpp.
        const double step = 1.0 / 255, root = std::sqrt(highest / map.scale);
        const double sum = device.profile() == Profile::kEs2Mediump ? 2e-2 * reference.peak : 1e-4;
        CHECK(worst <= (2 * root * step + step * step) * map.scale + sum);
      },
      {"GL_OES_texture_half_float GL_EXT_color_buffer_half_float", false});
}

TEST_CASE("zero normals leave the harmonics that have no direction", "[gles][es2]") {
  PredictedScene scene(kPlanes, kS10);
  scene.clear_normals();
  check_frame("zero normals", scene);
}

TEST_CASE("a black light predicts nothing", "[gles][es2]") {
  PredictedScene scene(kPlanes, kS10);
  scene.light_.irradiance = {};
  check_frame("no irradiance", scene);
  scene.weights_.assign(scene.weights_.size(), Rgb{});
  scene.light_.weights = scene.weights_;
  check_frame("only the constant", scene);
}

TEST_CASE("what a prediction lacks counts as zero until it comes", "[gles][es2]") {
  const PredictedScene scene(kPlanes, kS8);
  const Scene::Reference reference = scene.reference();
  const std::size_t size = reference.values.size();
  on_each_backend([&](const Device& device, const Backend&) {
    auto compositor = take(Compositor::create(device, scene.description_));
    require(compositor->upload(scene.views_, 0));
    FoldedLight flat = scene.light_;
    flat.irradiance = {};
    take(compositor->composite(flat, {0, -1, 0}));
    const std::vector<double> without = widened(read(*compositor, size));
    const auto first_normal = static_cast<std::size_t>(scene.description_.normal_planes);
    for (const std::size_t missing : {std::size_t{0}, first_normal, first_normal + 2}) {
      std::vector<std::uint8_t> wanted(scene.views_.size(), 1);
      wanted[missing] = 0;
      require(compositor->upload(scene.views_, 1, wanted));
      take(compositor->composite(scene.light_, {1, -1, 0}));
      CHECK(largest_difference(read(*compositor, size), without) <=
            required(device) * reference.peak);
      require(compositor->upload(scene.views_, 1, {}, true));
      take(compositor->composite(scene.light_, {1, -1, 0}));
      CHECK(largest_difference(read(*compositor, size), reference.values) <=
            required(device) * reference.peak);
    }
  });
}

TEST_CASE("compositor refuses a prediction that was not described", "[gles][es2]") {
  const PredictedScene scene({"", 16, 16, 1, 8}, {"", 16, 16, 1, 8});
  on_each_backend([&](const Device& device, const Backend&) {
    auto compositor = take(Compositor::create(device, scene.description_));
    require(compositor->upload(scene.views_, 0));
    const auto refused = [&](auto change) {
      FoldedLight light = scene.light_;
      std::vector<Rgb> weights = scene.weights_;
      change(light, weights);
      light.weights = weights;
      return compositor->composite(light).error().code == ErrorCode::kInvalid;
    };
    using Weights = std::vector<Rgb>;
    CHECK(refused([](FoldedLight& light, Weights&) { light.prediction_plane = -1; }));
    CHECK(refused([](FoldedLight& light, Weights&) { light.prediction_plane = 1; }));
    CHECK(refused([](FoldedLight& light, Weights&) { light.irradiance[4][1] = NAN; }));
    CHECK(refused([](FoldedLight&, Weights& weights) { weights.back()[2] = 0.1f; }));
    CHECK(refused([](FoldedLight&, Weights& weights) { weights.pop_back(); }));
    std::vector<PlaneView> views = scene.views_;
    views.back().scale = 1;
    CHECK(compositor->upload(views, 1).error().code == ErrorCode::kInvalid);

    const auto undescribable = [&](auto change) {
      PlaneSetDescription description = scene.description_;
      change(description);
      const auto result = Compositor::create(device, description);
      return !result && result.error().code == ErrorCode::kInvalid;
    };
    CHECK(undescribable([](PlaneSetDescription& d) { d.prediction_plane = -1; }));
    CHECK(undescribable([](PlaneSetDescription& d) { d.prediction_plane = 4; }));
    CHECK(undescribable([](PlaneSetDescription& d) { d.prediction_plane = -2; }));
    CHECK(undescribable([](PlaneSetDescription& d) { d.normal_planes = -1; }));
    CHECK(undescribable([](PlaneSetDescription& d) { d.normal_planes = 5; }));
    CHECK(undescribable([](PlaneSetDescription& d) { d.planes[5].bit_depth = 10; }));
    CHECK(undescribable([](PlaneSetDescription& d) { d.planes[5].mantissa_shift = 1; }));
    CHECK(undescribable([](PlaneSetDescription& d) { d.planes[5].has_exponent = true; }));
    CHECK(undescribable([](PlaneSetDescription& d) { d.planes[1].bit_depth = 16; }));
  });
}
