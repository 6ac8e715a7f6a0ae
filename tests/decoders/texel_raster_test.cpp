// SPDX-License-Identifier: MIT
#include "decoders/texel_raster.hpp"

#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <vector>

#include "tests/test.hpp"

using namespace relit::decoders;

namespace {

struct Mesh2 {
  std::vector<glm::vec2> uv;
  std::vector<std::uint32_t> indices;
};

std::vector<TexelSample> rasterized(std::span<const glm::vec2> uv,
                                    std::span<const std::uint32_t> indices, int width, int height) {
  auto samples = rasterize_atlas(uv, indices, width, height);
  REQUIRE(samples);
  return std::move(*samples);
}

// A grid of n × n quads over [lo,hi]² with inner vertices moved at random, diagonals at random.
Mesh2 jittered_grid(int n, float lo, float hi, unsigned seed, bool mirrored) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> jitter(-0.3f, 0.3f);
  Mesh2 m;
  for (int y = 0; y <= n; ++y) {
    for (int x = 0; x <= n; ++x) {
      const bool inner = x > 0 && y > 0 && x < n && y < n;
      glm::vec2 p(static_cast<float>(x), static_cast<float>(y));
      if (inner) p += glm::vec2(jitter(random), jitter(random));
      p = lo + p / static_cast<float>(n) * (hi - lo);
      if (mirrored) p.x = lo + hi - p.x;
      m.uv.push_back(p);
    }
  }
  const auto id = [&](int x, int y) { return static_cast<std::uint32_t>(y * (n + 1) + x); };
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const std::uint32_t a = id(x, y), b = id(x + 1, y), c = id(x + 1, y + 1), d = id(x, y + 1);
      if ((random() & 1u) != 0) {
        m.indices.insert(m.indices.end(), {a, b, c, a, c, d});
      } else {
        m.indices.insert(m.indices.end(), {a, b, d, b, c, d});
      }
    }
  }
  return m;
}

std::vector<int> owners_per_texel(const Mesh2& m, int width, int height) {
  std::vector<int> count(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (std::size_t t = 0; t + 2 < m.indices.size(); t += 3) {
    FixedTriangle(m.uv[m.indices[t]], m.uv[m.indices[t + 1]], m.uv[m.indices[t + 2]], width, height)
        .for_each_row(0, height, width, [&](int y, int x0, int x1) {
          for (int x = x0; x <= x1; ++x) ++count[static_cast<std::size_t>(y * width + x)];
        });
  }
  return count;
}

}  // namespace

TEST_CASE("triangles that tile the atlas own every texel exactly once, in either winding") {
  for (const bool mirrored : {false, true}) {
    for (unsigned seed = 0; seed < 8; ++seed) {
      const Mesh2 m = jittered_grid(7, 0.0f, 1.0f, seed, mirrored);
      for (const int c : owners_per_texel(m, 97, 64)) REQUIRE(c == 1);
    }
  }
}

TEST_CASE("edges through texel centres belong to one side") {
  // Every vertex of this grid is a texel centre and so is every diagonal's texel.
  Mesh2 m;
  const float n = 8;
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      m.uv.push_back({(static_cast<float>(x) + 0.5f) / n, (static_cast<float>(y) + 0.5f) / n});
    }
  }
  for (std::uint32_t y = 0; y < 7; ++y) {
    for (std::uint32_t x = 0; x < 7; ++x) {
      const std::uint32_t a = y * 8 + x;
      m.indices.insert(m.indices.end(), {a, a + 1, a + 9, a, a + 9, a + 8});
    }
  }
  int owned = 0;
  for (const int c : owners_per_texel(m, 8, 8)) {
    REQUIRE(c <= 1);
    owned += c;
  }
  // The outline runs through centres too: two of its four sides belong to the inside.
  CHECK(owned == 49);
}

TEST_CASE("barycentric coordinates lead back to the texel centre") {
  const int width = 61, height = 40;
  for (const bool mirrored : {false, true}) {
    const Mesh2 m = jittered_grid(5, 0.1f, 0.9f, 3, mirrored);
    const auto samples = rasterized(m.uv, m.indices, width, height);
    std::uint32_t before = 0;
    bool first = true;
    for (const TexelSample& s : samples) {
      REQUIRE((first || s.texel > before));
      before = s.texel;
      first = false;
      const glm::vec2 p = (1 - s.b1 - s.b2) * m.uv[m.indices[3 * s.triangle]] +
                          s.b1 * m.uv[m.indices[3 * s.triangle + 1]] +
                          s.b2 * m.uv[m.indices[3 * s.triangle + 2]];
      const glm::vec2 q = p * glm::vec2(width, height);
      const glm::vec2 c(static_cast<float>(s.texel % width) + 0.5f,
                        static_cast<float>(s.texel / width) + 0.5f);
      REQUIRE(s.b1 >= 0);
      REQUIRE(s.b2 >= 0);
      REQUIRE(s.b1 + s.b2 <= 1.0f + 1e-6f);
      // Corners are rounded by up to 1/8192 texel; the rest is the float arithmetic above.
      if (s.covered) {
        REQUIRE(glm::length(q - c) < 5e-4f);
      } else {
        // The square touches, so its nearest point is no farther than a corner of the square.
        REQUIRE(glm::length(q - c) <= std::sqrt(0.5f) + 1e-3f);
      }
    }
  }
}

TEST_CASE("texels whose square touches a chart take its nearest point over all triangles") {
  const int size = 32;
  const Mesh2 m = jittered_grid(3, 0.21f, 0.77f, 9, false);
  const auto samples = rasterized(m.uv, m.indices, size, size);
  std::map<std::uint32_t, TexelSample> by_texel;
  for (const TexelSample& s : samples) by_texel[s.texel] = s;
  const float lo = 0.21f * size, hi = 0.77f * size;
  int touched = 0;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
      const bool touches = fx <= hi && fx + 1 >= lo && fy <= hi && fy + 1 >= lo;
      const auto found = by_texel.find(static_cast<std::uint32_t>(y * size + x));
      REQUIRE(touches == (found != by_texel.end()));
      if (!touches || found->second.covered) continue;
      ++touched;
      const TexelSample& s = found->second;
      const glm::vec2 p = ((1 - s.b1 - s.b2) * m.uv[m.indices[3 * s.triangle]] +
                           s.b1 * m.uv[m.indices[3 * s.triangle + 1]] +
                           s.b2 * m.uv[m.indices[3 * s.triangle + 2]]) *
                          static_cast<float>(size);
      const glm::vec2 c(fx + 0.5f, fy + 0.5f);
      REQUIRE(glm::length(p - glm::clamp(c, glm::vec2(lo), glm::vec2(hi))) < 1e-3f);
    }
  }
  // lo = 6.72, hi = 24.64: the outline cuts the columns and rows 6 beyond their centres.
  CHECK(touched == 2 * 19 - 1);
}

TEST_CASE("a triangle on texel borders touches the texels next to them") {
  const std::vector<glm::vec2> uv{{0.25f, 0.25f}, {0.75f, 0.25f}, {0.75f, 0.75f}, {0.25f, 0.75f}};
  const std::vector<std::uint32_t> indices{0, 1, 2, 0, 2, 3};
  const auto samples = rasterized(uv, indices, 8, 8);
  // 4 × 4 inside, and the ring of closed squares that share a side or a corner with it.
  CHECK(samples.size() == 36);
  int covered = 0;
  for (const TexelSample& s : samples) covered += s.covered ? 1 : 0;
  CHECK(covered == 16);
}

TEST_CASE("degenerate, unfinished and far triangles own nothing") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  const std::vector<glm::vec2> uv{{0.1f, 0.1f}, {0.5f, 0.5f}, {0.9f, 0.9f},
                                  {nan, 0.2f},  {inf, 0.1f},  {1e30f, 0.3f}};
  const std::vector<std::uint32_t> indices{0, 1, 2, 0, 0, 1, 0, 1, 3, 0, 1, 4, 0, 2, 5};
  CHECK(rasterized(uv, indices, 64, 64).empty());
}

TEST_CASE("triangles beyond the atlas are clipped to it") {
  const std::vector<glm::vec2> uv{{-3, -3}, {7, -3}, {-3, 7}};
  const std::vector<std::uint32_t> indices{0, 1, 2};
  const auto samples = rasterized(uv, indices, 16, 9);
  CHECK(samples.size() == 16 * 9);
  for (const TexelSample& s : samples) REQUIRE(s.covered);
}

TEST_CASE("where triangles overlap the first one owns the texel") {
  const std::vector<glm::vec2> uv{{0, 0}, {1, 0}, {0, 1}, {1, 1}};
  const std::vector<std::uint32_t> indices{0, 1, 2, 2, 1, 0, 0, 1, 3};
  for (const TexelSample& s : rasterized(uv, indices, 16, 16)) {
    if (s.covered) REQUIRE(s.triangle != 1);
  }
}
