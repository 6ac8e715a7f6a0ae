// SPDX-License-Identifier: MIT
#include "gles/environment.hpp"

#include <cmath>
#include <vector>

#include "tests/test.hpp"

using namespace relit::gles;

namespace {

/// All faces of a cube map, one after another.
std::vector<float> faces_of(const CubeMap& cube) {
  const auto face_size =
      3 * static_cast<std::size_t>(cube.side) * static_cast<std::size_t>(cube.side);
  std::vector<float> rgb(6 * face_size);
  for (int face = 0; face < 6; ++face)
    cube.write(face, std::span(rgb).subspan(face_size * static_cast<std::size_t>(face), face_size));
  return rgb;
}

}  // namespace

TEST_CASE("cube maps share their edges", "[gles]") {
  // The right column of +X is the left column of -Z, and so on around; the top of +Z is the bottom
  // row of +Y.
  constexpr int kSide = 5, kLast = kSide - 1;
  for (int i = 0; i < kSide; ++i) {
    CHECK(glm::distance(cube_direction(0, kLast, i, kSide), cube_direction(5, 0, i, kSide)) <
          1e-6f);
    CHECK(glm::distance(cube_direction(4, kLast, i, kSide), cube_direction(0, 0, i, kSide)) <
          1e-6f);
    CHECK(glm::distance(cube_direction(4, i, 0, kSide), cube_direction(2, i, kLast, kSide)) <
          1e-6f);
  }
}

TEST_CASE("a constant environment stays constant under blur", "[gles]") {
  const std::vector<float> rgb(3 * 32 * 16, 2.5f);
  for (const float blur : {0.0f, 0.1f, 0.5f, 3.0f}) {
    const CubeMap cube = make_cube_map(EnvironmentView{32, 16, rgb}, blur, 16);
    REQUIRE(cube.side == 8);
    // Sums of kernels of up to some hundred floats.
    for (const float value : faces_of(cube)) CHECK(value * cube.scale == Approx(2.5).epsilon(1e-4));
  }
}

TEST_CASE("blur spreads a source evenly and keeps its power", "[gles]") {
  // One bright pixel on the horizon, and one beside the pole.
  for (const int row : {32, 3}) {
    std::vector<float> rgb(3 * 128 * 64, 0.0f);
    for (std::size_t c = 0; c < 3; ++c)
      rgb[static_cast<std::size_t>(3 * (row * 128 + 20)) + c] = 1000;
    auto power = [](const CubeMap& cube) {
      const std::vector<float> faces = faces_of(cube);
      double sum = 0, solid_angle = 0;
      for (int face = 0; face < 6; ++face)
        for (int y = 0; y < cube.side; ++y)
          for (int x = 0; x < cube.side; ++x) {
            const double s = 2.0 * x / (cube.side - 1) - 1, t = 2.0 * y / (cube.side - 1) - 1;
            double area = std::pow(1 + s * s + t * t, -1.5);
            if (x == 0 || x == cube.side - 1) area *= 0.5;
            if (y == 0 || y == cube.side - 1) area *= 0.5;
            const int i = 3 * ((face * cube.side + y) * cube.side + x);
            sum += area * faces[static_cast<std::size_t>(i)] * cube.scale;
            solid_angle += area;
          }
      return sum / solid_angle * 4 * 3.14159265;
    };
    const CubeMap blurred = make_cube_map(EnvironmentView{128, 64, rgb}, 0.2f, 64);
    const double expected =
        1000 * (2 * 3.14159265 / 128) *
        (std::cos(3.14159265 * row / 64) - std::cos(3.14159265 * (row + 1) / 64));
    // The kernel is normalised over pixels of half a deviation (0.1 rad), which sample its integral
    // to far better than a percent; the cut at three deviations moves 1.1 % and comes and goes by
    // pixels.
    CHECK(power(blurred) == Approx(expected).epsilon(0.05));
    float most = 0;
    for (const float value : faces_of(blurred)) most = std::max(most, value * blurred.scale);
    // A Gaussian of 0.2 rad peaks at power / (2π·0.04). The nearest sample may be 0.07 rad away (6
    // %), and linear interpolation between samples 0.1 rad apart loses 0.1²/(8·0.04) on each axis
    // (6 %).
    CHECK(most == Approx(expected / (2 * 3.14159265 * 0.04)).epsilon(0.12));
  }
}

TEST_CASE("environments lose what is not finite or negative", "[gles]") {
  std::vector<float> rgb(3 * 8 * 4, 1.0f);
  rgb[5] = NAN;
  rgb[17] = INFINITY;
  rgb[30] = -4;
  const CubeMap cube = make_cube_map(EnvironmentView{8, 4, rgb}, 0.3f, 8);
  for (const float value : faces_of(cube)) {
    CHECK(std::isfinite(value));
    CHECK(value >= 0);
  }
}

TEST_CASE("harmonics of all four bands are orthonormal over the cube", "[gles]") {
  // The mean square of 1 + Y_n over the sphere, times 4π, less 4π, is 1: every Y_n has norm 1 and,
  // from band 1 on, mean 0. The offset of 2 keeps values positive.
  for (std::size_t n = 1; n < 16; ++n) {
    std::vector<std::array<float, 3>> sh(16);
    sh[0] = {2 * 3.5449077f, 0, 0};
    sh[n][0] = 1;
    const CubeMap cube = make_cube_map(sh, 48);
    const std::vector<float> faces = faces_of(cube);
    double mean = 0, square = 0, total = 0;
    for (int face = 0; face < 6; ++face)
      for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 48; ++x) {
          const double s = 2.0 * x / 47 - 1, t = 2.0 * y / 47 - 1;
          double area = std::pow(1 + s * s + t * t, -1.5);
          if (x == 0 || x == 47) area *= 0.5;
          if (y == 0 || y == 47) area *= 0.5;
          const double v =
              faces[static_cast<std::size_t>(3 * ((face * 48 + y) * 48 + x))] * cube.scale - 2;
          mean += area * v;
          square += area * v * v;
          total += area;
        }
    INFO("n = " << n);
    // The trapezoid rule on 47² squares: a relative error of about (2/47)².
    CHECK(square / total * 4 * 3.14159265 == Approx(1).epsilon(5e-3));
    CHECK(std::abs(mean / total) < 2e-3);
  }
}
