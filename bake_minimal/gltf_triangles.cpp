// SPDX-License-Identifier: MIT
#include "bake_minimal/gltf_triangles.hpp"

#include <array>

namespace relit::bake::gltf {

std::vector<std::uint32_t> list_triangles(Topology topology,
                                          std::span<const std::uint32_t> corners) {
  if (topology == Topology::kTriangles) {
    const auto whole = corners.first(corners.size() / 3 * 3);
    return {whole.begin(), whole.end()};
  }
  std::vector<std::uint32_t> out;
  if (corners.size() < 3) return out;
  out.reserve((corners.size() - 2) * 3);
  for (std::size_t i = 0; i + 2 < corners.size(); ++i) {
    const bool odd = i % 2 == 1;
    const std::array<std::size_t, 3> from =
        topology == Topology::kFan
            ? std::array<std::size_t, 3>{i + 1, i + 2, 0}
            : std::array<std::size_t, 3>{i, i + (odd ? 2u : 1u), i + (odd ? 1u : 2u)};
    for (const std::size_t corner : from) out.push_back(corners[corner]);
  }
  return out;
}

glm::dvec3 area_normal(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  return glm::cross(b - a, c - a);
}

std::size_t drop_degenerate(std::span<const glm::vec3> positions, bool may_open,
                            std::vector<std::uint32_t>& indices) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < indices.size(); t += 3) {
    const std::array<std::uint32_t, 3> i{indices[t], indices[t + 1], indices[t + 2]};
    bool degenerate = i[0] == i[1] || i[1] == i[2] || i[2] == i[0];
    if (!degenerate && !may_open) {
      degenerate = area_normal(positions[i[0]], positions[i[1]], positions[i[2]]) == glm::dvec3(0);
    }
    if (degenerate) continue;
    for (const std::uint32_t corner : i) indices[kept++] = corner;
  }
  const std::size_t dropped = (indices.size() - kept) / 3;
  indices.resize(kept);
  return dropped;
}

std::vector<std::uint32_t> compact_vertices(std::size_t vertex_count,
                                            std::vector<std::uint32_t>& indices) {
  constexpr std::uint32_t kUnused = ~0u;
  std::vector<std::uint32_t> renumbered(vertex_count, kUnused);
  for (const std::uint32_t i : indices) renumbered[i] = 0;
  std::vector<std::uint32_t> source;
  for (std::size_t v = 0; v < vertex_count; ++v) {
    if (renumbered[v] == kUnused) continue;
    renumbered[v] = static_cast<std::uint32_t>(source.size());
    source.push_back(static_cast<std::uint32_t>(v));
  }
  for (std::uint32_t& i : indices) i = renumbered[i];
  return source;
}

}  // namespace relit::bake::gltf
