// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bake_minimal/gltf_document.hpp"
#include "bake_minimal/scene.hpp"
#include "container/base/result.hpp"

namespace relit::bake::gltf {

/// A primitive of the file, before a node shows it.
struct MeshPart {
  std::string where;                  ///< for messages
  Primitive primitive;                ///< without node, skin, joints and weights
  std::vector<std::uint32_t> source;  ///< the file's number of every vertex
  int influences_per_vertex = 0;      ///< four for every JOINTS_n
  std::vector<std::uint32_t> joints;  ///< as the file has them, unchecked
  std::vector<float> weights;         ///< likewise
};

/// The parts of a mesh that hold triangles. `material` of a part without one is the number of the
/// file's materials. Errors: kCorrupt, kLimit.
[[nodiscard]] Result<std::vector<MeshPart>> read_mesh(Document& document, std::size_t mesh);

}  // namespace relit::bake::gltf
