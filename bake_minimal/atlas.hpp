// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include "bake_minimal/scene.hpp"
#include "container/base/result.hpp"
#include "decoders/texel_raster.hpp"

namespace relit::bake {

using decoders::TexelSample;

struct AtlasOptions {
  enum class Source { kAuto, kSet, kUnwrap };
  Source source = Source::kAuto;
  int set = 0;      ///< with kSet
  int width = 128;  ///< texels of the light map, for the gutter; 1..limits::kLightMapSide
  int height = 128;
  int gutter = 2;  ///< empty texels between charts, at least; 0..64
  /// Primitives that are not the file's (add_ground()'s): they need no UV set. Where a set of the
  /// others qualifies, its charts are kept rigid and packed anew together with these.
  std::vector<std::uint32_t> added;
  double added_density = 0.5;  ///< texels a metre on `added`, over those on the others; > 0
};

struct AtlasReport {
  int set = -1;           ///< the UV set taken, -1: unwrapped
  bool repacked = false;  ///< its charts were moved to make room for AtlasOptions::added
  int charts = 0;
  int gutter = 0;          ///< empty texels between two charts, at least; counted up to 8
  double coverage = 0;     ///< covered texels over all texels
  double density_p5 = 0;   ///< texels a metre over their median, 5th and 95th percentile of the
  double density_p95 = 0;  ///< triangles; on `added` over `added_density`
  std::string reason;      ///< why the other sets were refused, for the user; may be empty
};

/// How much of the covered texels may be owned by two triangles in a UV set that qualifies, counted
/// at 1024 × 1024 by the exact rasteriser, as tools for artists leave touching corners behind.
inline constexpr double kOverlapTolerance = 1e-3;
/// How much of the surface may have no room in such a set (UVs in one point or on a line).
inline constexpr double kRoomlessTolerance = 1e-2;
/// How far UVs may leave [0,1]; they are clamped.
inline constexpr float kOutsideTolerance = 1e-5f;

/// Gives every primitive its `lightmap_uv`: the first UV set (or the one asked for) that every
/// primitive has, inside [0,1], in which nothing overlaps across all of them (see the tolerances),
/// else an automatic unwrap. Double-sided primitives get their reversed triangles (and
/// `other_side`) first; a UV set then qualifies only if there are none. Vertices are split at chart
/// borders; new ones come after the old. Unwrapped and repacked UVs are multiples of 1/65535, as
/// files hold them. `posed` is the first frame's position of every vertex of every primitive as the
/// scene stands before the call, in which density is measured. Deterministic. The scene is
/// untouched after an error. Errors: kInvalid when the set asked for does not qualify (says why) or
/// `posed` does not match, kLimit when the charts do not fit the size.
[[nodiscard]] Result<AtlasReport> assign_lightmap_uvs(Scene& scene,
                                                      std::span<const std::vector<glm::vec3>> posed,
                                                      const AtlasOptions& options);

}  // namespace relit::bake
