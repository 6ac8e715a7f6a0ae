// SPDX-License-Identifier: MIT
#pragma once

#include "bake_minimal/gltf_document.hpp"
#include "bake_minimal/gltf_nodes.hpp"
#include "bake_minimal/scene.hpp"
#include "container/base/result.hpp"

namespace relit::bake::gltf {

/// Fills Scene::primitives and the morph weights: every mesh once for each shown node that carries
/// it, bound to that node's skin. A primitive without material gets number model.materials.size().
/// Needs nodes and skins. Errors: kCorrupt, kNotFound (nothing to show), kLimit.
[[nodiscard]] Status read_instances(Document& document, const NodeMap& nodes, Scene& scene);

/// The morph weights of a node: [first, first + count).
struct MorphRange {
  std::uint32_t first = 0;
  std::uint32_t count = 0;
};

/// By node of the scene, from its primitives.
[[nodiscard]] std::vector<MorphRange> morph_ranges(const Scene& scene);

}  // namespace relit::bake::gltf
