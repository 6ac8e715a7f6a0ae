// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "bake_minimal/gltf_document.hpp"
#include "bake_minimal/scene.hpp"
#include "container/base/result.hpp"

namespace relit::bake::gltf {

/// What became of the file's nodes, by their number in the file.
struct NodeMap {
  std::vector<int> to_scene;  ///< into Scene::nodes
  std::vector<bool> shown;    ///< in the default scene (every node, where the file has no scenes)
};

/// Fills Scene::nodes, parents first. Errors: kCorrupt (cycles, two parents, missing nodes,
/// transforms that make no sense), kLimit.
[[nodiscard]] Result<NodeMap> read_nodes(Document& document, Scene& scene);

/// Fills Scene::skins, in the file's order. Errors: kCorrupt, kLimit.
[[nodiscard]] Status read_skins(const Document& document, const NodeMap& nodes, Scene& scene);

}  // namespace relit::bake::gltf
