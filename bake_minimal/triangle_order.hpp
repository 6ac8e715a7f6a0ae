// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relit::bake {

/// A part of a triangle list that 16-bit indices can address.
struct MeshPart {
  std::vector<std::uint32_t> vertices;   ///< of the whole list, in the part's order of first use
  std::vector<std::uint32_t> indices;    ///< into `vertices`
  std::vector<std::uint32_t> triangles;  ///< of the whole list, by the part's triangles
};

/// Orders triangles for the vertex cache and for the index codec, vertices by first use, and starts
/// a new part whenever another triangle would exceed `max_vertices` or `max_triangles`. Corners
/// keep their order within a triangle. Deterministic.
[[nodiscard]] std::vector<MeshPart> order_triangles(std::span<const std::uint32_t> indices,
                                                    std::size_t vertex_count,
                                                    std::size_t max_vertices,
                                                    std::size_t max_triangles);

}  // namespace relit::bake
