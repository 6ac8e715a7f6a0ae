// SPDX-License-Identifier: MIT
#include "bake_minimal/triangle_order.hpp"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

namespace relit::bake {
namespace {

using Corners = std::array<std::uint32_t, 3>;

/// The triangle begun at its smallest index, so that rotations compare equal.
Corners canonical(const std::uint32_t* t) {
  const auto first = static_cast<std::size_t>(std::min_element(t, t + 3) - t);
  return {t[first], t[(first + 1) % 3], t[(first + 2) % 3]};
}

std::vector<std::uint32_t> sorted_triangles(std::span<const std::uint32_t> indices) {
  std::vector<std::uint32_t> order(indices.size() / 3);
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return canonical(&indices[3 * std::size_t{a}]) < canonical(&indices[3 * std::size_t{b}]);
  });
  return order;
}

/// Which triangle of `before` each triangle of `after` is; equal ones are matched in order.
std::vector<std::uint32_t> match_triangles(std::span<const std::uint32_t> before,
                                           std::span<const std::uint32_t> after) {
  const std::vector<std::uint32_t> from = sorted_triangles(before);
  const std::vector<std::uint32_t> to = sorted_triangles(after);
  std::vector<std::uint32_t> match(to.size());
  for (std::size_t i = 0; i < to.size(); ++i) match[to[i]] = from[i];
  return match;
}

}  // namespace

std::vector<MeshPart> order_triangles(std::span<const std::uint32_t> indices,
                                      std::size_t vertex_count, std::size_t max_vertices,
                                      std::size_t max_triangles) {
  std::vector<MeshPart> parts;
  if (indices.empty()) return parts;
  std::vector<std::uint32_t> ordered(indices.size());
  meshopt_optimizeVertexCacheStrip(ordered.data(), indices.data(), indices.size(), vertex_count);
  const std::vector<std::uint32_t> match = match_triangles(indices, ordered);

  constexpr std::uint32_t kUnseen = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> local(vertex_count, kUnseen);
  parts.emplace_back();
  for (std::size_t t = 0; t < match.size(); ++t) {
    // The matched triangle's own corners: the optimiser may have rotated them.
    const std::uint32_t* corners = &indices[3 * std::size_t{match[t]}];
    const auto unseen = static_cast<std::size_t>(
        std::count_if(corners, corners + 3, [&](std::uint32_t v) { return local[v] == kUnseen; }));
    if (parts.back().vertices.size() + unseen > max_vertices ||
        parts.back().triangles.size() == max_triangles) {
      for (const std::uint32_t v : parts.back().vertices) local[v] = kUnseen;
      parts.emplace_back();
    }
    MeshPart& part = parts.back();
    for (std::size_t c = 0; c < 3; ++c) {
      std::uint32_t& number = local[corners[c]];
      if (number == kUnseen) {
        number = static_cast<std::uint32_t>(part.vertices.size());
        part.vertices.push_back(corners[c]);
      }
      part.indices.push_back(number);
    }
    part.triangles.push_back(match[t]);
  }
  return parts;
}

}  // namespace relit::bake
