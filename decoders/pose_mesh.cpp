// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cassert>
#include <cmath>

#include "decoders/pose.hpp"

namespace relit::decoders {
namespace {

glm::vec3 unit_or(const glm::vec3& v, const glm::vec3& otherwise) {
  // Scaled first: cofactors of large matrices would overflow when squared. What overflowed already
  // may be NaN in one component alone, which max() does not see.
  const float largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  const bool finite = std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
  if (!finite || largest == 0.0f) return otherwise;
  const glm::vec3 scaled = v / largest;
  return scaled / std::sqrt(glm::dot(scaled, scaled));
}

void add_morphs(const std::vector<std::vector<glm::vec3>>& targets, std::size_t first_weight,
                const Pose& pose, std::span<glm::vec3> out) {
  for (std::size_t k = 0; k < targets.size(); ++k) {
    const float weight = pose.morph_weights[first_weight + k];
    if (weight == 0.0f) continue;
    const glm::vec3* offsets = targets[k].data();
    for (std::size_t v = 0; v < out.size(); ++v) out[v] += weight * offsets[v];
  }
}

/// The weighted sum of a vertex's palette matrices; one full weight, as of rigid meshes, skips the
/// sum.
template <int kInfluences>
inline glm::mat4x3 blend(const glm::mat4x3* palette, const std::uint16_t* joints,
                         const float* weights) {
  if (weights[0] == 1.0f) return palette[joints[0]];
  glm::mat4x3 sum = palette[joints[0]] * weights[0];
  for (int i = 1; i < kInfluences; ++i) {
    if (weights[i] != 0.0f) sum += palette[joints[i]] * weights[i];
  }
  return sum;
}

template <int kInfluences>
void skin(const Mesh& mesh, const Pose& pose, std::span<glm::vec3> positions,
          std::span<glm::vec3> normals) {
  const glm::mat4x3* palette = pose.palette.data();
  for (std::size_t v = 0; v < positions.size(); ++v) {
    const glm::mat4x3 m =
        blend<kInfluences>(palette, &mesh.joints[v * kInfluences], &mesh.weights[v * kInfluences]);
    const glm::vec3 p = positions[v];
    positions[v] = m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3];
    if (normals.empty()) continue;
    const glm::vec3 n = normals[v];
    const glm::vec3 x = glm::cross(m[1], m[2]);
    const glm::vec3 posed = x * n.x + glm::cross(m[2], m[0]) * n.y + glm::cross(m[0], m[1]) * n.z;
    // The cofactors of a reflection turn normals inside out.
    normals[v] = unit_or(glm::dot(x, m[0]) < 0 ? -posed : posed, n);
  }
}

void normals_of_triangles(const Mesh& mesh, std::span<const glm::vec3> positions,
                          std::span<glm::vec3> normals) {
  std::fill(normals.begin(), normals.end(), glm::vec3(0.0f));
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const std::size_t a = mesh.indices[i], b = mesh.indices[i + 1], c = mesh.indices[i + 2];
    const glm::vec3 n = glm::cross(positions[b] - positions[a], positions[c] - positions[a]);
    normals[a] += n;
    normals[b] += n;
    normals[c] += n;
  }
  for (glm::vec3& n : normals) n = unit_or(n, glm::vec3(0, 1, 0));
}

}  // namespace

void pose_mesh(const Mesh& mesh, std::size_t mesh_index, const Pose& pose,
               std::span<glm::vec3> positions, std::span<glm::vec3> normals) {
  assert(positions.size() == mesh.positions.size());
  assert(normals.empty() || normals.size() == mesh.positions.size());
  if (!pose.vertices.empty()) {
    const std::vector<glm::vec3>& posed = pose.vertices[mesh_index];
    std::copy(posed.begin(), posed.end(), positions.begin());
    if (!normals.empty()) normals_of_triangles(mesh, positions, normals);
    return;
  }
  const bool own_normals = !normals.empty() && !mesh.normals.empty();
  std::copy(mesh.positions.begin(), mesh.positions.end(), positions.begin());
  add_morphs(mesh.morph_targets, mesh.first_morph_weight, pose, positions);
  if (own_normals) {
    std::copy(mesh.normals.begin(), mesh.normals.end(), normals.begin());
    if (!mesh.morph_normals.empty()) {
      add_morphs(mesh.morph_normals, mesh.first_morph_weight, pose, normals);
      for (std::size_t v = 0; v < normals.size(); ++v) {
        normals[v] = unit_or(normals[v], mesh.normals[v]);
      }
    }
  }
  const std::span<glm::vec3> skinned = own_normals ? normals : std::span<glm::vec3>();
  if (mesh.influences_per_vertex == 4) skin<4>(mesh, pose, positions, skinned);
  if (mesh.influences_per_vertex == 8) skin<8>(mesh, pose, positions, skinned);
  if (!normals.empty() && !own_normals) normals_of_triangles(mesh, positions, normals);
}

}  // namespace relit::decoders
