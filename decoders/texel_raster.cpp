// SPDX-License-Identifier: MIT
#include "decoders/texel_raster.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <new>
#include <string>

namespace relit::decoders {
namespace {

constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();
constexpr int kBandRows = 64;

/// Texels that may be looked at for each texel of the map, and besides for each triangle.
constexpr std::uint64_t kVisitsPerTexel = 64, kVisitsPerTriangle = 4096;

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

/// Some rows of the atlas at a time, so that memory is bounded whatever the triangles are.
class AtlasRaster {
 public:
  AtlasRaster(std::span<const glm::vec2> uv, std::span<const std::uint32_t> indices, int width,
              int height, const std::function<void(const TexelSample&)>& take)
      : uv_(uv), indices_(indices), width_(width), height_(height), take_(take) {
    const std::uint64_t texels =
        static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    visits_left_ = kVisitsPerTexel * texels + kVisitsPerTriangle * (indices.size() / 3);
    band_.resize(static_cast<std::size_t>(width) *
                 static_cast<std::size_t>(std::min(height, kBandRows)));
  }

  Status run() {
    for (first_row_ = 0; first_row_ < height_; first_row_ += kBandRows) {
      end_row_ = std::min(first_row_ + kBandRows, height_);
      std::fill(band_.begin(), band_.end(), Claim{});
      const bool seen =
          for_each_triangle([&](std::uint32_t t, const FixedTriangle& fixed) { own(t, fixed); }) &&
          for_each_triangle([&](std::uint32_t t, const FixedTriangle& fixed) { touch(t, fixed); });
      if (!seen) {
        return fail(ErrorCode::kLimit, "the light-map UVs lie over each other more than " +
                                           std::to_string(kVisitsPerTexel) +
                                           " times on the average");
      }
      collect();
    }
    return {};
  }

 private:
  /// Who has a texel of the band: an owner (distance 0), or the nearest so far.
  struct Claim {
    std::uint32_t triangle = kNobody;
    bool owned = false;
    double distance2 = std::numeric_limits<double>::infinity();
    float b1 = 0, b2 = 0;
  };

  Claim* row(int y) {
    return band_.data() +
           static_cast<std::size_t>(y - first_row_) * static_cast<std::size_t>(width_);
  }

  /// False once too many texels have been visited.
  template <class Visit>
  bool for_each_triangle(Visit&& visit) {
    for (std::size_t t = 0; 3 * t + 2 < indices_.size(); ++t) {
      const FixedTriangle fixed(uv_[indices_[3 * t]], uv_[indices_[3 * t + 1]],
                                uv_[indices_[3 * t + 2]], width_, height_);
      if (fixed.degenerate()) continue;
      visit(static_cast<std::uint32_t>(t), fixed);
      if (visits_left_ == 0) return false;
    }
    return true;
  }

  void count(int x0, int x1) {
    const auto visits = static_cast<std::uint64_t>(std::max(x1 - x0 + 1, 0));
    visits_left_ -= std::min(visits_left_, visits);
  }

  void own(std::uint32_t t, const FixedTriangle& fixed) {
    fixed.for_each_row(first_row_, end_row_, width_, [&](int y, int x0, int x1) {
      count(x0, x1);
      Claim* const claims = row(y);
      for (int x = x0; x <= x1; ++x) {
        if (claims[x].owned) continue;
        const glm::vec2 b = fixed.barycentric(x, y);
        claims[x] = {t, true, 0, b.x, b.y};
      }
    });
  }

  void touch(std::uint32_t t, const FixedTriangle& fixed) {
    const std::array<glm::dvec2, 3> p = fixed.texels();
    const double lo = std::min({p[0].y, p[1].y, p[2].y});
    const double hi = std::max({p[0].y, p[1].y, p[2].y});
    // Closed squares: one that shares no more than its side with the triangle counts, since a
    // bilinear fetch on that side reads half of it.
    const int y0 = static_cast<int>(std::max<double>(first_row_, std::ceil(lo) - 1));
    const int y1 = static_cast<int>(std::min(end_row_ - 1.0, std::floor(hi)));
    for (int y = y0; y <= y1; ++y) {
      const SlabExtent xs = slab_extent(p, y, y + 1.0);
      const int x0 = static_cast<int>(std::max(0.0, std::ceil(xs.lo) - 1));
      const int x1 = static_cast<int>(std::min(width_ - 1.0, std::floor(xs.hi)));
      count(x0, x1);
      Claim* const claims = row(y);
      for (int x = x0; x <= x1; ++x) {
        if (claims[x].owned) continue;
        const Nearest n = nearest_on_border(p, {x + 0.5, y + 0.5});
        if (n.distance2 < claims[x].distance2) {
          claims[x] = {t, false, n.distance2, static_cast<float>(n.b1), static_cast<float>(n.b2)};
        }
      }
    }
  }

  void collect() {
    auto texel = static_cast<std::uint32_t>(first_row_) * static_cast<std::uint32_t>(width_);
    for (int y = first_row_; y < end_row_; ++y) {
      const Claim* const claims = row(y);
      for (int x = 0; x < width_; ++x, ++texel) {
        if (claims[x].triangle == kNobody) continue;
        take_({texel, claims[x].triangle, claims[x].b1, claims[x].b2, claims[x].owned});
      }
    }
  }

  std::span<const glm::vec2> uv_;
  std::span<const std::uint32_t> indices_;
  int width_, height_;
  int first_row_ = 0, end_row_ = 0;
  std::uint64_t visits_left_ = 0;
  std::vector<Claim> band_;
  const std::function<void(const TexelSample&)>& take_;
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

Status rasterize_atlas(std::span<const glm::vec2> uv, std::span<const std::uint32_t> indices,
                       int width, int height, const std::function<void(const TexelSample&)>& take) {
  assert(width > 0 && height > 0 && width <= (1 << 14) && height <= (1 << 14));
  try {
    return AtlasRaster(uv, indices, width, height, take).run();
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kOutOfMemory, "no memory for the texels of a light map");
  }
}

Result<std::vector<TexelSample>> rasterize_atlas(std::span<const glm::vec2> uv,
                                                 std::span<const std::uint32_t> indices, int width,
                                                 int height) {
  std::vector<TexelSample> samples;
  RELIT_TRY(rasterize_atlas(uv, indices, width, height,
                            [&](const TexelSample& sample) { samples.push_back(sample); }));
  return samples;
}

}  // namespace relit::decoders
