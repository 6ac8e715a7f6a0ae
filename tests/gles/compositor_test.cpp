// SPDX-License-Identifier: MIT
#include "gles/compositor.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "tests/gles/backends.hpp"
#include "tests/test.hpp"

namespace {

using namespace relit;
using namespace relit::gles;
using namespace relit::test;

struct Case {
  const char* name;
  int width = 64, height = 64;
  int tiles = 9;  // RGB groups; planes = 3 × tiles
  int bit_depth = 8;
  bool chroma_420 = false;
  int exponent_shift = -1;  // -1: no exponents
  bool hints = true;        // pictures are described, so that they are uploaded whole
};

// A model with its frame as a decoder would leave it: one picture of three components with a grid
// of tiles, rows padded, and an exponent picture whose tiles the planes of a group share.
class Scene {
 public:
  explicit Scene(const Case& c) : width_(c.width), height_(c.height) {
    std::mt19937 random(static_cast<unsigned>(c.tiles * 1000 + c.width));
    const int columns = static_cast<int>(std::ceil(std::sqrt(c.tiles)));
    const int rows = (c.tiles + columns - 1) / columns;
    // Tiles start on even samples, as 4:2:0 needs.
    const int tile_w = (c.width + 15) / 16 * 16, tile_h = (c.height + 15) / 16 * 16;
    const int bytes = c.bit_depth > 8 ? 2 : 1;
    for (int component = 0; component < 3; ++component) {
      const int shift = c.chroma_420 && component > 0 ? 1 : 0;
      const int w = (tile_w * columns) >> shift, h = (tile_h * rows) >> shift;
      stride_[component] = w * bytes + 32;
      std::vector<std::uint8_t>& data = pictures_[component];
      data.resize(static_cast<std::size_t>(stride_[component] * h));
      for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x)
          put(component, x, y, bytes, draw_mantissa(random, c.bit_depth, x, y));
    }
    exponent_stride_ = tile_w * columns + 7;
    exponents_.resize(static_cast<std::size_t>(exponent_stride_ * tile_h * rows));
    // E from a range of 12, and 0 now and then: exactly zero.
    for (std::uint8_t& e : exponents_)
      e = random() % 16 == 0 ? std::uint8_t{0} : static_cast<std::uint8_t>(122 + random() % 12);

    description_.width = c.width;
    description_.height = c.height;
    std::uniform_real_distribution<float> weight(-1, 1);
    for (int tile = 0; tile < c.tiles; ++tile) {
      for (int component = 0; component < 3; ++component) {
        const int shift = c.chroma_420 && component > 0 ? 1 : 0;
        const int x = (tile % columns) * tile_w, y = (tile / columns) * tile_h;
        PlaneView view;
        view.mantissa = {
            pictures_[component].data() + (y >> shift) * stride_[component] + (x >> shift) * bytes,
            stride_[component], (c.width + shift) >> shift, (c.height + shift) >> shift, bytes};
        view.mantissa_shift = shift;
        view.mantissa_zero = 1 << (c.bit_depth - 1);
        view.exponent_zero = c.bit_depth > 8 ? 137 : 135;
        view.scale = 1.0f / (1 + static_cast<float>(tile));
        PlaneDescription plane;
        plane.bit_depth = c.bit_depth;
        plane.mantissa_shift = shift;
        plane.mantissa = {c.hints ? component : -1, x >> shift, y >> shift};
        if (c.exponent_shift >= 0) {
          const int s = c.exponent_shift;
          const int ex = (tile % columns) * (tile_w >> s), ey = (tile / columns) * (tile_h >> s);
          view.exponent = {exponents_.data() + ey * exponent_stride_ + ex, exponent_stride_,
                           (c.width + (1 << s) - 1) >> s, (c.height + (1 << s) - 1) >> s, 1};
          view.exponent_shift = s;
          plane.has_exponent = true;
          plane.exponent_shift = s;
          plane.exponent = {c.hints ? 0 : -1, ex, ey};
        }
        views_.push_back(view);
        description_.planes.push_back(plane);
        weights_.push_back({weight(random), weight(random), weight(random)});
      }
    }
    light_.weights = weights_;
    light_.constant = {0.11f, -0.07f, 0.05f};
    light_.magnitude = 3;
  }

  // The formula of plane_view.hpp in double precision; also Σ |terms| at its largest.
  struct Reference {
    std::vector<double> values;  // [3][H][W]
    double peak = 0;
    double absolute_sum = 0;
  };
  [[nodiscard]] Reference reference() const {
    Reference r;
    const auto texels = static_cast<std::size_t>(width_ * height_);
    r.values.resize(3 * texels);
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        for (std::size_t c = 0; c < 3; ++c) {
          double sum = light_.constant[c], absolute = std::abs(sum);
          for (std::size_t k = 0; k < views_.size(); ++k) {
            const PlaneView& v = views_[k];
            const int e = v.exponent.empty()
                              ? v.exponent_zero
                              : v.exponent.at(x >> v.exponent_shift, y >> v.exponent_shift);
            if (e == 0) continue;
            const double term =
                double{weights_[k][c]} * v.scale *
                (v.mantissa.at(x >> v.mantissa_shift, y >> v.mantissa_shift) - v.mantissa_zero) *
                std::exp2(e - v.exponent_zero);
            sum += term;
            absolute += std::abs(term);
          }
          r.values[c * texels + static_cast<std::size_t>(y * width_ + x)] = sum;
          r.peak = std::max(r.peak, std::abs(sum));
          r.absolute_sum = std::max(r.absolute_sum, absolute);
        }
      }
    }
    return r;
  }

  PlaneSetDescription description_;
  std::vector<PlaneView> views_;
  std::vector<Rgb> weights_;
  FoldedLight light_;
  int width_, height_;

 private:
  static int draw_mantissa(std::mt19937& random, int bit_depth, int x, int y) {
    const int range = 1 << bit_depth;
    // Smooth with noise over the whole range, the ends included: 0 is what a lossy decoder may
    // yield.
    const double smooth = 0.5 + 0.5 * std::sin(0.13 * x + 0.07 * y);
    const double noise = static_cast<double>(random() % 1000) / 1000 - 0.5;
    return std::clamp(static_cast<int>(range * (smooth + 0.3 * noise)), 0, range - 1);
  }
  void put(int component, int x, int y, int bytes, int value) {
    std::uint8_t* p = pictures_[component].data() + y * stride_[component] + x * bytes;
    const auto wide = static_cast<std::uint16_t>(value);
    if (bytes == 1)
      *p = static_cast<std::uint8_t>(value);
    else
      __builtin_memcpy(p, &wide, 2);
  }
  std::vector<std::uint8_t> pictures_[3];
  std::ptrdiff_t stride_[3] = {};
  std::vector<std::uint8_t> exponents_;
  std::ptrdiff_t exponent_stride_ = 0;
};

double largest_difference(std::span<const float> values, const std::vector<double>& reference) {
  double worst = 0;
  for (std::size_t i = 0; i < values.size(); ++i)
    worst = std::max(worst, std::abs(values[i] - reference[i]));
  return worst;
}

// Highp: sums in floats are exact to n·2^-24 of Σ|terms|; then a half-float target truncates to 11
// bits, a relative error of 2^-10 = 9.8e-4 at the peak. Mediump: a term is rounded when its weight
// becomes a half (2^-11), when it is multiplied (twice with an exponent) and in each of the sums
// after it, which grow to Σ|terms| at most; every pass truncates once more. The worst of all these
// roundings at once:
double bound(const Device& device, const Compositor& compositor, const Scene::Reference& r,
             std::size_t planes) {
  const double passes = compositor.pass_count();
  if (device.profile() != Profile::kEs2Mediump)
    return passes * std::exp2(-10) * r.peak +
           static_cast<double>(planes + 8) * std::exp2(-24) * r.absolute_sum;
  return (static_cast<double>(planes) / passes + 4) * std::exp2(-11) * r.absolute_sum +
         passes * std::exp2(-10) * r.absolute_sum;
}

// What the player counts on, relative to the peak.
double required(const Device& device) {
  switch (device.profile()) {
    case Profile::kEs3:
      return 1.5e-3;
    case Profile::kEs2:
      return 4e-3;
    case Profile::kEs2Mediump:
      break;
  }
  return 2e-2;
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
        CHECK(error <= bound(device, **compositor, reference, scene.views_.size()));
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
    CHECK(c.composite(light).error().code == ErrorCode::kUnsupported);
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
