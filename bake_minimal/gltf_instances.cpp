// SPDX-License-Identifier: MIT
#include "bake_minimal/gltf_instances.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "bake_minimal/gltf_meshes.hpp"
#include "container/base/limits.hpp"

namespace relit::bake::gltf {
namespace {

/// Of all primitives together: instances multiply what the file holds.
constexpr std::size_t kSceneVertices = std::size_t{1} << 26;
constexpr std::size_t kSceneMorphedVertices = std::size_t{1} << 27;

struct Influence {
  std::uint16_t joint = 0;
  float weight = 0;
};

Unexpected bad_vertex(const Document& document, const MeshPart& part, std::size_t v,
                      const std::string& what) {
  return document.fail(ErrorCode::kCorrupt, part.where,
                       "vertex " + std::to_string(part.source[v]) + ": " + what);
}

/// The influences of one vertex that count, with normalised weights: the 8 largest if there are
/// more. Returns how many there were.
Result<std::size_t> read_vertex(const Document& document, const MeshPart& part,
                                std::size_t joint_count, std::size_t v,
                                std::vector<Influence>& out) {
  out.clear();
  const auto influences = static_cast<std::size_t>(part.influences_per_vertex);
  double sum = 0;
  for (std::size_t i = v * influences; i < (v + 1) * influences; ++i) {
    const float weight = part.weights[i];
    if (!std::isfinite(weight) || weight < 0) {
      return bad_vertex(document, part, v,
                        "a weight is negative or not finite; normalise the weights and export "
                        "again");
    }
    if (weight == 0) continue;
    if (part.joints[i] >= joint_count) {
      return bad_vertex(document, part, v,
                        "joint " + std::to_string(part.joints[i]) +
                            " does not exist; the skin has " + std::to_string(joint_count) +
                            " joints: export again");
    }
    out.push_back({static_cast<std::uint16_t>(part.joints[i]), weight});
    sum += static_cast<double>(weight);
  }
  if (!(sum > 1e-12)) {
    return bad_vertex(document, part, v,
                      "its weights are all zero; bind it to a joint (in Blender: Weights > "
                      "Normalize All) and export again");
  }
  const std::size_t count = out.size();
  if (count > 8) {
    std::stable_sort(out.begin(), out.end(),
                     [](const Influence& a, const Influence& b) { return a.weight > b.weight; });
    out.resize(8);
    sum = 0;
    for (const Influence& influence : out) sum += static_cast<double>(influence.weight);
  }
  for (Influence& influence : out) {
    influence.weight = static_cast<float>(static_cast<double>(influence.weight) / sum);
  }
  return count;
}

Status bind_to_skin(Document& document, const MeshPart& part, const Skin& skin, Primitive& out) {
  const std::size_t count = out.positions.size();
  std::vector<Influence> vertex;
  std::vector<std::array<Influence, 8>> all(count);
  std::size_t most = 0;
  for (std::size_t v = 0; v < count; ++v) {
    RELIT_ASSIGN(const std::size_t had, read_vertex(document, part, skin.joints.size(), v, vertex));
    std::copy(vertex.begin(), vertex.end(), all[v].begin());
    most = std::max(most, had);
  }
  if (most > 8) {
    document.warn(part.where, std::to_string(most) +
                                  " joints move a vertex; only the 8 of largest weight are kept");
  }
  out.influences_per_vertex = most <= 4 ? 4 : 8;
  for (const auto& influences : all) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(out.influences_per_vertex); ++i) {
      out.joints.push_back(influences[i].joint);
      out.weights.push_back(influences[i].weight);
    }
  }
  return {};
}

/// Front faces of mirrored surfaces become counter-clockwise again, as the rest pose has them.
void unmirror(const Scene& scene, std::span<const glm::mat4> world, Primitive& primitive) {
  const auto is_mirrored = [&](std::uint32_t vertex) {
    if (primitive.skin < 0) {
      return glm::determinant(
                 glm::dmat3(glm::dmat4(world[static_cast<std::size_t>(primitive.node)]))) < 0;
    }
    const Skin& skin = scene.skins[static_cast<std::size_t>(primitive.skin)];
    const auto influences = static_cast<std::size_t>(primitive.influences_per_vertex);
    glm::dmat4 sum(0.0);
    for (std::size_t i = vertex * influences; i < (vertex + 1) * influences; ++i) {
      const std::uint16_t joint = primitive.joints[i];
      sum += static_cast<double>(primitive.weights[i]) *
             (glm::dmat4(world[static_cast<std::size_t>(skin.joints[joint])]) *
              glm::dmat4(skin.inverse_bind[joint]));
    }
    return glm::determinant(glm::dmat3(sum)) < 0;
  };
  for (std::size_t t = 0; t < primitive.indices.size(); t += 3) {
    if (is_mirrored(primitive.indices[t])) {
      std::swap(primitive.indices[t + 1], primitive.indices[t + 2]);
    }
  }
}

Status add_morph_weights(const Document& document, std::size_t file_node, std::size_t target_count,
                         Scene& scene) {
  const tinygltf::Node& node = document.model.nodes[file_node];
  const tinygltf::Mesh& mesh = document.model.meshes[static_cast<std::size_t>(node.mesh)];
  const auto& weights = node.weights.empty() ? mesh.weights : node.weights;
  if (!weights.empty() && weights.size() != target_count) {
    return document.fail(ErrorCode::kCorrupt, label("node", file_node, node.name),
                         std::to_string(weights.size()) + " morph weights for " +
                             std::to_string(target_count) + " targets; there must be one each");
  }
  for (std::size_t t = 0; t < target_count; ++t) {
    const float weight = weights.empty() ? 0.0f : static_cast<float>(weights[t]);
    if (!std::isfinite(weight)) {
      return document.fail(ErrorCode::kCorrupt, label("node", file_node, node.name),
                           "a morph weight is out of the range of 32-bit floats");
    }
    scene.default_morph_weights.push_back(weight);
  }
  scene.morph_weight_count = static_cast<std::uint32_t>(scene.default_morph_weights.size());
  return {};
}

class Instancer {
 public:
  Instancer(Document& document, const NodeMap& nodes, Scene& scene)
      : document_(document), nodes_(nodes), scene_(scene), meshes_(document.model.meshes.size()) {
    ScenePose rest;
    scene.sample(-1, 0, rest);
    scene.world_matrices(rest, world_);
  }

  Status add(std::size_t file_node) {
    const tinygltf::Node& node = document_.model.nodes[file_node];
    const std::string where = label("node", file_node, node.name);
    if (!in_range(node.mesh, meshes_.size())) {
      return document_.fail(ErrorCode::kCorrupt, where,
                            "mesh " + std::to_string(node.mesh) + " does not exist; there are " +
                                std::to_string(meshes_.size()));
    }
    if (node.skin >= 0 && !in_range(node.skin, scene_.skins.size())) {
      return document_.fail(ErrorCode::kCorrupt, where,
                            "skin " + std::to_string(node.skin) + " does not exist; there are " +
                                std::to_string(scene_.skins.size()));
    }
    auto& parts = meshes_[static_cast<std::size_t>(node.mesh)];
    if (!parts) {
      RELIT_ASSIGN(parts, read_mesh(document_, static_cast<std::size_t>(node.mesh)));
    }
    if (parts->empty()) return {};
    const std::uint32_t first_morph_weight = scene_.morph_weight_count;
    RELIT_TRY(add_morph_weights(document_, file_node, parts->front().primitive.morph_targets.size(),
                                scene_));
    for (const MeshPart& part : *parts) {
      RELIT_TRY(count(part));
      Primitive primitive = part.primitive;
      primitive.node = nodes_.to_scene[file_node];
      primitive.first_morph_weight = first_morph_weight;
      if (node.skin >= 0) RELIT_TRY(bind(part, node.skin, primitive));
      unmirror(scene_, world_, primitive);
      scene_.primitives.push_back(std::move(primitive));
    }
    return {};
  }

 private:
  Status bind(const MeshPart& part, int skin, Primitive& primitive) {
    if (part.influences_per_vertex == 0) {
      document_.warn(part.where,
                     "its node has a skin but it has no JOINTS_0; it moves with the "
                     "node instead");
      return {};
    }
    primitive.skin = skin;
    return bind_to_skin(document_, part, scene_.skins[static_cast<std::size_t>(skin)], primitive);
  }

  Status count(const MeshPart& part) {
    vertices_ += part.primitive.positions.size();
    morphed_ += part.primitive.positions.size() * part.primitive.morph_targets.size();
    if (scene_.primitives.size() >= limits::kMeshes || vertices_ > kSceneVertices ||
        morphed_ > kSceneMorphedVertices) {
      return document_.fail(ErrorCode::kLimit, part.where,
                            "the scene shows more than " + std::to_string(limits::kMeshes) +
                                " primitives, " + std::to_string(kSceneVertices) + " vertices or " +
                                std::to_string(kSceneMorphedVertices) +
                                " morphed vertices; merge, simplify or split it");
    }
    return {};
  }

  Document& document_;
  const NodeMap& nodes_;
  Scene& scene_;
  std::vector<std::optional<std::vector<MeshPart>>> meshes_;
  std::vector<glm::mat4> world_;
  std::size_t vertices_ = 0;
  std::size_t morphed_ = 0;
};

}  // namespace

Status read_instances(Document& document, const NodeMap& nodes, Scene& scene) {
  if (document.model.meshes.empty()) {
    return document.fail(ErrorCode::kNotFound, "meshes",
                         "the file has none; export it with its meshes");
  }
  Instancer instancer(document, nodes, scene);
  std::size_t hidden = 0, shown = 0;
  for (std::size_t n = 0; n < document.model.nodes.size(); ++n) {
    if (document.model.nodes[n].mesh < 0) continue;
    if (!nodes.shown[n]) {
      ++hidden;
      continue;
    }
    ++shown;
    RELIT_TRY(instancer.add(n));
  }
  if (hidden > 0) {
    document.warn("scene", std::to_string(hidden) +
                               " nodes with meshes are outside the default scene and not shown");
  }
  if (scene.primitives.empty()) {
    return document.fail(ErrorCode::kNotFound, shown == 0 ? "scene" : "meshes",
                         shown == 0 ? "no node of the default scene has a mesh; put one there"
                                    : "no mesh that is shown has a triangle with an area; "
                                      "export surfaces");
  }
  return {};
}

std::vector<MorphRange> morph_ranges(const Scene& scene) {
  std::vector<MorphRange> ranges(scene.nodes.size());
  for (const Primitive& primitive : scene.primitives) {
    ranges[static_cast<std::size_t>(primitive.node)] = {
        primitive.first_morph_weight, static_cast<std::uint32_t>(primitive.morph_targets.size())};
  }
  return ranges;
}

}  // namespace relit::bake::gltf
