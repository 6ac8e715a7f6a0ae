// SPDX-License-Identifier: MIT
#include "bake_minimal/gltf_meshes.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include "bake_minimal/gltf_accessors.hpp"
#include "bake_minimal/gltf_triangles.hpp"
#include "container/base/limits.hpp"

namespace relit::bake::gltf {
namespace {

/// Vertices times morph targets of one primitive; sparse targets need no bytes in the file.
constexpr std::size_t kMorphedVertices = std::size_t{1} << 26;

using Attributes = std::map<std::string, int>;

int attribute(const Attributes& attributes, const std::string& name) {
  const auto it = attributes.find(name);
  return it == attributes.end() ? -1 : it->second;
}

/// An attribute with one element a vertex.
Result<Numbers> read_attribute(const Document& document, int accessor, AccessorUse use,
                               std::size_t vertex_count) {
  RELIT_ASSIGN(Numbers out, read_numbers(document, accessor, use));
  if (out.count != vertex_count) {
    return document.fail(ErrorCode::kCorrupt, use.where,
                         std::to_string(out.count) + " elements for " +
                             std::to_string(vertex_count) +
                             " vertices; all attributes must have as many as POSITION");
  }
  return out;
}

template <class Vec>
std::vector<Vec> as_vectors(const Numbers& numbers) {
  std::vector<Vec> out(numbers.count);
  for (std::size_t i = 0; i < numbers.count; ++i) {
    for (int c = 0; c < Vec::length(); ++c) {
      out[i][c] = c < numbers.components
                      ? numbers.values[i * static_cast<std::size_t>(numbers.components) +
                                       static_cast<std::size_t>(c)]
                      : 1.0f;
    }
  }
  return out;
}

Result<std::vector<std::uint32_t>> read_triangles(Document& document, const MeshPart& part,
                                                  const tinygltf::Primitive& source,
                                                  std::size_t vertex_count) {
  std::vector<std::uint32_t> corners(vertex_count);
  if (source.indices < 0) {
    std::iota(corners.begin(), corners.end(), 0u);
  } else {
    RELIT_ASSIGN(Integers indices,
                 read_integers(document, source.indices, {part.where + ", indices", 1}));
    corners = std::move(indices.values);
  }
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (corners[i] >= vertex_count) {
      return document.fail(ErrorCode::kCorrupt, part.where,
                           "index " + std::to_string(i) + " is " + std::to_string(corners[i]) +
                               ", but there are " + std::to_string(vertex_count) +
                               " vertices; export the mesh again");
    }
  }
  const Topology topology = source.mode == TINYGLTF_MODE_TRIANGLE_STRIP ? Topology::kStrip
                            : source.mode == TINYGLTF_MODE_TRIANGLE_FAN ? Topology::kFan
                                                                        : Topology::kTriangles;
  if (topology == Topology::kTriangles && corners.size() % 3 != 0) {
    document.warn(part.where, std::to_string(corners.size()) +
                                  " indices are no whole triangles; the last are ignored");
  }
  return list_triangles(topology, corners);
}

Status read_surface(Document& document, const tinygltf::Primitive& source, MeshPart& part) {
  Primitive& out = part.primitive;
  const std::size_t count = out.positions.size();
  if (const int normals = attribute(source.attributes, "NORMAL"); normals >= 0) {
    RELIT_ASSIGN(const Numbers n,
                 read_attribute(document, normals, {part.where + ", NORMAL", 3, 0, true}, count));
    out.normals = as_vectors<glm::vec3>(n);
  }
  for (int set = 0;; ++set) {
    const std::string name = "TEXCOORD_" + std::to_string(set);
    const int accessor = attribute(source.attributes, name);
    if (accessor < 0) break;
    RELIT_ASSIGN(const Numbers uv,
                 read_attribute(document, accessor, {part.where + ", " + name, 2, 0, true}, count));
    out.texcoords.push_back(as_vectors<glm::vec2>(uv));
  }
  if (const int colors = attribute(source.attributes, "COLOR_0"); colors >= 0) {
    RELIT_ASSIGN(const Numbers c,
                 read_attribute(document, colors, {part.where + ", COLOR_0", 4, 3}, count));
    out.colors = as_vectors<glm::vec4>(c);
  }
  return {};
}

Status read_influences(const Document& document, const tinygltf::Primitive& source,
                       MeshPart& part) {
  const std::size_t count = part.primitive.positions.size();
  std::vector<Integers> joints;
  std::vector<Numbers> weights;
  for (std::size_t set = 0;; ++set) {
    const std::string j_name = "JOINTS_" + std::to_string(set);
    const std::string w_name = "WEIGHTS_" + std::to_string(set);
    const int j = attribute(source.attributes, j_name), w = attribute(source.attributes, w_name);
    if (j < 0 && w < 0) break;
    if (j < 0 || w < 0) {
      return document.fail(ErrorCode::kCorrupt, part.where,
                           (j < 0 ? w_name : j_name) + " comes without " +
                               (j < 0 ? j_name : w_name) +
                               "; a skinned mesh needs both: export it again");
    }
    RELIT_ASSIGN(Integers joint, read_integers(document, j, {part.where + ", " + j_name, 4}));
    RELIT_ASSIGN(Numbers weight,
                 read_attribute(document, w, {part.where + ", " + w_name, 4}, count));
    if (joint.count != count) {
      return document.fail(ErrorCode::kCorrupt, part.where + ", " + j_name,
                           std::to_string(joint.count) + " elements for " + std::to_string(count) +
                               " vertices; all attributes must have as many as POSITION");
    }
    joints.push_back(std::move(joint));
    weights.push_back(std::move(weight));
  }
  part.influences_per_vertex = static_cast<int>(joints.size()) * 4;
  for (std::size_t v = 0; v < count; ++v) {
    for (std::size_t set = 0; set < joints.size(); ++set) {
      for (std::size_t c = v * 4; c < v * 4 + 4; ++c) {
        part.joints.push_back(joints[set].values[c]);
        part.weights.push_back(weights[set].values[c]);
      }
    }
  }
  return {};
}

Status read_morph_targets(Document& document, const tinygltf::Primitive& source, MeshPart& part) {
  Primitive& out = part.primitive;
  const std::size_t count = out.positions.size();
  if (source.targets.size() > limits::kMorphTargets ||
      source.targets.size() * count > kMorphedVertices) {
    return document.fail(ErrorCode::kLimit, part.where,
                         std::to_string(source.targets.size()) + " morph targets of " +
                             std::to_string(count) + " vertices are too many; at most " +
                             std::to_string(limits::kMorphTargets) + " targets and " +
                             std::to_string(kMorphedVertices) + " vertices in all are taken");
  }
  for (std::size_t t = 0; t < source.targets.size(); ++t) {
    const std::string where = part.where + ", morph target " + std::to_string(t);
    MorphDelta delta;
    delta.positions.resize(count);
    for (const auto& [name, accessor] : source.targets[t]) {
      if (name == "POSITION" || (name == "NORMAL" && !out.normals.empty())) {
        RELIT_ASSIGN(const Numbers n,
                     read_attribute(document, accessor, {where + ", " + name, 3, 0, true}, count));
        (name == "POSITION" ? delta.positions : delta.normals) = as_vectors<glm::vec3>(n);
      } else if (name != "NORMAL" && name != "TANGENT") {
        document.warn(part.where, "morphing of " + name + " is not supported and ignored");
      }
    }
    out.morph_targets.push_back(std::move(delta));
  }
  return {};
}

/// Vertex i becomes what vertex `from[i]` was, `components` numbers each.
template <class T>
void gather(std::vector<T>& values, const std::vector<std::uint32_t>& from,
            std::size_t components = 1) {
  if (values.empty()) return;
  std::vector<T> out;
  out.reserve(from.size() * components);
  for (const std::uint32_t v : from) {
    const auto begin = values.begin() + static_cast<std::ptrdiff_t>(v * components);
    out.insert(out.end(), begin, begin + static_cast<std::ptrdiff_t>(components));
  }
  values = std::move(out);
}

void gather_vertices(MeshPart& part, const std::vector<std::uint32_t>& from) {
  Primitive& p = part.primitive;
  gather(p.positions, from);
  gather(p.normals, from);
  for (auto& set : p.texcoords) gather(set, from);
  gather(p.colors, from);
  for (MorphDelta& delta : p.morph_targets) {
    gather(delta.positions, from);
    gather(delta.normals, from);
  }
  const auto influences = static_cast<std::size_t>(part.influences_per_vertex);
  gather(part.joints, from, influences);
  gather(part.weights, from, influences);
  gather(part.source, from);
}

template <class Vec>
Status check_finite(const Document& document, const MeshPart& part, const std::vector<Vec>& values,
                    const std::string& what) {
  for (std::size_t v = 0; v < values.size(); ++v) {
    for (int c = 0; c < Vec::length(); ++c) {
      if (!std::isfinite(values[v][c])) {
        return document.fail(ErrorCode::kCorrupt, part.where,
                             what + " of vertex " + std::to_string(part.source[v]) +
                                 " is not finite; repair the mesh and export it again");
      }
    }
  }
  return {};
}

Status check_vertices(const Document& document, const MeshPart& part) {
  const Primitive& p = part.primitive;
  RELIT_TRY(check_finite(document, part, p.positions, "POSITION"));
  RELIT_TRY(check_finite(document, part, p.normals, "NORMAL"));
  RELIT_TRY(check_finite(document, part, p.colors, "COLOR_0"));
  for (std::size_t set = 0; set < p.texcoords.size(); ++set) {
    RELIT_TRY(check_finite(document, part, p.texcoords[set], "TEXCOORD_" + std::to_string(set)));
  }
  for (std::size_t t = 0; t < p.morph_targets.size(); ++t) {
    const std::string target = "morph target " + std::to_string(t) + ", ";
    RELIT_TRY(check_finite(document, part, p.morph_targets[t].positions, target + "POSITION"));
    RELIT_TRY(check_finite(document, part, p.morph_targets[t].normals, target + "NORMAL"));
  }
  return {};
}

glm::dvec3 face_normal(const Primitive& p, std::size_t first_vertex, const MorphDelta* delta) {
  glm::dvec3 corner[3];
  for (std::size_t c = 0; c < 3; ++c) {
    corner[c] = p.positions[first_vertex + c];
    if (delta != nullptr) corner[c] += glm::dvec3(delta->positions[first_vertex + c]);
  }
  const glm::dvec3 n = area_normal(corner[0], corner[1], corner[2]);
  const double length = glm::length(n);
  return length > 0 ? n / length : glm::dvec3(0);
}

// glTF 2.0, section 3.7.2.1: without normals every face is flat, and so is every face of a target.
void make_flat_normals(MeshPart& part) {
  Primitive& p = part.primitive;
  gather_vertices(part, std::vector<std::uint32_t>(p.indices));
  std::iota(p.indices.begin(), p.indices.end(), 0u);
  p.normals.resize(p.positions.size());
  for (MorphDelta& delta : p.morph_targets) delta.normals.resize(p.positions.size());
  for (std::size_t v = 0; v < p.positions.size(); v += 3) {
    glm::dvec3 normal = face_normal(p, v, nullptr);
    for (const MorphDelta& delta : p.morph_targets) {
      if (normal == glm::dvec3(0)) normal = face_normal(p, v, &delta);
    }
    if (normal == glm::dvec3(0)) normal = {0, 1, 0};
    for (std::size_t c = 0; c < 3; ++c) p.normals[v + c] = glm::vec3(normal);
    for (MorphDelta& delta : p.morph_targets) {
      const glm::dvec3 morphed = face_normal(p, v, &delta);
      if (morphed == glm::dvec3(0)) continue;
      for (std::size_t c = 0; c < 3; ++c) delta.normals[v + c] = glm::vec3(morphed - normal);
    }
  }
}

// Exporters write zero normals where a vertex has only slivers around it.
void normalize_normals(Document& document, MeshPart& part) {
  Primitive& p = part.primitive;
  std::vector<glm::dvec3> faces;
  for (std::size_t v = 0; v < p.normals.size(); ++v) {
    const glm::dvec3 n(p.normals[v]);
    const double length = glm::length(n);
    if (length > 1e-12) {
      p.normals[v] = glm::vec3(n / length);
      continue;
    }
    if (faces.empty()) {
      document.warn(part.where, "normals of length zero are replaced by those of the faces");
      faces.resize(p.positions.size());
      for (std::size_t t = 0; t < p.indices.size(); t += 3) {
        const glm::dvec3 area =
            area_normal(p.positions[p.indices[t]], p.positions[p.indices[t + 1]],
                        p.positions[p.indices[t + 2]]);
        for (std::size_t c = 0; c < 3; ++c) faces[p.indices[t + c]] += area;
      }
    }
    const double face_length = glm::length(faces[v]);
    p.normals[v] = face_length > 0 ? glm::vec3(faces[v] / face_length) : glm::vec3(0, 1, 0);
  }
}

Status read_geometry(Document& document, const tinygltf::Primitive& source, MeshPart& part) {
  Primitive& out = part.primitive;
  RELIT_ASSIGN(const Numbers positions,
               read_numbers(document, attribute(source.attributes, "POSITION"),
                            {part.where + ", POSITION", 3, 0, true}));
  out.positions = as_vectors<glm::vec3>(positions);
  part.source.resize(positions.count);
  std::iota(part.source.begin(), part.source.end(), 0u);
  RELIT_TRY(read_surface(document, source, part));
  RELIT_TRY(read_influences(document, source, part));
  RELIT_TRY(read_morph_targets(document, source, part));
  RELIT_ASSIGN(out.indices, read_triangles(document, part, source, out.positions.size()));
  gather_vertices(part, compact_vertices(out.positions.size(), out.indices));
  RELIT_TRY(check_vertices(document, part));
  const std::size_t dropped =
      drop_degenerate(out.positions, !out.morph_targets.empty(), out.indices);
  if (dropped > 0) {
    document.warn(part.where, std::to_string(dropped) + " triangles without area are left out");
    gather_vertices(part, compact_vertices(out.positions.size(), out.indices));
  }
  if (out.normals.empty()) {
    make_flat_normals(part);
  } else {
    normalize_normals(document, part);
  }
  return {};
}

Result<std::optional<MeshPart>> read_part(Document& document, std::size_t mesh_index,
                                          std::size_t index) {
  const tinygltf::Mesh& mesh = document.model.meshes[mesh_index];
  const tinygltf::Primitive& source = mesh.primitives[index];
  MeshPart part;
  part.where = label("mesh", mesh_index, mesh.name) + ", primitive " + std::to_string(index);
  part.primitive.name = mesh.name.empty() ? label("mesh", mesh_index, "") : mesh.name;
  if (mesh.primitives.size() > 1) part.primitive.name += "/" + std::to_string(index);
  if (source.mode < TINYGLTF_MODE_POINTS || source.mode > TINYGLTF_MODE_TRIANGLE_FAN) {
    return document.fail(
        ErrorCode::kCorrupt, part.where,
        "mode " + std::to_string(source.mode) + " does not exist; use 4, triangles");
  }
  if (source.mode < TINYGLTF_MODE_TRIANGLES) {
    document.warn(part.where, "points and lines have no surface to light and are ignored");
    return std::optional<MeshPart>();
  }
  if (attribute(source.attributes, "POSITION") < 0) {
    document.warn(part.where, "it has no POSITION and is ignored");
    return std::optional<MeshPart>();
  }
  part.primitive.material = source.material;
  if (source.material < 0) {
    part.primitive.material = static_cast<int>(document.model.materials.size());
  } else if (!in_range(source.material, document.model.materials.size())) {
    return document.fail(ErrorCode::kCorrupt, part.where,
                         "material " + std::to_string(source.material) +
                             " does not exist; there are " +
                             std::to_string(document.model.materials.size()));
  }
  RELIT_TRY(read_geometry(document, source, part));
  if (part.primitive.indices.empty()) {
    document.warn(part.where, "it has no triangle and is ignored");
    return std::optional<MeshPart>();
  }
  return std::optional(std::move(part));
}

}  // namespace

Result<std::vector<MeshPart>> read_mesh(Document& document, std::size_t mesh_index) {
  const tinygltf::Mesh& mesh = document.model.meshes[mesh_index];
  std::vector<MeshPart> parts;
  for (std::size_t i = 0; i < mesh.primitives.size(); ++i) {
    if (mesh.primitives[i].targets.size() != mesh.primitives[0].targets.size()) {
      return document.fail(ErrorCode::kCorrupt, label("mesh", mesh_index, mesh.name),
                           "primitives 0 and " + std::to_string(i) +
                               " have different numbers of morph targets; they must agree");
    }
    RELIT_ASSIGN(auto part, read_part(document, mesh_index, i));
    if (part) parts.push_back(std::move(*part));
  }
  return parts;
}

}  // namespace relit::bake::gltf
