// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "media/lights.hpp"

namespace relit::media {
namespace {

std::array<std::uint8_t, 4> to_rgbe(const glm::dvec3& c) {
  const double largest = std::max({c.x, c.y, c.z});
  if (largest < 1e-32) return {0, 0, 0, 0};
  int exponent = 0;
  // Rounding must not carry the largest mantissa to 256.
  if (std::frexp(largest, &exponent) * 256.0 >= 255.5) ++exponent;
  std::array<std::uint8_t, 4> out{};
  for (int k = 0; k < 3; ++k) {
    out[static_cast<std::size_t>(k)] =
        static_cast<std::uint8_t>(std::floor(std::ldexp(std::max(c[k], 0.0), 8 - exponent) + 0.5));
  }
  out[3] = static_cast<std::uint8_t>(exponent + 128);
  return out;
}

// One channel of one row: counts above 128 repeat a byte, the others precede bytes as they are.
void write_runs(std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>& out) {
  constexpr std::size_t kShortest = 4;
  const auto run_at = [&](std::size_t i) {
    std::size_t n = 1;
    while (i + n < bytes.size() && n < 127 && bytes[i + n] == bytes[i]) ++n;
    return n;
  };
  std::size_t i = 0;
  while (i < bytes.size()) {
    if (const std::size_t run = run_at(i); run >= kShortest) {
      out.push_back(static_cast<std::uint8_t>(128 + run));
      out.push_back(bytes[i]);
      i += run;
      continue;
    }
    std::size_t end = i;
    while (end < bytes.size() && end - i < 128 && run_at(end) < kShortest) ++end;
    out.push_back(static_cast<std::uint8_t>(end - i));
    out.insert(out.end(), bytes.begin() + static_cast<std::ptrdiff_t>(i),
               bytes.begin() + static_cast<std::ptrdiff_t>(end));
    i = end;
  }
}

}  // namespace

std::vector<std::uint8_t> write_hdr(const Panorama& panorama) {
  const std::string header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y " +
                             std::to_string(panorama.height) + " +X " +
                             std::to_string(panorama.width) + "\n";
  std::vector<std::uint8_t> out(header.begin(), header.end());
  const auto width = static_cast<std::size_t>(panorama.width);
  for (std::size_t y = 0; y < static_cast<std::size_t>(panorama.height); ++y) {
    out.insert(out.end(), {2, 2, static_cast<std::uint8_t>(width >> 8),
                           static_cast<std::uint8_t>(width & 0xff)});
    std::array<std::vector<std::uint8_t>, 4> channels;
    for (std::size_t x = 0; x < width; ++x) {
      const auto rgbe = to_rgbe(panorama.pixels[y * width + x]);
      for (std::size_t c = 0; c < 4; ++c) channels[c].push_back(rgbe[c]);
    }
    for (const auto& channel : channels) write_runs(channel, out);
  }
  return out;
}

}  // namespace relit::media
