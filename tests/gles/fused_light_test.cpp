// SPDX-License-Identifier: MIT
#include "gles/fused_light.hpp"

#include <cstdio>
#include <cstdlib>

#include "gles/character_renderer.hpp"
#include "tests/gles/backends.hpp"
#include "tests/gles/drawing.hpp"
#include "tests/gles/plane_scene.hpp"
#include "tests/gles/predicted_scene.hpp"
#include "tests/results.hpp"
#include "tests/test.hpp"

namespace {

using namespace relit;
using namespace relit::gles;
using namespace relit::test;

constexpr int kSide = 96;

// Values between 0.25 and 0.95, so that the sRGB curve is nowhere steep: 0.6 and terms that sum to
// 0.35 at most.
template <class AnyScene>
void tame(AnyScene& scene) {
  const auto share = static_cast<float>(0.35 / scene.reference().absolute_sum);
  for (Rgb& weight : scene.weights_)
    for (float& w : weight) w *= share;
  for (Rgb& row : scene.light_.irradiance)
    for (float& c : row) c *= share;
  scene.light_.constant = {0.6f, 0.55f, 0.5f};
  scene.light_.magnitude = 1;
  scene.light_.weights = scene.weights_;
}
Scene tame_scene(const Case& c) {
  Scene scene(c);
  tame(scene);
  return scene;
}

// A quad whose coordinates run past the light map's edges, seen as large as the picture or smaller.
Quad beyond_the_edges(float half) {
  Quad quad(1, half);
  quad.uv = {{-0.1f, 1.1f}, {1.1f, 1.1f}, {1.1f, -0.1f}, {-0.1f, -0.1f}};
  return quad;
}

int largest_step(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  int most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

// Both paths filter the same four texels. The light map's are truncated to half floats (2^-10 of
// values below 1), and filtered with weights of 8 bits at least (2^-9 of the difference between
// neighbours, below 0.7). The sRGB curve's slope is at most 1 above 0.25 (0.4396 · 0.25^-0.583), so
// that 255 · (2^-10 + 0.7 · 2^-9) = 0.6 levels; both get the same dither, so the rounded levels are
// at most one apart.
constexpr int kOneLevel = 1;

template <class AnyScene>
void check_scenes(const char* name, const AnyScene& from, const AnyScene& to) {
  on_each_backend([&](const Device& device, const Backend& backend) {
    INFO(name);
    auto compositor = take(Compositor::create(device, from.description_));
    require(compositor->upload(from.views_, 0));
    require(compositor->upload(to.views_, 1));
    if (device.profile() == Profile::kEs2Mediump) {
      CHECK(compositor->fuse(from.light_, {0, -1, 0}).error().code == ErrorCode::kUnsupported);
      return;
    }
    for (const float half : {1.0f, 0.2f}) {
      QuadStage stage(device, beyond_the_edges(half), kSide);
      for (const FrameSlots& frames : {FrameSlots{0, -1, 0}, FrameSlots{1, 0, 0.4f}}) {
        LightMap map = take(compositor->composite(from.light_, frames));
        const std::vector<std::uint8_t> expected = stage.draw(map).rgba;
        FusedLight& fused = *take(compositor->fuse(from.light_, frames));
        const std::vector<std::uint8_t> picture = stage.draw(fused).rgba;
        const int step = largest_step(picture, expected);
        std::printf("fused %-32s %-9s half %.1f blend %.1f: at most %d level(s) apart\n", name,
                    backend.name, static_cast<double>(half), static_cast<double>(frames.blend),
                    step);
        CHECK(step <= kOneLevel);
      }
    }
  });
}

void check_case(const Case& c) {
  Case other = c;
  other.seed = 1;
  check_scenes(c.name, tame_scene(c), tame_scene(other));
}

}  // namespace

TEST_CASE("a fused light is drawn as the light map is", "[gles][es2]") {
  check_case({"8 bit 4:4:4", 32, 24, 9, 8, false, -1});
  check_case({"8 bit 4:2:0, block 16", 32, 32, 4, 8, true, 4});
  check_case({"10 bit 4:2:0", 20, 28, 9, 10, true, -1});
  check_case({"10 bit, exponent per texel", 33, 17, 3, 10, false, 0});
}

TEST_CASE("a fused prediction is drawn as the light map is", "[gles][es2]") {
  for (const int bits : {8, 10}) {
    PredictedScene from({"", 32, 24, 5, 10}, {"", 32, 24, 1, bits});
    PredictedScene to({"", 32, 24, 5, 10, false, -1, true, 1}, {"", 32, 24, 1, bits});
    tame(from);
    tame(to);
    check_scenes(bits == 8 ? "predicted, s of 8 bits" : "predicted, s of 10 bits", from, to);
  }
  PredictedScene scene({"", 20, 28, 4, 8, true, 3}, {"", 20, 28, 1, 10, false, 4});
  tame(scene);
  check_scenes("predicted, exponents", scene, scene);
}

TEST_CASE("a fused light with another light needs no new program", "[gles][es2]") {
  const Scene scene = tame_scene({"relit", 24, 24, 4, 8, false, 0});
  on_each_backend([&](const Device& device, const Backend&) {
    if (device.profile() == Profile::kEs2Mediump) return;
    auto compositor = take(Compositor::create(device, scene.description_));
    require(compositor->upload(scene.views_, 0));
    QuadStage stage(device, beyond_the_edges(1), kSide);
    const auto first = stage.draw(*take(compositor->fuse(scene.light_, {0, -1, 0}))).rgba;
    FoldedLight turned = scene.light_;
    std::vector<Rgb> weights = scene.weights_;
    std::reverse(weights.begin(), weights.end());
    turned.weights = weights;
    const auto second = stage.draw(*take(compositor->fuse(turned, {0, -1, 0}))).rgba;
    CHECK(largest_step(first, second) > 3);
    LightMap map = take(compositor->composite(turned, {0, -1, 0}));
    CHECK(largest_step(second, stage.draw(map).rgba) <= kOneLevel);
    // Without any plane the constant is left.
    std::vector<Rgb> none(weights.size());
    turned.weights = none;
    const auto plain = stage.draw(*take(compositor->fuse(turned, {0, -1, 0}))).rgba;
    const std::size_t centre = 4 * (kSide * kSide / 2 + kSide / 2);
    CHECK(std::abs(plain[centre] - encode_srgb(0.6)) <= 1.01);
    CHECK(std::abs(plain[centre + 2] - encode_srgb(0.5)) <= 1.01);
  });
}

TEST_CASE("planes that do not fit one shader are not fused", "[gles]") {
  Scene scene({"many planes", 8, 8, 80, 8, false, -1, false});
  on_each_backend([&](const Device& device, const Backend&) {
    PlaneSetDescription description = scene.description_;
    auto compositor = Compositor::create(device, description);
    if (!compositor) FAIL(compositor.error().message);
    // 240 planes of two frames take 480 vectors, and 20 are others'.
    const Status fused = (*compositor)->prepare_fused();
    const bool fits = device.profile() != Profile::kEs2Mediump &&
                      device.caps().max_fragment_uniform_vectors >= 500;
    CHECK(fused.has_value() == fits);
    if (!fused) CHECK(fused.error().code == ErrorCode::kUnsupported);
  });
}
