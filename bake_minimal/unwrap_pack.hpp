// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include "container/base/result.hpp"

namespace relit::bake {

/// A chart to be placed: triangles over points, in a unit common to all charts, any origin.
struct PackShape {
  std::vector<glm::dvec2> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

struct ChartPackOptions {
  int width = 128;  ///< texels
  int height = 128;
  int gutter = 2;           ///< empty texels between texels covered by different shapes, at least
  int greatest_grid = 512;  ///< cells a side; larger atlases are packed in coarser cells
  bool quarter_turns_only = false;  ///< else few shapes are tried at finer angles too
};

struct PackResult {
  double scale = 0;                             ///< texels per unit
  std::vector<std::vector<glm::dvec2>> points;  ///< in texels, by shape
};

/// Places all shapes on the atlas at the greatest common scale found, turned by quarter turns and
/// moved by whole texels. Guaranteed for any two shapes: `gutter` empty texels lie between the
/// texels whose centres they cover, and no texel is read by a bilinear fetch inside both. Nothing
/// comes closer than half a texel to the atlas's border. Shapes thinner than half a texel are
/// widened to that, and every shape covers a texel centre. Shapes nest into each other's hollows;
/// the search starts from what their bounding rectangles reach (stb_rect_pack). Deterministic.
/// Errors: kLimit when there are more shapes than the size has room for.
[[nodiscard]] Result<PackResult> pack_shapes(std::span<const PackShape> shapes,
                                             const ChartPackOptions& options);

/// Whether shapes fit at a scale (texels per unit), as the search above would try it.
[[nodiscard]] bool shapes_fit(std::span<const PackShape> shapes, const ChartPackOptions& options,
                              double scale);

/// Rectangles in whole cells. False when they do not all fit; `at` are their lower corners.
[[nodiscard]] bool pack_rectangles(std::span<const glm::ivec2> sizes, glm::ivec2 atlas,
                                   std::span<glm::ivec2> at);

}  // namespace relit::bake
