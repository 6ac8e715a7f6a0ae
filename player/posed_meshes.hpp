// SPDX-License-Identifier: MIT
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "container/base/result.hpp"
#include "decoders/mesh.hpp"
#include "decoders/pose.hpp"

namespace relit::player {

/// The pose between two frames of a clip, `t` of the way from `a` to `b`, into `out`, which keeps
/// its memory. Palette matrices move as screws (dual quaternions), so that limbs neither shrink nor
/// leave their joints; those that shear, mirror or scale unevenly, morph weights and vertices are
/// blended linearly. `a` and `b` are of one clip; 0 <= t <= 1.
void blend_poses(const decoders::Pose& a, const decoders::Pose& b, float t, decoders::Pose& out);

/// The vertices of all meshes at the moment that is shown. Steady state allocates nothing.
class PosedMeshes {
 public:
  /// `meshes` is borrowed.
  explicit PosedMeshes(std::span<const decoders::Mesh> meshes);

  /// The pose of one clip, and where one fades into another the other's with its weight: vertices
  /// are then blended linearly. Poses are copied. `other` null: `pose` alone.
  void set(const decoders::Pose& pose, const decoders::Pose* other, float other_weight);

  [[nodiscard]] bool empty() const { return !posed_; }
  /// Model space; valid until the next set().
  [[nodiscard]] std::span<const glm::vec3> positions(std::size_t mesh) const {
    return positions_[mesh];
  }
  /// Unit normals, computed here; `out` has the mesh's count.
  void normals(std::size_t mesh, std::span<glm::vec3> out);
  [[nodiscard]] std::size_t count() const { return meshes_.size(); }

 private:
  std::span<const decoders::Mesh> meshes_;
  std::vector<std::vector<glm::vec3>> positions_;
  std::vector<glm::vec3> scratch_positions_, scratch_normals_;  ///< of the largest mesh
  decoders::Pose pose_, other_;
  float other_weight_ = 0;
  bool posed_ = false;
};

}  // namespace relit::player
