// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "bake_minimal/unwrap_surface.hpp"

namespace relit::bake {

/// A patch laid flat. UVs are in the surface's unit, scaled so that the areas of patch and chart
/// agree, and turned so that the bounding rectangle is the smallest one, wider than high, from (0,
/// 0).
struct FlatChart {
  std::vector<std::uint32_t> triangles;
  std::vector<std::uint32_t> corners;  ///< 3 × triangles, into uv; shared across inner edges only
  std::vector<glm::dvec2> uv;
  glm::dvec2 size{0.0};
  double area = 0;
  double outline = 0;  ///< length of the border on the surface
};

/// What a chart may do to the surface, over 96 % of its area (98 % on either side); density is the
/// root of the areas' ratio over the chart's mean.
struct FlattenLimits {
  double least_density = 0.8;
  double greatest_density = 1.25;
  double greatest_anisotropy = 2.0;  ///< longest over shortest image of a unit length, 98 %
  double greatest_side = 0;          ///< of the bounding rectangle; 0: any. Never less than the
  double greatest_short_side = 0;    ///< patch's longest edge, which no cut makes shorter
  double least_fill = 0;             ///< of the bounding rectangle by the chart
  double overlap_scale = 0;  ///< texels a unit at which overlap is looked for; 0: 512 a side
};

/// Lays a connected patch flat: as it is where it is plane, else by a least squares conformal map
/// (Lévy et al. 2002) and a few local/global steps towards an isometry (Liu et al. 2008).
/// Nothing when the result folds over, overlaps itself or breaks a limit. A single triangle always
/// succeeds, whatever the limits. Deterministic.
[[nodiscard]] std::optional<FlatChart> flatten_patch(const Surface& surface,
                                                     std::span<const std::uint32_t> patch,
                                                     const FlattenLimits& limits);

/// Turns `points` so that their bounding rectangle has the least area, is wider than high and
/// starts at (0, 0); returns its size.
glm::dvec2 turn_to_least_rectangle(std::span<glm::dvec2> points);

}  // namespace relit::bake
