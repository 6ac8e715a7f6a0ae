// SPDX-License-Identifier: MIT
#include "bake_minimal/primitive_packer.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "bake_minimal/influence_slots.hpp"
#include "bake_minimal/stream_encoder.hpp"
#include "bake_minimal/triangle_order.hpp"
#include "container/base/limits.hpp"

namespace relit::bake {
namespace {

using container::MorphTarget;
using container::Semantic;
using container::VertexStream;

std::string place(const Primitive& p, std::uint32_t index) {
  return "primitive " + std::to_string(index) + " (\"" + p.name + "\")";
}

template <class T>
bool all_finite(const std::vector<T>& vectors) {
  for (const T& v : vectors) {
    for (int i = 0; i < T::length(); ++i) {
      if (!std::isfinite(v[i])) return false;
    }
  }
  return true;
}

/// Moves a still primitive into model space. Normal offsets are divided by what their normal is, so
/// that normal + weight × offset keeps its direction.
void move_to_world(PreparedPrimitive& out, const glm::mat4& world) {
  const glm::dmat4 w(world);
  const glm::dmat3 linear(w);
  glm::dmat3 cofactor(glm::cross(linear[1], linear[2]), glm::cross(linear[2], linear[0]),
                      glm::cross(linear[0], linear[1]));
  if (glm::determinant(linear) < 0) cofactor = -cofactor;
  for (glm::vec3& p : out.positions) p = glm::vec3(w * glm::dvec4(glm::dvec3(p), 1.0));
  std::vector<double> lengths(out.normals.size());
  for (std::size_t v = 0; v < out.normals.size(); ++v) {
    const glm::dvec3 n = cofactor * glm::dvec3(out.normals[v]);
    lengths[v] = std::sqrt(glm::dot(n, n));
    if (lengths[v] > 0) out.normals[v] = glm::vec3(n / lengths[v]);
  }
  for (MorphDelta& m : out.morphs) {
    for (glm::vec3& d : m.positions) d = glm::vec3(linear * glm::dvec3(d));
    for (std::size_t v = 0; v < m.normals.size(); ++v) {
      if (lengths[v] > 0)
        m.normals[v] = glm::vec3(cofactor * glm::dvec3(m.normals[v]) / lengths[v]);
    }
  }
}

void append_bytes(std::vector<std::uint8_t>& out, const void* data, std::size_t size) {
  const auto* p = static_cast<const std::uint8_t*>(data);
  out.insert(out.end(), p, p + size);
}

VertexStream make_stream(Semantic semantic, std::uint8_t stride, const Grid& grid = {}) {
  return {semantic, stride, grid.offset, grid.step, {}};
}

std::uint8_t unorm8(float v) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(v, 0.0f, 1.0f)));
}

/// The attributes of a primitive as integers, in the layouts of the vertex streams, not yet coded.
class Quantizer {
 public:
  Quantizer(const Primitive& primitive, const PreparedPrimitive& prepared,
            const PrimitiveGrids& grids, const TextureUse* texture, const PackOptions& options)
      : primitive_(primitive),
        prepared_(prepared),
        grids_(grids),
        texture_(texture),
        options_(options) {}

  void run() {
    add_positions();
    add_lightmap_uv();
    if (texture_ != nullptr) add_albedo_uv();
    if (!primitive_.colors.empty()) add_colors();
    if (options_.normals) add_normals();
    if (!prepared_.still) add_influences();
    for (std::size_t k = 0; k < prepared_.morphs.size(); ++k) add_morph_target(k);
  }

  std::vector<VertexStream> streams;
  std::vector<MorphTarget> targets;

 private:
  void add_positions() {
    VertexStream s = make_stream(Semantic::kPosition, 8, grids_.positions);
    for (const glm::vec3& p : prepared_.positions) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        append_u16(s.bytes, grids_.positions.nearest(p[static_cast<int>(axis)], axis));
      }
      append_u16(s.bytes, 0);
    }
    streams.push_back(std::move(s));
  }

  static VertexStream uv_stream(Semantic semantic, const Grid& grid,
                                const std::vector<glm::vec2>& uv) {
    VertexStream s = make_stream(semantic, 4, grid);
    for (const glm::vec2& v : uv) {
      append_u16(s.bytes, grid.nearest(v.x, 0));
      append_u16(s.bytes, grid.nearest(v.y, 1));
    }
    return s;
  }

  void add_lightmap_uv() {
    int bits = options_.lightmap_uv_bits;
    if (texture_ != nullptr && albedo_uv() == primitive_.lightmap_uv) {
      bits = std::max(bits, albedo_bits(1));
    }
    const Grid grid = uniform_grid(glm::vec3(0), glm::vec3(1), bits);
    streams.push_back(uv_stream(Semantic::kLightMapUv, grid, primitive_.lightmap_uv));
  }

  std::vector<glm::vec2> albedo_uv() const {
    const auto set = static_cast<std::size_t>(texture_->texcoord);
    std::vector<glm::vec2> uv = primitive_.texcoords[set];
    for (glm::vec2& v : uv) v = glm::vec2(texture_->uv_transform * glm::vec3(v, 1.0f));
    return uv;
  }

  /// For texture coordinates that span `range` pictures.
  int albedo_bits(double range) const {
    if (options_.albedo_uv_bits != 0) return options_.albedo_uv_bits;
    return uv_bits(range * grids_.albedo_texels * kAlbedoSteps);
  }

  void add_albedo_uv() {
    const std::vector<glm::vec2> uv = albedo_uv();
    if (uv == primitive_.lightmap_uv) return;
    glm::vec3 low(0), high(0);
    if (!uv.empty()) low = high = glm::vec3(uv[0], 0.0f);
    for (const glm::vec2& v : uv) {
      low = glm::min(low, glm::vec3(v, 0.0f));
      high = glm::max(high, glm::vec3(v, 0.0f));
    }
    const double range =
        std::max(static_cast<double>(high.x) - low.x, static_cast<double>(high.y) - low.y);
    const Grid grid = uniform_grid(low, high, albedo_bits(range));
    streams.push_back(uv_stream(Semantic::kAlbedoUv, grid, uv));
  }

  void add_colors() {
    VertexStream s = make_stream(Semantic::kColor, 4);
    for (const glm::vec4& c : primitive_.colors) {
      for (int i = 0; i < 4; ++i) s.bytes.push_back(unorm8(c[i]));
    }
    const bool white =
        std::all_of(s.bytes.begin(), s.bytes.end(), [](std::uint8_t b) { return b == 255; });
    if (!white) streams.push_back(std::move(s));
  }

  void add_normals() {
    VertexStream s = make_stream(Semantic::kNormal, 4);
    for (const glm::vec3& n : prepared_.normals) {
      const std::array<std::int8_t, 2> o = encode_octahedral(n);
      const std::array<std::uint8_t, 4> b{static_cast<std::uint8_t>(o[0]),
                                          static_cast<std::uint8_t>(o[1]), 0, 0};
      append_bytes(s.bytes, b.data(), b.size());
    }
    streams.push_back(std::move(s));
  }

  std::vector<Influence> influences_of(std::size_t v) const {
    if (primitive_.skin < 0) return {{prepared_.palette_index[0], 255}};
    const auto count = static_cast<std::size_t>(primitive_.influences_per_vertex);
    std::vector<Influence> raw(count);
    for (std::size_t i = 0; i < count; ++i) {
      raw[i] = {prepared_.palette_index[primitive_.joints[v * count + i]],
                primitive_.weights[v * count + i]};
    }
    return quantize_weights(raw);
  }

  void add_influences() {
    std::vector<std::vector<Influence>> all(prepared_.positions.size());
    std::size_t most = 0;
    for (std::size_t v = 0; v < all.size(); ++v) {
      all[v] = influences_of(v);
      most = std::max(most, all[v].size());
    }
    for (std::size_t first = 0; first < most; first += 4) {
      VertexStream joints = make_stream(Semantic::kJoints, 8);
      VertexStream weights = make_stream(Semantic::kWeights, 4);
      for (const std::vector<Influence>& influences : all) {
        for (std::size_t i = first; i < first + 4; ++i) {
          const Influence used = i < influences.size() ? influences[i] : Influence{};
          append_u16(joints.bytes, used.joint);
          weights.bytes.push_back(static_cast<std::uint8_t>(used.weight));
        }
      }
      streams.push_back(std::move(joints));
      streams.push_back(std::move(weights));
    }
  }

  void add_morph_target(std::size_t k) {
    const float step = grids_.morph_steps[k];
    MorphTarget target{{step, step, step}, {}};
    for (const glm::vec3& d : prepared_.morphs[k].positions) {
      for (int axis = 0; axis < 3; ++axis) {
        const double steps = std::clamp(static_cast<double>(d[axis]) / step, -32767.0, 32767.0);
        append_u16(target.bytes, static_cast<unsigned>(std::lround(steps)) & 0xffffu);
      }
      append_u16(target.bytes, 0);
    }
    targets.push_back(std::move(target));
  }

  const Primitive& primitive_;
  const PreparedPrimitive& prepared_;
  const PrimitiveGrids& grids_;
  const TextureUse* texture_;
  const PackOptions& options_;
};

/// The first vertex that equals each vertex in every stream, target and normal.
std::vector<std::uint32_t> merge_vertices(const Quantizer& q, const PreparedPrimitive& prepared) {
  const std::size_t count = prepared.positions.size();
  std::vector<std::vector<std::uint8_t>> keys(count);
  std::unordered_map<std::string_view, std::uint32_t> first;
  std::vector<std::uint32_t> merged(count);
  for (std::size_t v = 0; v < count; ++v) {
    std::vector<std::uint8_t>& key = keys[v];
    for (const VertexStream& s : q.streams) append_bytes(key, &s.bytes[v * s.stride], s.stride);
    for (const MorphTarget& t : q.targets) append_bytes(key, &t.bytes[v * 8], 8);
    append_bytes(key, &prepared.normals[v], sizeof(glm::vec3));
    for (const MorphDelta& m : prepared.morphs) {
      if (!m.normals.empty()) append_bytes(key, &m.normals[v], sizeof(glm::vec3));
    }
    const std::string_view view(reinterpret_cast<const char*>(key.data()), key.size());
    merged[v] = first.try_emplace(view, static_cast<std::uint32_t>(v)).first->second;
  }
  return merged;
}

/// A triangle list after merging, without the triangles that name a vertex twice.
struct KeptTriangles {
  std::vector<std::uint32_t> indices;
  std::vector<std::uint32_t> triangles;
};

KeptTriangles keep_triangles(std::span<const std::uint32_t> indices,
                             std::span<const std::uint32_t> merged) {
  KeptTriangles out;
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    const std::uint32_t a = merged[indices[i]], b = merged[indices[i + 1]],
                        c = merged[indices[i + 2]];
    if (a == b || b == c || c == a) continue;
    out.indices.insert(out.indices.end(), {a, b, c});
    out.triangles.push_back(static_cast<std::uint32_t>(i / 3));
  }
  return out;
}

std::vector<std::uint8_t> gather(const std::vector<std::uint8_t>& bytes, std::size_t stride,
                                 std::span<const std::uint32_t> vertices) {
  std::vector<std::uint8_t> out;
  out.reserve(vertices.size() * stride);
  for (const std::uint32_t v : vertices) append_bytes(out, &bytes[v * stride], stride);
  return out;
}

std::vector<glm::vec3> gather(const std::vector<glm::vec3>& values,
                              std::span<const std::uint32_t> vertices) {
  std::vector<glm::vec3> out;
  out.reserve(vertices.size());
  for (const std::uint32_t v : vertices) out.push_back(values[v]);
  return out;
}

/// For each vertex the earlier one that equals it in every stream but the UVs, or kNoTwin; empty
/// where that is so for none.
std::vector<std::uint16_t> find_twins(std::span<const VertexStream> streams,
                                      std::span<const MorphTarget> targets, std::size_t count) {
  std::vector<std::string> keys(count);
  std::unordered_map<std::string_view, std::uint16_t> first;
  std::vector<std::uint16_t> twins(count, decoders::kNoTwin);
  const auto append = [&](const std::vector<std::uint8_t>& bytes, std::size_t stride) {
    for (std::size_t v = 0; v < count; ++v) {
      keys[v].append(reinterpret_cast<const char*>(&bytes[v * stride]), stride);
    }
  };
  for (const VertexStream& s : streams) {
    if (decoders::form_of(s.semantic).of_points) append(s.bytes, s.stride);
  }
  for (const MorphTarget& t : targets) append(t.bytes, decoders::morph_target_form().stride);
  std::uint16_t last = 0;
  bool any = false;
  for (std::size_t v = 0; v < count; ++v) {
    const auto [found, is_new] = first.try_emplace(keys[v], static_cast<std::uint16_t>(v));
    // A distance of exactly 2^15 has no word of its own.
    if (is_new || static_cast<std::uint16_t>(found->second - last) == 0x8000) continue;
    twins[v] = last = found->second;
    any = true;
  }
  if (!any) twins.clear();
  return twins;
}

container::MeshRecord make_record(const Quantizer& q, const MeshPart& part,
                                  std::uint32_t first_morph_weight) {
  const std::size_t count = part.vertices.size();
  container::MeshRecord record;
  record.vertex_count = static_cast<std::uint32_t>(count);
  record.index_count = static_cast<std::uint32_t>(part.indices.size());
  record.first_morph_weight = q.targets.empty() ? 0 : first_morph_weight;
  for (const VertexStream& s : q.streams) {
    record.streams.emplace_back(s).bytes = gather(s.bytes, s.stride, part.vertices);
  }
  for (const MorphTarget& t : q.targets) {
    record.morph_targets.push_back({t.scale, gather(t.bytes, 8, part.vertices)});
  }
  record.indices = encode_index_stream(part.indices, count);
  const std::vector<std::uint16_t> indices(part.indices.begin(), part.indices.end());
  const decoders::VertexLinks links = decoders::link_vertices(
      indices, count, find_twins(record.streams, record.morph_targets, count));
  match_influence_slots(record.streams, links);
  for (VertexStream& s : record.streams) {
    s.bytes = encode_vertex_stream(s.bytes, decoders::form_of(s.semantic), links);
  }
  for (MorphTarget& t : record.morph_targets) {
    t.bytes = encode_vertex_stream(t.bytes, decoders::morph_target_form(), links);
  }
  if (!links.twins.empty()) {
    VertexStream twins = make_stream(Semantic::kTwin, 2);
    twins.bytes = encode_twins(links.twins);
    record.streams.push_back(std::move(twins));
  }
  return record;
}

void attach_normals(decoders::Mesh& mesh, const PreparedPrimitive& prepared,
                    std::span<const std::uint32_t> vertices) {
  mesh.normals = gather(prepared.normals, vertices);
  const bool morphed = std::any_of(prepared.morphs.begin(), prepared.morphs.end(),
                                   [](const MorphDelta& m) { return !m.normals.empty(); });
  if (!morphed) return;
  for (const MorphDelta& m : prepared.morphs) {
    mesh.morph_normals.push_back(m.normals.empty()
                                     ? std::vector<glm::vec3>(vertices.size(), glm::vec3(0.0f))
                                     : gather(m.normals, vertices));
  }
}

}  // namespace

Status check_primitive(const Scene& scene, std::uint32_t index) {
  const Primitive& p = scene.primitives[index];
  const std::string where = place(p, index);
  const std::size_t count = p.positions.size();
  const auto influences = static_cast<std::size_t>(p.influences_per_vertex);
  const auto sized = [&](std::size_t size) { return size == 0 || size == count; };
  bool sizes = p.normals.size() == count && sized(p.colors.size()) &&
               p.joints.size() == influences * count && p.weights.size() == influences * count;
  bool finite =
      all_finite(p.positions) && all_finite(p.normals) && all_finite(p.colors) &&
      all_finite(p.lightmap_uv) &&
      std::all_of(p.weights.begin(), p.weights.end(), [](float w) { return std::isfinite(w); });
  for (const auto& set : p.texcoords) {
    sizes = sizes && set.size() == count;
    finite = finite && all_finite(set);
  }
  for (const MorphDelta& m : p.morph_targets) {
    sizes = sizes && m.positions.size() == count && sized(m.normals.size());
    finite = finite && all_finite(m.positions) && all_finite(m.normals);
  }
  if (!sizes) return fail(ErrorCode::kInvalid, where + ": attributes differ in length");
  if (!finite) return fail(ErrorCode::kInvalid, where + ": a vertex attribute is not finite");
  if (p.lightmap_uv.size() != count) {
    return fail(ErrorCode::kInvalid, where + ": has no light-map UVs; assign them first");
  }
  for (const glm::vec2& uv : p.lightmap_uv) {
    if (uv.x < -1e-5f || uv.y < -1e-5f || uv.x > 1 + 1e-5f || uv.y > 1 + 1e-5f) {
      return fail(ErrorCode::kInvalid, where + ": a light-map UV lies outside [0,1]");
    }
  }
  if (p.indices.size() % 3 != 0 || std::any_of(p.indices.begin(), p.indices.end(),
                                               [&](std::uint32_t i) { return i >= count; })) {
    return fail(ErrorCode::kInvalid, where + ": an index is out of range, or no triangle list");
  }
  if (p.morph_targets.size() > limits::kMorphTargets) {
    return fail(ErrorCode::kLimit, where + ": " + std::to_string(p.morph_targets.size()) +
                                       " morph targets; at most " +
                                       std::to_string(limits::kMorphTargets) + " can be stored");
  }
  if (p.skin >= 0) {
    if (static_cast<std::size_t>(p.skin) >= scene.skins.size() || influences == 0) {
      return fail(ErrorCode::kInvalid, where + ": its skin does not exist or it has no weights");
    }
    const std::size_t joints = scene.skins[static_cast<std::size_t>(p.skin)].joints.size();
    if (std::any_of(p.joints.begin(), p.joints.end(),
                    [&](std::uint16_t j) { return j >= joints; })) {
      return fail(ErrorCode::kInvalid,
                  where + ": a joint is not one of its skin's " + std::to_string(joints));
    }
  }
  return {};
}

Result<PreparedPrimitive> prepare_primitive(const Scene& scene, std::uint32_t primitive, bool still,
                                            bool turned, const glm::mat4& world) {
  const Primitive& p = scene.primitives[primitive];
  PreparedPrimitive out;
  out.primitive = primitive;
  out.still = still;
  out.positions = p.positions;
  out.normals = p.normals;
  out.morphs = p.morph_targets;
  out.indices = p.indices;
  if (turned) {
    for (std::size_t i = 0; i + 2 < out.indices.size(); i += 3) {
      std::swap(out.indices[i + 1], out.indices[i + 2]);
    }
  }
  if (still && world != glm::mat4(1.0f)) move_to_world(out, world);
  if (!all_finite(out.positions)) {
    return fail(ErrorCode::kInvalid, place(p, primitive) + ": its node's matrix leads to infinity");
  }
  return out;
}

Result<std::vector<PackedPart>> pack_primitive(const Scene& scene,
                                               const PreparedPrimitive& prepared,
                                               const PrimitiveGrids& grids,
                                               const TextureUse* texture,
                                               const PackOptions& options) {
  const Primitive& p = scene.primitives[prepared.primitive];
  Quantizer q(p, prepared, grids, texture, options);
  q.run();
  const KeptTriangles kept = keep_triangles(prepared.indices, merge_vertices(q, prepared));
  std::vector<PackedPart> out;
  for (MeshPart& part : order_triangles(kept.indices, prepared.positions.size(),
                                        limits::kVerticesPerMesh, limits::kIndicesPerMesh / 3)) {
    PackedPart packed;
    packed.record = make_record(q, part, p.first_morph_weight);
    // Decoded like any file's: what the checks of the decoder refuse must not be written.
    RELIT_ASSIGN(packed.mesh,
                 decoders::decode_mesh(packed.record, limits::kPalette, scene.morph_weight_count));
    attach_normals(packed.mesh, prepared, part.vertices);
    packed.source_vertex = std::move(part.vertices);
    for (const std::uint32_t t : part.triangles) {
      packed.source_triangle.push_back(kept.triangles[t]);
    }
    out.push_back(std::move(packed));
  }
  return out;
}

}  // namespace relit::bake
