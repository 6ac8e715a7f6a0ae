// SPDX-License-Identifier: MIT
#pragma once

#include "bake_minimal/gltf_document.hpp"
#include "bake_minimal/gltf_nodes.hpp"
#include "bake_minimal/scene.hpp"
#include "container/base/result.hpp"

namespace relit::bake::gltf {

/// Fills Scene::clips, in the file's order. Needs nodes and primitives. Errors: kCorrupt, kLimit.
[[nodiscard]] Status read_animations(Document& document, const NodeMap& nodes, Scene& scene);

}  // namespace relit::bake::gltf
