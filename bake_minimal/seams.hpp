// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "bake_minimal/atlas.hpp"

namespace relit::bake {

/// An edge of the surface along which the light map is cut: the same two points, seen from the
/// chart on either side. Light-map UVs in [0,1].
struct Seam {
  glm::vec2 from[2];  ///< by side
  glm::vec2 to[2];
};

/// Vertices of one moment, all of the same length.
struct SeamGeometry {
  std::span<const std::uint32_t> indices;
  std::span<const glm::vec2> lightmap_uv;
  std::span<const glm::vec3> positions;
  std::span<const glm::vec3> normals;  ///< unit length
};

/// Finds the seams: edges that two triangles share by position but not by UV, smooth (vertex
/// normals within 8 degrees, so that neither creases nor the two sides of a sheet count) at both
/// moments. Deterministic.
[[nodiscard]] std::vector<Seam> find_seams(const SeamGeometry& first, const SeamGeometry& second);

/// Makes the two sides of every seam look alike: of all light maps it takes the one that minimises
///
///     Σ_seam samples (bilinear(x, uv on one side) − bilinear(x, uv on the other))² · w
///     + Σ_texels c · (x − given)²
///
/// over the texels that bilinear lookups on seams touch, c being smaller where a texel was only
/// filled, and keeps them within the range that the plane had. The matrix depends on the layout
/// alone: it is factored once (sparse Cholesky) and solved for each plane. A constant stays that
/// constant.
class SeamStitcher {
 public:
  /// `samples` tell which texels were traced.
  SeamStitcher(int width, int height, std::span<const Seam> seams,
               std::span<const TexelSample> samples);
  SeamStitcher(SeamStitcher&&) noexcept;
  SeamStitcher& operator=(SeamStitcher&&) noexcept;
  ~SeamStitcher();

  /// Changes one [height][width] plane in place. Any number of threads at once.
  void stitch(std::span<float> plane) const;

  /// Root mean square of the differences across all seam samples of a plane.
  [[nodiscard]] double mismatch(std::span<const float> plane) const;
  [[nodiscard]] std::size_t texel_count() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace relit::bake
