// SPDX-License-Identifier: MIT
#include "player/posed_meshes.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>

namespace relit::player {
namespace {

/// Rotation, translation and an even scale.
struct Screw {
  glm::quat rotation;
  glm::quat dual;  ///< ½·(0, translation)·rotation
  float scale = 1;
};

/// False for matrices that are something else.
bool to_screw(const glm::mat4x3& m, Screw& out) {
  const glm::vec3 x = m[0], y = m[1], z = m[2];
  const float xx = glm::dot(x, x), volume = glm::dot(glm::cross(x, y), z);
  const float tolerance = 1e-3f * xx;
  const bool even = std::abs(glm::dot(y, y) - xx) <= tolerance &&
                    std::abs(glm::dot(z, z) - xx) <= tolerance &&
                    std::abs(glm::dot(x, y)) <= tolerance &&
                    std::abs(glm::dot(y, z)) <= tolerance && std::abs(glm::dot(z, x)) <= tolerance;
  if (!even || !(volume > 0) || !(xx > 1e-12f)) return false;
  out.scale = std::sqrt(xx);
  out.rotation = glm::normalize(glm::quat_cast(glm::mat3(x, y, z) / out.scale));
  const glm::quat translation(0, 0.5f * m[3].x, 0.5f * m[3].y, 0.5f * m[3].z);
  out.dual = translation * out.rotation;
  return true;
}

glm::mat4x3 blend_linearly(const glm::mat4x3& a, const glm::mat4x3& b, float t) {
  return a * (1 - t) + b * t;
}

glm::mat4x3 blend_matrices(const glm::mat4x3& a, const glm::mat4x3& b, float t) {
  Screw from, to;
  if (!to_screw(a, from) || !to_screw(b, to)) return blend_linearly(a, b, t);
  // Both signs are the same rotation; the shorter way is taken.
  const float sign = glm::dot(from.rotation, to.rotation) < 0 ? -1.0f : 1.0f;
  const glm::quat real = from.rotation * (1 - t) + to.rotation * (sign * t);
  const glm::quat dual = from.dual * (1 - t) + to.dual * (sign * t);
  const float square = glm::dot(real, real);
  if (!(square > 1e-6f)) return blend_linearly(a, b, t);
  const glm::quat moved = dual * glm::conjugate(real) * (2 / square);
  const glm::mat3 turned =
      glm::mat3_cast(real / std::sqrt(square)) * (from.scale * (1 - t) + to.scale * t);
  return {turned[0], turned[1], turned[2], glm::vec3(moved.x, moved.y, moved.z)};
}

}  // namespace

void blend_poses(const decoders::Pose& a, const decoders::Pose& b, float t, decoders::Pose& out) {
  out.palette.resize(a.palette.size());
  for (std::size_t i = 0; i < a.palette.size(); ++i)
    out.palette[i] = blend_matrices(a.palette[i], b.palette[i], t);
  out.morph_weights.resize(a.morph_weights.size());
  for (std::size_t i = 0; i < a.morph_weights.size(); ++i)
    out.morph_weights[i] = a.morph_weights[i] * (1 - t) + b.morph_weights[i] * t;
  out.vertices.resize(a.vertices.size());
  for (std::size_t m = 0; m < a.vertices.size(); ++m) {
    out.vertices[m].resize(a.vertices[m].size());
    for (std::size_t i = 0; i < a.vertices[m].size(); ++i)
      out.vertices[m][i] = glm::mix(a.vertices[m][i], b.vertices[m][i], t);
  }
}

PosedMeshes::PosedMeshes(std::span<const decoders::Mesh> meshes) : meshes_(meshes) {
  std::size_t most = 0;
  for (const decoders::Mesh& mesh : meshes) {
    positions_.emplace_back(mesh.positions.size());
    most = std::max(most, mesh.positions.size());
  }
  scratch_positions_.resize(most);
  scratch_normals_.resize(most);
}

void PosedMeshes::set(const decoders::Pose& pose, const decoders::Pose* other, float other_weight) {
  pose_ = pose;
  other_weight_ = other != nullptr ? other_weight : 0;
  if (other_weight_ > 0) other_ = *other;
  for (std::size_t m = 0; m < meshes_.size(); ++m) {
    decoders::pose_mesh(meshes_[m], m, pose_, positions_[m], {});
    if (!(other_weight_ > 0)) continue;
    const std::span<glm::vec3> others(scratch_positions_.data(), positions_[m].size());
    decoders::pose_mesh(meshes_[m], m, other_, others, {});
    for (std::size_t i = 0; i < others.size(); ++i)
      positions_[m][i] = glm::mix(positions_[m][i], others[i], other_weight_);
  }
  posed_ = true;
}

void PosedMeshes::normals(std::size_t mesh, std::span<glm::vec3> out) {
  const std::span<glm::vec3> positions(scratch_positions_.data(), out.size());
  decoders::pose_mesh(meshes_[mesh], mesh, pose_, positions, out);
  if (!(other_weight_ > 0)) return;
  const std::span<glm::vec3> others(scratch_normals_.data(), out.size());
  decoders::pose_mesh(meshes_[mesh], mesh, other_, positions, others);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const glm::vec3 mixed = glm::mix(out[i], others[i], other_weight_);
    const float length = glm::length(mixed);
    if (length > 0) out[i] = mixed / length;
  }
}

}  // namespace relit::player
