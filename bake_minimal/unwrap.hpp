// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "bake_minimal/unwrap_flatten.hpp"
#include "bake_minimal/unwrap_pack.hpp"
#include "bake_minimal/unwrap_surface.hpp"
#include "container/base/result.hpp"

namespace relit::bake {

/// Cuts a surface into charts and lays them flat: patches grow by flatness, are cut again while
/// they fold, overlap or stretch, and neighbours are joined, longest common border first, as long
/// as the union can be laid flat within tighter limits. Every triangle with area is in exactly one
/// chart.
[[nodiscard]] std::vector<FlatChart> make_charts(const Surface& surface,
                                                 const ChartPackOptions& options);

struct Unwrapped {
  std::vector<glm::vec2> corner_uv;  ///< 3 a triangle, in [0,1], multiples of 1/65535
  int charts = 0;
};

/// UVs for every corner of every triangle: make_charts(), packed, and checked by the exact
/// rasteriser at the size asked for: no texel is owned twice. Corners of triangles without area
/// coincide, in a neighbour's chart. Deterministic. Errors: those of pack_shapes().
[[nodiscard]] Result<Unwrapped> unwrap_surface(const SurfaceInput& input,
                                               const ChartPackOptions& options);

/// To the grid of 16-bit UVs, which files hold, clamped to [0,1].
[[nodiscard]] glm::vec2 snap_uv(const glm::dvec2& uv);

/// UVs of every corner from charts packed in this order.
[[nodiscard]] std::vector<glm::vec2> corner_uvs(const Surface& surface,
                                                std::span<const FlatChart> charts,
                                                std::span<const std::vector<glm::dvec2>> texels,
                                                const ChartPackOptions& options);

[[nodiscard]] PackShape to_shape(const FlatChart& chart);

}  // namespace relit::bake
