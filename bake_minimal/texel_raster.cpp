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

constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();

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

std::vector<TexelSample> rasterize_atlas(std::span<const glm::vec2> uv,
                                         std::span<const std::uint32_t> indices, int width,
                                         int height) {
  assert(width > 0 && height > 0 && width <= (1 << 14) && height <= (1 << 14));
  return AtlasRaster(uv, indices, width, height).run();
}

}  // namespace relit::bake
