// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "bake_minimal/scene.hpp"
#include "container/base/result.hpp"

namespace relit::bake {

struct GroundOptions {
  double radius = 1.6;                 ///< over half the clip's larger horizontal extent; > 0
  glm::vec3 albedo{0.5f, 0.5f, 0.5f};  ///< linear, 0..1
  int segments = 64;                   ///< of the outline, 3..4096
  int rings = 12;                      ///< 1..1024
};

/// Adds a flat disc for the figure to stand on and cast its shadow on: at the lowest y of the clip,
/// facing +Y, centred under its bounds (metres, over all frames, in model space). Appends a
/// material, a static root node and a primitive with one planar set of texture coordinates, and
/// returns the primitive's index, for AtlasOptions::added. Rings lie closer towards the middle.
/// Errors: kInvalid for bounds that are not finite or reversed, or options out of their ranges.
[[nodiscard]] Result<std::uint32_t> add_ground(Scene& scene, const glm::vec3& bounds_min,
                                               const glm::vec3& bounds_max,
                                               const GroundOptions& options);

}  // namespace relit::bake
