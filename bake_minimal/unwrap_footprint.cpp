// SPDX-License-Identifier: MIT
#include "bake_minimal/unwrap_footprint.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "bake_minimal/cross2.hpp"
#include "decoders/texel_raster.hpp"

namespace relit::bake {
namespace {

struct Crossing {
  int row;
  double x;
  int direction;
};

class Mask {
 public:
  explicit Mask(glm::ivec2 size)
      : size_(size), bits_(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y)) {}

  void mark(int y, double from, double to) {
    const int x0 = std::max(0, static_cast<int>(std::ceil(from - 0.5)));
    const int x1 = std::min(size_.x - 1, static_cast<int>(std::floor(to - 0.5)));
    if (x0 > x1) return;
    std::uint8_t* row =
        bits_.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(size_.x);
    std::fill(row + x0, row + x1 + 1, std::uint8_t{1});
  }

  void mark_near(const glm::dvec2& a, const glm::dvec2& b, double reach) {
    const int y0 = std::max(0, static_cast<int>(std::ceil(std::min(a.y, b.y) - reach - 0.5)));
    const int y1 =
        std::min(size_.y - 1, static_cast<int>(std::floor(std::max(a.y, b.y) + reach - 0.5)));
    for (int y = y0; y <= y1; ++y) {
      const decoders::SlabExtent e =
          decoders::slab_extent({a, b, b}, y + 0.5 - reach, y + 0.5 + reach);
      mark(y, e.lo - reach, e.hi + reach);
    }
  }

  void fill(std::vector<Crossing>& crossings) {
    std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
      return a.row != b.row ? a.row < b.row : a.x < b.x;
    });
    int winding = 0;
    for (std::size_t i = 0; i + 1 < crossings.size(); ++i) {
      winding += crossings[i].direction;
      if (crossings[i + 1].row != crossings[i].row) {
        winding = 0;
      } else if (winding != 0) {
        mark(crossings[i].row, crossings[i].x, crossings[i + 1].x);
      }
    }
  }

  std::vector<CellRun> runs() const {
    std::vector<CellRun> out;
    for (int y = 0; y < size_.y; ++y) {
      const std::uint8_t* row =
          bits_.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(size_.x);
      for (int x = 0; x < size_.x;) {
        if (row[x] == 0) {
          ++x;
          continue;
        }
        const int first = x;
        while (x < size_.x && row[x] != 0) ++x;
        out.push_back({static_cast<std::int16_t>(y), static_cast<std::int16_t>(first),
                       static_cast<std::int16_t>(x - 1)});
      }
    }
    return out;
  }

 private:
  glm::ivec2 size_;
  std::vector<std::uint8_t> bits_;
};

void add_crossings(const glm::dvec2& a, const glm::dvec2& b, int rows,
                   std::vector<Crossing>& crossings) {
  const glm::dvec2& low = a.y < b.y ? a : b;
  const glm::dvec2& high = a.y < b.y ? b : a;
  const int y0 = std::max(0, static_cast<int>(std::ceil(low.y - 0.5)));
  for (int y = y0; y < rows && y + 0.5 < high.y; ++y) {
    const double x = low.x + (high.x - low.x) * ((y + 0.5 - low.y) / (high.y - low.y));
    crossings.push_back({y, x, a.y < b.y ? 1 : -1});
  }
}

}  // namespace

std::vector<OutlineEdge> find_outline(std::span<const glm::dvec2> points,
                                      std::span<const std::array<std::uint32_t, 3>> triangles) {
  std::map<OutlineEdge, int> count;  // by (lower, higher) point: forward minus backward
  std::vector<OutlineEdge> outline;
  for (const auto& t : triangles) {
    const double area = cross2(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]]);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      if (area == 0) {
        outline.push_back({a, b});
        outline.push_back({b, a});
        continue;
      }
      count[{std::min(a, b), std::max(a, b)}] += (a < b) == (area > 0) ? 1 : -1;
    }
  }
  for (const auto& [edge, n] : count) {
    for (int i = 0; i < std::abs(n); ++i) {
      outline.push_back(n > 0 ? edge : OutlineEdge{edge[1], edge[0]});
    }
  }
  return outline;
}

std::vector<CellRun> find_cells(std::span<const glm::dvec2> points,
                                std::span<const OutlineEdge> outline, double reach,
                                glm::ivec2 size) {
  Mask mask(size);
  std::vector<Crossing> crossings;
  for (const OutlineEdge& e : outline) {
    add_crossings(points[e[0]], points[e[1]], size.y, crossings);
    mask.mark_near(points[e[0]], points[e[1]], reach);
  }
  mask.fill(crossings);
  std::vector<CellRun> runs = mask.runs();
  if (runs.empty()) runs.push_back({0, 0, 0});
  std::stable_sort(runs.begin(), runs.end(), [](const CellRun& a, const CellRun& b) {
    return a.last - a.first > b.last - b.first;
  });
  return runs;
}

}  // namespace relit::bake
