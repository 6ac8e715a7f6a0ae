// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include "bake_minimal/scene.hpp"
#include "container/base/result.hpp"

namespace relit::bake {

struct AtlasOptions {
  enum class Source { kAuto, kSet, kUnwrap };
  Source source = Source::kAuto;
  int set = 0;       ///< with kSet
  int width = 128;   ///< texels of the light map, for the gutter
  int height = 128;
  int gutter = 2;    ///< empty texels between charts, at least
};

struct AtlasReport {
  int set = -1;            ///< the UV set taken, -1: unwrapped
  int charts = 0;
  double coverage = 0;     ///< covered texels over all texels
  double density_p5 = 0;   ///< texel density over its median, 5th and 95th percentile
  double density_p95 = 0;
  std::string reason;      ///< why the other sets were refused, for the user
};

/// Gives every primitive its `lightmap_uv`: the first UV set (or the one asked for) inside [0,1] in which
/// nothing overlaps across all primitives, else an automatic unwrap. Double-sided primitives get their
/// reversed triangles (and `other_side`) first; a UV set then qualifies only if there are none.
/// Vertices are split at chart borders. `posed` is the first frame's position of every vertex of every
/// primitive, in which density is measured. Deterministic. Errors: kInvalid when the set asked for does
/// not qualify (says why), kLimit when the charts do not fit the size.
[[nodiscard]] Result<AtlasReport> assign_lightmap_uvs(Scene& scene,
                                                      std::span<const std::vector<glm::vec3>> posed,
                                                      const AtlasOptions& options);

/// One texel to be sampled: texel centre, or the nearest surface point where only the texel's square
/// touches a chart.
struct TexelSample {
  std::uint32_t texel = 0;     ///< y × width + x
  std::uint32_t triangle = 0;  ///< into the triangles given
  float b1 = 0, b2 = 0;        ///< barycentric: p = (1-b1-b2)·p0 + b1·p1 + b2·p2
  bool covered = false;        ///< the centre lies inside the chart (exact, top-left rule)
};

/// Rasterises triangles of light-map UVs; exact fixed point with the top-left rule, so that triangles
/// that share an edge never both own a texel. Samples are in order of their texel; one a texel.
[[nodiscard]] std::vector<TexelSample> rasterize_atlas(std::span<const glm::vec2> uv,
                                                       std::span<const std::uint32_t> indices,
                                                       int width, int height);

}  // namespace relit::bake
