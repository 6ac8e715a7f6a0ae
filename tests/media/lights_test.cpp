// SPDX-License-Identifier: MIT
#include "media/lights.hpp"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "media/exact_math.hpp"
#include "tests/test.hpp"

namespace {

using namespace relit::media;

std::filesystem::path source_folder() {
  const char* folder = std::getenv("RELIT_SOURCE_DIR");
  return folder != nullptr ? folder : ".";
}

}  // namespace

TEST_CASE("regenerated lights are the shipped bytes") {
  for (const Panorama& panorama : make_panoramas()) {
    const auto path = source_folder() / "media" / "lights" / (panorama.name + ".hdr");
    CAPTURE(path.string());
    std::ifstream file(path, std::ios::binary);
    REQUIRE(file);
    const std::vector<std::uint8_t> shipped{std::istreambuf_iterator<char>(file),
                                            std::istreambuf_iterator<char>()};
    CHECK(shipped.size() <= 60'000);
    CHECK(shipped == write_hdr(panorama));
  }
}

TEST_CASE("lights stay nearly positive in spherical harmonics of order 2") {
  // Y of bands 0 to 2; their sums over the picture, then the sums' own picture again.
  const auto basis = [](const glm::dvec3& d) {
    return std::array<double, 9>{0.282095,
                                 0.488603 * d.y,
                                 0.488603 * d.z,
                                 0.488603 * d.x,
                                 1.092548 * d.x * d.y,
                                 1.092548 * d.y * d.z,
                                 0.315392 * (3.0 * d.z * d.z - 1.0),
                                 1.092548 * d.x * d.z,
                                 0.546274 * (d.x * d.x - d.y * d.y)};
  };
  for (const Panorama& panorama : make_panoramas()) {
    std::array<glm::dvec3, 9> light{};
    std::vector<glm::dvec3> directions;
    for (int y = 0; y < panorama.height; ++y) {
      const double theta = kPi * (y + 0.5) / panorama.height;
      const double area = std::sin(theta) * kPi / panorama.height * kTau / panorama.width;
      for (int x = 0; x < panorama.width; ++x) {
        const double phi = kTau * (x + 0.5) / panorama.width;
        const glm::dvec3 d(std::sin(theta) * std::cos(phi), std::cos(theta),
                           std::sin(theta) * std::sin(phi));
        directions.push_back(d);
        const glm::dvec3& radiance =
            panorama.pixels[static_cast<std::size_t>(y * panorama.width + x)];
        REQUIRE((radiance.x >= 0.0 && radiance.y >= 0.0 && radiance.z >= 0.0));
        REQUIRE(std::isfinite(radiance.x + radiance.y + radiance.z));
        const auto b = basis(d);
        for (std::size_t n = 0; n < 9; ++n) light[n] += radiance * b[n] * area;
      }
    }
    const double mean = (light[0].x + light[0].y + light[0].z) / 3.0 / std::sqrt(4.0 * kPi);
    double lowest = 0.0;
    for (const glm::dvec3& d : directions) {
      const auto b = basis(d);
      glm::dvec3 sum(0.0);
      for (std::size_t n = 0; n < 9; ++n) sum += light[n] * b[n];
      lowest = std::min(lowest, (sum.x + sum.y + sum.z) / 3.0);
    }
    CAPTURE(panorama.name, mean, lowest);
    CHECK(mean > 0.2);
    CHECK(mean < 1.0);
    // A point light of the same energy would reach -1.8 times the mean.
    CHECK(lowest > -0.6 * mean);
  }
}

TEST_CASE("exact functions agree with the C library") {
  for (int k = -2000; k <= 2000; ++k) {
    const double x = 0.0137 * k;
    CHECK(std::abs(exact_sin(x) - std::sin(x)) < 1e-14);
    CHECK(std::abs(exact_cos(x) - std::cos(x)) < 1e-14);
    CHECK(std::abs(exact_exp(x) / std::exp(x) - 1.0) < 1e-14);
    const double y = std::exp(x);
    CHECK(std::abs(exact_log(y) - x) < 1e-14 * std::max(1.0, std::abs(x)));
  }
  CHECK(exact_pow(0.0, 0.5) == 0.0);
  CHECK(exact_pow(2.0, 0.5) == Approx(std::sqrt(2.0)).epsilon(1e-14));
}
