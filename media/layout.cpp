// SPDX-License-Identifier: MIT
#include "media/layout.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <optional>

#include "media/exact_math.hpp"

namespace relit::media {
namespace {

constexpr std::size_t kGrid = 128;
using BitRow = std::bitset<kGrid>;

// A chart's texels, dilated by one: two dilated masks that do not meet leave two empty texels.
struct Mask {
  std::vector<BitRow> rows;
  std::size_t width = 0;
  std::size_t texels = 0;
};

double widest_row(const Chart& chart) {
  return *std::max_element(chart.row_width.begin(), chart.row_width.end());
}

double disc_radius(const Chart& chart) { return chart.row_at.back(); }

glm::dvec2 chart_size(const Chart& chart) {
  if (chart.unroll == Unroll::kDisc) return glm::dvec2(2.0 * disc_radius(chart));
  return {widest_row(chart), chart.row_at.back()};
}

// Half the width of the chart at distance `y` from its first row.
double half_width(const Chart& chart, double y) {
  if (chart.unroll == Unroll::kDisc) {
    const double r = disc_radius(chart), h = y - r;
    return std::sqrt(std::max(r * r - h * h, 0.0));
  }
  const auto& at = chart.row_at;
  if (y <= at.front()) return 0.5 * chart.row_width.front();
  for (std::size_t i = 0; i + 1 < at.size(); ++i) {
    if (y > at[i + 1]) continue;
    const double f = at[i + 1] > at[i] ? (y - at[i]) / (at[i + 1] - at[i]) : 0.0;
    return 0.5 * (chart.row_width[i] + (chart.row_width[i + 1] - chart.row_width[i]) * f);
  }
  return 0.5 * chart.row_width.back();
}

std::vector<std::vector<bool>> outline(const Chart& chart, double scale, bool turned) {
  const glm::dvec2 size = chart_size(chart) * scale;
  const auto w = static_cast<std::size_t>(std::ceil(size.x)),
             h = static_cast<std::size_t>(std::ceil(size.y));
  std::vector<std::vector<bool>> cells(turned ? w : h, std::vector<bool>(turned ? h : w, false));
  for (std::size_t y = 0; y < h; ++y) {
    double half = 0.0;
    for (int k = 0; k <= 8; ++k) {
      half =
          std::max(half, half_width(chart, (static_cast<double>(y) + 0.125 * k) / scale) * scale);
    }
    for (std::size_t x = 0; x < w; ++x) {
      const double left = static_cast<double>(x) - 0.5 * size.x, right = left + 1.0;
      if (right <= -half || left >= half) continue;
      if (turned) {
        cells[x][y] = true;
      } else {
        cells[y][x] = true;
      }
    }
  }
  return cells;
}

std::optional<Mask> make_mask(const Chart& chart, double scale, bool turned) {
  const auto cells = outline(chart, scale, turned);
  if (cells.size() + 2 > kGrid || cells[0].size() + 2 > kGrid) return std::nullopt;
  Mask mask{.rows = std::vector<BitRow>(cells.size() + 2), .width = cells[0].size() + 2};
  for (std::size_t y = 0; y < cells.size(); ++y) {
    for (std::size_t x = 0; x < cells[y].size(); ++x) {
      if (!cells[y][x]) continue;
      ++mask.texels;
      for (std::size_t dy = 0; dy < 3; ++dy) {
        for (std::size_t dx = 0; dx < 3; ++dx) mask.rows[y + dy].set(x + dx);
      }
    }
  }
  return mask;
}

bool meets(const std::vector<BitRow>& taken, const Mask& mask, std::size_t x, std::size_t y) {
  for (std::size_t r = 0; r < mask.rows.size(); ++r) {
    if (((mask.rows[r] << x) & taken[y + r]).any()) return true;
  }
  return false;
}

struct Spot {
  std::size_t x = 0, y = 0;
};

std::optional<Spot> find_spot(const std::vector<BitRow>& taken, const Mask& mask) {
  for (std::size_t y = 0; y + mask.rows.size() <= kGrid; ++y) {
    for (std::size_t x = 0; x + mask.width <= kGrid; ++x) {
      if (!meets(taken, mask, x, y)) return Spot{x, y};
    }
  }
  return std::nullopt;
}

// The first chart is the largest, and goes to the corner; every other one to the lowest row that
// takes it.
std::optional<Layout> try_scale(std::span<const Chart> charts, std::span<const std::size_t> order,
                                double texels_per_metre) {
  Layout layout{.placements = std::vector<Placement>(charts.size()),
                .texels_per_metre = texels_per_metre};
  std::vector<BitRow> taken(kGrid);
  std::size_t texels = 0;
  for (const std::size_t i : order) {
    const double scale = texels_per_metre * charts[i].weight;
    std::optional<Spot> best;
    Mask best_mask;
    bool turned = false;
    for (const bool turn : {false, true}) {
      const auto mask = make_mask(charts[i], scale, turn);
      const auto spot = mask ? find_spot(taken, *mask) : std::nullopt;
      if (!spot) continue;
      if (best && spot->y + mask->rows.size() >= best->y + best_mask.rows.size()) continue;
      best = spot;
      best_mask = *mask;
      turned = turn;
    }
    if (!best) return std::nullopt;
    for (std::size_t r = 0; r < best_mask.rows.size(); ++r)
      taken[best->y + r] |= best_mask.rows[r] << best->x;
    texels += best_mask.texels;
    layout.placements[i] = {
        .scale = scale / kGrid,
        .origin = glm::dvec2(static_cast<double>(best->x + 1), static_cast<double>(best->y + 1)) /
                  double{kGrid},
        .widest = charts[i].unroll == Unroll::kDisc ? 2.0 * disc_radius(charts[i])
                                                    : widest_row(charts[i]),
        .turned = turned};
  }
  layout.coverage = static_cast<double>(texels) / (kGrid * kGrid);
  return layout;
}

}  // namespace

glm::dvec2 Placement::place(const Chart& chart, std::size_t row, double turn) const {
  glm::dvec2 local;
  if (chart.unroll == Unroll::kDisc) {
    const double angle = kTau * turn;
    local = glm::dvec2(0.5 * widest) +
            chart.row_at[row] * glm::dvec2(exact_sin(angle), exact_cos(angle));
  } else {
    local = {0.5 * widest + (turn - 0.5) * chart.row_width[row], chart.row_at[row]};
  }
  if (turned) std::swap(local.x, local.y);
  return origin + scale * local;
}

Layout lay_out(std::span<const Chart> charts) {
  std::vector<std::vector<std::size_t>> orders(3, std::vector<std::size_t>(charts.size()));
  for (std::size_t k = 0; k < orders.size(); ++k) {
    std::iota(orders[k].begin(), orders[k].end(), std::size_t{0});
    std::stable_sort(orders[k].begin(), orders[k].end(), [&](std::size_t a, std::size_t b) {
      const auto key = [&](std::size_t i) {
        const glm::dvec2 size = chart_size(charts[i]) * charts[i].weight;
        const double large = std::max(size.x, size.y), small = std::min(size.x, size.y);
        return k == 0 ? large : k == 1 ? small : large * small;
      };
      return key(a) > key(b);
    });
  }
  Layout best;
  for (const auto& order : orders) {
    for (double step = 16.0; step > 0.1; step *= 0.5) {
      while (const auto layout = try_scale(charts, order, best.texels_per_metre + step))
        best = *layout;
    }
  }
  return best;
}

}  // namespace relit::media
