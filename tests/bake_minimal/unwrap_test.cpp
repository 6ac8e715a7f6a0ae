// SPDX-License-Identifier: MIT
#include "bake_minimal/unwrap.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <string>

#include "bake_minimal/atlas.hpp"
#include "bake_minimal/atlas_check.hpp"
#include "bake_minimal/unwrap_charts.hpp"
#include "tests/bake_minimal/shapes.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::bake;
using shapes::Mesh;

namespace {

struct Checked {
  Unwrapped unwrapped;
  double coverage = 0;
  double density_p5 = 0, density_p95 = 0;
};

Result<Unwrapped> unwrap_mesh(const Mesh& m, const ChartPackOptions& options) {
  const std::vector<std::uint32_t> group(m.positions.size(), 0);
  return unwrap_surface({m.positions, m.normals, group, m.indices}, options);
}

double area_of(const Mesh& m, std::size_t t) {
  const glm::dvec3 a(m.positions[m.indices[3 * t]]);
  const glm::dvec3 b(m.positions[m.indices[3 * t + 1]]);
  const glm::dvec3 c(m.positions[m.indices[3 * t + 2]]);
  return glm::length(glm::cross(b - a, c - a)) / 2;
}

double density_of(const Mesh& m, const std::vector<glm::vec2>& uv, std::size_t t) {
  const glm::dvec2 a(uv[3 * t]), b(uv[3 * t + 1]), c(uv[3 * t + 2]);
  const double flat = std::abs((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)) / 2;
  const double area = area_of(m, t);
  return area > 0 ? std::sqrt(flat / area) : 0.0;
}

// The promises of unwrap_surface(), by the exact rasteriser.
Checked require_valid(const Mesh& m, const ChartPackOptions& options) {
  auto result = unwrap_mesh(m, options);
  if (!result) FAIL(result.error().message);
  Checked out{*std::move(result)};
  const auto& uv = out.unwrapped.corner_uv;
  REQUIRE(uv.size() == m.indices.size());
  for (const glm::vec2& p : uv) {
    REQUIRE((p.x >= 0 && p.x <= 1 && p.y >= 0 && p.y <= 1));
    REQUIRE(std::abs(p.x * 65535 - std::round(p.x * 65535)) < 0.01f);
  }
  std::vector<std::uint32_t> corners(uv.size());
  std::iota(corners.begin(), corners.end(), 0u);
  const OverlapCount count = count_overlap(uv, corners, options.width, options.height);
  REQUIRE(count.doubly == 0);
  const UvCharts charts = find_uv_charts(uv, corners);
  REQUIRE(measure_gutter(uv, corners, charts, {options.width, options.height}, 8) >=
          options.gutter);

  // Texels that a bilinear fetch reads, of two charts, are apart; and every chart covers a texel.
  std::vector<int> reader(static_cast<std::size_t>(options.width * options.height), -1);
  std::set<std::uint32_t> covering;
  const auto samples = decoders::rasterize_atlas(uv, corners, options.width, options.height);
  REQUIRE(samples);
  for (const TexelSample& s : *samples) {
    if (s.covered) covering.insert(charts.of_triangle[s.triangle]);
  }
  std::set<std::uint32_t> with_area;
  std::vector<double> density;
  for (std::size_t t = 0; t < charts.of_triangle.size(); ++t) {
    const auto chart = static_cast<int>(charts.of_triangle[t]);
    // Points throughout the triangle, whose fetches read up to four texels; one whose weight is
    // below a hundredth does not count, since UVs are snapped.
    for (int i = 0; i <= 6; ++i) {
      for (int j = 0; i + j <= 6; ++j) {
        const float b1 = static_cast<float>(i) / 6, b2 = static_cast<float>(j) / 6;
        const glm::vec2 p = (1 - b1 - b2) * uv[3 * t] + b1 * uv[3 * t + 1] + b2 * uv[3 * t + 2];
        const float x = p.x * static_cast<float>(options.width) - 0.5f;
        const float y = p.y * static_cast<float>(options.height) - 0.5f;
        for (const float dx : {1e-2f, 1 - 1e-2f}) {
          for (const float dy : {1e-2f, 1 - 1e-2f}) {
            const int tx = std::clamp(static_cast<int>(std::floor(x + dx)), 0, options.width - 1);
            const int ty = std::clamp(static_cast<int>(std::floor(y + dy)), 0, options.height - 1);
            int& r = reader[static_cast<std::size_t>(ty * options.width + tx)];
            REQUIRE((r == -1 || r == chart));
            r = chart;
          }
        }
      }
    }
    const double d = density_of(m, uv, t);
    if (d > 0) {
      density.push_back(d);
      with_area.insert(charts.of_triangle[t]);
    }
  }
  REQUIRE(std::includes(covering.begin(), covering.end(), with_area.begin(), with_area.end()));
  out.coverage =
      static_cast<double>(count.covered) / (static_cast<double>(options.width) * options.height);
  if (!density.empty()) {
    std::sort(density.begin(), density.end());
    const double median = density[density.size() / 2];
    out.density_p5 = density[density.size() / 20] / median;
    out.density_p95 = density[density.size() - 1 - density.size() / 20] / median;
  }
  return out;
}

void require_even(const Checked& c) {
  REQUIRE(c.density_p5 > 0.8);
  REQUIRE(c.density_p95 < 1.25);
}

}  // namespace

TEST_CASE("a box becomes its six faces, undistorted") {
  const Checked c = require_valid(shapes::box({1.0f, 2.0f, 0.7f}), {128, 128, 2});
  CHECK(c.unwrapped.charts >= 6);
  CHECK(c.density_p5 > 0.99);
  CHECK(c.density_p95 < 1.01);
  CHECK(c.coverage > 0.7);
}

TEST_CASE("curved surfaces unwrap evenly into few charts") {
  for (const int size : {64, 600}) {
    const Checked sphere = require_valid(shapes::sphere(32, 18), {size, size, 2});
    require_even(sphere);
    CHECK(sphere.unwrapped.charts <= 12);
    CHECK(sphere.coverage > 0.45);
    const Checked torus = require_valid(shapes::torus(32, 14), {size, size, 2});
    require_even(torus);
    CHECK(torus.unwrapped.charts <= 20);
    CHECK(torus.coverage > 0.45);
  }
  const Checked cylinder = require_valid(shapes::cylinder(32, 6), {128, 128, 2});
  require_even(cylinder);
  CHECK(cylinder.unwrapped.charts <= 8);
}

TEST_CASE("a strip that cannot be oriented and edges of three triangles unwrap") {
  const Checked c = require_valid(shapes::moebius_with_fin(60), {128, 128, 2});
  require_even(c);
  CHECK(c.unwrapped.charts <= 16);
}

TEST_CASE("loose triangles smaller than texels get texels of their own") {
  const Mesh m = shapes::loose_triangles(150, 4);
  const Checked c = require_valid(m, {128, 128, 2});
  CHECK(c.unwrapped.charts == 150);
}

TEST_CASE("the atlas may be any rectangle and the gutter any width") {
  Mesh m = shapes::torus(24, 12);
  shapes::append(m, shapes::box(glm::vec3(0.5f)), {3, 0, 0});
  for (const ChartPackOptions& o : {ChartPackOptions{256, 64, 2}, ChartPackOptions{48, 200, 2},
                                    ChartPackOptions{128, 128, 5}, ChartPackOptions{128, 128, 0}}) {
    require_valid(m, o);
  }
}

TEST_CASE("more charts than texels are an error that names the size") {
  const auto refused = unwrap_mesh(shapes::loose_triangles(100, 1), {16, 16, 2});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == ErrorCode::kLimit);
  CHECK(refused.error().message.find("16x16") != std::string::npos);
}

TEST_CASE("a mesh without any area gets one valid place") {
  Mesh m;
  m.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {5, 5, 5}};
  m.normals.assign(4, {0, 1, 0});
  m.indices = {0, 1, 2, 3, 3, 3, 0, 0, 1};
  const auto result = unwrap_mesh(m, {64, 64, 2});
  REQUIRE(result);
  CHECK(result->charts == 0);
  for (const glm::vec2& uv : result->corner_uv) CHECK(uv == result->corner_uv[0]);
  const auto nothing = unwrap_mesh(Mesh{}, {64, 64, 2});
  REQUIRE(nothing);
  CHECK(nothing->corner_uv.empty());
}

TEST_CASE("triangles without area take the place of a neighbour's corner") {
  const Mesh m = shapes::sphere(16, 8);
  const auto result = unwrap_mesh(m, {128, 128, 2});
  REQUIRE(result);
  int degenerate = 0;
  for (std::size_t t = 0; 3 * t < m.indices.size(); ++t) {
    if (area_of(m, t) > 1e-12) continue;
    ++degenerate;
    const auto uv = std::span(result->corner_uv).subspan(3 * t, 3);
    REQUIRE(uv[0] == uv[1]);
    REQUIRE(uv[0] == uv[2]);
    const auto others = std::count(result->corner_uv.begin(), result->corner_uv.end(), uv[0]);
    REQUIRE(others > 3);
  }
  CHECK(degenerate == 32);
}

TEST_CASE("positions that are not finite do not spread") {
  Mesh m = shapes::torus(16, 8);
  m.positions[20].y = std::numeric_limits<float>::quiet_NaN();
  m.positions[60].x = std::numeric_limits<float>::infinity();
  const auto result = unwrap_mesh(m, {128, 128, 2});
  REQUIRE(result);
  for (const glm::vec2& uv : result->corner_uv) {
    REQUIRE(std::isfinite(uv.x));
    REQUIRE(std::isfinite(uv.y));
  }
}

TEST_CASE("unwrapping twice gives the same bits") {
  const Mesh m = shapes::torus(24, 12);
  const auto a = unwrap_mesh(m, {128, 128, 2});
  const auto b = unwrap_mesh(m, {128, 128, 2});
  REQUIRE(a);
  REQUIRE(b);
  CHECK(a->corner_uv == b->corner_uv);
}

TEST_CASE("groups share no chart although they lie in the same place") {
  Mesh m = shapes::sheet(8, 8);
  const std::size_t front = m.positions.size();
  const std::size_t corners = m.indices.size();
  shapes::append(m, shapes::sheet(8, 8), glm::vec3(0));
  std::vector<std::uint32_t> group(m.positions.size(), 0);
  std::fill(group.begin() + static_cast<std::ptrdiff_t>(front), group.end(), 1u);
  const auto result = unwrap_surface({m.positions, m.normals, group, m.indices}, {128, 128, 2});
  REQUIRE(result);
  std::vector<std::uint32_t> all(m.indices.size());
  std::iota(all.begin(), all.end(), 0u);
  const UvCharts charts = find_uv_charts(result->corner_uv, all);
  std::set<std::uint32_t> a, b;
  for (std::size_t t = 0; t < charts.of_triangle.size(); ++t) {
    (3 * t < corners ? a : b).insert(charts.of_triangle[t]);
  }
  for (const std::uint32_t c : a) CHECK(b.count(c) == 0);
}

TEST_CASE("patches are connected and hold every triangle with area once") {
  const Mesh m = shapes::sphere(30, 20);
  const std::vector<std::uint32_t> group(m.positions.size(), 0);
  const Surface surface({m.positions, m.normals, group, m.indices});
  std::vector<int> seen(surface.triangles.size(), 0);
  for (const auto& patch : grow_patches(surface)) {
    CHECK(connected_parts(surface, patch).size() == 1);
    for (const std::uint32_t t : patch) ++seen[t];
    if (patch.size() < 2) continue;
    const auto parts = split_patch(surface, patch);
    REQUIRE(parts.size() == 2);
    CHECK(parts[0].size() + parts[1].size() == patch.size());
    for (const auto& part : parts) {
      REQUIRE_FALSE(part.empty());
      CHECK(connected_parts(surface, part).size() == 1);
    }
  }
  for (std::size_t t = 0; t < seen.size(); ++t) CHECK(seen[t] == (surface.areas[t] > 0 ? 1 : 0));
}

TEST_CASE("a developable patch flattens without distortion") {
  // Half of a cylinder of radius 1 is a rectangle of π × 2.
  const Mesh m = shapes::grid(64, 8, [](float u, float v, glm::vec3& n) {
    const float a = u * shapes::kTau / 2;
    n = {std::cos(a), 0, -std::sin(a)};
    return glm::vec3(n.x, 2 * v, n.z);
  });
  const std::vector<std::uint32_t> group(m.positions.size(), 0);
  const Surface surface({m.positions, m.normals, group, m.indices});
  std::vector<std::uint32_t> all(surface.triangles.size());
  std::iota(all.begin(), all.end(), 0u);
  FlattenLimits limits;
  limits.least_density = 0.999;
  limits.greatest_density = 1.001;
  limits.greatest_anisotropy = 1.001;
  const auto chart = flatten_patch(surface, all, limits);
  REQUIRE(chart);
  // 64 chords of the half circle.
  const double length = 64 * 2 * std::sin(3.14159265358979 / 128);
  CHECK(chart->size.x == Approx(length).epsilon(1e-4));
  CHECK(chart->size.y == Approx(2.0).epsilon(1e-4));
}

TEST_CASE("closed and strongly curved patches are refused") {
  const Mesh m = shapes::torus(24, 12);
  const std::vector<std::uint32_t> group(m.positions.size(), 0);
  const Surface surface({m.positions, m.normals, group, m.indices});
  std::vector<std::uint32_t> all(surface.triangles.size());
  std::iota(all.begin(), all.end(), 0u);
  CHECK_FALSE(flatten_patch(surface, all, FlattenLimits{}));
  all.pop_back();
  CHECK_FALSE(flatten_patch(surface, all, FlattenLimits{}));
}

TEST_CASE("the least rectangle is found at any angle") {
  for (const double angle : {0.0, 0.3, 1.1, 2.7}) {
    std::vector<glm::dvec2> points{{0, 0}, {4, 0}, {4, 1}, {0, 1}, {2, 0.5}};
    for (glm::dvec2& p : points) {
      p = {std::cos(angle) * p.x - std::sin(angle) * p.y,
           std::sin(angle) * p.x + std::cos(angle) * p.y};
    }
    const glm::dvec2 size = turn_to_least_rectangle(points);
    CHECK(size.x == Approx(4.0));
    CHECK(size.y == Approx(1.0));
    for (const glm::dvec2& p : points) {
      CHECK(p.x > -1e-9);
      CHECK(p.y > -1e-9);
    }
  }
}
