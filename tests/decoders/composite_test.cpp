// SPDX-License-Identifier: MIT
#include "decoders/composite.hpp"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <string>

#include "decoders/composite_kernels.hpp"
#include "tests/reference/composite_reference.hpp"
#include "tests/test.hpp"

namespace relit::decoders {
namespace {

using Random = std::mt19937;

int pick(Random& random, int least, int most) {
  return std::uniform_int_distribution<int>(least, most)(random);
}
float uniform(Random& random, float least, float most) {
  return std::uniform_real_distribution<float>(least, most)(random);
}

/// Samples in rows that are `padding` bytes too long, in a block of exactly the size they need:
/// what is read beyond it the sanitizers see.
struct Samples {
  std::unique_ptr<std::uint8_t[]> bytes;
  SampleView view;

  Samples(int width, int height, int bytes_per_sample, int padding, int misaligned = 0) {
    const std::ptrdiff_t row = std::ptrdiff_t{width} * bytes_per_sample;
    const std::ptrdiff_t stride = row + padding;
    const std::ptrdiff_t size = misaligned + stride * (height - 1) + row;
    bytes = std::make_unique<std::uint8_t[]>(static_cast<std::size_t>(size));
    view = {bytes.get() + misaligned, stride, width, height, bytes_per_sample};
  }
  void set(int x, int y, int value) {
    std::uint8_t* p = bytes.get() + (view.data - bytes.get()) + y * view.stride_bytes +
                      std::ptrdiff_t{x} * view.bytes_per_sample;
    if (view.bytes_per_sample == 1) {
      *p = static_cast<std::uint8_t>(value);
    } else {
      const auto word = static_cast<std::uint16_t>(value);
      std::memcpy(p, &word, sizeof word);
    }
  }
  template <class F>
  void fill(F f) {
    for (int y = 0; y < view.height; ++y) {
      for (int x = 0; x < view.width; ++x) set(x, y, f());
    }
  }
};

int shifted(int size, int shift) { return (size + (1 << shift) - 1) >> shift; }

/// A job with all it needs. Planes are added, then finish() joins the parts.
struct Scene {
  std::vector<Samples> samples;
  std::vector<PlaneView> planes;
  std::vector<Rgb> weights;
  std::array<std::vector<glm::vec3>, 2> normals;
  std::vector<float> out;
  CompositeJob job;

  Scene(int width, int height) {
    job.width = width;
    job.height = height;
  }
  /// `depth` 8 or 10 bits; exponent_shift < 0: no exponents.
  PlaneView& add(Random& random, int depth, int mantissa_shift, int exponent_shift) {
    PlaneView plane;
    plane.mantissa_shift = mantissa_shift;
    plane.mantissa_zero = depth == 8 ? 128 : 512;
    plane.exponent_zero = depth == 8 ? 135 : 137;
    Samples mantissa(shifted(job.width, mantissa_shift), shifted(job.height, mantissa_shift),
                     depth == 8 ? 1 : 2, pick(random, 0, 9), pick(random, 0, 3));
    mantissa.fill([&] { return pick(random, 0, depth == 8 ? 255 : 1023); });
    plane.mantissa = mantissa.view;
    samples.push_back(std::move(mantissa));
    if (exponent_shift >= 0) {
      plane.exponent_shift = exponent_shift;
      Samples exponent(shifted(job.width, exponent_shift), shifted(job.height, exponent_shift), 1,
                       pick(random, 0, 9));
      exponent.fill([&] { return pick(random, plane.exponent_zero - 14, plane.exponent_zero); });
      plane.exponent = exponent.view;
      samples.push_back(std::move(exponent));
    }
    weights.push_back({uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)});
    planes.push_back(plane);
    return planes.back();
  }
  /// By the first or the second of the predictions.
  void predict(Random& random, int plane, std::size_t which = 0, float share = 1) {
    job.predictions[which].plane = plane;
    job.predictions[which].share = share;
    std::normal_distribution<float> normal;
    for (int i = 0; i < job.width * job.height; ++i) {
      normals[which].push_back(
          glm::normalize(glm::vec3(normal(random), normal(random), normal(random) + 1e-3f)));
    }
    for (std::size_t n = 0; n < 9; ++n) {
      for (float& value : job.light.irradiance[n]) value = uniform(random, -1, 1);
    }
  }
  void finish() {
    out.assign(static_cast<std::size_t>(3 * job.width * job.height), -7e33f);
    job.planes = planes;
    job.light.weights = weights;
    for (std::size_t i = 0; i < 2; ++i) job.predictions[i].normals = normals[i];
    job.out = out;
    const Status status = job.validate();
    INFO((status ? std::string() : status.error().message));
    REQUIRE(status);
  }
};

/// Every kernel within the bound of the reference, and equal to the scalar one bit for bit.
void check_all_kernels(Scene& scene) {
  const reference::Composite expected = reference::composite(scene.job);
  scene.job.run_scalar();
  const std::vector<float> scalar = scene.out;
  std::size_t beyond = 0;
  std::string where;
  for (std::size_t i = 0; i < scalar.size(); ++i) {
    const double error = std::abs(static_cast<double>(scalar[i]) - expected.value[i]);
    if (error <= reference::composite_bound(scene.job, expected.magnitude[i])) continue;
    if (beyond++ == 0) {
      where = "index " + std::to_string(i) + ": " + std::to_string(scalar[i]) + " instead of " +
              std::to_string(expected.value[i]);
    }
  }
  CAPTURE(where);
  CHECK(beyond == 0);
  for (const CompositeKernel& kernel : composite_kernels()) {
    CAPTURE(kernel.name);
    std::fill(scene.out.begin(), scene.out.end(), -7e33f);
    kernel.run(scene.job);
    CHECK(std::memcmp(scene.out.data(), scalar.data(), scalar.size() * sizeof(float)) == 0);
  }
}

/// A light map of one texel and one plane, red weight 1.
float single(int mantissa, int exponent, int mantissa_zero, int exponent_zero) {
  Random random(1);
  Scene scene(1, 1);
  scene.add(random, mantissa_zero == 128 ? 8 : 10, 0, 0);
  scene.samples[0].set(0, 0, mantissa);
  scene.samples[1].set(0, 0, exponent);
  scene.planes[0].exponent_zero = exponent_zero;
  scene.weights[0] = {1, 0, 0};
  scene.finish();
  check_all_kernels(scene);
  scene.job.run();
  return scene.out[0];
}

container::PlaneRecord plane_record(std::vector<container::MatrixEntry> matrix) {
  container::PlaneRecord plane;
  plane.matrix = std::move(matrix);
  return plane;
}

}  // namespace

TEST_CASE("run() takes the last of the kernels this processor has") {
  const auto kernels = composite_kernels();
  REQUIRE_FALSE(kernels.empty());
  CHECK(std::string(kernels.front().name) == "scalar");
  CHECK(std::string(composite_kernel()) == kernels.back().name);
#if defined(__x86_64__) || defined(__ARM_NEON)
  CHECK(kernels.size() > 1);
#endif
}

TEST_CASE("a texel is the sum of the definition") {
  Random random(2);
  Scene scene(1, 1);
  scene.add(random, 8, 0, 0).scale = 0.5f;
  scene.add(random, 8, 0, -1).scale = 2;
  scene.samples[0].set(0, 0, 130);
  scene.samples[1].set(0, 0, 136);
  scene.samples[2].set(0, 0, 100);
  scene.weights = {{1, 2, 3}, {0.25f, 0, -1}};
  scene.job.light.constant = {10, 20, 30};
  scene.finish();
  scene.job.run();
  CHECK(scene.out == std::vector<float>{10 + 2 - 14, 20 + 4, 30 + 6 + 56});
}

TEST_CASE("every exponent scales exactly, and zero is exactly zero") {
  for (const auto& [zero, exponent_zero] : {std::pair{128, 135}, {512, 137}}) {
    for (int exponent = 0; exponent <= 255; ++exponent) {
      CAPTURE(zero, exponent);
      const int step = exponent - exponent_zero;
      const float expected = exponent == 0 ? 0 : std::ldexp(-3.0f, step);
      // (0 − zero) · 2^(255 − E₀) = −2^127 is the largest value there is.
      CHECK(single(zero - 3, exponent, zero, exponent_zero) == expected);
      CHECK(single(0, exponent, zero, exponent_zero) ==
            (exponent == 0 ? 0 : std::ldexp(static_cast<float>(-zero), step)));
    }
  }
  // The ends of the range of E₀: the least step is the least subnormal, the largest 2^127.
  CHECK(single(129, 1, 128, 150) == std::numeric_limits<float>::denorm_min());
  CHECK(single(129, 255, 128, 128) == std::ldexp(1.0f, 127));
}

TEST_CASE("every kernel keeps the bound for every width, depth and shift") {
  Random random(3);
  for (int width = 1; width <= 67; ++width) {
    CAPTURE(width);
    Scene scene(width, pick(random, 1, 5));
    for (int depth : {8, 10}) {
      for (int mantissa_shift : {0, 1}) {
        for (int exponent_shift = -1; exponent_shift <= 5; ++exponent_shift) {
          scene.add(random, depth, mantissa_shift, exponent_shift).scale = uniform(random, -3, 3);
          Rgb& weight = scene.weights.back();
          const int kind = pick(random, 0, 7);
          if (kind < 3) weight = {0, 0, 0}, weight[static_cast<std::size_t>(kind)] = 1.5f;
          if (kind == 3) weight[1] = 0;
        }
      }
    }
    for (float& value : scene.job.light.constant) value = uniform(random, -1, 1);
    scene.finish();
    check_all_kernels(scene);
  }
}

TEST_CASE("a light map of half size is every second texel of the full one, bit for bit") {
  Random random(14);
  for (int width = 1; width <= 67; ++width) {
    CAPTURE(width);
    Scene scene(width, pick(random, 1, 7));
    for (int depth : {8, 10}) {
      for (int mantissa_shift : {0, 1}) {
        for (int exponent_shift = -1; exponent_shift <= 5; ++exponent_shift) {
          scene.add(random, depth, mantissa_shift, exponent_shift).scale = uniform(random, -3, 3);
          if (pick(random, 0, 1) == 0) scene.weights.back() = {0, 1.5f, 0};
        }
      }
    }
    scene.finish();
    scene.job.run_scalar();
    const std::vector<float> full = scene.out;
    CompositeJob half = scene.job;
    half.every = 2;
    std::vector<float> out(static_cast<std::size_t>(3 * half.out_width() * half.out_height()));
    half.out = out;
    REQUIRE(half.validate());
    for (const CompositeKernel& kernel : composite_kernels()) {
      CAPTURE(kernel.name);
      std::fill(out.begin(), out.end(), -7e33f);
      kernel.run(half);
      std::size_t at = 0, different = 0;
      for (int c = 0; c < 3; ++c) {
        for (int y = 0; y < half.height; y += 2) {
          for (int x = 0; x < width; x += 2, ++at) {
            const int texel = (c * half.height + y) * width + x;
            different += out[at] != full[static_cast<std::size_t>(texel)];
          }
        }
      }
      CHECK(at == out.size());
      CHECK(different == 0);
    }
  }
  Scene wide(4095, 3);  // more than one tile, and an odd end
  wide.add(random, 8, 0, 0);
  wide.add(random, 10, 1, 3);
  wide.finish();
  wide.job.run_scalar();
  const std::vector<float> full = wide.out;
  wide.job.every = 2;
  wide.out.resize(static_cast<std::size_t>(3 * 2048 * 2));
  wide.job.out = wide.out;
  REQUIRE(wide.job.validate());
  for (const CompositeKernel& kernel : composite_kernels()) {
    CAPTURE(kernel.name);
    kernel.run(wide.job);
    CHECK(wide.out[2047] == full[4094]);
    CHECK(wide.out[2048 + 1024] == full[2 * 4095 + 2048]);
  }
  wide.job.every = 3;
  CHECK_FALSE(wide.job.validate());
}

TEST_CASE("every kernel keeps the bound with exponents from one end to the other") {
  Random random(4);
  const std::array<int, 8> ends{0, 1, 8, 9, 128, 135, 254, 255};
  for (int round = 0; round < 40; ++round) {
    Scene scene(pick(random, 1, 40), pick(random, 1, 9));
    const int depth = round % 2 == 0 ? 8 : 10;
    for (int k = 0; k < 3; ++k) {
      scene.add(random, depth, pick(random, 0, 1), pick(random, 0, 5)).scale =
          std::ldexp(uniform(random, 1, 2), pick(random, -20, -2));
      scene.samples.back().fill([&] { return ends[static_cast<std::size_t>(pick(random, 0, 7))]; });
    }
    scene.finish();
    check_all_kernels(scene);
  }
}

TEST_CASE(
    "every kernel keeps the bound where planes cancel and where one texel outshines the rest") {
  Random random(5);
  for (int exponent_shift : {-1, 0, 3}) {
    Scene scene(53, 21);
    for (int k = 0; k < 40; k += 2) {
      scene.add(random, 8, 0, exponent_shift);
      scene.planes.push_back(
          scene.planes.back());  // the same samples with nearly the opposite weight
      const Rgb weight = scene.weights.back();
      scene.weights.push_back({-weight[0], std::nextafter(-weight[1], 1.0f), -weight[2] * 0.999f});
    }
    if (exponent_shift == 0) scene.samples[1].set(17, 5, 200);
    scene.finish();
    check_all_kernels(scene);
  }
}

TEST_CASE("every kernel keeps the bound with a prediction") {
  Random random(6);
  for (int round = 0; round < 20; ++round) {
    Scene scene(pick(random, 1, 35), pick(random, 1, 6));
    for (int k = 0; k < 5; ++k) {
      scene.add(random, round % 2 == 0 ? 8 : 10, k % 2, pick(random, -1, 5));
      if (k % 2 == 0) scene.weights.back() = {};
    }
    scene.predict(random, pick(random, 0, 4));
    scene.finish();
    check_all_kernels(scene);
  }
}

TEST_CASE("every kernel keeps the bound with the predictions of two frames that blend") {
  Random random(16);
  for (int round = 0; round < 20; ++round) {
    Scene scene(pick(random, 1, 35), pick(random, 1, 6));
    for (int k = 0; k < 6; ++k) scene.add(random, round % 2 == 0 ? 8 : 10, 0, -1);
    const float blend = uniform(random, 0, 1);
    scene.predict(random, pick(random, 0, 2), 0, 1 - blend);
    scene.predict(random, pick(random, 3, 5), 1, blend);
    scene.finish();
    check_all_kernels(scene);
  }
}

TEST_CASE("a prediction alone is s times the irradiance of the normal") {
  Random random(7);
  Scene scene(9, 1);
  scene.add(random, 8, 0, -1).scale = 1.0f / 100;
  scene.samples[0].fill([] { return 228; });  // s = 1
  scene.weights[0] = {};
  scene.predict(random, 0);
  scene.finish();
  scene.job.run();
  for (std::size_t i = 0; i < 9; ++i) {
    std::array<double, 9> y{};
    evaluate_sh(2, glm::dvec3(scene.normals[0][i]), y);
    for (std::size_t c = 0; c < 3; ++c) {
      double expected = 0;
      for (std::size_t n = 0; n < 9; ++n) {
        expected += static_cast<double>(scene.job.light.irradiance[n][c]) * y[n];
      }
      // The bound: 18 roundings on terms that sum to less than 9 × 1.1.
      CHECK(std::abs(static_cast<double>(scene.out[c * 9 + i]) - expected) < 18 * 10 * 6e-8);
    }
  }
}

TEST_CASE("a light map wider than a tile has no seams") {
  Random random(8);
  for (int width : {1023, 1024, 1025, 2100}) {
    Scene scene(width, 3);
    for (int exponent_shift : {-1, 0, 4, 5}) scene.add(random, 8, 1, exponent_shift);
    scene.finish();
    check_all_kernels(scene);
  }
  Scene tall(1, 2050);
  for (int exponent_shift : {-1, 0, 4, 5}) tall.add(random, 10, 1, exponent_shift);
  tall.finish();
  check_all_kernels(tall);
}

TEST_CASE("the composite of a typical model is within 1e-5 of its peak") {
  Random random(9);
  Scene scene(128, 128);
  for (int n = 0; n < 16; ++n) {
    for (std::size_t c = 0; c < 3; ++c) {
      scene.add(random, 8, 0, 0).scale = 1.0f / 128;
      Rgb& weight = scene.weights.back();
      weight = {};
      weight[c] = uniform(random, -1, 1);
    }
  }
  scene.finish();
  const reference::Composite expected = reference::composite(scene.job);
  double peak = 0;
  for (double value : expected.value) peak = std::max(peak, std::abs(value));
  for (const CompositeKernel& kernel : composite_kernels()) {
    kernel.run(scene.job);
    double worst = 0;
    for (std::size_t i = 0; i < scene.out.size(); ++i) {
      worst = std::max(worst, std::abs(static_cast<double>(scene.out[i]) - expected.value[i]));
    }
    CAPTURE(kernel.name, worst / peak);
    CHECK(worst <= 1e-5 * peak);
  }
}

TEST_CASE("planes without weight are not read, and empty ones count as zero") {
  Random random(10);
  Scene scene(20, 4);
  scene.add(random, 8, 0, 0);
  scene.add(random, 8, 0, 0);
  scene.planes[0] = {};
  scene.weights[0] = {0, -0.0f, 0};
  scene.finish();
  check_all_kernels(scene);
  scene.weights[0] = {1, 1, 1};  // a layer that has not arrived
  CHECK_FALSE(scene.job.validate());
  check_all_kernels(scene);
}

TEST_CASE("no planes leave the constant, and rows may run upwards") {
  Random random(11);
  Scene constant(5, 2);
  constant.job.light.constant = {1, -2, 3};
  constant.finish();
  check_all_kernels(constant);
  CHECK(constant.out[0] == 1);
  CHECK(constant.out[19] == -2);
  CHECK(constant.out[29] == 3);

  Scene flipped(33, 7);
  SampleView& view = flipped.add(random, 10, 0, -1).mantissa;
  view.data += view.stride_bytes * (view.height - 1);
  view.stride_bytes = -view.stride_bytes;
  flipped.finish();
  check_all_kernels(flipped);
}

TEST_CASE("what overflows saturates to the same finite values in every kernel") {
  Random random(12);
  Scene scene(37, 3);
  for (int k = 0; k < 4; ++k) {
    scene.add(random, 10, 0, 0).scale = k % 2 == 0 ? 1e30f : -1e30f;
    scene.samples.back().fill([&] { return pick(random, 0, 3) == 0 ? 0 : 255; });
  }
  scene.finish();
  scene.job.run_scalar();
  const std::vector<float> scalar = scene.out;
  CHECK(std::all_of(scalar.begin(), scalar.end(), [](float v) { return std::isfinite(v); }));
  CHECK(std::count(scalar.begin(), scalar.end(), FLT_MAX) > 0);
  CHECK(std::count(scalar.begin(), scalar.end(), -FLT_MAX) > 0);
  for (const CompositeKernel& kernel : composite_kernels()) {
    CAPTURE(kernel.name);
    kernel.run(scene.job);
    CHECK(scene.out == scalar);
  }
}

TEST_CASE("jobs that would read or write elsewhere are refused") {
  Random random(13);
  Scene scene(16, 8);
  scene.add(random, 8, 1, 2);
  scene.add(random, 8, 0, -1);
  scene.finish();
  const auto refused = [&](auto change) {
    CompositeJob job = scene.job;
    std::vector<PlaneView> planes = scene.planes;
    std::vector<Rgb> weights = scene.weights;
    job.planes = planes;
    job.light.weights = weights;
    change(job, planes, weights);
    const Status status = job.validate();
    return !status && status.error().code == ErrorCode::kInvalid;
  };
  using Planes = std::vector<PlaneView>;
  using Weights = std::vector<Rgb>;
  CHECK(refused([](CompositeJob& j, Planes&, Weights&) { j.width = 0; }));
  CHECK(refused([](CompositeJob& j, Planes&, Weights&) { j.width = 17; }));
  CHECK(refused([](CompositeJob& j, Planes&, Weights&) { j.height = 1 << 30; }));
  CHECK(refused([](CompositeJob& j, Planes&, Weights&) { j.out = j.out.first(10); }));
  CHECK(refused([](CompositeJob& j, Planes&, Weights&) { j.planes = j.planes.first(1); }));
  CHECK(refused([](CompositeJob& j, Planes&, Weights&) { j.predictions[0].plane = 2; }));
  CHECK(refused([](CompositeJob& j, Planes&, Weights&) { j.predictions[1].plane = -2; }));
  CHECK(refused([](CompositeJob& j, Planes&, Weights&) { j.predictions[0].plane = 0; }));
  CHECK(refused([](CompositeJob& j, Planes&, Weights&) { j.light.constant[1] = NAN; }));
  CHECK(refused([](CompositeJob& j, Planes&, Weights&) { j.light.irradiance[8][1] = INFINITY; }));
  CHECK(refused([](CompositeJob&, Planes&, Weights& w) { w[0][2] = NAN; }));
  CHECK(refused([](CompositeJob&, Planes& p, Weights&) { p[0].scale = INFINITY; }));
  CHECK(refused([](CompositeJob&, Planes& p, Weights& w) { p[0].scale = 1e30f, w[0][0] = 1e30f; }));
  CHECK(refused([](CompositeJob&, Planes& p, Weights&) { p[0].mantissa.width = 7; }));
  CHECK(refused([](CompositeJob&, Planes& p, Weights&) { p[0].mantissa.height = 3; }));
  CHECK(refused([](CompositeJob&, Planes& p, Weights&) { p[0].mantissa_shift = 2; }));
  CHECK(refused([](CompositeJob&, Planes& p, Weights&) { p[0].mantissa_shift = 0; }));
  CHECK(refused([](CompositeJob&, Planes& p, Weights&) { p[0].mantissa.bytes_per_sample = 4; }));
  CHECK(refused([](CompositeJob&, Planes& p, Weights&) { p[0].mantissa.stride_bytes = 7; }));
  CHECK(refused([](CompositeJob&, Planes& p, Weights&) { p[0].mantissa.stride_bytes = -7; }));
  CHECK(refused([](CompositeJob&, Planes& p, Weights&) { p[0].mantissa_zero = -1; }));
  CHECK(refused([](CompositeJob&, Planes& p, Weights&) { p[0].exponent.width = 3; }));
  CHECK(refused([](CompositeJob&, Planes& p, Weights&) { p[0].exponent.bytes_per_sample = 2; }));
  CHECK(refused([](CompositeJob&, Planes& p, Weights&) { p[0].exponent_shift = 6; }));
  CHECK(refused([](CompositeJob&, Planes& p, Weights&) { p[0].exponent_shift = -1; }));
  CHECK(refused([](CompositeJob&, Planes& p, Weights&) { p[0].exponent_zero = 127; }));
  CHECK(refused([](CompositeJob&, Planes& p, Weights&) { p[0].exponent_zero = 151; }));
  CHECK_FALSE(refused([](CompositeJob&, Planes&, Weights&) {}));
}

TEST_CASE("a light folds into the matrix") {
  container::ModelRecord model;
  model.order = 1;
  model.mean = {{1, 2, 3}, {0, 0, 0}, {4, 0, 0}, {0, 0, 5}};
  std::vector<container::LayerRecord> layers(2);
  layers[0].planes = {plane_record({{0, 0, 2}, {0, 1, 3}, {2, 0, -1}}), plane_record({})};
  layers[1].planes = {plane_record({{3, 2, 0.5f}, {3, 2, 0.25f}})};
  Light light;
  light.sh = {{2, 4, 8}, {1, 1, 1}, {-16, 3, 5}, {6, 7, 8}};
  FoldedWeights folded;
  REQUIRE(fold_light(model, layers, light, folded));
  CHECK(folded.view.magnitude == 16);
  CHECK(folded.view.weights.data() == folded.weights.data());
  CHECK(folded.weights ==
        std::vector<Rgb>{{(4 + 16) / 16.0f, 12 / 16.0f, 0}, {}, {0, 0, 6 / 16.0f}});
  CHECK(folded.view.constant == Rgb{(2 - 64) / 16.0f, 8 / 16.0f, (24 + 40) / 16.0f});
  CHECK(folded.view.irradiance[0] == Rgb{2 / 16.0f, 4 / 16.0f, 8 / 16.0f});
  CHECK(folded.view.irradiance[2][0] == Approx(-2.0 / 3));
  CHECK(folded.view.irradiance[4] == Rgb{});
  CHECK(folded.view.prediction_plane == -1);
}

TEST_CASE("coefficients that the light or the model lacks count as zero") {
  container::ModelRecord model;
  model.order = 2;
  model.mean.assign(9, {1, 1, 1});
  std::vector<container::LayerRecord> layers(1);
  layers[0].planes = {plane_record({{0, 0, 1}, {8, 0, 100}})};
  Light light;
  light.sh = {{2, 2, 2}};
  FoldedWeights folded;
  REQUIRE(fold_light(model, layers, light, folded));
  CHECK(folded.weights[0] == Rgb{1, 0, 0});
  CHECK(folded.view.constant == Rgb{1, 1, 1});

  light.sh.assign(16, {1, 1, 1});
  light.sh[15] = {0, -4, 0};  // beyond the model, but the largest of the light
  REQUIRE(fold_light(model, layers, light, folded));
  CHECK(folded.view.magnitude == 4);
  CHECK(folded.weights[0] == Rgb{101 / 4.0f, 0, 0});
  CHECK(folded.view.constant == Rgb{9 / 4.0f, 9 / 4.0f, 9 / 4.0f});
}

TEST_CASE("lights of any finite magnitude fold to the same weights") {
  container::ModelRecord model;
  std::vector<container::LayerRecord> layers(1);
  layers[0].planes = {plane_record({{0, 0, 1}, {1, 1, 0.5f}})};
  Random random(14);
  Light light;
  light.sh.resize(9);
  for (auto& row : light.sh) {
    for (double& value : row) value = static_cast<double>(uniform(random, -1, 1));
  }
  FoldedWeights expected;
  REQUIRE(fold_light(model, layers, light, expected));
  for (int power : {-120, -40, 100, 126}) {
    Light scaled = light;
    for (auto& row : scaled.sh) {
      for (double& value : row) value = std::ldexp(value, power);
    }
    FoldedWeights folded;
    REQUIRE(fold_light(model, layers, scaled, folded));
    CHECK(folded.weights == expected.weights);
    CHECK(folded.view.magnitude == std::ldexp(expected.view.magnitude, power));
  }
}

TEST_CASE("a black light has magnitude 1 and no weights") {
  container::ModelRecord model;
  model.mean.assign(9, {1, 1, 1});
  std::vector<container::LayerRecord> layers(1);
  layers[0].planes = {plane_record({{0, 0, 1}})};
  Light light;
  for (double value : {0.0, 1e-300, 1e-39}) {
    light.sh.assign(9, {value, -value, 0});
    FoldedWeights folded;
    REQUIRE(fold_light(model, layers, light, folded));
    CHECK(folded.view.magnitude == 1);
    CHECK(folded.weights[0] == Rgb{});
    CHECK(folded.view.constant == Rgb{});
  }
}

TEST_CASE("lights and matrices that make no sense do not fold") {
  container::ModelRecord model;
  std::vector<container::LayerRecord> layers(1);
  layers[0].planes = {plane_record({{0, 0, 1}})};
  Light light;
  light.sh.assign(9, {1, 1, 1});
  FoldedWeights folded;
  REQUIRE(fold_light(model, layers, light, folded));
  const auto refused = [&] {
    const Status status = fold_light(model, layers, light, folded);
    return !status && status.error().code == ErrorCode::kInvalid;
  };
  for (double value : {std::nan(""), HUGE_VAL, -HUGE_VAL, 1e39}) {
    light.sh[4][1] = value;
    CHECK(refused());
  }
  light.sh.assign(5, {1, 1, 1});
  CHECK(refused());
  light.sh.assign(9, {1, 1, 1});
  layers[0].planes[0].matrix[0].coefficient = 9;
  CHECK(refused());
  layers[0].planes[0].matrix[0] = {0, 3, 1};
  CHECK(refused());
  layers[0].planes[0].matrix = {{0, 0, FLT_MAX}, {1, 0, FLT_MAX}};
  CHECK(refused());
  layers[0].planes[0].matrix = {};
  model.prediction_plane = 1;
  CHECK(refused());
  model.prediction_plane = 0;
  CHECK_FALSE(refused());
}

}  // namespace relit::decoders
