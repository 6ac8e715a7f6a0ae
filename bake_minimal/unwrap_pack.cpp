// SPDX-License-Identifier: MIT
#include "bake_minimal/unwrap_pack.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>

#include "bake_minimal/cross2.hpp"
#include "bake_minimal/unwrap_footprint.hpp"

namespace relit::bake {
namespace {

constexpr double kLeastThickness = 0.5;  // texels
constexpr std::size_t kGreatestNested = 3000;
constexpr int kSearchSteps = 10;
constexpr double kScaleTolerance = 1.004;
constexpr std::size_t kFewShapes = 16;
constexpr double kOpen = 1e-6;

// The cells of a shape at its place in the corner of the grid: those it covers, which keep the
// gutter, and those that bilinear fetches inside it read, which nobody else may read.
struct Footprint {
  std::vector<CellRun> covered;
  std::vector<CellRun> read;
  glm::ivec2 size{0};
};

// `covered` and `read` have their longest runs first: those find no room, and skip most then.
struct Placed {
  std::vector<glm::dvec2> points;  // in cells, from the grid's corner
  Footprint footprint;
};

// One shape at every turn that is tried; nothing where it is too large for the atlas.
using Candidates = std::vector<std::optional<Placed>>;

// Occupied cells; knows for every cell the nearest occupied one at or before it in its row, so that
// a run is tested, and the place beyond an obstacle found, in one look.
class Occupancy {
 public:
  explicit Occupancy(glm::ivec2 size)
      : size_(size),
        last_(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y), -1),
        gap_(static_cast<std::size_t>(size.y), size.x) {}

  std::int16_t last_occupied(int x, int y) const { return row(y)[x]; }

  // Whether row y may have room for a run so long; as of the last note_gaps().
  bool may_hold(int y, int length) const { return gap_[static_cast<std::size_t>(y)] >= length; }

  void note_gaps(int y0, int y1) {
    for (int y = std::max(y0, 0); y <= std::min(y1, size_.y - 1); ++y) {
      const std::int16_t* r = row(y);
      int longest = 0;
      for (int x = 0; x < size_.x; ++x) longest = std::max(longest, x - r[x]);
      gap_[static_cast<std::size_t>(y)] = longest;
    }
  }

  void occupy(int y, int x0, int x1) {
    if (y < 0 || y >= size_.y) return;
    x0 = std::max(x0, 0);
    x1 = std::min(x1, size_.x - 1);
    std::int16_t* r = row(y);
    for (int x = x0; x <= x1; ++x) r[x] = static_cast<std::int16_t>(x);
    for (int x = x1 + 1; x < size_.x && r[x] < x1; ++x) r[x] = static_cast<std::int16_t>(x1);
  }

 private:
  std::int16_t* row(int y) {
    return last_.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(size_.x);
  }
  const std::int16_t* row(int y) const {
    return last_.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(size_.x);
  }

  glm::ivec2 size_;
  std::vector<std::int16_t> last_;
  std::vector<int> gap_;
};

// The first x from `x` on at which no run meets an occupied cell, as far as this pass saw; equal to
// x when none does.
int next_free(const Occupancy& grid, const std::vector<CellRun>& runs, int x, int y) {
  int next = x;
  for (const CellRun& run : runs) {
    const int hit = grid.last_occupied(next + run.last, y + run.row);
    if (hit >= next + run.first) return hit - run.first + 1;
  }
  return next;
}

class Packer {
 public:
  Packer(std::span<const PackShape> shapes, const ChartPackOptions& options)
      : shapes_(shapes), options_(options) {
    const int larger = std::max(options.width, options.height);
    while (larger > options.greatest_grid * unit_) unit_ *= 2;
    grid_size_ = {options.width / unit_, options.height / unit_};
    // A coarse cell counts as covered when it is touched; one empty cell then keeps fetches apart.
    gutter_ = unit_ == 1 ? options.gutter : std::max(1, (options.gutter + unit_ - 1) / unit_);
    covered_reach_ = unit_ == 1 ? 1.0 / 128 : 0.5;
    read_reach_ = (unit_ == 1 ? 1.0 : 0.5) - kOpen;
    inset_ = 0.5 / unit_;
    // Quarter turns first: between equals they keep straight borders on the grid.
    turns_ = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    const int finer = options.quarter_turns_only        ? 1
                      : shapes.size() <= kFewShapes     ? 4
                      : shapes.size() <= 4 * kFewShapes ? 2
                                                        : 1;
    for (int k = 1; k < finer; ++k) {
      const double angle = std::numbers::pi / 2 * k / finer;
      for (int quarter = 0; quarter < 4; ++quarter) {
        const double a = angle + quarter * std::numbers::pi / 2;
        turns_.emplace_back(std::cos(a), std::sin(a));
      }
    }
    for (const PackShape& s : shapes_) {
      outlines_.push_back(find_outline(s.points, s.triangles));
      for (const auto& t : s.triangles) {
        area_ += std::abs(cross2(s.points[t[1]] - s.points[t[0]], s.points[t[2]] - s.points[t[0]]));
      }
    }
    area_ /= 2;
  }

  Result<PackResult> run() {
    const double full = grid_size_.x * static_cast<double>(grid_size_.y);
    // In cells per unit. Nothing with area: any scale does.
    const double greatest = area_ > 0 ? std::sqrt(full / area_) : 1.0;
    double good = 0;
    double bad = greatest;
    std::optional<std::vector<Placed>> best;
    search(good, bad, best, [&](double s) { return try_rectangles(s); });
    if (shapes_.size() <= kGreatestNested) {
      bad = greatest;
      search(good, bad, best, [&](double s) { return try_nested(s); });
    }
    if (!best) {
      return fail(ErrorCode::kLimit,
                  "light map: " + std::to_string(shapes_.size()) + " charts with gutters of " +
                      std::to_string(options_.gutter) + " texels do not fit " +
                      std::to_string(options_.width) + "x" + std::to_string(options_.height) +
                      " texels; a larger size would do");
    }
    PackResult result;
    result.scale = good * unit_;
    for (Placed& p : *best) {
      for (glm::dvec2& q : p.points) q *= unit_;
      result.points.push_back(std::move(p.points));
    }
    return result;
  }

  bool fits(double scale) const { return try_nested(scale / unit_).has_value(); }

 private:
  template <class Try>
  void search(double& good, double& bad, std::optional<std::vector<Placed>>& best, Try attempt) {
    // From nothing known, first down by halves until something fits.
    for (int halvings = 0; good == 0 && halvings < 24; ++halvings) {
      const double s = bad / 2;
      if (auto placed = attempt(s)) {
        best = std::move(placed);
        good = s;
      } else {
        bad = s;
      }
    }
    if (good == 0) return;
    for (int step = 0; step < kSearchSteps && bad > good * kScaleTolerance; ++step) {
      const double s = (good + bad) / 2;
      if (auto placed = attempt(s)) {
        best = std::move(placed);
        good = s;
      } else {
        bad = s;
      }
    }
  }

  // The shape at a scale, turned, from the inset on, with a texel centre inside.
  std::vector<glm::dvec2> transformed(const PackShape& shape, double scale,
                                      const glm::dvec2& turn) const {
    std::vector<glm::dvec2> out;
    out.reserve(shape.points.size());
    for (const glm::dvec2& p : shape.points) {
      out.emplace_back(scale * (p.x * turn.x - p.y * turn.y),
                       scale * (p.x * turn.y + p.y * turn.x));
    }
    glm::dvec2 lo, hi;
    bounds(out, lo, hi);
    const double least = kLeastThickness / unit_;
    for (int axis = 0; axis < 2; ++axis) {
      const double size = hi[axis] - lo[axis];
      const double stretch = size > 0 && size < least ? least / size : 1.0;
      for (glm::dvec2& q : out) q[axis] = (q[axis] - lo[axis]) * stretch + inset_;
    }
    bounds(out, lo, hi);
    const double small = 4.0 / unit_;
    if (hi.x - lo.x < small || hi.y - lo.y < small) centre_largest_triangle(shape, out);
    return out;
  }

  static void bounds(const std::vector<glm::dvec2>& points, glm::dvec2& lo, glm::dvec2& hi) {
    lo = glm::dvec2(std::numeric_limits<double>::infinity());
    hi = -lo;
    for (const glm::dvec2& q : points) {
      lo = glm::min(lo, q);
      hi = glm::max(hi, q);
    }
  }

  // Moves the points up to a texel further so that the largest triangle's incentre is a texel
  // centre.
  void centre_largest_triangle(const PackShape& shape, std::vector<glm::dvec2>& points) const {
    double largest = 0;
    glm::dvec2 incentre(0.0);
    for (const auto& t : shape.triangles) {
      const glm::dvec2 a = points[t[0]], b = points[t[1]], c = points[t[2]];
      const double area = std::abs(cross2(b - a, c - a));
      if (area <= largest) continue;
      largest = area;
      const double la = glm::length(b - c), lb = glm::length(c - a), lc = glm::length(a - b);
      incentre = (a * la + b * lb + c * lc) / (la + lb + lc);
    }
    if (largest <= 0) return;
    const glm::dvec2 texel = incentre * static_cast<double>(unit_) - 0.5;
    const glm::dvec2 shift = (glm::ceil(texel - 1e-9) - texel) / static_cast<double>(unit_);
    for (glm::dvec2& q : points) q += shift;
  }

  std::optional<std::vector<Placed>> try_rectangles(double scale) const {
    std::vector<Placed> placed(shapes_.size());
    std::vector<glm::ivec2> sizes(shapes_.size()), at(shapes_.size());
    for (std::size_t i = 0; i < shapes_.size(); ++i) {
      placed[i].points = transformed(shapes_[i], scale, turns_.front());
      glm::dvec2 lo, hi;
      bounds(placed[i].points, lo, hi);
      if (hi.x > grid_size_.x - inset_ || hi.y > grid_size_.y - inset_) return std::nullopt;
      const int gap = std::max(gutter_, 2);
      sizes[i] =
          glm::ivec2(static_cast<int>(std::floor(hi.x)), static_cast<int>(std::floor(hi.y))) + 1 +
          gap;
    }
    // The gap after the last column may hang over the border.
    if (!pack_rectangles(sizes, grid_size_ + std::max(gutter_, 2), at)) return std::nullopt;
    for (std::size_t i = 0; i < placed.size(); ++i) {
      for (glm::dvec2& q : placed[i].points) q += glm::dvec2(at[i]);
      glm::dvec2 lo, hi;
      bounds(placed[i].points, lo, hi);
      if (hi.x > grid_size_.x - inset_ || hi.y > grid_size_.y - inset_) return std::nullopt;
    }
    return placed;
  }

  std::optional<Placed> footprint(std::size_t i, double scale, const glm::dvec2& turn) const {
    Placed out;
    out.points = transformed(shapes_[i], scale, turn);
    glm::dvec2 lo, hi;
    bounds(out.points, lo, hi);
    if (hi.x > grid_size_.x - inset_ || hi.y > grid_size_.y - inset_) return std::nullopt;
    // Centred fetches at the very border read one cell more than is touched.
    const glm::ivec2 size = glm::min(
        glm::ivec2(static_cast<int>(std::floor(hi.x)), static_cast<int>(std::floor(hi.y))) + 2,
        grid_size_);
    out.footprint.covered = find_cells(out.points, outlines_[i], covered_reach_, size);
    out.footprint.read = find_cells(out.points, outlines_[i], read_reach_, size);
    // May be moved as long as its points keep the inset.
    out.footprint.size = {static_cast<int>(std::ceil(hi.x + inset_ - kOpen)),
                          static_cast<int>(std::ceil(hi.y + inset_ - kOpen))};
    return out;
  }

  std::optional<std::vector<Placed>> try_nested(double scale) const {
    const std::size_t count = shapes_.size();
    std::vector<Candidates> turned(count);
    std::vector<glm::dvec2> sizes(count);
    for (std::size_t i = 0; i < count; ++i) {
      for (const glm::dvec2& turn : turns_) turned[i].push_back(footprint(i, scale, turn));
      const auto any = std::find_if(turned[i].begin(), turned[i].end(),
                                    [](const auto& candidate) { return candidate.has_value(); });
      if (any == turned[i].end()) return std::nullopt;
      sizes[i] = glm::dvec2((*any)->footprint.size);
    }
    if (!room_for(turned)) return std::nullopt;
    // Large before small, in more than one sense where that is cheap.
    const int senses = count <= 4 * kFewShapes ? 3 : 1;
    for (int sense = 0; sense < senses; ++sense) {
      const auto weight = [&](std::size_t i) {
        const double longest = std::max(sizes[i].x, sizes[i].y);
        return sense == 0   ? longest * (sizes[i].x + sizes[i].y)
               : sense == 1 ? sizes[i].x * sizes[i].y
                            : longest;
      };
      std::vector<std::size_t> order(count);
      std::iota(order.begin(), order.end(), std::size_t{0});
      std::stable_sort(order.begin(), order.end(),
                       [&](std::size_t a, std::size_t b) { return weight(a) > weight(b); });
      if (auto placed = place_all(turned, order)) return placed;
    }
    return std::nullopt;
  }

  std::optional<std::vector<Placed>> place_all(const std::vector<Candidates>& turned,
                                               const std::vector<std::size_t>& order) const {
    Occupancy covered(grid_size_), read(grid_size_);
    std::vector<Placed> placed(turned.size());
    for (const std::size_t i : order) {
      if (!place(turned[i], covered, read, placed[i])) return std::nullopt;
    }
    return placed;
  }

  // Covered cells of two shapes are more than a gutter apart, so they stay disjoint when each grows
  // by the gutter to the right and upwards: their sum is a cheap bound.
  bool room_for(const std::vector<Candidates>& turned) const {
    std::int64_t cells = 0;
    for (const Candidates& shape : turned) {
      std::int64_t least = std::numeric_limits<std::int64_t>::max();
      for (const auto& candidate : shape) {
        if (candidate) least = std::min(least, grown_cells(candidate->footprint.covered));
      }
      cells += least;
    }
    return cells <= std::int64_t{grid_size_.x + gutter_} * (grid_size_.y + gutter_);
  }

  std::int64_t grown_cells(const std::vector<CellRun>& runs) const {
    std::int64_t cells = 0;
    std::set<int> rows;
    for (const CellRun& r : runs) {
      cells += r.last - r.first + 1;
      rows.insert(r.row);
    }
    const std::int64_t longest = runs.front().last - runs.front().first + 1;
    return cells + gutter_ * (static_cast<std::int64_t>(rows.size()) + longest + gutter_);
  }

  // The lowest place, then the leftmost, over all turns.
  bool place(const Candidates& turned, Occupancy& covered, Occupancy& read, Placed& out) const {
    int best_top = std::numeric_limits<int>::max();
    glm::ivec2 best_at(0);
    const Placed* best = nullptr;
    for (const auto& candidate : turned) {
      if (!candidate) continue;
      const Footprint& f = candidate->footprint;
      const CellRun longest = f.covered.front();
      for (int y = 0; y + f.size.y <= grid_size_.y && y + f.size.y <= best_top; ++y) {
        if (!covered.may_hold(y + longest.row, longest.last - longest.first + 1)) continue;
        const int x = first_free(f, covered, read, y);
        if (x < 0) continue;
        if (y + f.size.y < best_top || x < best_at.x) {
          best_top = y + f.size.y;
          best_at = {x, y};
          best = &*candidate;
        }
        break;
      }
    }
    if (best == nullptr) return false;
    out = *best;
    for (const CellRun& r : out.footprint.covered) {
      for (int dy = -gutter_; dy <= gutter_; ++dy) {
        covered.occupy(best_at.y + r.row + dy, best_at.x + r.first - gutter_,
                       best_at.x + r.last + gutter_);
      }
    }
    for (const CellRun& r : out.footprint.read) {
      read.occupy(best_at.y + r.row, best_at.x + r.first, best_at.x + r.last);
    }
    covered.note_gaps(best_at.y - gutter_, best_at.y + out.footprint.size.y + gutter_);
    for (glm::dvec2& q : out.points) q += glm::dvec2(best_at);
    return true;
  }

  int first_free(const Footprint& f, const Occupancy& covered, const Occupancy& read, int y) const {
    int x = 0;
    while (x + f.size.x <= grid_size_.x) {
      const int a = next_free(covered, f.covered, x, y);
      if (a > x) {
        x = a;
        continue;
      }
      const int b = next_free(read, f.read, x, y);
      if (b == x) return x;
      x = b;
    }
    return -1;
  }

  std::span<const PackShape> shapes_;
  const ChartPackOptions& options_;
  int unit_ = 1;  // texels a cell
  glm::ivec2 grid_size_{0};
  std::vector<std::vector<OutlineEdge>> outlines_;  // by shape
  std::vector<glm::dvec2> turns_;                   // cosine and sine
  int gutter_ = 2;                                  // cells
  double covered_reach_ = 0, read_reach_ = 0, inset_ = 0;
  double area_ = 0;
};

}  // namespace

Result<PackResult> pack_shapes(std::span<const PackShape> shapes, const ChartPackOptions& options) {
  if (shapes.empty()) return PackResult{1.0, {}};
  return Packer(shapes, options).run();
}

bool shapes_fit(std::span<const PackShape> shapes, const ChartPackOptions& options, double scale) {
  return Packer(shapes, options).fits(scale);
}

}  // namespace relit::bake
