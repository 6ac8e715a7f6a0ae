// SPDX-License-Identifier: MIT
#include "bake_minimal/mesh_packer.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <utility>

#include "bake_minimal/primitive_packer.hpp"
#include "container/base/limits.hpp"

namespace relit::bake {
namespace {

using container::Affine;

Affine to_affine(const glm::mat4& m) {
  Affine a{};
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 4; ++c) a[static_cast<std::size_t>(4 * r + c)] = m[c][r];
  }
  return a;
}

glm::mat4 to_matrix(const Node& node) {
  if (node.matrix) return *node.matrix;
  glm::mat4 m = glm::mat4_cast(node.local.rotation);
  for (int c = 0; c < 3; ++c) m[c] *= node.local.scale[c];
  m[3] = glm::vec4(node.local.translation, 1.0f);
  return m;
}

class ScenePacker {
 public:
  ScenePacker(const Scene& scene, const PackOptions& options) : scene_(scene), options_(options) {}

  Result<PackedScene> run() {
    RELIT_TRY(check_scene());
    find_moving_nodes();
    ScenePose pose;
    scene_.sample(options_.clip, 0, pose);
    scene_.world_matrices(pose, world_);
    scene_.sample(-1, 0, pose);
    scene_.world_matrices(pose, rest_world_);
    RELIT_TRY(prepare());
    build_palette();
    RELIT_TRY(pack_used_materials());
    for (const PreparedPrimitive& prepared : prepared_) RELIT_TRY(pack(prepared));
    RELIT_TRY(check_limits());
    link_other_sides();
    return std::move(out_);
  }

 private:
  Status check_scene() const {
    const auto bits = [](int value, int low) { return value >= low && value <= 16; };
    if (!bits(options_.position_bits, 8) || !bits(options_.lightmap_uv_bits, 10) ||
        (options_.albedo_uv_bits != 0 && !bits(options_.albedo_uv_bits, 10))) {
      return fail(ErrorCode::kInvalid,
                  "packing: positions take 8 to 16 bits, texture coordinates 10 to 16");
    }
    for (std::size_t n = 0; n < scene_.nodes.size(); ++n) {
      if (scene_.nodes[n].parent >= static_cast<int>(n)) {
        return fail(ErrorCode::kInvalid,
                    "node " + std::to_string(n) + ": its parent does not come before it");
      }
    }
    for (std::size_t i = 0; i < scene_.primitives.size(); ++i) {
      const Primitive& p = scene_.primitives[i];
      if (p.node < 0 || p.node >= static_cast<int>(scene_.nodes.size())) {
        return fail(ErrorCode::kInvalid,
                    "primitive " + std::to_string(i) + ": its node does not exist");
      }
      if (p.first_morph_weight > scene_.morph_weight_count ||
          p.morph_targets.size() > scene_.morph_weight_count - p.first_morph_weight) {
        return fail(ErrorCode::kInvalid,
                    "primitive " + std::to_string(i) + ": its morph weights do not exist");
      }
    }
    for (std::size_t i = 0; i < scene_.skins.size(); ++i) {
      for (const int joint : scene_.skins[i].joints) {
        if (joint < 0 || joint >= static_cast<int>(scene_.nodes.size())) {
          return fail(ErrorCode::kInvalid, "skin " + std::to_string(i) + ": joint " +
                                               std::to_string(joint) + " is no node");
        }
      }
    }
    return {};
  }

  void find_moving_nodes() {
    moving_.assign(scene_.nodes.size(), false);
    for (const Clip& clip : scene_.clips) {
      for (const Channel& c : clip.channels) {
        if (c.path == Path::kWeights || c.node < 0) continue;
        if (static_cast<std::size_t>(c.node) < moving_.size()) {
          moving_[static_cast<std::size_t>(c.node)] = true;
        }
      }
    }
    for (std::size_t n = 0; n < moving_.size(); ++n) {
      const int parent = scene_.nodes[n].parent;
      if (parent >= 0 && moving_[static_cast<std::size_t>(parent)]) moving_[n] = true;
    }
  }

  Status prepare() {
    for (std::size_t i = 0; i < scene_.primitives.size(); ++i) {
      const Primitive& p = scene_.primitives[i];
      RELIT_TRY(check_primitive(scene_, static_cast<std::uint32_t>(i)));
      const auto node = static_cast<std::size_t>(p.node);
      const bool still = p.skin < 0 && !moving_[node];
      RELIT_ASSIGN(
          PreparedPrimitive prepared,
          prepare_primitive(scene_, static_cast<std::uint32_t>(i), still, turned(p), world_[node]));
      prepared_.push_back(std::move(prepared));
    }
    return {};
  }

  /// Scenes are wound for the rest pose; whether the first frame mirrors a rigid primitive anew.
  bool turned(const Primitive& p) const {
    if (p.skin >= 0) return false;
    const auto mirrored = [&](const std::vector<glm::mat4>& world) {
      const glm::dmat4 m(world[static_cast<std::size_t>(p.node)]);
      return glm::determinant(glm::dmat3(m)) < 0;
    };
    return mirrored(world_) != mirrored(rest_world_);
  }

  static glm::mat4 inverse_bind(const Skin& skin, std::size_t joint) {
    return joint < skin.inverse_bind.size() ? skin.inverse_bind[joint] : glm::mat4(1.0f);
  }

  /// Nodes that pose a vertex and their ancestors, in the scene's order, and the palette.
  void build_palette() {
    std::vector<std::vector<bool>> used(scene_.primitives.size());
    std::vector<bool> needed(scene_.nodes.size(), false);
    for (const PreparedPrimitive& prepared : prepared_) {
      if (prepared.still) continue;
      const Primitive& p = scene_.primitives[prepared.primitive];
      std::vector<bool>& joints = used[prepared.primitive];
      if (p.skin < 0) {
        joints = {true};
        needed[static_cast<std::size_t>(p.node)] = true;
        continue;
      }
      const Skin& skin = scene_.skins[static_cast<std::size_t>(p.skin)];
      joints = used_joints(p, skin.joints.size());
      for (std::size_t j = 0; j < joints.size(); ++j) {
        if (joints[j]) needed[static_cast<std::size_t>(skin.joints[j])] = true;
      }
    }
    for (std::size_t n = needed.size(); n-- > 0;) {
      const int parent = scene_.nodes[n].parent;
      if (needed[n] && parent >= 0) needed[static_cast<std::size_t>(parent)] = true;
    }
    add_nodes(needed);
    for (PreparedPrimitive& prepared : prepared_) {
      if (!prepared.still) add_palette_entries(prepared, used[prepared.primitive]);
    }
    out_.skeleton.morph_weight_count = scene_.morph_weight_count;
  }

  /// A joint counts when it has weight; the first one stands in where a vertex has none at all.
  static std::vector<bool> used_joints(const Primitive& p, std::size_t joint_count) {
    std::vector<bool> used(joint_count, false);
    const auto influences = static_cast<std::size_t>(p.influences_per_vertex);
    for (std::size_t i = 0; i < p.joints.size(); ++i) {
      if (p.weights[i] > 0 || i % influences == 0) used[p.joints[i]] = true;
    }
    return used;
  }

  void add_nodes(const std::vector<bool>& needed) {
    packed_node_.assign(scene_.nodes.size(), -1);
    for (std::size_t n = 0; n < needed.size(); ++n) {
      if (!needed[n]) continue;
      const int parent = scene_.nodes[n].parent;
      packed_node_[n] = static_cast<int>(out_.skeleton.nodes.size());
      out_.skeleton.nodes.push_back(
          {parent < 0 ? -1 : packed_node_[static_cast<std::size_t>(parent)],
           to_affine(to_matrix(scene_.nodes[n]))});
      out_.node_source.push_back(static_cast<std::uint32_t>(n));
    }
  }

  void add_palette_entries(PreparedPrimitive& prepared, const std::vector<bool>& used) {
    const Primitive& p = scene_.primitives[prepared.primitive];
    prepared.palette_index.assign(used.size(), 0);
    for (std::size_t j = 0; j < used.size(); ++j) {
      if (!used[j]) continue;
      if (p.skin < 0) {
        prepared.palette_index[j] = palette_entry(p.node, glm::mat4(1.0f));
        continue;
      }
      const Skin& skin = scene_.skins[static_cast<std::size_t>(p.skin)];
      prepared.palette_index[j] = palette_entry(skin.joints[j], inverse_bind(skin, j));
    }
  }

  /// Wraps beyond 65535 entries; check_limits() refuses such a palette before it is returned.
  std::uint16_t palette_entry(int node, const glm::mat4& inverse_bind) {
    const Affine affine = to_affine(inverse_bind);
    const auto packed = static_cast<std::uint32_t>(packed_node_[static_cast<std::size_t>(node)]);
    const auto [found, is_new] = palette_.try_emplace(
        std::make_pair(packed, affine), static_cast<std::uint32_t>(out_.skeleton.palette.size()));
    if (is_new) out_.skeleton.palette.push_back({packed, affine});
    return static_cast<std::uint16_t>(found->second);
  }

  Status pack_used_materials() {
    std::vector<int> used;
    for (const Primitive& p : scene_.primitives) used.push_back(p.material);
    RELIT_ASSIGN(out_.materials, pack_materials(scene_, used));
    out_.warnings = out_.materials.warnings;
    return {};
  }

  /// Skins share a space whatever their node, other primitives share that of their node.
  std::pair<int, int> space_of(const PreparedPrimitive& prepared) const {
    const Primitive& p = scene_.primitives[prepared.primitive];
    return p.skin >= 0 ? std::make_pair(1, p.skin) : std::make_pair(0, p.node);
  }

  PrimitiveGrids grids_of(const PreparedPrimitive& prepared) const {
    const Primitive& p = scene_.primitives[prepared.primitive];
    glm::vec3 low(0), high(0);
    bool first = true;
    std::vector<float> reach(prepared.morphs.size(), 0.0f);
    for (const PreparedPrimitive& other : prepared_) {
      if (space_of(other) != space_of(prepared)) continue;
      for (const glm::vec3& v : other.positions) {
        low = first ? v : glm::min(low, v);
        high = first ? v : glm::max(high, v);
        first = false;
      }
      const Primitive& o = scene_.primitives[other.primitive];
      if (o.first_morph_weight != p.first_morph_weight) continue;
      for (std::size_t k = 0; k < std::min(reach.size(), other.morphs.size()); ++k) {
        for (const glm::vec3& d : other.morphs[k].positions) {
          reach[k] = std::max({reach[k], std::abs(d.x), std::abs(d.y), std::abs(d.z)});
        }
      }
    }
    PrimitiveGrids grids{uniform_grid(low, high, options_.position_bits), {}, 0};
    for (const float r : reach) {
      grids.morph_steps.push_back(std::max(r / 32767.0f, grids.positions.step[0]));
    }
    return grids;
  }

  Status pack(const PreparedPrimitive& prepared) {
    const Primitive& p = scene_.primitives[prepared.primitive];
    const auto material =
        static_cast<std::size_t>(out_.materials.packed_index[static_cast<std::size_t>(p.material)]);
    const TextureUse* texture = &out_.materials.texture[material];
    if (texture->image < 0) texture = nullptr;
    if (texture != nullptr && (texture->texcoord < 0 ||
                               static_cast<std::size_t>(texture->texcoord) >= p.texcoords.size())) {
      return fail(ErrorCode::kInvalid, "primitive " + std::to_string(prepared.primitive) + " (\"" +
                                           p.name + "\"): its material needs UV set " +
                                           std::to_string(texture->texcoord) +
                                           ", which it does not have");
    }
    PrimitiveGrids grids = grids_of(prepared);
    if (texture != nullptr) {
      const Image& picture = out_.materials.texels[static_cast<std::size_t>(texture->image)];
      grids.albedo_texels = std::max(picture.width, picture.height);
    }
    RELIT_ASSIGN(std::vector<PackedPart> parts,
                 pack_primitive(scene_, prepared, grids, texture, options_));
    if (parts.empty()) {
      out_.warnings.push_back("primitive " + std::to_string(prepared.primitive) + " (\"" + p.name +
                              "\") has no triangle with three different vertices; left out");
    }
    for (PackedPart& part : parts) add_part(prepared.primitive, material, std::move(part));
    return {};
  }

  void add_part(std::uint32_t primitive, std::size_t material, PackedPart part) {
    const Primitive& p = scene_.primitives[primitive];
    const auto id = static_cast<std::uint32_t>(out_.meshes.size());
    part.record.id = part.mesh.id = id;
    part.record.material_id = part.mesh.material_id = out_.materials.materials[material].id;
    part.record.name = part.mesh.name = p.name.substr(0, limits::kStringBytes);
    out_.sources.push_back({primitive, static_cast<std::uint32_t>(out_.triangles.size()),
                            std::move(part.source_vertex)});
    for (const std::uint32_t t : part.source_triangle) {
      out_.triangles.push_back({id, primitive, t, kSingleSided, p.material});
    }
    out_.mesh_records.push_back(std::move(part.record));
    out_.meshes.push_back(std::move(part.mesh));
  }

  Status check_limits() const {
    const auto check = [](std::size_t count, std::size_t limit, const char* what) -> Status {
      if (count <= limit) return {};
      return fail(ErrorCode::kLimit, "the scene has " + std::to_string(count) + " " + what +
                                         "; a file holds at most " + std::to_string(limit));
    };
    RELIT_TRY(check(out_.meshes.size(), limits::kMeshes, "meshes"));
    RELIT_TRY(check(out_.materials.materials.size(), limits::kMaterials, "materials"));
    RELIT_TRY(check(out_.materials.images.size(), limits::kImages, "images"));
    RELIT_TRY(check(out_.skeleton.nodes.size(), limits::kNodes, "nodes"));
    return check(out_.skeleton.palette.size(), limits::kPalette, "joints");
  }

  void link_other_sides() {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> packed;
    for (std::size_t i = 0; i < out_.triangles.size(); ++i) {
      const PackedTriangle& t = out_.triangles[i];
      if (!scene_.primitives[t.primitive].other_side.empty()) {
        packed[{t.primitive, t.triangle}] = static_cast<std::uint32_t>(i);
      }
    }
    for (PackedTriangle& t : out_.triangles) {
      const std::vector<std::uint32_t>& other = scene_.primitives[t.primitive].other_side;
      if (t.triangle >= other.size()) continue;
      const auto found = packed.find({t.primitive, other[t.triangle]});
      if (found != packed.end()) t.other_side = found->second;
    }
  }

  const Scene& scene_;
  const PackOptions& options_;
  PackedScene out_;
  std::vector<bool> moving_;      ///< nodes that any clip moves
  std::vector<glm::mat4> world_;  ///< at the first frame
  std::vector<glm::mat4> rest_world_;
  std::vector<PreparedPrimitive> prepared_;
  std::vector<int> packed_node_;  ///< by scene node, -1: left out
  std::map<std::pair<std::uint32_t, Affine>, std::uint32_t> palette_;
};

}  // namespace

Result<PackedScene> pack_scene(const Scene& scene, const PackOptions& options) {
  return ScenePacker(scene, options).run();
}

void drop_rig(PackedScene& packed) {
  for (container::MeshRecord& record : packed.mesh_records) {
    std::erase_if(record.streams, [](const container::VertexStream& s) {
      return s.semantic == container::Semantic::kJoints ||
             s.semantic == container::Semantic::kWeights;
    });
    record.morph_targets.clear();
    record.first_morph_weight = 0;
  }
  for (decoders::Mesh& mesh : packed.meshes) {
    mesh.influences_per_vertex = 0;
    mesh.joints.clear();
    mesh.weights.clear();
    mesh.morph_targets.clear();
    mesh.morph_normals.clear();
    mesh.first_morph_weight = 0;
  }
  packed.skeleton = {};
  packed.node_source.clear();
}

}  // namespace relit::bake
