// SPDX-License-Identifier: MIT
#pragma once

#include <glm/glm.hpp>

namespace relit::bake {

/// The third component of a × b: twice the signed area of the triangle that they span.
[[nodiscard]] inline double cross2(const glm::dvec2& a, const glm::dvec2& b) {
  return a.x * b.y - a.y * b.x;
}

}  // namespace relit::bake
