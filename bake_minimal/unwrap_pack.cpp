// SPDX-License-Identifier: MIT
#include "bake_minimal/unwrap_pack.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "bake_minimal/texel_raster.hpp"

namespace relit::bake {
namespace {

constexpr int kGreatestGrid = 512;       // cells a side; larger atlases are packed in coarser cells
constexpr double kLeastThickness = 0.5;  // texels
constexpr std::size_t kGreatestNested = 3000;
constexpr int kSearchSteps = 10;
constexpr double kOpen = 1e-6;

struct Run {
  std::int16_t row, first, last;
};

// The cells of a shape at its place in the corner of the grid: those it covers, which keep the
// gutter, and those that bilinear fetches inside it read, which nobody else may read.
struct Footprint {
  std::vector<Run> covered;
  std::vector<Run> read;
  glm::ivec2 size{0};
};

struct Placed {
  std::vector<glm::dvec2> points;  // in cells, from the grid's corner
  Footprint footprint;
};

class Mask {
 public:
  explicit Mask(glm::ivec2 size)
      : size_(size), bits_(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y)) {}

  // Marks the cells whose centre is within `reach` of the triangle on both axes.
  void add(const std::array<glm::dvec2, 3>& p, double reach) {
    const double lo = std::min({p[0].y, p[1].y, p[2].y});
    const double hi = std::max({p[0].y, p[1].y, p[2].y});
    const int y0 = std::max(0, static_cast<int>(std::ceil(lo - reach - 0.5)));
    const int y1 = std::min(size_.y - 1, static_cast<int>(std::floor(hi + reach - 0.5)));
    for (int y = y0; y <= y1; ++y) {
      const SlabExtent e = slab_extent(p, y + 0.5 - reach, y + 0.5 + reach);
      const int x0 = std::max(0, static_cast<int>(std::ceil(e.lo - reach - 0.5)));
      const int x1 = std::min(size_.x - 1, static_cast<int>(std::floor(e.hi + reach - 0.5)));
      const auto row = static_cast<std::size_t>(y) * static_cast<std::size_t>(size_.x);
      for (int x = x0; x <= x1; ++x) bits_[row + static_cast<std::size_t>(x)] = 1;
    }
  }

  std::vector<Run> runs() const {
    std::vector<Run> out;
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

// Occupied cells; knows for every cell the nearest occupied one at or before it in its row, so that
// a run is tested, and the place beyond an obstacle found, in one look.
class Grid {
 public:
  explicit Grid(glm::ivec2 size)
      : size_(size),
        last_(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y), -1) {}

  std::int16_t last_occupied(int x, int y) const { return row(y)[x]; }

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
};

// The first x from `x` on at which no run meets an occupied cell, as far as this pass saw; equal to
// x when none does.
int next_free(const Grid& grid, const std::vector<Run>& runs, int x, int y) {
  int next = x;
  for (const Run& run : runs) {
    const int hit = grid.last_occupied(next + run.last, y + run.row);
    if (hit >= next + run.first) return hit - run.first + 1;
  }
  return next;
}

double cross2(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

class Packer {
 public:
  Packer(std::span<const PackShape> shapes, const PackOptions& options)
      : shapes_(shapes), options_(options) {
    const int larger = std::max(options.width, options.height);
    while (larger > kGreatestGrid * unit_) unit_ *= 2;
    grid_size_ = {options.width / unit_, options.height / unit_};
    // A coarse cell counts as covered when it is touched; one empty cell then keeps fetches apart.
    gutter_ = unit_ == 1 ? options.gutter : std::max(1, (options.gutter + unit_ - 1) / unit_);
    covered_reach_ = unit_ == 1 ? 1.0 / 128 : 0.5;
    read_reach_ = (unit_ == 1 ? 1.0 : 0.5) - kOpen;
    inset_ = 0.5 / unit_;
    for (const PackShape& s : shapes_) {
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
    for (int step = 0; step < kSearchSteps && bad > good * 1.002; ++step) {
      const double s = (good + bad) / 2;
      if (auto placed = attempt(s)) {
        best = std::move(placed);
        good = s;
      } else {
        bad = s;
      }
    }
  }

  // The shape at a scale, after quarter turns, from the inset on, with a texel centre inside.
  std::vector<glm::dvec2> transformed(const PackShape& shape, double scale, int quarter) const {
    std::vector<glm::dvec2> out;
    out.reserve(shape.points.size());
    for (const glm::dvec2& p : shape.points) {
      const glm::dvec2 q = p * scale;
      out.push_back(quarter == 0   ? q
                    : quarter == 1 ? glm::dvec2(-q.y, q.x)
                    : quarter == 2 ? -q
                                   : glm::dvec2(q.y, -q.x));
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
      placed[i].points = transformed(shapes_[i], scale, 0);
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

  std::optional<Placed> footprint(const PackShape& shape, double scale, int quarter) const {
    Placed out;
    out.points = transformed(shape, scale, quarter);
    glm::dvec2 lo, hi;
    bounds(out.points, lo, hi);
    if (hi.x > grid_size_.x - inset_ || hi.y > grid_size_.y - inset_) return std::nullopt;
    // Centred fetches at the very border read one cell more than is touched.
    const glm::ivec2 size = glm::min(
        glm::ivec2(static_cast<int>(std::floor(hi.x)), static_cast<int>(std::floor(hi.y))) + 2,
        grid_size_);
    Mask covered(size), read(size);
    for (const auto& t : shape.triangles) {
      const std::array<glm::dvec2, 3> p{out.points[t[0]], out.points[t[1]], out.points[t[2]]};
      covered.add(p, covered_reach_);
      read.add(p, read_reach_);
    }
    out.footprint.covered = covered.runs();
    out.footprint.read = read.runs();
    // May be moved as long as its points keep the inset.
    out.footprint.size = {static_cast<int>(std::ceil(hi.x + inset_ - kOpen)),
                          static_cast<int>(std::ceil(hi.y + inset_ - kOpen))};
    return out;
  }

  std::optional<std::vector<Placed>> try_nested(double scale) const {
    const std::size_t count = shapes_.size();
    std::vector<std::array<std::optional<Placed>, 4>> turned(count);
    std::vector<std::size_t> cells(count, 0);
    for (std::size_t i = 0; i < count; ++i) {
      for (int quarter = 0; quarter < 4; ++quarter) {
        turned[i][static_cast<std::size_t>(quarter)] = footprint(shapes_[i], scale, quarter);
      }
      const auto& any = turned[i][0] ? turned[i][0] : turned[i][1];
      if (!any) return std::nullopt;
      const glm::ivec2 size = any->footprint.size;
      cells[i] = static_cast<std::size_t>(std::max(size.x, size.y)) *
                 static_cast<std::size_t>(size.x + size.y);
    }
    if (!room_for(turned)) return std::nullopt;
    std::vector<std::size_t> order(count);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return cells[a] > cells[b]; });
    Grid covered(grid_size_), read(grid_size_);
    std::vector<Placed> placed(count);
    for (const std::size_t i : order) {
      if (!place(turned[i], covered, read, placed[i])) return std::nullopt;
    }
    return placed;
  }

  // Covered cells of two shapes are more than a gutter apart, so they stay disjoint when each grows
  // by the gutter to the right and upwards: their sum is a cheap bound.
  bool room_for(const std::vector<std::array<std::optional<Placed>, 4>>& turned) const {
    std::int64_t cells = 0;
    for (const auto& shape : turned) {
      const std::vector<Run>& runs = (shape[0] ? shape[0] : shape[1])->footprint.covered;
      int longest = 0, row = -1;
      for (const Run& r : runs) {
        const int length = r.last - r.first + 1;
        cells += length + (r.row != row ? gutter_ : 0);
        row = r.row;
        longest = std::max(longest, length);
      }
      cells += std::int64_t{gutter_} * (longest + gutter_);
    }
    return cells <= std::int64_t{grid_size_.x + gutter_} * (grid_size_.y + gutter_);
  }

  // The lowest place, then the leftmost, over the four turns.
  bool place(std::array<std::optional<Placed>, 4>& turned, Grid& covered, Grid& read,
             Placed& out) const {
    int best_top = std::numeric_limits<int>::max();
    glm::ivec2 best_at(0);
    std::optional<Placed>* best = nullptr;
    for (auto& candidate : turned) {
      if (!candidate) continue;
      const Footprint& f = candidate->footprint;
      for (int y = 0; y + f.size.y <= grid_size_.y && y + f.size.y <= best_top; ++y) {
        const int x = first_free(f, covered, read, y);
        if (x < 0) continue;
        if (y + f.size.y < best_top || x < best_at.x) {
          best_top = y + f.size.y;
          best_at = {x, y};
          best = &candidate;
        }
        break;
      }
    }
    if (best == nullptr) return false;
    out = *std::move(*best);
    for (const Run& r : out.footprint.covered) {
      for (int dy = -gutter_; dy <= gutter_; ++dy) {
        covered.occupy(best_at.y + r.row + dy, best_at.x + r.first - gutter_,
                       best_at.x + r.last + gutter_);
      }
    }
    for (const Run& r : out.footprint.read) {
      read.occupy(best_at.y + r.row, best_at.x + r.first, best_at.x + r.last);
    }
    for (glm::dvec2& q : out.points) q += glm::dvec2(best_at);
    return true;
  }

  int first_free(const Footprint& f, const Grid& covered, const Grid& read, int y) const {
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
  const PackOptions& options_;
  int unit_ = 1;  // texels a cell
  glm::ivec2 grid_size_{0};
  int gutter_ = 2;  // cells
  double covered_reach_ = 0, read_reach_ = 0, inset_ = 0;
  double area_ = 0;
};

}  // namespace

Result<PackResult> pack_shapes(std::span<const PackShape> shapes, const PackOptions& options) {
  if (shapes.empty()) return PackResult{1.0, {}};
  return Packer(shapes, options).run();
}

}  // namespace relit::bake
