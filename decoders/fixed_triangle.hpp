// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>

namespace relit::decoders {

/// A triangle of light-map UVs on a width × height atlas, its corners rounded to 1/4096 texel, in
/// integer arithmetic from there on: which texel centres it owns is exact. Owned = strictly inside,
/// or on an edge that the top-left rule gives to this triangle, so that two triangles on either
/// side of a shared edge never both own a texel and never both miss one. Either winding is right.
/// Without area, not finite, or beyond 8 atlas sizes: degenerate, owns nothing. Sides up to 16384
/// texels.
class FixedTriangle {
 public:
  static constexpr std::int64_t kOne = 4096;  ///< one texel

  FixedTriangle(glm::vec2 a, glm::vec2 b, glm::vec2 c, int width, int height);

  [[nodiscard]] bool degenerate() const { return area2_ == 0; }

  /// Calls `visit(y, x0, x1)` for every row from `first` to before `end` in which it owns the
  /// texels x0..x1.
  template <class Visit>
  void for_each_row(int first, int end, int width, Visit&& visit) const {
    int y0, y1;
    if (!rows(first, end, y0, y1)) return;
    for (int y = y0; y <= y1; ++y) {
      int x0, x1;
      if (row(y, width, x0, x1)) visit(y, x0, x1);
    }
  }

  /// (b1, b2) of the centre of an owned texel: p = (1-b1-b2)·p0 + b1·p1 + b2·p2.
  [[nodiscard]] glm::vec2 barycentric(int x, int y) const;

  /// The rounded corners in texels, in the order given.
  [[nodiscard]] std::array<glm::dvec2, 3> texels() const;

 private:
  bool rows(int first, int end, int& y0, int& y1) const;
  bool row(int y, int width, int& x0, int& x1) const;

  std::array<glm::i64vec2, 3> p_{};
  std::int64_t area2_ = 0;
  bool mirrored_ = false;
};

}  // namespace relit::decoders
