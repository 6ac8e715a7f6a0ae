// SPDX-License-Identifier: MIT
#include "decoders/texel_normals.hpp"

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <vector>

#include "decoders/texel_raster.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::decoders;

namespace {

constexpr int kWidth = 16, kHeight = 12;

/// Two triangles whose charts lie apart: the first in texels (2,2) (8,2) (2,8), the second in
/// (10,4) (14,4) (14,10), all of one joint.
Mesh two_triangles() {
  Mesh mesh;
  const glm::vec2 texels[] = {{2, 2}, {8, 2}, {2, 8}, {10, 4}, {14, 4}, {14, 10}};
  const glm::vec3 normals[] = {{1, 0, 0}, {0, 1, 0},       {0, 0, 1},
                               {0, 0, 1}, {0, 0.6f, 0.8f}, {0.6f, 0, 0.8f}};
  for (std::size_t i = 0; i < 6; ++i) {
    mesh.positions.emplace_back(texels[i], 0.0f);
    mesh.normals.push_back(normals[i]);
    mesh.lightmap_uv.push_back(texels[i] / glm::vec2(kWidth, kHeight));
    mesh.indices.push_back(static_cast<std::uint16_t>(i));
    mesh.joints.insert(mesh.joints.end(), {0, 0, 0, 0});
    mesh.weights.insert(mesh.weights.end(), {1, 0, 0, 0});
  }
  mesh.influences_per_vertex = 4;
  return mesh;
}

Pose turned(float degrees) {
  Pose pose;
  pose.palette.push_back(
      glm::mat4x3(glm::rotate(glm::mat4(1), glm::radians(degrees), glm::vec3(0.48f, 0.6f, 0.64f))));
  return pose;
}

struct Computed {
  std::vector<Mesh> meshes;
  std::vector<glm::vec3> normals;
  [[nodiscard]] glm::vec3 at(int x, int y) const {
    return normals[static_cast<std::size_t>(y * kWidth + x)];
  }
};

Computed compute(std::vector<Mesh> meshes, const Pose& pose) {
  Computed computed{std::move(meshes), std::vector<glm::vec3>(kWidth * kHeight, glm::vec3(7))};
  auto texels = TexelNormals::create(computed.meshes, kWidth, kHeight);
  REQUIRE(texels);
  texels->compute(pose, computed.normals);
  return computed;
}

/// Barycentrics are kept in 1/65535, and a normal is turned by at most that times the difference of
/// its corners', here below 1.5.
constexpr float kTolerance = 1.5f * 2 / 65535 + 1e-6f;

bool close(const glm::vec3& a, const glm::vec3& b) { return glm::length(a - b) < kTolerance; }

}  // namespace

TEST_CASE("a covered texel has the posed normal at its centre") {
  for (const float degrees : {0.0f, 73.0f}) {
    const Pose pose = turned(degrees);
    const Computed computed = compute({two_triangles()}, pose);
    const glm::mat3 turn(pose.palette[0]);
    // Texel (3, 3): its centre is (3.5, 3.5), a quarter of the way along either side.
    CHECK(close(computed.at(3, 3), turn * glm::normalize(glm::vec3(0.5f, 0.25f, 0.25f))));
    CHECK(close(computed.at(2, 2), turn * glm::normalize(glm::vec3(10, 1, 1))));
  }
}

TEST_CASE("a texel that only touches a chart has the normal of the nearest point of it") {
  const Computed computed = compute({two_triangles()}, turned(0));
  // Its square shares the side x = 2 with the first triangle; nearest to (1.5, 3.5) is (2, 3.5).
  CHECK(close(computed.at(1, 3), glm::normalize(glm::vec3(0.75f, 0, 0.25f))));
  // Beyond a corner, the corner.
  CHECK(close(computed.at(1, 1), glm::vec3(1, 0, 0)));
}

TEST_CASE("texels beside the surface have the mean of their neighbours, others none") {
  const Computed computed = compute({two_triangles()}, turned(0));
  glm::vec3 sum(0);
  for (int y = 2; y <= 4; ++y) sum += computed.at(1, y);
  CHECK(close(computed.at(0, 3), glm::normalize(sum)));
  for (const glm::ivec2 far : {glm::ivec2(15, 0), glm::ivec2(6, 11), glm::ivec2(0, 11)})
    CHECK(computed.at(far.x, far.y) == glm::vec3(0));
  std::vector<std::uint8_t> mask(kWidth * kHeight, 0);
  const auto texels = TexelNormals::create(computed.meshes, kWidth, kHeight);
  REQUIRE(texels);
  texels->mark(mask);
  for (std::size_t i = 0; i < mask.size(); ++i) {
    INFO(i);
    CHECK((mask[i] != 0) == (computed.normals[i] != glm::vec3(0)));
  }
}

TEST_CASE("every bilinear lookup inside a chart meets texels with normals") {
  const Computed computed = compute({two_triangles()}, turned(0));
  const FixedTriangle triangle(computed.meshes[0].lightmap_uv[0], computed.meshes[0].lightmap_uv[1],
                               computed.meshes[0].lightmap_uv[2], kWidth, kHeight);
  for (int i = 0; i <= 24; ++i) {
    for (int j = 0; i + j <= 24; ++j) {
      const glm::vec2 p(2 + static_cast<float>(i) / 4, 2 + static_cast<float>(j) / 4);
      const glm::ivec2 corner(glm::floor(p - 0.5f));
      for (const glm::ivec2 step :
           {glm::ivec2(0, 0), glm::ivec2(1, 0), glm::ivec2(0, 1), glm::ivec2(1, 1)}) {
        const glm::vec2 share = glm::abs(p - glm::vec2(corner + step) - 0.5f);
        if (share.x >= 1 || share.y >= 1) continue;  // has no weight
        CHECK(glm::length(computed.at(corner.x + step.x, corner.y + step.y)) == Approx(1));
      }
    }
  }
}

TEST_CASE(
    "normals that cancel, degenerate charts and meshes without normals are no directions amiss") {
  Mesh mesh = two_triangles();
  for (glm::vec3& n : mesh.normals) n = glm::vec3(0, 0, 1);
  mesh.normals[1] = mesh.normals[2] = glm::vec3(0, 0, -1);
  Computed computed = compute({mesh}, turned(0));
  for (const glm::vec3& n : computed.normals) {
    CHECK((n == glm::vec3(0) || std::abs(glm::length(n) - 1) < 1e-6f));
  }
  // All corners in one point: owns nothing.
  for (glm::vec2& uv : mesh.lightmap_uv) uv = {0.5f, 0.5f};
  computed = compute({mesh}, turned(0));
  for (const glm::vec3& n : computed.normals) CHECK(n == glm::vec3(0));
  // The triangles' own, both of which face +z.
  Mesh bare = two_triangles();
  bare.normals.clear();
  computed = compute({bare}, turned(0));
  CHECK(close(computed.at(3, 3), glm::vec3(0, 0, 1)));
}

TEST_CASE("triangles over triangles without end are refused, not drawn") {
  Mesh mesh = two_triangles();
  const std::vector<glm::vec2> corners{{0, 0}, {1, 0}, {0, 1}};
  for (std::size_t i = 0; i < 3; ++i) mesh.lightmap_uv[i] = corners[i];
  mesh.indices.clear();
  for (int t = 0; t < 1 << 14; ++t) mesh.indices.insert(mesh.indices.end(), {0, 1, 2});
  // Each visits half of 2^18 texels, 2^14 times over, of which 64 times the map and a little for
  // each triangle are allowed.
  const std::vector<Mesh> meshes{mesh};
  const auto texels = TexelNormals::create(meshes, 512, 512);
  REQUIRE(!texels);
  CHECK(texels.error().code == ErrorCode::kLimit);
}
