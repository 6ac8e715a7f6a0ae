// SPDX-License-Identifier: MIT
#include "bake_minimal/unwrap.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <queue>
#include <tuple>

#include "bake_minimal/unwrap_charts.hpp"
#include "decoders/texel_raster.hpp"

namespace relit::bake {
namespace {

// How much of the atlas charts come to fill; only used to tell which ones are too long for it.
constexpr double kExpectedFill = 0.65;
// Triangles that may be laid flat in trial unions, over those of the surface: bounds the time.
constexpr std::size_t kMergeEffort = 20;
constexpr double kOverlapFineness = 8;  // of the check within a chart, over the baked texels
constexpr int kTrialGrid = 128;
constexpr std::size_t kGreatestTrimmed = 64;
constexpr int kGreatestCuts = 6;
constexpr std::size_t kCutCandidates = 5;
constexpr std::size_t kGreatestPieces = 4;
constexpr double kLeastGain = 1.04;  // in scale, for one more seam
constexpr double kGoodFill = 0.72;
constexpr double kSmallChart = 6;         // texels a side
constexpr double kLeastShapeFill = 0.35;  // of the bounding rectangle, after a union

FlattenLimits cut_limits(const Surface& surface, const ChartPackOptions& options) {
  double area = 0;
  for (const double a : surface.areas) area += a;
  const double texels = double{kExpectedFill} * options.width * options.height;
  const double metres_a_texel = std::sqrt(area / texels);
  FlattenLimits limits;
  limits.greatest_side = 0.95 * metres_a_texel * std::max(options.width, options.height);
  limits.greatest_short_side = 0.95 * metres_a_texel * std::min(options.width, options.height);
  limits.overlap_scale = kOverlapFineness / metres_a_texel;
  return limits;
}

FlattenLimits union_limits(FlattenLimits limits) {
  limits.least_density = 0.85;
  limits.greatest_density = 1.18;
  limits.greatest_anisotropy = 1.6;
  limits.least_fill = kLeastShapeFill;
  return limits;
}

// Lays a patch flat, in as many pieces as it takes.
void flatten_pieces(const Surface& surface, std::vector<std::uint32_t> patch,
                    const FlattenLimits& limits, std::vector<FlatChart>& charts) {
  std::vector<std::vector<std::uint32_t>> stack{std::move(patch)};
  while (!stack.empty()) {
    const std::vector<std::uint32_t> piece = std::move(stack.back());
    stack.pop_back();
    if (auto chart = flatten_patch(surface, piece, limits)) {
      charts.push_back(*std::move(chart));
      continue;
    }
    auto parts = split_patch(surface, piece);
    stack.push_back(std::move(parts[1]));
    stack.push_back(std::move(parts[0]));
  }
}

class Merger {
 public:
  Merger(const Surface& surface, std::vector<FlatChart> charts, const FlattenLimits& limits,
         double small_area)
      : surface_(surface),
        limits_(limits),
        small_area_(small_area),
        charts_(std::move(charts)),
        version_(charts_.size(), 0),
        chart_of_(surface.triangles.size(), kNoTriangle) {
    for (std::uint32_t c = 0; c < charts_.size(); ++c) claim(c);
  }

  std::vector<FlatChart> run() {
    for (std::uint32_t c = 0; c < charts_.size(); ++c) push_pairs(c, true);
    std::size_t effort = 0;
    while (!queue_.empty() && effort < kMergeEffort * surface_.triangles.size()) {
      const Pair pair = queue_.top();
      queue_.pop();
      if (version_[pair.a] != pair.version_a || version_[pair.b] != pair.version_b) continue;
      std::vector<std::uint32_t> both = charts_[pair.a].triangles;
      const auto& other = charts_[pair.b].triangles;
      both.insert(both.end(), other.begin(), other.end());
      std::sort(both.begin(), both.end());
      effort += both.size();
      auto merged = flatten_patch(surface_, both, limits_);
      if (!merged) continue;
      charts_[pair.a] = *std::move(merged);
      charts_[pair.b].triangles.clear();
      ++version_[pair.a];
      ++version_[pair.b];
      claim(pair.a);
      push_pairs(pair.a, false);
    }
    std::erase_if(charts_, [](const FlatChart& c) { return c.triangles.empty(); });
    return std::move(charts_);
  }

 private:
  struct Pair {
    double score;
    std::uint32_t a, b;
    std::uint32_t version_a, version_b;
    bool operator<(const Pair& o) const {
      return std::tie(score, o.a, o.b) < std::tie(o.score, a, b);
    }
  };

  void claim(std::uint32_t c) {
    for (const std::uint32_t t : charts_[c].triangles) chart_of_[t] = c;
  }

  struct Border {
    double length = 0;  // a crease is the better place for a seam, so it counts half
    double sharp = 0;
  };

  void push_pairs(std::uint32_t c, bool only_later) {
    std::map<std::uint32_t, Border> borders;
    for (const std::uint32_t t : charts_[c].triangles) {
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t n = surface_.neighbours[t][i];
        if (n == kNoTriangle || chart_of_[n] == c) continue;
        const double edge = surface_.edge_length(t, i);
        Border& border = borders[chart_of_[n]];
        border.length += surface_.creases[t][i] == Crease::kSmooth ? edge : edge / 2;
        if (surface_.creases[t][i] == Crease::kSharp) border.sharp += edge / 2;
      }
    }
    for (const auto& [other, border] : borders) {
      if (only_later && other < c) continue;
      // Light breaks off at a sharp edge, and filtering would blur it; charts of few texels are
      // unfolded all the same, since gutters would cost more than they show.
      const bool sharp = border.sharp > 0.5 * border.length;
      if (sharp && std::min(charts_[c].area, charts_[other].area) > small_area_) continue;
      const double outline = std::min(charts_[c].outline, charts_[other].outline);
      if (!(outline > 0)) continue;
      const std::uint32_t a = std::min(c, other), b = std::max(c, other);
      queue_.push({border.length / outline, a, b, version_[a], version_[b]});
    }
  }

  const Surface& surface_;
  const FlattenLimits& limits_;
  double small_area_;
  std::vector<FlatChart> charts_;
  std::vector<std::uint32_t> version_;
  std::vector<std::uint32_t> chart_of_;
  std::priority_queue<Pair> queue_;
};

// Cuts large charts through the middle where that lets everything be packed at a clearly larger
// scale: two squares fill half a square, but a square and two halves nearly all of it. Judged on a
// coarse grid.
class Trimmer {
 public:
  Trimmer(const Surface& surface, const FlattenLimits& limits, const ChartPackOptions& options)
      : surface_(surface), limits_(limits), options_(options) {
    const int larger = std::max(options.width, options.height);
    options_.greatest_grid = std::min(larger, kTrialGrid);
  }

  void run(std::vector<FlatChart>& charts) const {
    if (charts.size() > kGreatestTrimmed) return;
    double scale = 0;
    for (int cuts = 0; cuts < kGreatestCuts; ++cuts) {
      const auto packed = pack_shapes(shapes_of(charts), options_);
      if (!packed) return;
      scale = std::max(packed->scale, scale);
      if (fill(charts, scale) > kGoodFill || !cut_one(charts, scale * kLeastGain)) return;
      scale *= kLeastGain;
    }
  }

 private:
  static std::vector<PackShape> shapes_of(const std::vector<FlatChart>& charts) {
    std::vector<PackShape> shapes;
    for (const FlatChart& c : charts) shapes.push_back(to_shape(c));
    return shapes;
  }

  double fill(const std::vector<FlatChart>& charts, double scale) const {
    double area = 0;
    for (const FlatChart& c : charts) area += c.area;
    return area * scale * scale / (static_cast<double>(options_.width) * options_.height);
  }

  bool cut_one(std::vector<FlatChart>& charts, double scale) const {
    std::vector<std::size_t> order(charts.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return charts[a].size.x > charts[b].size.x;
    });
    order.resize(std::min<std::size_t>(order.size(), kCutCandidates));
    for (const std::size_t c : order) {
      std::vector<FlatChart> pieces = halves(charts[c]);
      if (pieces.size() < 2 || pieces.size() > kGreatestPieces) continue;
      std::vector<FlatChart> trial = charts;
      trial[c] = std::move(pieces.back());
      pieces.pop_back();
      std::move(pieces.begin(), pieces.end(), std::back_inserter(trial));
      if (!shapes_fit(shapes_of(trial), options_, scale)) continue;
      charts = std::move(trial);
      return true;
    }
    return false;
  }

  std::vector<FlatChart> halves(const FlatChart& chart) const {
    std::array<std::vector<std::uint32_t>, 2> sides;
    for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
      double x = 0;
      for (std::size_t k = 0; k < 3; ++k) x += chart.uv[chart.corners[3 * i + k]].x;
      sides[x < 1.5 * chart.size.x ? 0 : 1].push_back(chart.triangles[i]);
    }
    std::vector<FlatChart> pieces;
    if (sides[0].empty() || sides[1].empty()) return pieces;
    for (const auto& side : sides) {
      for (auto& part : connected_parts(surface_, side)) {
        flatten_pieces(surface_, std::move(part), limits_, pieces);
      }
    }
    return pieces;
  }

  const Surface& surface_;
  const FlattenLimits& limits_;
  ChartPackOptions options_;
};

// Charts with a texel that two of their own triangles own, at the baked size.
std::vector<bool> self_overlapping(std::span<const FlatChart> charts, std::span<const glm::vec2> uv,
                                   const ChartPackOptions& options) {
  std::vector<std::uint32_t> owner(
      static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height),
      kNoTriangle);
  std::vector<bool> bad(charts.size(), false);
  for (std::uint32_t c = 0; c < charts.size(); ++c) {
    for (const std::uint32_t t : charts[c].triangles) {
      const std::size_t k = 3 * static_cast<std::size_t>(t);
      decoders::FixedTriangle(uv[k], uv[k + 1], uv[k + 2], options.width, options.height)
          .for_each_row(0, options.height, options.width, [&](int y, int x0, int x1) {
            for (int x = x0; x <= x1; ++x) {
              auto& o =
                  owner[static_cast<std::size_t>(y) * static_cast<std::size_t>(options.width) +
                        static_cast<std::size_t>(x)];
              if (o == c) bad[c] = true;
              o = c;
            }
          });
    }
  }
  return bad;
}

bool cut_overlapping(const Surface& surface, const FlattenLimits& limits,
                     const std::vector<bool>& bad, std::vector<FlatChart>& charts) {
  std::vector<FlatChart> next;
  bool changed = false;
  for (std::size_t c = 0; c < charts.size(); ++c) {
    if (!bad[c] || charts[c].triangles.size() < 2) {
      next.push_back(std::move(charts[c]));
      continue;
    }
    changed = true;
    for (auto& part : split_patch(surface, charts[c].triangles)) {
      flatten_pieces(surface, std::move(part), limits, next);
    }
  }
  charts = std::move(next);
  return changed;
}

// Triangles without area: all three corners at one place that a neighbour knows, so that they own
// no texel and read a sensible one should they open up later in the clip.
void place_degenerate(const Surface& surface, std::vector<glm::vec2>& uv) {
  std::vector<std::optional<glm::vec2>> known(surface.points.size());
  std::vector<std::uint32_t> waiting;
  glm::vec2 anywhere(0.5f);
  bool any = false;
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    if (surface.areas[t] <= 0) {
      waiting.push_back(t);
      continue;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      auto& k = known[surface.triangles[t][i]];
      if (!k) k = uv[3 * static_cast<std::size_t>(t) + i];
    }
    if (!any) anywhere = uv[3 * static_cast<std::size_t>(t)];
    any = true;
  }
  const auto settle = [&](std::uint32_t t, const glm::vec2& place) {
    for (std::size_t i = 0; i < 3; ++i) {
      uv[3 * static_cast<std::size_t>(t) + i] = place;
      auto& k = known[surface.triangles[t][i]];
      if (!k) k = place;
    }
  };
  for (bool changed = true; changed && !waiting.empty();) {
    const std::size_t before = waiting.size();
    std::erase_if(waiting, [&](std::uint32_t t) {
      for (const std::uint32_t p : surface.triangles[t]) {
        if (!known[p]) continue;
        settle(t, *known[p]);
        return true;
      }
      return false;
    });
    changed = waiting.size() != before;
  }
  for (const std::uint32_t t : waiting) settle(t, anywhere);
}

}  // namespace

std::vector<FlatChart> make_charts(const Surface& surface, const ChartPackOptions& options) {
  const FlattenLimits limits = cut_limits(surface, options);
  std::vector<FlatChart> charts;
  for (auto& patch : grow_patches(surface)) {
    flatten_pieces(surface, std::move(patch), limits, charts);
  }
  const double texel = kOverlapFineness / limits.overlap_scale;
  const double small_area = kSmallChart * kSmallChart * texel * texel;
  const FlattenLimits tighter = union_limits(limits);
  charts = Merger(surface, std::move(charts), tighter, small_area).run();
  Trimmer(surface, limits, options).run(charts);
  return charts;
}

PackShape to_shape(const FlatChart& chart) {
  PackShape shape;
  shape.points = chart.uv;
  for (std::size_t k = 0; k + 2 < chart.corners.size(); k += 3) {
    shape.triangles.push_back({chart.corners[k], chart.corners[k + 1], chart.corners[k + 2]});
  }
  return shape;
}

glm::vec2 snap_uv(const glm::dvec2& uv) {
  return glm::vec2(glm::round(glm::clamp(uv, 0.0, 1.0) * 65535.0) / 65535.0);
}

std::vector<glm::vec2> corner_uvs(const Surface& surface, std::span<const FlatChart> charts,
                                  std::span<const std::vector<glm::dvec2>> texels,
                                  const ChartPackOptions& options) {
  std::vector<glm::vec2> uv(3 * surface.triangles.size(), glm::vec2(0.5f));
  const glm::dvec2 size(options.width, options.height);
  for (std::size_t c = 0; c < charts.size(); ++c) {
    for (std::size_t i = 0; i < charts[c].triangles.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        uv[3 * static_cast<std::size_t>(charts[c].triangles[i]) + k] =
            snap_uv(texels[c][charts[c].corners[3 * i + k]] / size);
      }
    }
  }
  place_degenerate(surface, uv);
  return uv;
}

Result<Unwrapped> unwrap_surface(const SurfaceInput& input, const ChartPackOptions& options) {
  const Surface surface(input);
  std::vector<FlatChart> charts = make_charts(surface, options);
  const FlattenLimits limits = cut_limits(surface, options);
  while (true) {
    std::vector<PackShape> shapes;
    for (const FlatChart& c : charts) shapes.push_back(to_shape(c));
    RELIT_ASSIGN(const PackResult packed, pack_shapes(shapes, options));
    Unwrapped out;
    out.corner_uv = corner_uvs(surface, charts, packed.points, options);
    out.charts = static_cast<int>(charts.size());
    // Overlaps finer than the check within a chart; every round cuts, so this ends.
    const std::vector<bool> bad = self_overlapping(charts, out.corner_uv, options);
    if (!cut_overlapping(surface, limits, bad, charts)) return out;
  }
}

}  // namespace relit::bake
