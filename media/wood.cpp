// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "media/exact_math.hpp"
#include "media/figure.hpp"

#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
#include <stb_image_write.h>
#pragma GCC diagnostic pop

namespace relit::media {
namespace {

constexpr int kSize = 512;

double lattice(std::uint32_t x, std::uint32_t y, std::uint32_t seed) {
  std::uint32_t h = x * 0x9E3779B1u ^ y * 0x85EBCA77u ^ seed * 0xC2B2AE3Du;
  h = (h ^ h >> 15) * 0x2C1B3C6Du;
  h = (h ^ h >> 12) * 0x297A2D39u;
  return static_cast<double>((h ^ h >> 15) & 0xffffffu) / 16777215.0;
}

// Value noise of -1..1 that repeats after (nx, ny) cells.
double noise(double u, double v, std::uint32_t nx, std::uint32_t ny, std::uint32_t seed) {
  const double x = u * nx, y = v * ny;
  const double fx = std::floor(x), fy = std::floor(y);
  const double tx = smooth_step(0.0, 1.0, x - fx), ty = smooth_step(0.0, 1.0, y - fy);
  const auto at = [&](std::uint32_t dx, std::uint32_t dy) {
    return lattice((static_cast<std::uint32_t>(fx) + dx) % nx,
                   (static_cast<std::uint32_t>(fy) + dy) % ny, seed);
  };
  const double low = at(0, 0) + tx * (at(1, 0) - at(0, 0)),
               high = at(0, 1) + tx * (at(1, 1) - at(0, 1));
  return 2.0 * (low + ty * (high - low)) - 1.0;
}

// How far the wood of one year is into its late, dark growth: 0..1. The years are of uneven width
// and depth.
double late_wood(double u, double v) {
  constexpr std::uint32_t kYears = 17;
  const double bent = u + 0.016 * noise(u, v, 3, 2, 1) + 0.006 * noise(u, v, 7, 5, 2) +
                      0.0012 * noise(u, v, 24, 16, 3);
  const double year = bent * kYears + 0.85 * noise(bent + 1.0, 0.5, 6, 1, 4) + 2.0 * kYears;
  const double phase = year - std::floor(year);
  const double depth =
      0.30 + 0.70 * lattice(static_cast<std::uint32_t>(std::floor(year)) % kYears, 7u, 4u);
  return depth * (smooth_step(0.15, 0.88, phase) - smooth_step(0.90, 1.0, phase));
}

std::array<double, 3> wood_colour(double u, double v) {
  const double late = late_wood(u, v);
  const double fibre = 0.6 * noise(u, v, 128, 8, 5) + 0.4 * noise(u, v, 64, 5, 6);
  const double cloud = noise(u, v, 4, 3, 8);
  // Short dark flecks along the grain, as in beech.
  const double fleck = smooth_step(0.72, 0.95, noise(u, v, 100, 20, 9));
  const double dark =
      std::clamp(0.15 + 0.46 * late + 0.045 * fibre + 0.08 * cloud + 0.10 * fleck, 0.0, 1.0);
  const std::array<double, 3> pale{0.745, 0.535, 0.325}, deep{0.480, 0.268, 0.122};
  std::array<double, 3> out{};
  for (std::size_t c = 0; c < 3; ++c) out[c] = pale[c] + dark * (deep[c] - pale[c]);
  return out;
}

std::uint8_t to_srgb(double linear) {
  const double s =
      linear <= 0.0031308 ? 12.92 * linear : 1.055 * exact_pow(linear, 1.0 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::clamp(s * 255.0 + 0.5, 0.0, 255.0));
}

}  // namespace

std::vector<std::uint8_t> make_wood_png() {
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      for (const double value : wood_colour((x + 0.5) / kSize, (y + 0.5) / kSize))
        pixels.push_back(to_srgb(value));
    }
  }
  std::vector<std::uint8_t> png;
  const auto sink = [](void* context, void* data, int size) {
    const auto* bytes = static_cast<const std::uint8_t*>(data);
    static_cast<std::vector<std::uint8_t>*>(context)->insert(
        static_cast<std::vector<std::uint8_t>*>(context)->end(), bytes, bytes + size);
  };
  stbi_write_png_compression_level = 32;
  stbi_write_png_to_func(sink, &png, kSize, kSize, 3, pixels.data(), kSize * 3);
  return png;
}

}  // namespace relit::media
