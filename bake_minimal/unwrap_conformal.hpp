// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

namespace relit::bake {

/// A patch as the solvers see it: triangles over local vertices, each with its true shape in a
/// plane of its own (`rest`, counter-clockwise, with area).
struct PatchMesh {
  std::size_t vertex_count = 0;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::array<glm::dvec2, 3>> rest;
  std::array<std::uint32_t, 2> pins{};  ///< two vertices far apart
  double pin_distance = 1;
};

/// Least squares conformal map: the UVs that minimise Dirichlet energy minus area with both pins
/// fixed (Lévy et al. 2002; in this form Mullen et al. 2008, section 2). Nothing if the system is
/// singular.
[[nodiscard]] std::optional<std::vector<glm::dvec2>> solve_conformal(const PatchMesh& mesh);

/// Steps of "as rigid as possible" from `uv`: best rotation per triangle, then the UVs that fit all
/// rotations best (Liu et al. 2008, sections 3 and 4). Nothing if the system is singular.
[[nodiscard]] std::optional<std::vector<glm::dvec2>> solve_rigid(const PatchMesh& mesh,
                                                                 std::vector<glm::dvec2> uv,
                                                                 int steps);

}  // namespace relit::bake
