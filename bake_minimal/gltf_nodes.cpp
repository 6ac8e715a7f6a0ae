// SPDX-License-Identifier: MIT
#include "bake_minimal/gltf_nodes.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "bake_minimal/gltf_accessors.hpp"
#include "container/base/limits.hpp"

namespace relit::bake::gltf {
namespace {

std::string node_label(const Document& document, std::size_t index) {
  return label("node", index, document.model.nodes[index].name);
}

Result<std::vector<int>> find_parents(const Document& document) {
  const auto& nodes = document.model.nodes;
  std::vector<int> parents(nodes.size(), -1);
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    for (const int child : nodes[n].children) {
      if (!in_range(child, nodes.size())) {
        return document.fail(ErrorCode::kCorrupt, node_label(document, n),
                             "child " + std::to_string(child) + " does not exist; there are " +
                                 std::to_string(nodes.size()) + " nodes");
      }
      int& parent = parents[static_cast<std::size_t>(child)];
      if (parent >= 0) {
        return document.fail(ErrorCode::kCorrupt,
                             node_label(document, static_cast<std::size_t>(child)),
                             "it has two parents, nodes " + std::to_string(parent) + " and " +
                                 std::to_string(n) + "; give it one, or a copy to each");
      }
      parent = static_cast<int>(n);
    }
  }
  return parents;
}

/// Node numbers, parents first, from `roots`; a node once.
std::vector<std::size_t> depth_first(const Document& document, std::vector<std::size_t> stack) {
  std::vector<std::size_t> order;
  std::vector<bool> seen(document.model.nodes.size(), false);
  std::reverse(stack.begin(), stack.end());
  while (!stack.empty()) {
    const std::size_t n = stack.back();
    stack.pop_back();
    if (seen[n]) continue;
    seen[n] = true;
    order.push_back(n);
    const auto& children = document.model.nodes[n].children;
    for (auto c = children.rbegin(); c != children.rend(); ++c) {
      stack.push_back(static_cast<std::size_t>(*c));
    }
  }
  return order;
}

Result<std::vector<std::size_t>> parents_first(const Document& document,
                                               const std::vector<int>& parents) {
  std::vector<std::size_t> roots;
  for (std::size_t n = 0; n < parents.size(); ++n) {
    if (parents[n] < 0) roots.push_back(n);
  }
  std::vector<std::size_t> order = depth_first(document, std::move(roots));
  if (order.size() != parents.size()) {
    std::vector<bool> reached(parents.size(), false);
    for (const std::size_t n : order) reached[n] = true;
    const auto lost = static_cast<std::size_t>(std::find(reached.begin(), reached.end(), false) -
                                               reached.begin());
    return document.fail(ErrorCode::kCorrupt, node_label(document, lost),
                         "it is in a cycle of children; remove the link back to its parent");
  }
  return order;
}

Result<std::vector<float>> numbers(const Document& document, std::size_t node, const char* property,
                                   std::span<const double> values, std::size_t count) {
  if (!values.empty() && values.size() != count) {
    return document.fail(ErrorCode::kCorrupt, node_label(document, node),
                         std::string(property) + " has " + std::to_string(values.size()) +
                             " numbers; it must have " + std::to_string(count));
  }
  std::vector<float> out(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    out[i] = static_cast<float>(values[i]);
    if (!std::isfinite(out[i])) {
      return document.fail(ErrorCode::kCorrupt, node_label(document, node),
                           std::string(property) + " is out of the range of 32-bit floats");
    }
  }
  return out;
}

Status read_matrix(const Document& document, std::size_t n, Node& node) {
  RELIT_ASSIGN(const auto m, numbers(document, n, "matrix", document.model.nodes[n].matrix, 16));
  glm::mat4 matrix;
  for (int c = 0; c < 16; ++c) matrix[c / 4][c % 4] = m[static_cast<std::size_t>(c)];
  if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1) {
    return document.fail(ErrorCode::kCorrupt, node_label(document, n),
                         "matrix is not affine: its last row must be 0 0 0 1");
  }
  node.matrix = matrix;
  return {};
}

Status read_trs(const Document& document, std::size_t n, Node& node) {
  const tinygltf::Node& source = document.model.nodes[n];
  RELIT_ASSIGN(const auto t, numbers(document, n, "translation", source.translation, 3));
  RELIT_ASSIGN(const auto r, numbers(document, n, "rotation", source.rotation, 4));
  RELIT_ASSIGN(const auto s, numbers(document, n, "scale", source.scale, 3));
  if (!t.empty()) node.local.translation = {t[0], t[1], t[2]};
  if (!s.empty()) node.local.scale = {s[0], s[1], s[2]};
  if (r.empty()) return {};
  const glm::dquat q(r[3], r[0], r[1], r[2]);
  if (!(glm::length(q) > 1e-6)) {
    return document.fail(ErrorCode::kCorrupt, node_label(document, n),
                         "rotation is no unit quaternion; 0 0 0 1 stands for none");
  }
  node.local.rotation = glm::quat(glm::normalize(q));
  return {};
}

Result<std::vector<bool>> find_shown(const Document& document) {
  const auto& model = document.model;
  if (model.scenes.empty() && model.defaultScene < 0) {
    return std::vector<bool>(model.nodes.size(), true);
  }
  const int index = model.defaultScene < 0 ? 0 : model.defaultScene;
  if (!in_range(index, model.scenes.size())) {
    return document.fail(ErrorCode::kCorrupt, "scene",
                         "scene " + std::to_string(index) + " does not exist; there are " +
                             std::to_string(model.scenes.size()));
  }
  const tinygltf::Scene& scene = model.scenes[static_cast<std::size_t>(index)];
  std::vector<std::size_t> roots;
  for (const int root : scene.nodes) {
    if (!in_range(root, model.nodes.size())) {
      return document.fail(ErrorCode::kCorrupt,
                           label("scene", static_cast<std::size_t>(index), scene.name),
                           "node " + std::to_string(root) + " does not exist; there are " +
                               std::to_string(model.nodes.size()));
    }
    roots.push_back(static_cast<std::size_t>(root));
  }
  std::vector<bool> shown(model.nodes.size(), false);
  for (const std::size_t n : depth_first(document, std::move(roots))) shown[n] = true;
  return shown;
}

Result<std::vector<glm::mat4>> read_inverse_bind(const Document& document, std::size_t index) {
  const tinygltf::Skin& skin = document.model.skins[index];
  std::vector<glm::mat4> out(skin.joints.size(), glm::mat4(1.0f));
  if (skin.inverseBindMatrices < 0) return out;
  const std::string where = label("skin", index, skin.name) + ", inverseBindMatrices";
  RELIT_ASSIGN(const Numbers m, read_numbers(document, skin.inverseBindMatrices, {where, 16}));
  if (m.count < out.size()) {
    return document.fail(ErrorCode::kCorrupt, where,
                         std::to_string(m.count) + " matrices for " + std::to_string(out.size()) +
                             " joints; there must be one a joint");
  }
  for (std::size_t j = 0; j < out.size(); ++j) {
    for (int c = 0; c < 16; ++c) {
      const float value = m.values[j * 16 + static_cast<std::size_t>(c)];
      if (!std::isfinite(value)) {
        return document.fail(ErrorCode::kCorrupt, where,
                             "matrix " + std::to_string(j) +
                                 " holds a number that is not finite; bind the skin again");
      }
      out[j][c / 4][c % 4] = value;
    }
    // Exporters leave rounding noise in the last row, which is 0 0 0 1 by definition.
    for (int c = 0; c < 4; ++c) out[j][c][3] = c == 3 ? 1.0f : 0.0f;
  }
  return out;
}

}  // namespace

Result<NodeMap> read_nodes(Document& document, Scene& scene) {
  const auto& nodes = document.model.nodes;
  if (nodes.size() > limits::kNodes) {
    return document.fail(ErrorCode::kLimit, "nodes",
                         "there are " + std::to_string(nodes.size()) + "; at most " +
                             std::to_string(limits::kNodes) + " are taken: merge some");
  }
  RELIT_ASSIGN(const auto parents, find_parents(document));
  RELIT_ASSIGN(const auto order, parents_first(document, parents));
  NodeMap map;
  map.to_scene.assign(nodes.size(), -1);
  for (const std::size_t n : order) {
    Node node;
    node.name = nodes[n].name;
    if (parents[n] >= 0) node.parent = map.to_scene[static_cast<std::size_t>(parents[n])];
    RELIT_TRY(nodes[n].matrix.empty() ? read_trs(document, n, node)
                                      : read_matrix(document, n, node));
    map.to_scene[n] = static_cast<int>(scene.nodes.size());
    scene.nodes.push_back(std::move(node));
  }
  RELIT_ASSIGN(map.shown, find_shown(document));
  return map;
}

Status read_skins(const Document& document, const NodeMap& nodes, Scene& scene) {
  for (std::size_t s = 0; s < document.model.skins.size(); ++s) {
    const tinygltf::Skin& source = document.model.skins[s];
    const std::string where = label("skin", s, source.name);
    if (source.joints.empty() || source.joints.size() > limits::kPalette) {
      return document.fail(source.joints.empty() ? ErrorCode::kCorrupt : ErrorCode::kLimit, where,
                           "it has " + std::to_string(source.joints.size()) +
                               " joints; there must be 1 to " + std::to_string(limits::kPalette));
    }
    Skin skin;
    for (const int joint : source.joints) {
      if (!in_range(joint, nodes.to_scene.size())) {
        return document.fail(ErrorCode::kCorrupt, where,
                             "joint node " + std::to_string(joint) + " does not exist; there are " +
                                 std::to_string(nodes.to_scene.size()) + " nodes");
      }
      skin.joints.push_back(nodes.to_scene[static_cast<std::size_t>(joint)]);
    }
    RELIT_ASSIGN(skin.inverse_bind, read_inverse_bind(document, s));
    scene.skins.push_back(std::move(skin));
  }
  return {};
}

}  // namespace relit::bake::gltf
