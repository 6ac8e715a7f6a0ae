// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "bake_minimal/scene.hpp"

namespace relit::bake {

/// Appends the reversed triangles of a primitive over copies of its vertices with negated normals
/// (those of morph targets too), and fills `other_side` both ways. `posed`, its posed positions,
/// grows along.
void add_other_side(Primitive& primitive, std::vector<glm::vec3>& posed);

/// Gives the corners of a primitive their UVs (three a triangle): a vertex takes those of its first
/// corner, and a copy of it is appended for each other UV its corners want. Vertices that no
/// triangle uses get (0, 0).
void set_corner_uvs(Primitive& primitive, std::span<const glm::vec2> corner_uv);

}  // namespace relit::bake
