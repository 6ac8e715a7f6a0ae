// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace relit::media {

/// An equirectangular picture of a surrounding, linear radiance; row 0 is +y, u = 0 is +x, u = 1/4
/// is +z.
struct Panorama {
  std::string name;
  int width = 0, height = 0;
  std::vector<glm::dvec3> pixels;
};

/// studio_soft, low_sun, coloured_pair.
[[nodiscard]] std::vector<Panorama> make_panoramas();

/// Radiance picture file, run-length coded.
[[nodiscard]] std::vector<std::uint8_t> write_hdr(const Panorama& panorama);

}  // namespace relit::media
