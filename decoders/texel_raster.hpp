// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <limits>
#include <span>
#include <vector>

#include "container/base/result.hpp"
#include "decoders/fixed_triangle.hpp"

namespace relit::decoders {

/// Where a texel of the light map lies on the surface: its centre, or the surface point nearest to
/// it where only the texel's square touches a chart (FORMAT.md, "Texels and the surface").
struct TexelSample {
  std::uint32_t texel = 0;     ///< y × width + x
  std::uint32_t triangle = 0;  ///< into the triangles given
  float b1 = 0, b2 = 0;        ///< barycentric: p = (1-b1-b2)·p0 + b1·p1 + b2·p2
  bool covered = false;        ///< the centre lies inside the chart (exact, top-left rule)
};

/// Rasterises triangles of light-map UVs; exact fixed point with the top-left rule, so that
/// triangles that share an edge never both own a texel; of triangles that overlap the first owns
/// it, and of several that are equally near to a centre that nobody owns the first is taken.
/// Samples are in order of their texel; one a texel. Sides up to 16384. Memory is some rows' worth,
/// whatever the triangles are. Errors: kLimit for triangles that lie over each other so often that
/// no atlas was meant (files lie); kOutOfMemory.
Status rasterize_atlas(std::span<const glm::vec2> uv, std::span<const std::uint32_t> indices,
                       int width, int height, const std::function<void(const TexelSample&)>& take);
/// The same, as a list.
[[nodiscard]] Result<std::vector<TexelSample>> rasterize_atlas(
    std::span<const glm::vec2> uv, std::span<const std::uint32_t> indices, int width, int height);

/// An interval of x; empty when hi < lo.
struct SlabExtent {
  double lo = std::numeric_limits<double>::infinity();
  double hi = -std::numeric_limits<double>::infinity();
};

/// The x extent of the part of a triangle that lies in the closed slab y0 <= y <= y1.
[[nodiscard]] SlabExtent slab_extent(const std::array<glm::dvec2, 3>& p, double y0, double y1);

}  // namespace relit::decoders
