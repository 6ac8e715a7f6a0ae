// SPDX-License-Identifier: MIT
#include "bake_minimal/texel_raster.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

#include "bake_minimal/atlas.hpp"

namespace relit::bake {
namespace {

constexpr std::int64_t kHalf = FixedTriangle::kOne / 2;
constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();
// Coordinates beyond this many atlas sizes are refused: with sides up to 2^14 texels, edge products
// then stay below 2 · (2^(14+3+1+12))^2 = 2^61.
constexpr float kFarthest = 8.0f;

std::int64_t floor_div(std::int64_t a, std::int64_t b) {
  const std::int64_t q = a / b;
  return q - ((a % b != 0) && ((a < 0) != (b < 0)) ? 1 : 0);
}

std::int64_t cross(glm::i64vec2 a, glm::i64vec2 b, glm::i64vec2 p) {
  return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
}

struct Nearest {
  double distance2;
  double b1, b2;
};

// The point of the triangle nearest to a point outside it, hence on one of its edges.
Nearest nearest_on_border(const std::array<glm::dvec2, 3>& p, glm::dvec2 c) {
  Nearest best{std::numeric_limits<double>::infinity(), 0, 0};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const glm::dvec2 d = p[j] - p[i];
    const double length2 = glm::dot(d, d);
    const double t = length2 > 0 ? std::clamp(glm::dot(c - p[i], d) / length2, 0.0, 1.0) : 0.0;
    const glm::dvec2 off = c - (p[i] + t * d);
    const double distance2 = glm::dot(off, off);
    if (distance2 < best.distance2) {
      std::array<double, 3> b{};
      b[i] = 1.0 - t;
      b[j] = t;
      best = {distance2, b[1], b[2]};
    }
  }
  return best;
}

struct Candidate {
  std::uint32_t texel;
  std::uint32_t triangle;
  double distance2;
  float b1, b2;
};

class AtlasRaster {
 public:
  AtlasRaster(std::span<const glm::vec2> uv, std::span<const std::uint32_t> indices, int width,
              int height)
      : uv_(uv),
        indices_(indices),
        width_(width),
        height_(height),
        owner_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), kNobody) {}

  std::vector<TexelSample> run() {
    const std::size_t triangles = indices_.size() / 3;
    for (std::size_t t = 0; t < triangles; ++t) {
      make_triangle(t).for_each_row(width_, height_, [&](int y, int x0, int x1) {
        std::uint32_t* row = owner_.data() + texel(0, y);
        for (int x = x0; x <= x1; ++x) {
          if (row[x] == kNobody) row[x] = static_cast<std::uint32_t>(t);
        }
      });
    }
    for (std::size_t t = 0; t < triangles; ++t) add_touched(t);
    return collect();
  }

 private:
  std::size_t texel(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }

  FixedTriangle make_triangle(std::size_t t) const {
    return FixedTriangle(uv_[indices_[3 * t]], uv_[indices_[3 * t + 1]], uv_[indices_[3 * t + 2]],
                         width_, height_);
  }

  void add_touched(std::size_t t) {
    const FixedTriangle fixed = make_triangle(t);
    if (fixed.degenerate()) return;
    const std::array<glm::dvec2, 3> p = fixed.texels();
    const double lo = std::min({p[0].y, p[1].y, p[2].y});
    const double hi = std::max({p[0].y, p[1].y, p[2].y});
    // Closed squares: one that shares no more than its side with the triangle counts, since a
    // bilinear fetch on that side reads half of it.
    const int y0 = static_cast<int>(std::max(0.0, std::ceil(lo) - 1));
    const int y1 = static_cast<int>(std::min(height_ - 1.0, std::floor(hi)));
    for (int y = y0; y <= y1; ++y) {
      const SlabExtent xs = slab_extent(p, y, y + 1.0);
      const int x0 = static_cast<int>(std::max(0.0, std::ceil(xs.lo) - 1));
      const int x1 = static_cast<int>(std::min(width_ - 1.0, std::floor(xs.hi)));
      for (int x = x0; x <= x1; ++x) {
        if (owner_[texel(x, y)] != kNobody) continue;
        const Nearest n = nearest_on_border(p, {x + 0.5, y + 0.5});
        candidates_.push_back({static_cast<std::uint32_t>(texel(x, y)),
                               static_cast<std::uint32_t>(t), n.distance2, static_cast<float>(n.b1),
                               static_cast<float>(n.b2)});
      }
    }
  }

  std::vector<TexelSample> collect() {
    std::sort(candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
      if (a.texel != b.texel) return a.texel < b.texel;
      if (a.distance2 != b.distance2) return a.distance2 < b.distance2;
      return a.triangle < b.triangle;
    });
    std::vector<TexelSample> samples;
    auto next = candidates_.begin();
    for (std::size_t i = 0; i < owner_.size(); ++i) {
      const auto id = static_cast<std::uint32_t>(i);
      if (owner_[i] != kNobody) {
        const auto x = static_cast<int>(i % static_cast<std::size_t>(width_));
        const auto y = static_cast<int>(i / static_cast<std::size_t>(width_));
        const glm::vec2 b = make_triangle(owner_[i]).barycentric(x, y);
        samples.push_back({id, owner_[i], b.x, b.y, true});
      } else if (next != candidates_.end() && next->texel == id) {
        samples.push_back({id, next->triangle, next->b1, next->b2, false});
      }
      while (next != candidates_.end() && next->texel == id) ++next;
    }
    return samples;
  }

  std::span<const glm::vec2> uv_;
  std::span<const std::uint32_t> indices_;
  int width_;
  int height_;
  std::vector<std::uint32_t> owner_;
  std::vector<Candidate> candidates_;
};

void extend(SlabExtent& extent, double v) {
  extent.lo = std::min(extent.lo, v);
  extent.hi = std::max(extent.hi, v);
}

}  // namespace

SlabExtent slab_extent(const std::array<glm::dvec2, 3>& p, double y0, double y1) {
  SlabExtent extent;
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec2 a = p[i];
    const glm::dvec2 b = p[(i + 1) % 3];
    if (a.y >= y0 && a.y <= y1) extend(extent, a.x);
    for (const double y : {y0, y1}) {
      if ((a.y < y && b.y > y) || (a.y > y && b.y < y)) {
        extend(extent, a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)));
      }
    }
  }
  return extent;
}

FixedTriangle::FixedTriangle(glm::vec2 a, glm::vec2 b, glm::vec2 c, int width, int height) {
  const std::array<glm::vec2, 3> corners{a, b, c};
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::vec2 v = corners[i];
    // Written so that NaN fails it.
    if (!(std::abs(v.x) <= kFarthest && std::abs(v.y) <= kFarthest)) return;
    p_[i] = {std::llround(static_cast<double>(v.x) * width * static_cast<double>(kOne)),
             std::llround(static_cast<double>(v.y) * height * static_cast<double>(kOne))};
  }
  area2_ = cross(p_[0], p_[1], p_[2]);
  if (area2_ < 0) {
    std::swap(p_[1], p_[2]);
    area2_ = -area2_;
    mirrored_ = true;
  }
}

std::array<glm::dvec2, 3> FixedTriangle::texels() const {
  std::array<glm::dvec2, 3> out;
  for (std::size_t i = 0; i < 3; ++i) out[i] = glm::dvec2(p_[i]) / static_cast<double>(kOne);
  if (mirrored_) std::swap(out[1], out[2]);
  return out;
}

bool FixedTriangle::rows(int height, int& y0, int& y1) const {
  if (degenerate()) return false;
  const std::int64_t lo = std::min({p_[0].y, p_[1].y, p_[2].y});
  const std::int64_t hi = std::max({p_[0].y, p_[1].y, p_[2].y});
  y0 = static_cast<int>(std::max<std::int64_t>(0, -floor_div(kHalf - lo, kOne)));
  y1 = static_cast<int>(std::min<std::int64_t>(height - 1, floor_div(hi - kHalf, kOne)));
  return y0 <= y1;
}

bool FixedTriangle::row(int y, int width, int& x0, int& x1) const {
  const std::int64_t centre_y = y * kOne + kHalf;
  std::int64_t lo = 0;
  std::int64_t hi = width - 1;
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::i64vec2 a = p_[i];
    const glm::i64vec2 d = p_[(i + 1) % 3] - a;
    // Centres on the edge belong to the triangle when it is a left or a top one; which of the two
    // names fits depends on where v points, that exactly one of two neighbours owns it does not.
    const bool owns_edge = d.y > 0 || (d.y == 0 && d.x < 0);
    const std::int64_t least = owns_edge ? 0 : 1;
    const std::int64_t at_zero = d.x * (centre_y - a.y) - d.y * (kHalf - a.x);
    // Inside: at_zero - x · d.y · kOne >= least.
    if (d.y > 0) {
      hi = std::min(hi, floor_div(at_zero - least, d.y * kOne));
    } else if (d.y < 0) {
      lo = std::max(lo, -floor_div(at_zero - least, -d.y * kOne));
    } else if (at_zero < least) {
      return false;
    }
  }
  x0 = static_cast<int>(lo);
  x1 = static_cast<int>(hi);
  return lo <= hi;
}

glm::vec2 FixedTriangle::barycentric(int x, int y) const {
  const glm::i64vec2 centre{x * kOne + kHalf, y * kOne + kHalf};
  const double area2 = static_cast<double>(area2_);
  const auto b1 = static_cast<float>(static_cast<double>(cross(p_[2], p_[0], centre)) / area2);
  const auto b2 = static_cast<float>(static_cast<double>(cross(p_[0], p_[1], centre)) / area2);
  return mirrored_ ? glm::vec2(b2, b1) : glm::vec2(b1, b2);
}

std::vector<TexelSample> rasterize_atlas(std::span<const glm::vec2> uv,
                                         std::span<const std::uint32_t> indices, int width,
                                         int height) {
  assert(width > 0 && height > 0 && width <= (1 << 14) && height <= (1 << 14));
  return AtlasRaster(uv, indices, width, height).run();
}

}  // namespace relit::bake
