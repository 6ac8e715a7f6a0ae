// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>

#include "container/base/result.hpp"
#include "decoders/mesh.hpp"

namespace relit::decoders {

/// Sets mask[y × width + x] = 1 for every texel whose centre lies inside a triangle of the meshes'
/// light-map UVs (design, section 1: covered), by the exact rule of FixedTriangle, and all others
/// to 0. `mask` is uint8 [height][width]. Errors: kLimit where the triangles lie over one another
/// so often that this would take long, with the mask unspecified; charts do not overlap.
[[nodiscard]] Status mark_covered_texels(std::span<const Mesh> meshes, int width, int height,
                                         std::span<std::uint8_t> mask);

}  // namespace relit::decoders
