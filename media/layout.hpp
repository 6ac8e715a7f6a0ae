// SPDX-License-Identifier: MIT
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "media/surface.hpp"

namespace relit::media {

/// Where a chart lies in the atlas.
struct Placement {
  double scale = 0;        ///< atlas units a metre of surface
  glm::dvec2 origin{0.0};  ///< of the chart's box, atlas units (0..1)
  double widest = 0;       ///< of a strip, metres
  bool turned = false;     ///< rows run along v

  /// Place of the point of row `row` at `turn` (0..1 around) in the atlas.
  [[nodiscard]] glm::dvec2 place(const Chart& chart, std::size_t row, double turn) const;
};

struct Layout {
  std::vector<Placement> placements{};  ///< one a chart
  double texels_per_metre = 0;          ///< at 128 × 128 and weight 1
  double coverage = 0;                  ///< texels of 128 × 128 inside charts, conservatively
};

/// Packs charts by their true outlines on a grid of 128 × 128 texels with two empty texels between
/// any two and one along the border, at the largest scale that fits. Deterministic.
[[nodiscard]] Layout lay_out(std::span<const Chart> charts);

}  // namespace relit::media
