// SPDX-License-Identifier: MIT
#include "bake_minimal/atlas.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <tuple>

#include "bake_minimal/atlas_check.hpp"
#include "bake_minimal/ground.hpp"
#include "bake_minimal/scene.hpp"
#include "tests/bake_minimal/shapes.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::bake;

namespace {

using Posed = std::vector<std::vector<glm::vec3>>;

Scene one_material() {
  Scene scene;
  scene.materials.resize(1);
  scene.nodes.resize(1);
  return scene;
}

// Every attribute that a primitive may have, each a different function of the vertex.
void add(Scene& scene, const shapes::Mesh& m, const std::vector<std::vector<glm::vec2>>& sets) {
  Primitive p;
  p.name = "mesh" + std::to_string(scene.primitives.size());
  p.node = 0;
  p.positions = m.positions;
  p.normals = m.normals;
  p.indices = m.indices;
  p.texcoords = sets;
  p.influences_per_vertex = 4;
  p.morph_targets.resize(1);
  for (std::size_t v = 0; v < m.positions.size(); ++v) {
    const auto f = static_cast<float>(v);
    p.colors.emplace_back(f, 1, 0, 1);
    p.morph_targets[0].positions.emplace_back(f, 2, 3);
    p.morph_targets[0].normals.emplace_back(0, f, 1);
    for (int k = 0; k < 4; ++k) {
      p.joints.push_back(static_cast<std::uint16_t>(4 * v + static_cast<std::size_t>(k)));
      p.weights.push_back(f + 0.25f * static_cast<float>(k));
    }
  }
  scene.primitives.push_back(std::move(p));
}

Posed pose(const Scene& scene) {
  Posed posed;
  for (const Primitive& p : scene.primitives) posed.push_back(p.positions);
  return posed;
}

// The UVs of shapes::sheet() and grids, squeezed into [lo, hi]².
std::vector<glm::vec2> grid_uv(int columns, int rows, glm::vec2 lo, glm::vec2 hi) {
  std::vector<glm::vec2> uv;
  for (int r = 0; r <= rows; ++r) {
    for (int c = 0; c <= columns; ++c) {
      const glm::vec2 f(static_cast<float>(c) / static_cast<float>(columns),
                        static_cast<float>(r) / static_cast<float>(rows));
      uv.push_back(lo + f * (hi - lo));
    }
  }
  return uv;
}

struct Joined {
  std::vector<glm::vec2> uv;
  std::vector<std::uint32_t> indices;
};

Joined join(const Scene& scene) {
  Joined j;
  for (const Primitive& p : scene.primitives) {
    REQUIRE(p.lightmap_uv.size() == p.positions.size());
    const auto base = static_cast<std::uint32_t>(j.uv.size());
    j.uv.insert(j.uv.end(), p.lightmap_uv.begin(), p.lightmap_uv.end());
    for (const std::uint32_t v : p.indices) j.indices.push_back(base + v);
  }
  return j;
}

void require_separate(const Scene& scene, const AtlasOptions& o) {
  const Joined j = join(scene);
  CHECK(count_overlap(j.uv, j.indices, o.width, o.height).doubly == 0);
  CHECK(measure_gutter(j.uv, j.indices, find_uv_charts(j.uv, j.indices), {o.width, o.height}, 8) >=
        o.gutter);
}

std::string refusal(Scene scene, int set) {
  AtlasOptions options;
  options.source = AtlasOptions::Source::kSet;
  options.set = set;
  const Posed posed = pose(scene);
  for (Primitive& p : scene.primitives) p.lightmap_uv.clear();
  const auto result = assign_lightmap_uvs(scene, posed, options);
  if (result) return "";
  CHECK(result.error().code == ErrorCode::kInvalid);
  for (const Primitive& p : scene.primitives) CHECK(p.lightmap_uv.empty());
  return result.error().message;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("the first UV set without overlap across all primitives is taken") {
  Scene scene = one_material();
  const auto left = grid_uv(8, 8, {0.02f, 0.02f}, {0.48f, 0.98f});
  const auto right = grid_uv(8, 8, {0.52f, 0.02f}, {0.98f, 0.98f});
  // Set 0 is right for each by itself, but both use the same half.
  add(scene, shapes::sheet(8, 8), {left, left});
  add(scene, shapes::sheet(8, 8), {left, right});
  const Posed posed = pose(scene);
  const auto report = assign_lightmap_uvs(scene, posed, {});
  REQUIRE(report);
  CHECK(report->set == 1);
  CHECK_FALSE(report->repacked);
  CHECK(report->charts == 2);
  CHECK(contains(report->reason, "UV set 0"));
  CHECK(scene.primitives[0].lightmap_uv == left);
  CHECK(scene.primitives[1].lightmap_uv == right);
  CHECK(scene.primitives[1].positions.size() == 81);
  // Texel centres within 2.56..61.44 and 66.56..125.44 across, 2.56..125.44 down.
  CHECK(report->coverage == 2.0 * 58 * 122 / (128 * 128));
  CHECK(report->density_p5 > 0.8);
  CHECK(report->density_p95 < 1.1);
}

TEST_CASE("a set that is asked for is refused with its reason") {
  const auto good = grid_uv(8, 8, {0, 0}, {1, 1});
  Scene scene = one_material();
  add(scene, shapes::sheet(8, 8),
      {good, grid_uv(8, 8, {0.3f, 0.1f}, {1.2f, 0.9f}), std::vector<glm::vec2>(81, glm::vec2(0.5f)),
       grid_uv(8, 8, {0, 0}, {1, 1})});
  auto& doubled = scene.primitives[0].texcoords[3];
  for (glm::vec2& uv : doubled) uv.x = 2 * std::abs(uv.x - 0.5f);
  CHECK(refusal(scene, 0).empty());
  CHECK(contains(refusal(scene, 1), "leaves [0,1]"));
  CHECK(contains(refusal(scene, 2), "no room"));
  CHECK(contains(refusal(scene, 3), "belong to two triangles"));
  CHECK(contains(refusal(scene, 4), "does not have it"));
  CHECK_FALSE(refusal(scene, -1).empty());
  scene.primitives[0].texcoords[0][40].x = std::numeric_limits<float>::quiet_NaN();
  CHECK(contains(refusal(scene, 0), "leaves [0,1]"));
  scene.primitives[0].texcoords[0][40].x = 0.5f;
  scene.materials[0].double_sided = true;
  CHECK(contains(refusal(scene, 0), "double-sided"));
}

TEST_CASE("UVs a rounding error outside are clamped, farther ones refused") {
  Scene scene = one_material();
  add(scene, shapes::sheet(4, 4), {grid_uv(4, 4, {-0.8e-5f, 0}, {1.000008f, 1})});
  const Posed posed = pose(scene);
  const auto report = assign_lightmap_uvs(scene, posed, {});
  REQUIRE(report);
  CHECK(report->set == 0);
  for (const glm::vec2& uv : scene.primitives[0].lightmap_uv) {
    CHECK((uv.x >= 0 && uv.x <= 1));
  }
  scene.primitives[0].texcoords[0][0].x = -3e-5f;
  CHECK(contains(refusal(scene, 0), "leaves [0,1]"));
}

TEST_CASE("without a usable set the unwrap says why and copies every attribute at its seams") {
  Scene scene = one_material();
  const shapes::Mesh torus = shapes::torus(24, 12);
  add(scene, torus, {grid_uv(24, 12, {0, 0}, {4, 4})});
  add(scene, shapes::box(glm::vec3(0.5f)), {});
  const Scene before = scene;
  const Posed posed = pose(scene);
  const AtlasOptions options;
  const auto report = assign_lightmap_uvs(scene, posed, options);
  REQUIRE(report);
  CHECK(report->set == -1);
  CHECK(contains(report->reason, "UV set 0"));
  CHECK(report->gutter >= 2);
  CHECK(report->density_p5 > 0.8);
  CHECK(report->density_p95 < 1.25);
  require_separate(scene, options);
  CHECK(scene.primitives[0].positions.size() > before.primitives[0].positions.size());
  for (std::size_t i = 0; i < scene.primitives.size(); ++i) {
    const Primitive& now = scene.primitives[i];
    const Primitive& was = before.primitives[i];
    REQUIRE(now.indices.size() == was.indices.size());
    const std::size_t count = now.positions.size();
    REQUIRE(now.normals.size() == count);
    REQUIRE(now.colors.size() == count);
    REQUIRE(now.joints.size() == 4 * count);
    REQUIRE(now.weights.size() == 4 * count);
    REQUIRE(now.morph_targets[0].positions.size() == count);
    REQUIRE(now.morph_targets[0].normals.size() == count);
    for (const auto& set : now.texcoords) REQUIRE(set.size() == count);
    for (std::size_t k = 0; k < now.indices.size(); ++k) {
      const std::uint32_t v = now.indices[k], w = was.indices[k];
      REQUIRE(now.positions[v] == was.positions[w]);
      REQUIRE(now.normals[v] == was.normals[w]);
      REQUIRE(now.colors[v] == was.colors[w]);
      REQUIRE(now.joints[4 * v + 3] == was.joints[4 * w + 3]);
      REQUIRE(now.weights[4 * v + 1] == was.weights[4 * w + 1]);
      REQUIRE(now.morph_targets[0].positions[v] == was.morph_targets[0].positions[w]);
      REQUIRE(now.morph_targets[0].normals[v] == was.morph_targets[0].normals[w]);
      if (!was.texcoords.empty()) REQUIRE(now.texcoords[0][v] == was.texcoords[0][w]);
    }
  }
}

TEST_CASE("double-sided surfaces get a second side with texels of its own") {
  Scene scene = one_material();
  scene.materials[0].double_sided = true;
  const shapes::Mesh sheet = shapes::sheet(10, 10);
  add(scene, sheet, {grid_uv(10, 10, {0, 0}, {1, 1})});
  const Posed posed = pose(scene);
  const AtlasOptions options;
  const auto report = assign_lightmap_uvs(scene, posed, options);
  REQUIRE(report);
  CHECK(report->set == -1);
  CHECK(contains(report->reason, "double-sided"));
  require_separate(scene, options);
  CHECK(report->coverage > 0.7);
  const Primitive& p = scene.primitives[0];
  const std::size_t triangles = sheet.indices.size() / 3;
  REQUIRE(p.indices.size() == 2 * sheet.indices.size());
  REQUIRE(p.other_side.size() == 2 * triangles);
  for (std::uint32_t t = 0; t < 2 * triangles; ++t) {
    const std::uint32_t other = p.other_side[t];
    REQUIRE(other != t);
    REQUIRE(p.other_side[other] == t);
    // The same corners, the other way round.
    const auto corner = [&](std::uint32_t tri, std::uint32_t k) { return p.indices[3 * tri + k]; };
    const std::array<std::uint32_t, 3> reversed{0, 2, 1};
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t v = corner(t, k), w = corner(other, reversed[k]);
      REQUIRE(v != w);
      REQUIRE(p.positions[v] == p.positions[w]);
      REQUIRE(p.normals[v] == -p.normals[w]);
      REQUIRE(p.morph_targets[0].normals[v] == -p.morph_targets[0].normals[w]);
      REQUIRE(p.morph_targets[0].positions[v] == p.morph_targets[0].positions[w]);
      REQUIRE(p.joints[4 * v] == p.joints[4 * w]);
      REQUIRE(p.colors[v] == p.colors[w]);
      REQUIRE(p.texcoords[0][v] == p.texcoords[0][w]);
    }
  }
}

TEST_CASE("density is measured on the posed surface, not on the rest pose") {
  Scene scene = one_material();
  add(scene, shapes::sheet(12, 12), {});
  Posed posed = pose(scene);
  // Half of the sheet is stretched to three times its width.
  for (glm::vec3& p : posed[0]) {
    if (p.x > 0.5f) p.x = 0.5f + 3 * (p.x - 0.5f);
  }
  const auto report = assign_lightmap_uvs(scene, posed, {});
  REQUIRE(report);
  CHECK(report->density_p5 > 0.9);
  CHECK(report->density_p95 < 1.1);
}

TEST_CASE("a set of the file makes room for the ground, its charts rigid") {
  Scene scene = one_material();
  const auto left = grid_uv(8, 8, {0.02f, 0.02f}, {0.46f, 0.46f});
  const auto right = grid_uv(8, 8, {0.54f, 0.50f}, {0.98f, 0.94f});
  add(scene, shapes::sheet(8, 8), {left});
  add(scene, shapes::sheet(8, 8), {right});
  for (glm::vec3& p : scene.primitives[1].positions) p.y += 1;
  const auto ground = add_ground(scene, {0, 0, 0}, {1, 1, 1}, {});
  REQUIRE(ground);
  AtlasOptions options;
  options.width = options.height = 256;
  options.added = {*ground};
  const Posed posed = pose(scene);
  const auto report = assign_lightmap_uvs(scene, posed, options);
  REQUIRE(report);
  CHECK(report->set == 0);
  CHECK(report->repacked);
  CHECK(report->charts == 3);
  require_separate(scene, options);
  CHECK(report->density_p5 > 0.9);
  CHECK(report->density_p95 < 1.1);
  // One scale for all, turned by right angles: every edge along an axis stays along one.
  double scale = 0;
  for (std::size_t i = 0; i < 2; ++i) {
    const Primitive& p = scene.primitives[i];
    REQUIRE(p.positions.size() == 81);
    const glm::dvec2 along = glm::dvec2(p.lightmap_uv[8]) - glm::dvec2(p.lightmap_uv[0]);
    const glm::dvec2 up = glm::dvec2(p.lightmap_uv[72]) - glm::dvec2(p.lightmap_uv[0]);
    // Snapped to 1/65535.
    CHECK(std::min(std::abs(along.x), std::abs(along.y)) < 2e-5);
    CHECK(std::abs(glm::length(along) - glm::length(up)) < 4e-5);
    CHECK((along.x * up.y - along.y * up.x) > 0);
    if (scale == 0) scale = glm::length(along);
    CHECK(std::abs(glm::length(along) - scale) < 4e-5);
  }
}

TEST_CASE("the ground has its own density in an unwrap") {
  for (const double density : {0.5, 1.0}) {
    Scene scene = one_material();
    add(scene, shapes::sheet(8, 8), {});
    const auto ground = add_ground(scene, {0, 0, 0}, {1, 1, 1}, {});
    REQUIRE(ground);
    AtlasOptions options;
    options.width = options.height = 256;
    options.added = {*ground};
    options.added_density = density;
    const Posed posed = pose(scene);
    const auto report = assign_lightmap_uvs(scene, posed, options);
    REQUIRE(report);
    const auto texels_over_metres = [&](std::size_t i) {
      const Primitive& p = scene.primitives[i];
      double flat = 0, area = 0;
      for (std::size_t k = 0; k < p.indices.size(); k += 3) {
        const std::uint32_t a = p.indices[k], b = p.indices[k + 1], c = p.indices[k + 2];
        const glm::dvec2 u(p.lightmap_uv[b] - p.lightmap_uv[a]);
        const glm::dvec2 v(p.lightmap_uv[c] - p.lightmap_uv[a]);
        flat += std::abs(u.x * v.y - u.y * v.x);
        area += glm::length(glm::cross(glm::dvec3(p.positions[b] - p.positions[a]),
                                       glm::dvec3(p.positions[c] - p.positions[a])));
      }
      return std::sqrt(flat / area);
    };
    CHECK(texels_over_metres(1) / texels_over_metres(0) == Approx(density).epsilon(0.02));
    CHECK(report->density_p95 < 1.1);
  }
}

TEST_CASE("what cannot be assigned leaves the scene as it was") {
  Scene scene = one_material();
  scene.materials[0].double_sided = true;
  add(scene, shapes::loose_triangles(200, 2), {});
  const Posed posed = pose(scene);
  AtlasOptions options;
  options.width = options.height = 24;
  const auto crowded = assign_lightmap_uvs(scene, posed, options);
  REQUIRE_FALSE(crowded);
  CHECK(crowded.error().code == ErrorCode::kLimit);
  CHECK(scene.primitives[0].indices.size() == 600);
  CHECK(scene.primitives[0].other_side.empty());
  CHECK(scene.primitives[0].lightmap_uv.empty());

  const auto expect_invalid = [&](const AtlasOptions& o,
                                  std::span<const std::vector<glm::vec3>> p) {
    const auto r = assign_lightmap_uvs(scene, p, o);
    REQUIRE_FALSE(r);
    CHECK(r.error().code == ErrorCode::kInvalid);
  };
  expect_invalid({}, {});
  Posed wrong = posed;
  wrong[0].pop_back();
  expect_invalid({}, wrong);
  AtlasOptions bad;
  bad.width = 0;
  expect_invalid(bad, posed);
  bad = {};
  bad.height = 5000;
  expect_invalid(bad, posed);
  bad = {};
  bad.gutter = -1;
  expect_invalid(bad, posed);
  bad = {};
  bad.added = {7};
  expect_invalid(bad, posed);
  bad = {};
  bad.added_density = 0;
  expect_invalid(bad, posed);
}

TEST_CASE("gutters, charts and overlap are counted as they are") {
  // Two quads of 8 × 8 texels, 3 texels apart; then one moved onto the other by 2 texels.
  const auto quads = [](float x) {
    const float a = 4.0f / 64, b = 12.0f / 64;
    return std::vector<glm::vec2>{
        {a, a}, {b, a}, {b, b}, {a, b}, {x, a}, {x + 8.0f / 64, a}, {x + 8.0f / 64, b}, {x, b}};
  };
  const std::vector<std::uint32_t> indices{0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7};
  const auto apart = quads(15.0f / 64);
  const UvCharts charts = find_uv_charts(apart, indices);
  CHECK(charts.count == 2);
  CHECK(charts.of_triangle == std::vector<std::uint32_t>{0, 0, 1, 1});
  CHECK(measure_gutter(apart, indices, charts, {64, 64}, 8) == 3);
  CHECK(measure_gutter(apart, indices, charts, {64, 64}, 2) == 2);
  CHECK(count_overlap(apart, indices, 64, 64).covered == 128);
  CHECK(count_overlap(apart, indices, 64, 64).doubly == 0);
  const auto over = quads(10.0f / 64);
  CHECK(count_overlap(over, indices, 64, 64).covered == 8 * 14);
  CHECK(count_overlap(over, indices, 64, 64).doubly == 16);
}
