// SPDX-License-Identifier: MIT
#include "decoders/fixed_triangle.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace relit::decoders {
namespace {

constexpr std::int64_t kHalf = FixedTriangle::kOne / 2;
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

}  // namespace

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

bool FixedTriangle::rows(int first, int end, int& y0, int& y1) const {
  if (degenerate()) return false;
  const std::int64_t lo = std::min({p_[0].y, p_[1].y, p_[2].y});
  const std::int64_t hi = std::max({p_[0].y, p_[1].y, p_[2].y});
  y0 = static_cast<int>(std::max<std::int64_t>(first, -floor_div(kHalf - lo, kOne)));
  y1 = static_cast<int>(std::min<std::int64_t>(end - 1, floor_div(hi - kHalf, kOne)));
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

}  // namespace relit::decoders
