// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "media/gait.hpp"
#include "media/layout.hpp"
#include "media/skeleton.hpp"
#include "media/surface.hpp"

namespace relit::media {

/// The mannequin, complete: surfaces with their light-map coordinates, and one key a frame.
struct Figure {
  std::vector<Patch> patches;
  Walk walk;
  std::vector<Pose> keys;       ///< walk.rate_hz × duration, and the first once more at the end
  double coverage = 0;          ///< of the light-map atlas
  double texels_per_metre = 0;  ///< at 128 × 128
};

[[nodiscard]] Figure make_figure();

/// The figure as binary glTF 2.0: rigid nodes for the wood, a skin for the cloth, one clip "walk".
/// `wood_png` is the base colour texture of everything turned.
[[nodiscard]] std::vector<std::uint8_t> write_glb(const Figure& figure,
                                                  const std::vector<std::uint8_t>& wood_png);

/// The wood texture: year rings along u, grain along v, both periodic; sRGB PNG.
[[nodiscard]] std::vector<std::uint8_t> make_wood_png();

}  // namespace relit::media
