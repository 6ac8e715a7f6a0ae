// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "bake_minimal/mesh_packer.hpp"
#include "bake_minimal/scene.hpp"
#include "bake_minimal/vertex_quantizer.hpp"
#include "container/base/result.hpp"
#include "container/records.hpp"
#include "decoders/mesh.hpp"

/// The part of pack_scene() that handles one primitive at a time.
namespace relit::bake {

/// A primitive's geometry in the space that its mesh will have.
struct PreparedPrimitive {
  std::uint32_t primitive = 0;  ///< into Scene::primitives
  bool still = false;           ///< in model space and never posed
  std::vector<glm::vec3> positions;
  std::vector<glm::vec3> normals;
  std::vector<MorphDelta> morphs;
  std::vector<std::uint32_t> indices;  ///< counter-clockwise from the front
  std::vector<std::uint16_t>
      palette_index;  ///< by the skin's joints; one entry for a rigid primitive
};

/// How the attributes are rounded; shared by all primitives of one space.
struct PrimitiveGrids {
  Grid positions;
  std::vector<float> morph_steps;  ///< by morph target
  int albedo_texels = 0;           ///< the longer side of the material's picture
};

/// Sizes, indices, joints and finite numbers of a primitive. Errors: kInvalid, kLimit.
[[nodiscard]] Status check_primitive(const Scene& scene, std::uint32_t primitive);

/// Brings a checked primitive into its mesh's space: moved by `world` where it is `still`, its
/// triangles wound the other way where `turned`. Errors: kInvalid when that leads to infinity.
[[nodiscard]] Result<PreparedPrimitive> prepare_primitive(const Scene& scene,
                                                          std::uint32_t primitive, bool still,
                                                          bool turned, const glm::mat4& world);

/// A mesh record with the mesh as the player decodes it, and where its parts came from.
struct PackedPart {
  container::MeshRecord record;
  decoders::Mesh mesh;
  std::vector<std::uint32_t> source_vertex;
  std::vector<std::uint32_t> source_triangle;
};

/// Quantises, merges, orders, splits and encodes one primitive. `texture` is the material's, null
/// when it has no image. Record ids, material and names are the caller's to set. Errors: kInvalid,
/// kLimit.
[[nodiscard]] Result<std::vector<PackedPart>> pack_primitive(const Scene& scene,
                                                             const PreparedPrimitive& prepared,
                                                             const PrimitiveGrids& grids,
                                                             const TextureUse* texture,
                                                             const PackOptions& options);

}  // namespace relit::bake
