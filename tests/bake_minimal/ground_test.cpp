// SPDX-License-Identifier: MIT
#include "bake_minimal/ground.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/test.hpp"

using namespace relit;
using namespace relit::bake;

TEST_CASE("the ground is a round disc under the clip that faces up") {
  Scene scene;
  scene.materials.resize(2);
  scene.nodes.resize(3);
  scene.primitives.resize(1);
  GroundOptions options;
  options.albedo = {0.25f, 0.5f, 0.75f};
  const auto added = add_ground(scene, {-1, 0.5f, 2}, {3, 4, 3}, options);
  REQUIRE(added);
  REQUIRE(*added == 1);
  const Primitive& p = scene.primitives[1];
  REQUIRE(p.material == 2);
  CHECK(scene.materials[2].base_color == glm::vec4(0.25f, 0.5f, 0.75f, 1.0f));
  CHECK_FALSE(scene.materials[2].double_sided);
  REQUIRE(p.node == 3);
  CHECK(scene.nodes[3].parent == -1);
  CHECK(p.skin == -1);

  const glm::vec3 centre(1, 0.5f, 2.5f);
  const float radius = 1.6f * 2;  // half of the larger extent, 4
  float farthest = 0;
  REQUIRE(p.normals.size() == p.positions.size());
  REQUIRE(p.texcoords.size() == 1);
  REQUIRE(p.texcoords[0].size() == p.positions.size());
  for (std::size_t v = 0; v < p.positions.size(); ++v) {
    REQUIRE(p.positions[v].y == 0.5f);
    REQUIRE(p.normals[v] == glm::vec3(0, 1, 0));
    farthest = std::max(farthest, glm::length(p.positions[v] - centre));
    const glm::vec2 uv = p.texcoords[0][v];
    // Planar: the same map everywhere, within float rounding of coordinates up to 5.
    const glm::vec2 off(p.positions[v].x - centre.x, p.positions[v].z - centre.z);
    REQUIRE(glm::length(uv - (0.5f + 0.5f * off / radius)) < 1e-6f);
  }
  CHECK(std::abs(farthest - radius) < 1e-6f);
  double area = 0;
  for (std::size_t k = 0; k < p.indices.size(); k += 3) {
    const glm::vec3 a = p.positions[p.indices[k]];
    const glm::vec3 n =
        glm::cross(p.positions[p.indices[k + 1]] - a, p.positions[p.indices[k + 2]] - a);
    REQUIRE(n.y > 0);
    area += static_cast<double>(n.y) / 2;
  }
  // A regular polygon of 64 sides, without holes or doubled triangles.
  const double exact = 32 * std::sin(2 * 3.14159265358979 / 64) * 3.2 * 3.2;
  CHECK(area == Approx(exact).epsilon(1e-5));
}

TEST_CASE("a clip without extent still gets a ground") {
  Scene scene;
  REQUIRE(add_ground(scene, glm::vec3(2), glm::vec3(2), {}));
  CHECK(scene.primitives[0].positions[1] != scene.primitives[0].positions[0]);
}

TEST_CASE("the ground refuses bounds and options that make no sense") {
  Scene scene;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  CHECK_FALSE(add_ground(scene, {0, nan, 0}, {1, 1, 1}, {}));
  CHECK_FALSE(add_ground(scene, {0, 0, 0}, {1, -1, 1}, {}));
  GroundOptions options;
  options.radius = 0;
  CHECK_FALSE(add_ground(scene, {0, 0, 0}, {1, 1, 1}, options));
  options = {};
  options.segments = 2;
  CHECK_FALSE(add_ground(scene, {0, 0, 0}, {1, 1, 1}, options));
  options = {};
  options.albedo.y = 1.5f;
  const auto refused = add_ground(scene, {0, 0, 0}, {1, 1, 1}, options);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == ErrorCode::kInvalid);
  CHECK(scene.primitives.empty());
  CHECK(scene.materials.empty());
  CHECK(scene.nodes.empty());
}
