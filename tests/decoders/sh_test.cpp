// SPDX-License-Identifier: MIT
#include "decoders/sh.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "tests/test.hpp"

namespace relit::decoders {
namespace {

constexpr double kPi = std::numbers::pi;

/// The sphere by the midpoint rule in φ (exact for waves below `columns`) and in z = cos of the
/// angle to +z, `rows` midpoints each; `f(direction, solid angle)`.
template <class F>
void for_sphere(int rows, int columns, F f) {
  for (int i = 0; i < rows; ++i) {
    const double z = (2.0 * i + 1) / rows - 1;
    const double r = std::sqrt(1 - z * z);
    for (int j = 0; j < columns; ++j) {
      const double phi = 2 * kPi * (j + 0.5) / columns;
      f(glm::dvec3(r * std::cos(phi), r * std::sin(phi), z), 4 * kPi / (rows * columns));
    }
  }
}

glm::dvec3 random_direction(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
}

Light random_light(int order, std::mt19937& random) {
  std::normal_distribution<double> normal;
  Light light;
  light.sh.resize(static_cast<std::size_t>(coefficient_count(order)));
  for (auto& row : light.sh) row = {normal(random), normal(random), normal(random)};
  return light;
}

Environment random_environment(int width, int height, std::mt19937& random) {
  std::uniform_real_distribution<float> uniform(0, 1);
  Environment environment{width, height, {}};
  environment.rgb.resize(static_cast<std::size_t>(3 * width * height));
  for (float& value : environment.rgb) value = uniform(random);
  return environment;
}

Environment constant_environment(int width, int height, float value) {
  return {width, height, std::vector<float>(static_cast<std::size_t>(3 * width * height), value)};
}

double largest_difference(const Light& a, const Light& b) {
  REQUIRE(a.sh.size() == b.sh.size());
  double largest = 0;
  for (std::size_t n = 0; n < a.sh.size(); ++n) {
    for (std::size_t c = 0; c < 3; ++c) {
      largest = std::max(largest, std::abs(a.sh[n][c] - b.sh[n][c]));
    }
  }
  return largest;
}

/// A pixel's integral of Y_n by brute force: `steps`² midpoints of its box.
double pixel_integral(int n, int x, int y, int width, int height, int steps) {
  double sum = 0;
  std::array<double, 16> values{};
  for (int i = 0; i < steps; ++i) {
    for (int j = 0; j < steps; ++j) {
      const double theta = kPi * (y + (i + 0.5) / steps) / height;
      const double phi = 2 * kPi * (x + (j + 0.5) / steps) / width;
      evaluate_sh(3,
                  glm::dvec3(std::sin(theta) * std::cos(phi), std::cos(theta),
                             std::sin(theta) * std::sin(phi)),
                  values);
      sum += values[static_cast<std::size_t>(n)] * std::sin(theta);
    }
  }
  return sum * kPi / (height * steps) * 2 * kPi / (width * steps);
}

}  // namespace

TEST_CASE("each harmonic is the polynomial of its name, without the Condon-Shortley sign") {
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    const glm::dvec3 d = random_direction(random);
    const double x = d.x, y = d.y, z = d.z;
    std::array<double, 16> v{};
    evaluate_sh(3, d, v);
    // Written from the definition K_lm P_lm(z) cos/sin(mφ), not from the code's constants.
    const std::array<double, 16> expected{
        0.5 / std::sqrt(kPi),
        std::sqrt(3 / (4 * kPi)) * y,
        std::sqrt(3 / (4 * kPi)) * z,
        std::sqrt(3 / (4 * kPi)) * x,
        0.5 * std::sqrt(15 / kPi) * x * y,
        0.5 * std::sqrt(15 / kPi) * y * z,
        0.25 * std::sqrt(5 / kPi) * (2 * z * z - x * x - y * y),
        0.5 * std::sqrt(15 / kPi) * z * x,
        0.25 * std::sqrt(15 / kPi) * (x * x - y * y),
        0.25 * std::sqrt(35 / (2 * kPi)) * y * (3 * x * x - y * y),
        0.5 * std::sqrt(105 / kPi) * x * y * z,
        0.25 * std::sqrt(21 / (2 * kPi)) * y * (4 * z * z - x * x - y * y),
        0.25 * std::sqrt(7 / kPi) * z * (2 * z * z - 3 * x * x - 3 * y * y),
        0.25 * std::sqrt(21 / (2 * kPi)) * x * (4 * z * z - x * x - y * y),
        0.25 * std::sqrt(105 / kPi) * z * (x * x - y * y),
        0.25 * std::sqrt(35 / (2 * kPi)) * x * (x * x - 3 * y * y)};
    std::array<float, 16> single{};
    evaluate_sh(3, glm::vec3(d), single);
    for (std::size_t n = 0; n < 16; ++n) {
      CAPTURE(n);
      // Few operations on values below 3: 1e-14 in double. In single the direction itself is off by
      // 2^-25 a component and |∇Y| < 7, so below 1e-6.
      CHECK(std::abs(v[n] - expected[n]) < 1e-14);
      CHECK(std::abs(static_cast<double>(single[n]) - expected[n]) < 2e-6);
    }
  }
}

TEST_CASE("lower orders write only their own coefficients") {
  for (int order = 0; order <= 3; ++order) {
    std::array<double, 16> y;
    y.fill(77);
    evaluate_sh(order, glm::dvec3(0.6, 0.0, 0.8), y);
    for (int n = 0; n < 16; ++n) {
      CHECK((y[static_cast<std::size_t>(n)] == 77) == (n >= coefficient_count(order)));
    }
  }
}

TEST_CASE("the harmonics are orthonormal") {
  std::array<std::array<double, 16>, 16> gram{};
  for_sphere(2000, 16, [&](const glm::dvec3& d, double solid_angle) {
    std::array<double, 16> y{};
    evaluate_sh(3, d, y);
    for (std::size_t a = 0; a < 16; ++a) {
      for (std::size_t b = 0; b < 16; ++b) gram[a][b] += y[a] * y[b] * solid_angle;
    }
  });
  for (std::size_t a = 0; a < 16; ++a) {
    for (std::size_t b = 0; b < 16; ++b) {
      // Midpoints of a polynomial f of z: error h²/24·|f'(1)−f'(−1)|·2π, h = 1e-3, |f'| < 50.
      CHECK(std::abs(gram[a][b] - (a == b ? 1 : 0)) < 5e-5);
    }
  }
}

TEST_CASE("the clamped cosine convolves to A_l times the harmonic of the normal") {
  std::mt19937 random(2);
  const std::array<double, 4> named{kPi, 2 * kPi / 3, kPi / 4, 0};
  for (int i = 0; i < 3; ++i) {
    const glm::dvec3 normal = random_direction(random);
    std::array<double, 16> integral{};
    for_sphere(600, 600, [&](const glm::dvec3& d, double solid_angle) {
      std::array<double, 16> y{};
      evaluate_sh(3, d, y);
      const double cosine = std::max(0.0, glm::dot(normal, d));
      for (std::size_t n = 0; n < 16; ++n) integral[n] += cosine * y[n] * solid_angle;
    });
    std::array<double, 16> y{};
    evaluate_sh(3, normal, y);
    for (int n = 0; n < 16; ++n) {
      const auto k = static_cast<std::size_t>(n);
      const int band = band_of(n);
      CHECK(clamped_cosine(band) == named[static_cast<std::size_t>(band)]);
      // Steps of 1/300 in z with a kink: h² × |∇| × area ≈ 1e-5 × 7 × 2.
      CHECK(std::abs(integral[k] - clamped_cosine(band) * y[k]) < 3e-4);
    }
  }
  CHECK(clamped_cosine(4) == 0);
  CHECK(clamped_cosine(-1) == 0);
}

TEST_CASE("a constant picture of any size is the constant alone") {
  for (const auto& [width, height] :
       {std::pair{1, 1}, {2, 1}, {1, 2}, {3, 5}, {64, 32}, {512, 7}}) {
    CAPTURE(width, height);
    const auto light = project_environment(constant_environment(width, height, 1), 3);
    REQUIRE(light);
    CHECK(light->order() == 3);
    for (std::size_t n = 0; n < 16; ++n) {
      for (double value : light->sh[n]) {
        CHECK(std::abs(value - (n == 0 ? std::sqrt(4 * kPi) : 0)) < 1e-12);
      }
    }
  }
}

TEST_CASE("each pixel counts with the integral of each harmonic over its box") {
  const int width = 6, height = 4;
  for (const auto& [x, y] : {std::pair{0, 0}, {4, 0}, {1, 1}, {5, 2}, {2, 3}}) {
    Environment environment = constant_environment(width, height, 0);
    environment.rgb[static_cast<std::size_t>(3 * (y * width + x) + 1)] = 2;
    const auto light = project_environment(environment, 3);
    REQUIRE(light);
    for (int n = 0; n < 16; ++n) {
      CAPTURE(x, y, n);
      const auto& row = light->sh[static_cast<std::size_t>(n)];
      CHECK(row[0] == 0);
      CHECK(row[2] == 0);
      // Midpoints in boxes of 1 rad: h² / 24 × |f''| ≲ (1/200)² / 24 × 20.
      CHECK(std::abs(row[1] - 2 * pixel_integral(n, x, y, width, height, 200)) < 5e-5);
    }
  }
}

TEST_CASE("lower orders are the head of higher ones") {
  std::mt19937 random(3);
  const Environment environment = random_environment(12, 6, random);
  const auto full = project_environment(environment, 3);
  REQUIRE(full);
  for (int order = 0; order < 3; ++order) {
    const auto light = project_environment(environment, order);
    REQUIRE(light);
    REQUIRE(light->order() == order);
    CHECK(std::equal(light->sh.begin(), light->sh.end(), full->sh.begin()));
  }
}

TEST_CASE("the top row shines from +Y and the first column from +X towards +Z") {
  Environment environment = constant_environment(4, 2, 0);
  environment.rgb[0] = 1;  // θ in [0, π/2], φ in [0, π/2]: the octant x, y, z > 0
  auto light = project_environment(environment, 1);
  REQUIRE(light);
  const double octant = 0.48860251190291992 * kPi / 4;  // ∫ x over the octant is π/4
  for (std::size_t n = 1; n < 4; ++n) CHECK(std::abs(light->sh[n][0] - octant) < 1e-12);
  environment.rgb[0] = 0;
  environment.rgb[3 * 5] = 1;  // bottom row, second column: x < 0, y < 0, z > 0
  light = project_environment(environment, 1);
  REQUIRE(light);
  CHECK(std::abs(light->sh[1][0] + octant) < 1e-12);
  CHECK(std::abs(light->sh[2][0] - octant) < 1e-12);
  CHECK(std::abs(light->sh[3][0] + octant) < 1e-12);
}

TEST_CASE("turning the light is turning the picture") {
  std::mt19937 random(4);
  const int width = 24, height = 10;
  const Environment environment = random_environment(width, height, random);
  for (int shift = 0; shift < width; shift += 5) {
    Environment shifted = environment;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        for (int c = 0; c < 3; ++c) {
          shifted.rgb[static_cast<std::size_t>(3 * (y * width + (x + shift) % width) + c)] =
              environment.rgb[static_cast<std::size_t>(3 * (y * width + x) + c)];
        }
      }
    }
    for (int order = 0; order <= 3; ++order) {
      auto turned = project_environment(environment, order);
      const auto expected = project_environment(shifted, order);
      REQUIRE(turned);
      REQUIRE(expected);
      rotate_light_y(*turned, 2 * kPi * shift / width);
      CHECK(largest_difference(*turned, *expected) < 1e-12);
    }
  }
}

TEST_CASE("a turned light shines from turned directions") {
  std::mt19937 random(5);
  const Light light = random_light(3, random);
  for (int i = 0; i < 50; ++i) {
    const double angle = std::uniform_real_distribution<double>(-10, 10)(random);
    Light turned = light;
    rotate_light_y(turned, angle);
    const glm::dvec3 d = random_direction(random);
    // φ runs from +X to +Z, so adding `angle` to it takes (x, z) to this:
    const glm::dvec3 to(d.x * std::cos(angle) - d.z * std::sin(angle), d.y,
                        d.x * std::sin(angle) + d.z * std::cos(angle));
    const auto expected = radiance(light, d);
    const auto actual = radiance(turned, to);
    for (std::size_t c = 0; c < 3; ++c) CHECK(std::abs(actual[c] - expected[c]) < 1e-12);
  }
}

TEST_CASE("360 turns of a degree give the light back") {
  std::mt19937 random(6);
  const Light light = random_light(3, random);
  Light turned = light;
  for (int i = 0; i < 360; ++i) rotate_light_y(turned, kPi / 180);
  CHECK(largest_difference(turned, light) < 1e-12);
}

TEST_CASE("exchanging y and z twice changes nothing, once it mirrors the light") {
  std::mt19937 random(7);
  for (int order = 0; order <= 3; ++order) {
    const Light light = random_light(order, random);
    Light mirrored = light;
    exchange_y_and_z(mirrored);
    for (int i = 0; i < 20; ++i) {
      const glm::dvec3 d = random_direction(random);
      const auto a = radiance(light, d);
      const auto b = radiance(mirrored, {d.x, d.z, d.y});
      for (std::size_t c = 0; c < 3; ++c) CHECK(std::abs(a[c] - b[c]) < 1e-12);
    }
    exchange_y_and_z(mirrored);
    CHECK(largest_difference(mirrored, light) < 1e-14);
  }
}

TEST_CASE("the window is Hann's over five bands, whatever the order") {
  for (int order = 0; order <= 3; ++order) {
    Light light;
    light.sh.assign(static_cast<std::size_t>(coefficient_count(order)), {1, 2, 3});
    window_light(light);
    for (int n = 0; n < coefficient_count(order); ++n) {
      const double window = (1 + std::cos(kPi * band_of(n) / 5)) / 2;
      const auto& row = light.sh[static_cast<std::size_t>(n)];
      CHECK(row[0] == Approx(window).margin(1e-15));
      CHECK(row[2] == Approx(3 * window).margin(1e-15));
    }
  }
}

TEST_CASE("the least radiance of known lights is found") {
  Light light;
  light.sh.assign(1, {3, 0, -2});
  auto least = minimum_radiance(light);
  CHECK(least[0] == Approx(3 * 0.28209479177387814));
  CHECK(least[1] == 0);
  CHECK(least[2] == Approx(-2 * 0.28209479177387814));

  // 1 + cos of the angle to an axis between the samples, in each channel another axis: least 0.
  std::mt19937 random(8);
  light.sh.assign(4, {});
  for (std::size_t c = 0; c < 3; ++c) {
    const glm::dvec3 axis = c == 0 ? glm::dvec3(0, 1, 0) : random_direction(random);
    std::array<double, 4> y{};
    evaluate_sh(1, axis, y);
    light.sh[0][c] = 1 / y[0];
    for (std::size_t n = 1; n < 4; ++n) light.sh[n][c] = y[n] * 4 * kPi / 3;
  }
  least = minimum_radiance(light);
  for (double value : least) CHECK(std::abs(value) < 1e-12);

  // (5z³ − 3z)/2 has its least value −1 at z = −1, and of the inner valleys −1/√5 at z = 1/√5;
  // about +Y instead of +z it is the same all around the picture.
  light.sh.assign(16, {});
  light.sh[12][0] = std::sqrt(4 * kPi / 7);
  exchange_y_and_z(light);
  CHECK(minimum_radiance(light)[0] == Approx(-1).margin(1e-12));
}

TEST_CASE("no direction is darker than the least radiance") {
  std::mt19937 random(9);
  for (int i = 0; i < 4; ++i) {
    const Light light = random_light(3, random);
    const auto least = minimum_radiance(light);
    std::array<double, 3> sampled{1e9, 1e9, 1e9};
    for_sphere(200, 200, [&](const glm::dvec3& d, double) {
      const auto value = radiance(light, d);
      for (std::size_t c = 0; c < 3; ++c) sampled[c] = std::min(sampled[c], value[c]);
    });
    for (std::size_t c = 0; c < 3; ++c) {
      CHECK(least[c] <= sampled[c] + 1e-12);
      CHECK(least[c] >
            sampled[c] - 0.05);  // the samples are 0.02 rad apart, the curvature below 100
    }
  }
}

TEST_CASE("a sun in a dim sky keeps the sky") {
  const int width = 64, height = 32;
  Environment environment = constant_environment(width, height, 1e-3f);
  const auto sky = project_environment(environment, 3);
  const std::size_t sun_pixel = 3 * (5 * width + 9);
  for (std::size_t c = 0; c < 3; ++c) environment.rgb[sun_pixel + c] = 1e9f;
  const auto both = project_environment(environment, 3);
  Environment sun_only = constant_environment(width, height, 0);
  for (std::size_t c = 0; c < 3; ++c) sun_only.rgb[sun_pixel + c] = 1e9f;
  const auto sun = project_environment(sun_only, 3);
  REQUIRE(sky);
  REQUIRE(both);
  REQUIRE(sun);
  const double solid_angle =
      2 * kPi / width * (std::cos(kPi * 5 / height) - std::cos(kPi * 6 / height));
  CHECK(sun->sh[0][0] == Approx(1e9 * solid_angle * 0.28209479177387814).epsilon(1e-12));
  for (std::size_t n = 0; n < 16; ++n) {
    // The sun's pixel replaces 1e-3 × its solid angle; a double of 1e7 resolves 2e-9.
    const double share = 1 - 1e-3 / 1e9;
    const double expected = sky->sh[n][0] + static_cast<double>(sun->sh[n][0]) * share;
    CHECK(std::abs(both->sh[n][0] - expected) < 1e-8);
  }
}

TEST_CASE("pixels at the ends of float are projected, those beyond are refused by place") {
  const float huge = std::numeric_limits<float>::max();
  const float tiny = std::numeric_limits<float>::denorm_min();
  for (float value : {huge, tiny}) {
    const auto light = project_environment(constant_environment(8, 4, value), 3);
    REQUIRE(light);
    CHECK(light->sh[0][1] ==
          Approx(static_cast<double>(value) * std::sqrt(4 * kPi)).epsilon(1e-12));
    for (std::size_t n = 1; n < 16; ++n) {
      CHECK(std::abs(light->sh[n][1]) <= 1e-12 * static_cast<double>(value));
    }
  }
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  for (float value : {nan, infinity, -infinity, -1e-30f}) {
    Environment environment = constant_environment(8, 4, 1);
    environment.rgb[3 * (2 * 8 + 5) + 1] = value;
    const auto light = project_environment(environment, 2);
    REQUIRE_FALSE(light);
    CHECK(light.error().code == ErrorCode::kInvalid);
    CHECK(light.error().message.find("(5, 2)") != std::string::npos);
    CHECK(light.error().message.find("green") != std::string::npos);
  }
  Environment negative_zero = constant_environment(2, 1, -0.0f);
  CHECK(project_environment(negative_zero, 0));
}

TEST_CASE("pictures and orders that make no sense are refused") {
  CHECK_FALSE(project_environment({}, 2));
  CHECK_FALSE(project_environment({-1, 2, std::vector<float>(6)}, 2));
  CHECK_FALSE(project_environment({2, 2, std::vector<float>(11)}, 2));
  CHECK_FALSE(project_environment(constant_environment(2, 1, 1), 4));
  CHECK_FALSE(project_environment(constant_environment(2, 1, 1), -1));
  const auto large = project_environment({1 << 20, 1 << 20, {}}, 2);
  REQUIRE_FALSE(large);
  CHECK(large.error().code == ErrorCode::kLimit);
}

TEST_CASE("a light without a proper number of rows has no order") {
  Light light;
  CHECK(light.order() == -1);
  light.sh.resize(5);
  CHECK(light.order() == -1);
  rotate_light_y(light, 1);  // nothing to turn, nothing to read
  light.sh.resize(9);
  CHECK(light.order() == 2);
}

}  // namespace relit::decoders
