// SPDX-License-Identifier: MIT
#include "decoders/coverage.hpp"

#include <algorithm>
#include <string>

#include "decoders/fixed_triangle.hpp"

namespace relit::decoders {
namespace {

/// Where no two triangles overlap, each row of a triangle has texels of its own, or lies in a
/// sliver between their centres: no chart is mostly slivers.
std::uint64_t most_rows(std::span<const Mesh> meshes, int width, int height) {
  std::uint64_t rows = 8 * static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
  for (const Mesh& mesh : meshes) rows += 32 * std::uint64_t{mesh.indices.size() / 3};
  return rows;
}

/// How many rows of texels a triangle may reach into.
std::uint64_t rows_of(glm::vec2 a, glm::vec2 b, glm::vec2 c, int height) {
  const float span = std::max({a.y, b.y, c.y}) - std::min({a.y, b.y, c.y});
  return static_cast<std::uint64_t>(std::clamp(span, 0.0f, 1.0f) * static_cast<float>(height)) + 1;
}

}  // namespace

Status mark_covered_texels(std::span<const Mesh> meshes, int width, int height,
                           std::span<std::uint8_t> mask) {
  std::ranges::fill(mask, std::uint8_t{0});
  std::uint64_t left = most_rows(meshes, width, height);
  for (const Mesh& mesh : meshes) {
    const auto& uv = mesh.lightmap_uv;
    const auto& indices = mesh.indices;
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
      const glm::vec2 a = uv[indices[i]], b = uv[indices[i + 1]], c = uv[indices[i + 2]];
      const FixedTriangle triangle(a, b, c, width, height);
      if (triangle.degenerate()) continue;
      const std::uint64_t rows = rows_of(a, b, c, height);
      if (rows > left) {
        return fail(ErrorCode::kLimit,
                    "the light-map triangles of mesh " + std::to_string(mesh.id) +
                        " lie over one another many times; the charts of a light map are disjoint");
      }
      left -= rows;
      triangle.for_each_row(0, height, width, [&](int y, int x0, int x1) {
        const auto row =
            mask.subspan(static_cast<std::size_t>(y) * static_cast<std::size_t>(width));
        std::fill(row.begin() + x0, row.begin() + x1 + 1, std::uint8_t{1});
      });
    }
  }
  return {};
}

}  // namespace relit::decoders
