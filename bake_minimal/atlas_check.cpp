// SPDX-License-Identifier: MIT
#include "bake_minimal/atlas_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "decoders/texel_raster.hpp"

namespace relit::bake {
namespace {

constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();

template <class Visit>
void for_each_owned(std::span<const glm::vec2> uv, std::span<const std::uint32_t> indices,
                    glm::ivec2 size, Visit&& visit) {
  for (std::size_t t = 0; 3 * t + 2 < indices.size(); ++t) {
    decoders::FixedTriangle(uv[indices[3 * t]], uv[indices[3 * t + 1]], uv[indices[3 * t + 2]],
                            size.x, size.y)
        .for_each_row(0, size.y, size.x, [&](int y, int x0, int x1) {
          const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(size.x);
          for (int x = x0; x <= x1; ++x) visit(t, row + static_cast<std::size_t>(x));
        });
  }
}

std::uint32_t find_root(std::vector<std::uint32_t>& parent, std::uint32_t a) {
  while (parent[a] != a) a = parent[a] = parent[parent[a]];
  return a;
}

}  // namespace

OverlapCount count_overlap(std::span<const glm::vec2> uv, std::span<const std::uint32_t> indices,
                           int width, int height) {
  std::vector<std::uint8_t> owners(static_cast<std::size_t>(width) *
                                   static_cast<std::size_t>(height));
  OverlapCount count;
  for_each_owned(uv, indices, {width, height}, [&](std::size_t, std::size_t texel) {
    if (owners[texel] == 0) ++count.covered;
    if (owners[texel] == 1) ++count.doubly;
    owners[texel] = static_cast<std::uint8_t>(std::min(owners[texel] + 1, 2));
  });
  return count;
}

UvCharts find_uv_charts(std::span<const glm::vec2> uv, std::span<const std::uint32_t> indices) {
  std::vector<std::uint32_t> order(uv.size());
  std::iota(order.begin(), order.end(), 0u);
  std::vector<glm::i64vec2> cell(uv.size());
  for (std::size_t v = 0; v < uv.size(); ++v) {
    const bool sane = std::abs(uv[v].x) < 1e9f && std::abs(uv[v].y) < 1e9f;
    cell[v] = sane ? glm::i64vec2(std::llround(static_cast<double>(uv[v].x) * 1e6),
                                  std::llround(static_cast<double>(uv[v].y) * 1e6))
                   : glm::i64vec2(std::numeric_limits<std::int64_t>::max());
  }
  const auto before = [&](std::uint32_t a, std::uint32_t b) {
    if (cell[a].x != cell[b].x) return cell[a].x < cell[b].x;
    if (cell[a].y != cell[b].y) return cell[a].y < cell[b].y;
    return a < b;
  };
  std::sort(order.begin(), order.end(), before);
  std::vector<std::uint32_t> parent(uv.size());
  std::iota(parent.begin(), parent.end(), 0u);
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (cell[order[i]] == cell[order[i - 1]]) parent[order[i]] = parent[order[i - 1]];
  }
  const auto join = [&](std::uint32_t a, std::uint32_t b) {
    a = find_root(parent, a);
    b = find_root(parent, b);
    parent[std::max(a, b)] = std::min(a, b);
  };
  for (std::size_t k = 0; k + 2 < indices.size(); k += 3) {
    join(indices[k], indices[k + 1]);
    join(indices[k], indices[k + 2]);
  }
  UvCharts charts;
  std::vector<std::uint32_t> number(uv.size(), kNobody);
  for (std::size_t k = 0; k + 2 < indices.size(); k += 3) {
    std::uint32_t& n = number[find_root(parent, indices[k])];
    if (n == kNobody) n = static_cast<std::uint32_t>(charts.count++);
    charts.of_triangle.push_back(n);
  }
  return charts;
}

int measure_gutter(std::span<const glm::vec2> uv, std::span<const std::uint32_t> indices,
                   const UvCharts& charts, glm::ivec2 size, int most) {
  std::vector<std::uint32_t> owner(
      static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y), kNobody);
  for_each_owned(uv, indices, size,
                 [&](std::size_t t, std::size_t texel) { owner[texel] = charts.of_triangle[t]; });
  const auto at = [&](int x, int y) {
    return owner[static_cast<std::size_t>(y) * static_cast<std::size_t>(size.x) +
                 static_cast<std::size_t>(x)];
  };
  // Of two charts that near each other, one has a texel whose neighbourhood meets the other's.
  int least = most;
  for (int y = 0; y < size.y; ++y) {
    for (int x = 0; x < size.x; ++x) {
      const std::uint32_t own = at(x, y);
      if (own == kNobody) continue;
      for (int dy = 0; dy <= least && y + dy < size.y; ++dy) {
        for (int dx = -least; dx <= least; ++dx) {
          if (x + dx < 0 || x + dx >= size.x) continue;
          const std::uint32_t other = at(x + dx, y + dy);
          if (other == kNobody || other == own) continue;
          least = std::min(least, std::max(std::abs(dx), dy) - 1);
        }
      }
      if (least <= 0) return 0;
    }
  }
  return least;
}

}  // namespace relit::bake
