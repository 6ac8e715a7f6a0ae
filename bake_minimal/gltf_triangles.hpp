// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace relit::bake::gltf {

enum class Topology { kTriangles, kStrip, kFan };

/// The triangles of a list, strip or fan with the winding that glTF 2.0 gives them
/// (section 3.7.2.1); corners that complete no triangle are left out.
[[nodiscard]] std::vector<std::uint32_t> list_triangles(Topology topology,
                                                        std::span<const std::uint32_t> corners);

/// (b − a) × (c − a): twice the area, along the normal.
[[nodiscard]] glm::dvec3 area_normal(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c);

/// Removes triangles without area, or only those with a repeated corner where `may_open` says that
/// morphing can give the others one. Returns how many.
std::size_t drop_degenerate(std::span<const glm::vec3> positions, bool may_open,
                            std::vector<std::uint32_t>& indices);

/// Renumbers `indices` so that no vertex below the highest is unused, keeping their order; returns
/// the old number of every new vertex.
[[nodiscard]] std::vector<std::uint32_t> compact_vertices(std::size_t vertex_count,
                                                          std::vector<std::uint32_t>& indices);

}  // namespace relit::bake::gltf
