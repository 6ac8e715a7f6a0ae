// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace relit::bake {

/// Cells first..last of one row.
struct CellRun {
  std::int16_t row, first, last;
};

/// A directed edge of a shape's outline, between two of its points.
using OutlineEdge = std::array<std::uint32_t, 2>;

/// The edges that are left when all triangles are turned counter-clockwise and edges that run in
/// opposite directions cancel. Whatever the triangles overlap, what they cover is what these wind
/// around. Triangles without area keep their edges.
[[nodiscard]] std::vector<OutlineEdge> find_outline(
    std::span<const glm::dvec2> points, std::span<const std::array<std::uint32_t, 3>> triangles);

/// Runs of the cells (of the grid of unit squares from the origin, `size` of them) whose centre
/// lies inside the outline or, on both axes, within `reach` of it; the longest first. Never empty.
[[nodiscard]] std::vector<CellRun> find_cells(std::span<const glm::dvec2> points,
                                              std::span<const OutlineEdge> outline, double reach,
                                              glm::ivec2 size);

}  // namespace relit::bake
