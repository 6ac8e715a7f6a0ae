// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "bake_minimal/material_packer.hpp"
#include "bake_minimal/scene.hpp"
#include "container/base/result.hpp"
#include "container/records.hpp"
#include "decoders/mesh.hpp"

/// Turns a Scene into the records of a file, and says where each packed triangle came from. The
/// baker traces what it gets back from here, so that the light maps fit the surface that will be
/// drawn.
namespace relit::bake {

struct PackOptions {
  int clip = -1;         ///< that will be shown; -1: the rest pose
  bool normals = false;  ///< write the normals into the file
  /// Of the longest axis of a mesh's space, 8..16; the step is the same on all axes. A coordinate
  /// is off by half a step at most, 1/8190 of that axis: a quarter of a pixel where it spans 2048
  /// rows.
  int position_bits = 12;
  int lightmap_uv_bits = 14;  ///< over [0,1], 10..16; more where they are an albedo's, too
  int albedo_uv_bits =
      0;  ///< of the longer axis of a mesh's range, 10..16; 0: as the picture needs
};

inline constexpr std::uint32_t kSingleSided = std::numeric_limits<std::uint32_t>::max();

/// One triangle of the packed meshes, in the order of `PackedScene::meshes` and their indices.
struct PackedTriangle {
  std::uint32_t mesh = 0;                   ///< into PackedScene::meshes
  std::uint32_t primitive = 0;              ///< into Scene::primitives
  std::uint32_t triangle = 0;               ///< of the primitive
  std::uint32_t other_side = kSingleSided;  ///< the packed triangle on the back of this one
  int material = 0;                         ///< into Scene::materials
};

struct PackedMeshSource {
  std::uint32_t primitive = 0;
  std::uint32_t first_triangle = 0;          ///< into PackedScene::triangles
  std::vector<std::uint32_t> source_vertex;  ///< of the primitive, by packed vertex
};

struct PackedScene {
  std::vector<container::MeshRecord> mesh_records;
  container::SkeletonRecord skeleton;
  PackedMaterials materials;
  /// The records, decoded as the player does, with the normals (and the morph targets' normal
  /// offsets) in full precision instead of the file's.
  std::vector<decoders::Mesh> meshes;
  std::vector<PackedMeshSource> sources;  ///< as `meshes`
  std::vector<PackedTriangle> triangles;
  std::vector<std::uint32_t> node_source;  ///< into Scene::nodes, by skeleton node
  std::vector<std::string> warnings;
};

/// Packs all primitives; they must have their light-map UVs. Vertices that agree in every quantised
/// attribute and in their normals are merged, unused ones dropped, and triangles that name one
/// vertex twice after that are dropped (others stay, whatever their area, for animation may open
/// them). Primitives of one skin, or of one node, share a grid of positions, so that no cracks open
/// between them. Rigid primitives that no clip moves are moved into model space and stand still.
/// Primitives come wound for the rest pose; those whose node has a determinant of the other sign in
/// the first frame of `options.clip` are wound the other way. Nodes that pose nothing are left out.
/// Errors: kInvalid (numbers that are not finite, missing UVs, indices out of range), kLimit.
/// Deterministic.
[[nodiscard]] Result<PackedScene> pack_scene(const Scene& scene, const PackOptions& options);

/// For files all of whose pose tracks are kVertices: removes joints, weights, morph targets and
/// skeleton.
void drop_rig(PackedScene& packed);

}  // namespace relit::bake
