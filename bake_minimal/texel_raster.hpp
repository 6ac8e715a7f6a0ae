// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <glm/glm.hpp>

#include "decoders/fixed_triangle.hpp"

namespace relit::bake {

using decoders::FixedTriangle;

/// An interval of x; empty when hi < lo.
struct SlabExtent {
  double lo = std::numeric_limits<double>::infinity();
  double hi = -std::numeric_limits<double>::infinity();
};

/// The x extent of the part of a triangle that lies in the closed slab y0 <= y <= y1.
[[nodiscard]] SlabExtent slab_extent(const std::array<glm::dvec2, 3>& p, double y0, double y1);

}  // namespace relit::bake
