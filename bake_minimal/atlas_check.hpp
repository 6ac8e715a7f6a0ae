// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace relit::bake {

/// How triangles of light-map UVs share an atlas, counted by the exact rasteriser.
struct OverlapCount {
  std::int64_t covered = 0;  ///< texels that at least one triangle owns
  std::int64_t doubly = 0;   ///< texels that more than one owns

  [[nodiscard]] double share() const {
    return covered > 0 ? static_cast<double>(doubly) / static_cast<double>(covered) : 0.0;
  }
};

[[nodiscard]] OverlapCount count_overlap(std::span<const glm::vec2> uv,
                                         std::span<const std::uint32_t> indices, int width,
                                         int height);

/// The chart of every triangle: connected over UV positions that agree to a millionth. Numbered in
/// the order of their first triangle; `count` of them.
struct UvCharts {
  std::vector<std::uint32_t> of_triangle;
  int count = 0;
};

[[nodiscard]] UvCharts find_uv_charts(std::span<const glm::vec2> uv,
                                      std::span<const std::uint32_t> indices);

/// The fewest empty texels between texels covered by two different charts (the larger of the
/// distances along the axes), looked for up to `most`; `most` when none are nearer.
[[nodiscard]] int measure_gutter(std::span<const glm::vec2> uv,
                                 std::span<const std::uint32_t> indices, const UvCharts& charts,
                                 glm::ivec2 size, int most);

}  // namespace relit::bake
