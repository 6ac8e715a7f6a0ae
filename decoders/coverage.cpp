// SPDX-License-Identifier: MIT
#include "decoders/coverage.hpp"

#include <algorithm>

#include "decoders/fixed_triangle.hpp"

namespace relit::decoders {

void mark_covered_texels(std::span<const glm::vec2> uv, std::span<const std::uint16_t> indices,
                         int width, int height, std::span<std::uint8_t> mask) {
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    const FixedTriangle triangle(uv[indices[i]], uv[indices[i + 1]], uv[indices[i + 2]], width,
                                 height);
    if (triangle.degenerate()) continue;
    triangle.for_each_row(0, height, width, [&](int y, int x0, int x1) {
      const auto row = mask.subspan(static_cast<std::size_t>(y) * static_cast<std::size_t>(width));
      std::fill(row.begin() + x0, row.begin() + x1 + 1, std::uint8_t{1});
    });
  }
}

}  // namespace relit::decoders
