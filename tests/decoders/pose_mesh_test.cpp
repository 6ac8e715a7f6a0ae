// SPDX-License-Identifier: MIT
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "decoders/pose.hpp"
#include "tests/decoders/mesh_fixture.hpp"
#include "tests/test.hpp"

using namespace relit;
using decoders::Mesh;
using decoders::Pose;

namespace {

glm::mat4x3 affine(const glm::mat4& m) { return glm::mat4x3(m); }

}  // namespace

TEST_CASE("pose_mesh blends eight influences") {
  const Mesh mesh = test::decoded_quad(2);
  Pose pose;
  pose.palette = {affine(glm::translate(glm::mat4(1), glm::vec3(1, 0, 0))),
                  affine(glm::translate(glm::mat4(1), glm::vec3(0, 2, 0)))};
  std::vector<glm::vec3> posed(4);
  decoders::pose_mesh(mesh, 0, pose, posed, {});
  for (std::size_t v = 0; v < 4; ++v) {
    const glm::dvec3 expected =
        glm::dvec3(mesh.positions[v]) + glm::dvec3(55 / 255.0, 2 * 200 / 255.0, 0);
    // Coordinates up to 17 in floats: a few steps of 1e-6.
    CHECK(glm::length(glm::dvec3(posed[v]) - expected) < 1e-5);
  }
}

TEST_CASE("pose_mesh turns normals by the inverse transpose, mirrors included") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Mesh mesh = test::decoded_quad();
  for (int round = 0; round < 200; ++round) {
    glm::dmat4 m(1);
    for (int c = 0; c < 4; ++c) {
      for (int r = 0; r < 3; ++r) m[c][r] = uniform(random);
    }
    const glm::dmat3 linear(m);
    const double determinant = glm::determinant(linear);
    if (std::abs(determinant) < 0.05) continue;
    mesh.normals.clear();
    for (std::size_t v = 0; v < 4; ++v) {
      const glm::dvec3 n(uniform(random), uniform(random), uniform(random));
      mesh.normals.push_back(glm::vec3(glm::normalize(n)));
    }
    Pose pose;
    pose.palette = {affine(glm::mat4(m))};
    std::vector<glm::vec3> positions(4), normals(4);
    decoders::pose_mesh(mesh, 0, pose, positions, normals);
    for (std::size_t v = 0; v < 4; ++v) {
      const glm::dvec3 p(m * glm::dvec4(glm::dvec3(mesh.positions[v]), 1));
      CHECK(glm::length(glm::dvec3(positions[v]) - p) < 2e-5);  // |p| < 40: 2.4e-6 a step
      const glm::dvec3 n =
          glm::normalize(glm::transpose(glm::inverse(linear)) * glm::dvec3(mesh.normals[v]));
      // Cofactors of up to 2 are off by some 3e-7; the shortest image, of det/|m| >= 0.05/3, makes
      // that 2e-5.
      CHECK(glm::length(glm::dvec3(normals[v]) - n) < 2e-5);
    }
  }
}

TEST_CASE("pose_mesh keeps a normal where a joint is scaled to nothing") {
  Mesh mesh = test::decoded_quad();
  mesh.normals.assign(4, glm::vec3(0, 1, 0));
  Pose pose;
  pose.palette = {glm::mat4x3(0.0f)};
  std::vector<glm::vec3> positions(4), normals(4);
  decoders::pose_mesh(mesh, 0, pose, positions, normals);
  CHECK(positions[2] == glm::vec3(0));
  CHECK(normals[2] == glm::vec3(0, 1, 0));
}

TEST_CASE("pose_mesh adds morph targets before it skins") {
  Mesh mesh = test::decoded_quad();
  mesh.first_morph_weight = 1;
  mesh.morph_targets = {std::vector<glm::vec3>(4, glm::vec3(1, 0, 0)),
                        std::vector<glm::vec3>(4, glm::vec3(0, 1, 0))};
  mesh.normals.assign(4, glm::vec3(0, 0, 1));
  mesh.morph_normals = {std::vector<glm::vec3>(4, glm::vec3(0, 1, -1)),
                        std::vector<glm::vec3>(4, glm::vec3(0, 0, 0))};
  Pose pose;
  pose.morph_weights = {9, 1, 0.5f};
  pose.palette = {affine(glm::scale(glm::mat4(1), glm::vec3(2)))};
  std::vector<glm::vec3> positions(4), normals(4);
  decoders::pose_mesh(mesh, 0, pose, positions, normals);
  CHECK(positions[1] == 2.0f * (mesh.positions[1] + glm::vec3(1, 0.5f, 0)));
  CHECK(glm::length(normals[1] - glm::vec3(0, 1, 0)) < 1e-6f);
}

TEST_CASE("pose_mesh takes normals from the triangles where there are no others") {
  const Mesh mesh = test::decoded_quad(0);
  Pose pose;
  std::vector<glm::vec3> positions(4), normals(4);
  decoders::pose_mesh(mesh, 0, pose, positions, normals);
  CHECK(positions == mesh.positions);
  // Vertex 1 belongs to triangle 0, 1, 2 alone, which lies in the plane of x and y.
  CHECK(normals[1] == glm::vec3(0, 0, 1));
  for (const glm::vec3& n : normals) CHECK(std::abs(glm::length(n) - 1) < 1e-6f);
  pose.vertices = {{{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0}}};
  decoders::pose_mesh(mesh, 0, pose, positions, normals);
  CHECK(normals[3] == glm::vec3(0, 1, 0));
}

TEST_CASE("normals stay finite where cross products overflow") {
  const Mesh mesh = test::decoded_quad(0);
  Pose pose;
  // The cross product of the first triangle's edges is (-1, inf - inf, 1).
  pose.vertices = {{{0, 0, 0}, {1e21f, 0, 1e21f}, {1e21f, 1e-21f, 1e21f}, {0, 0, 0}}};
  std::vector<glm::vec3> positions(4), normals(4);
  decoders::pose_mesh(mesh, 0, pose, positions, normals);
  for (const glm::vec3& n : normals) CHECK(std::abs(glm::length(n) - 1) < 1e-6f);
}
