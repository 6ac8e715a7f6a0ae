// SPDX-License-Identifier: MIT
#include "player/posed_meshes.hpp"

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "tests/test.hpp"

using namespace relit;
using namespace relit::player;

namespace {

glm::mat4x3 turned_about(const glm::vec3& pivot, float angle, float scale = 1) {
  glm::mat4 m = glm::translate(glm::mat4(1.0f), pivot);
  m = glm::rotate(m, angle, glm::normalize(glm::vec3(1, 2, -0.5f)));
  m = glm::scale(m, glm::vec3(scale));
  return glm::mat4x3(glm::translate(m, -pivot));
}

decoders::Pose pose_of(const glm::mat4x3& matrix) {
  decoders::Pose pose;
  pose.palette = {matrix};
  return pose;
}

glm::vec3 apply(const decoders::Pose& pose, const glm::vec3& p) {
  return pose.palette[0] * glm::vec4(p, 1);
}

}  // namespace

TEST_CASE("a limb between two poses keeps its length and its joint") {
  const glm::vec3 pivot(0.3f, 1.4f, -0.2f), tip(0.3f, 0.9f, 0.1f);
  const float length = glm::length(tip - pivot);
  for (const float angle : {0.4f, 2.5f}) {
    const decoders::Pose a = pose_of(turned_about(pivot, 0)),
                         b = pose_of(turned_about(pivot, angle));
    decoders::Pose out;
    for (const float t : {0.0f, 0.25f, 0.5f, 1.0f}) {
      INFO(angle << " " << t);
      blend_poses(a, b, t, out);
      // Some ten roundings of numbers of about 1, 6e-8 each.
      CHECK(glm::length(apply(out, pivot) - pivot) < 2e-6f);
      CHECK(std::abs(glm::length(apply(out, tip) - pivot) - length) < 2e-6f);
    }
    blend_poses(a, b, 0.5f, out);
    const decoders::Pose half = pose_of(turned_about(pivot, 0.5f * angle));
    CHECK(glm::length(apply(out, tip) - apply(half, tip)) < 2e-6f);
  }
}

TEST_CASE("even scales blend with the turn, other matrices linearly") {
  const glm::vec3 pivot(0), tip(0, 1, 0);
  decoders::Pose out;
  blend_poses(pose_of(turned_about(pivot, 0, 1)), pose_of(turned_about(pivot, 1, 3)), 0.5f, out);
  CHECK(glm::length(apply(out, tip)) == Approx(2).margin(1e-5));
  glm::mat4x3 sheared(1.0f), mirrored(1.0f);
  sheared[1].x = 0.5f;
  mirrored[0].x = -1;
  for (const glm::mat4x3& other : {sheared, mirrored}) {
    blend_poses(pose_of(glm::mat4x3(1.0f)), pose_of(other), 0.5f, out);
    const glm::vec3 p(1, 1, 1), mean = 0.5f * (p + other * glm::vec4(p, 1));
    CHECK(glm::length(apply(out, p) - mean) < 1e-6f);
  }
}

TEST_CASE("posed meshes mix the vertices of two poses") {
  decoders::Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.indices = {0, 1, 2};
  decoders::Pose low, high;
  low.vertices = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  high.vertices = {{{0, 0, 2}, {1, 0, 2}, {0, 1, 2}}};
  const std::vector<decoders::Mesh> meshes{mesh};
  PosedMeshes posed(meshes);
  CHECK(posed.empty());
  posed.set(low, &high, 0.25f);
  REQUIRE_FALSE(posed.empty());
  for (const glm::vec3& p : posed.positions(0)) CHECK(p.z == 0.5f);
  std::vector<glm::vec3> normals(3);
  posed.normals(0, normals);
  for (const glm::vec3& n : normals) CHECK(n.z == Approx(1));
  posed.set(low, nullptr, 0);
  for (const glm::vec3& p : posed.positions(0)) CHECK(p.z == 0);
}
