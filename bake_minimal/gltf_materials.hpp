// SPDX-License-Identifier: MIT
#pragma once

#include "bake_minimal/gltf_document.hpp"
#include "bake_minimal/scene.hpp"
#include "container/base/result.hpp"

namespace relit::bake::gltf {

/// Fills Scene::materials (all of the file, then a default one if a primitive needs it) and
/// Scene::images (those that the materials of Scene::primitives use, decoded), and gives every
/// primitive the texture coordinate sets that its material asks for. Errors: kCorrupt,
/// kUnsupported, kLimit, kIo.
[[nodiscard]] Status read_materials(Document& document, Scene& scene);

}  // namespace relit::bake::gltf
