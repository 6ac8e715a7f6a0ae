// SPDX-License-Identifier: MIT
#include "decoders/mesh.hpp"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <utility>

#include "container/base/limits.hpp"
#include "container/base/out_of_memory.hpp"
#include "decoders/inflate.hpp"
#include "decoders/vertex_prediction.hpp"

namespace relit::decoders {
namespace {

using container::MeshRecord;
using container::Semantic;
using container::VertexStream;

/// Axes of each semantic that offset and scale apply to.
constexpr std::array<int, 8> kScaledAxes{3, 0, 2, 2, 0, 0, 0, 0};

/// What meshoptimizer's layer of the indices may decompress to: its worst case is a few bytes above
/// the plain size, so that twice that is generous to any encoder.
std::size_t coded_limit(std::size_t plain_bytes) { return 2 * plain_bytes + 4096; }

std::string place(const MeshRecord& record) {
  return "mesh " + std::to_string(record.id) + " (\"" + record.name + "\")";
}

/// The values of a stream as [vertex][component]; what is stored are residuals in planes of bytes,
/// the low ones of every component, then the high ones.
Result<std::vector<std::uint16_t>> decode_values(const std::vector<std::uint8_t>& bytes,
                                                 const VertexStreamForm& form,
                                                 const VertexLinks& links,
                                                 const std::string& what) {
  const std::size_t count = links.of_vertices.size();
  const std::size_t stored = links.stored(form);
  const std::size_t components = form.components();
  RELIT_ASSIGN(const std::vector<std::uint8_t> planes,
               inflate_exact(bytes, stored * form.stride, what));
  const std::uint8_t* low = planes.data();
  const std::uint8_t* high = low + stored * components;
  std::vector<std::uint16_t> values(count * components);
  for (std::size_t v = 0, at = 0; v < count; ++v) {
    if (form.of_points && links.has_twin(v)) {
      std::copy_n(&values[links.twins[v] * components], components, &values[v * components]);
      continue;
    }
    for (std::size_t c = 0; c < components; ++c) {
      const std::size_t i = c * stored + at;
      const auto folded =
          static_cast<std::uint16_t>(form.value_bytes == 2 ? low[i] | high[i] << 8 : low[i]);
      const unsigned value = unfold_residual(folded) + 0u +
                             predict_vertex_value(form, links.neighbours(form, v), values, {v, c});
      values[v * components + c] =
          static_cast<std::uint16_t>(form.value_bytes == 2 ? value : value & 255);
    }
    ++at;
  }
  return values;
}

/// Offset and scale must keep every integer in [lowest, 65535 or 32767] finite and within bounds.
Status check_range(const std::array<float, 3>& offset, const std::array<float, 3>& scale,
                   int dimensions, float lowest, float highest, const std::string& what) {
  for (int i = 0; i < dimensions; ++i) {
    const auto axis = static_cast<std::size_t>(i);
    const float low = offset[axis] + scale[axis] * lowest;
    const float high = offset[axis] + scale[axis] * highest;
    if (!(std::abs(low) <= kMaxCoordinate) || !(std::abs(high) <= kMaxCoordinate)) {
      return fail(ErrorCode::kCorrupt, what + ": axis " + std::to_string(i) +
                                           " reaches beyond ±1e9; offset and scale are damaged");
    }
  }
  return {};
}

glm::vec3 decode_octahedral(std::int8_t ex, std::int8_t ey) {
  const float x = std::max(static_cast<float>(ex) / 127.0f, -1.0f);
  const float y = std::max(static_cast<float>(ey) / 127.0f, -1.0f);
  glm::vec3 n(x, y, 1.0f - std::abs(x) - std::abs(y));
  const float fold = std::max(-n.z, 0.0f);
  n.x += n.x >= 0 ? -fold : fold;
  n.y += n.y >= 0 ? -fold : fold;
  return n / std::sqrt(glm::dot(n, n));
}

/// The twins of a mesh: 0 for none, else 1 more than the folded distance from the last one.
Result<std::vector<std::uint16_t>> decode_twins(const VertexStream& stream, std::size_t count,
                                                const std::string& what) {
  RELIT_ASSIGN(const std::vector<std::uint8_t> planes,
               inflate_exact(stream.bytes, 2 * count, what));
  std::vector<std::uint16_t> twins(count, kNoTwin);
  std::uint16_t last = 0;
  for (std::size_t v = 0; v < count; ++v) {
    const auto word = static_cast<std::uint16_t>(planes[v] | planes[count + v] << 8);
    if (word == 0) continue;
    const unsigned step = unfold_residual(static_cast<std::uint16_t>(word - 1));
    last = static_cast<std::uint16_t>(last + step);
    if (last >= v) {
      return fail(ErrorCode::kCorrupt, what + ": vertex " + std::to_string(v) + " has the twin " +
                                           std::to_string(last) + ", which is not before it");
    }
    twins[v] = last;
  }
  return twins;
}

/// Decodes the streams of one mesh into a Mesh, one after the other. Its indices are there already.
class StreamDecoder {
 public:
  StreamDecoder(const MeshRecord& record, std::size_t palette_size, Mesh& mesh)
      : record_(record), palette_size_(palette_size), mesh_(mesh), count_(record.vertex_count) {}

  Status run() {
    for (const VertexStream& stream : record_.streams) RELIT_TRY(check(stream));
    if (seen(Semantic::kPosition) == 0 || seen(Semantic::kLightMapUv) == 0) {
      return fail(ErrorCode::kCorrupt,
                  place(record_) + ": lacks its " +
                      (seen(Semantic::kPosition) == 0 ? "position" : "light-map UV") + " stream");
    }
    std::vector<std::uint16_t> twins;
    for (const VertexStream& stream : record_.streams) {
      if (stream.semantic != Semantic::kTwin) continue;
      RELIT_ASSIGN(twins, decode_twins(stream, count_, name_of(stream)));
    }
    links_ = link_vertices(mesh_.indices, count_, std::move(twins));
    for (const VertexStream& stream : record_.streams) {
      if (stream.semantic != Semantic::kTwin) RELIT_TRY(decode(stream));
    }
    RELIT_TRY(join_influences());
    return decode_morph_targets();
  }

 private:
  std::string name_of(const VertexStream& stream) const {
    return place(record_) + ", " + form_of(stream.semantic).name + " stream";
  }

  int& seen(Semantic semantic) { return seen_[static_cast<std::size_t>(semantic)]; }

  Status check(const VertexStream& stream) {
    const auto semantic = static_cast<std::size_t>(stream.semantic);
    if (semantic >= seen_.size()) {
      return fail(ErrorCode::kUnsupported,
                  place(record_) + ": unknown vertex semantic " + std::to_string(semantic));
    }
    const VertexStreamForm& form = form_of(stream.semantic);
    if (stream.stride != form.stride) {
      return fail(ErrorCode::kCorrupt, name_of(stream) + ": stride " +
                                           std::to_string(stream.stride) + " instead of " +
                                           std::to_string(form.stride));
    }
    const bool per_influence =
        stream.semantic == Semantic::kJoints || stream.semantic == Semantic::kWeights;
    if (++seen(stream.semantic) > (per_influence ? 2 : 1)) {
      return fail(ErrorCode::kCorrupt, name_of(stream) + ": occurs too often");
    }
    return check_range(stream.offset, stream.scale, kScaledAxes[semantic], 0.0f, 65535.0f,
                       name_of(stream));
  }

  Status decode(const VertexStream& stream) {
    RELIT_ASSIGN(const std::vector<std::uint16_t> values,
                 decode_values(stream.bytes, form_of(stream.semantic), links_, name_of(stream)));
    switch (stream.semantic) {
      case Semantic::kPosition:
        store_positions(stream, values);
        break;
      case Semantic::kNormal:
        store_normals(values);
        break;
      case Semantic::kLightMapUv:
        store_uv(stream, values, mesh_.lightmap_uv);
        for (glm::vec2& uv : mesh_.lightmap_uv) uv = glm::clamp(uv, 0.0f, 1.0f);
        break;
      case Semantic::kAlbedoUv:
        store_uv(stream, values, mesh_.albedo_uv);
        break;
      case Semantic::kColor:
        mesh_.colors.resize(count_);
        for (std::size_t v = 0; v < count_; ++v) {
          const std::uint16_t* p = &values[v * 4];
          mesh_.colors[v] = {p[0], p[1], p[2], p[3]};
        }
        break;
      case Semantic::kJoints:
        return store_joints(values);
      case Semantic::kWeights:
        weights_.push_back(values);
        break;
      case Semantic::kTwin:
        break;
    }
    return {};
  }

  void store_positions(const VertexStream& stream, std::span<const std::uint16_t> values) {
    const glm::vec3 offset(stream.offset[0], stream.offset[1], stream.offset[2]);
    const glm::vec3 scale(stream.scale[0], stream.scale[1], stream.scale[2]);
    mesh_.positions.resize(count_);
    for (std::size_t v = 0; v < count_; ++v) {
      const std::uint16_t* p = &values[v * 4];
      mesh_.positions[v] = offset + scale * glm::vec3(p[0], p[1], p[2]);
    }
  }

  void store_normals(std::span<const std::uint16_t> values) {
    mesh_.normals.resize(count_);
    for (std::size_t v = 0; v < count_; ++v) {
      mesh_.normals[v] = decode_octahedral(static_cast<std::int8_t>(values[v * 4]),
                                           static_cast<std::int8_t>(values[v * 4 + 1]));
    }
  }

  void store_uv(const VertexStream& stream, std::span<const std::uint16_t> values,
                std::vector<glm::vec2>& out) const {
    const glm::vec2 offset(stream.offset[0], stream.offset[1]);
    const glm::vec2 scale(stream.scale[0], stream.scale[1]);
    out.resize(count_);
    for (std::size_t v = 0; v < count_; ++v) {
      out[v] = offset + scale * glm::vec2(values[v * 2], values[v * 2 + 1]);
    }
  }

  Status store_joints(const std::vector<std::uint16_t>& joints) {
    for (std::size_t i = 0; i < joints.size(); ++i) {
      if (joints[i] >= palette_size_) {
        return fail(ErrorCode::kCorrupt, place(record_) + ", vertex " + std::to_string(i / 4) +
                                             ": joint " + std::to_string(joints[i]) +
                                             " of a palette of " + std::to_string(palette_size_));
      }
    }
    joints_.push_back(joints);
    return {};
  }

  /// Interleaves the joint and weight streams, and checks that every vertex sums to 255.
  Status join_influences() {
    if (joints_.size() != weights_.size()) {
      return fail(ErrorCode::kCorrupt, place(record_) + ": " + std::to_string(joints_.size()) +
                                           " joint streams but " + std::to_string(weights_.size()) +
                                           " weight streams");
    }
    const std::size_t streams = joints_.size();
    if (streams == 0) return {};
    mesh_.influences_per_vertex = static_cast<int>(4 * streams);
    mesh_.joints.reserve(count_ * 4 * streams);
    mesh_.weights.reserve(count_ * 4 * streams);
    for (std::size_t v = 0; v < count_; ++v) {
      int sum = 0;
      for (std::size_t s = 0; s < streams; ++s) {
        for (std::size_t i = 0; i < 4; ++i) {
          const int weight = weights_[s][v * 4 + i];
          sum += weight;
          mesh_.joints.push_back(joints_[s][v * 4 + i]);
          mesh_.weights.push_back(static_cast<float>(weight) / 255.0f);
        }
      }
      if (sum != 255) {
        return fail(ErrorCode::kCorrupt, place(record_) + ", vertex " + std::to_string(v) +
                                             ": weights sum to " + std::to_string(sum) +
                                             " instead of 255");
      }
    }
    return {};
  }

  Status decode_morph_targets() {
    mesh_.first_morph_weight = record_.first_morph_weight;
    mesh_.morph_targets.reserve(record_.morph_targets.size());
    for (const container::MorphTarget& target : record_.morph_targets) {
      const std::string what =
          place(record_) + ", morph target " + std::to_string(mesh_.morph_targets.size());
      RELIT_TRY(check_range({}, target.scale, 3, -32768.0f, 32767.0f, what));
      RELIT_ASSIGN(const std::vector<std::uint16_t> values,
                   decode_values(target.bytes, morph_target_form(), links_, what));
      const glm::vec3 scale(target.scale[0], target.scale[1], target.scale[2]);
      std::vector<glm::vec3>& offsets = mesh_.morph_targets.emplace_back(count_);
      for (std::size_t v = 0; v < count_; ++v) {
        const std::uint16_t* p = &values[v * 4];
        offsets[v] =
            scale * glm::vec3(static_cast<std::int16_t>(p[0]), static_cast<std::int16_t>(p[1]),
                              static_cast<std::int16_t>(p[2]));
      }
    }
    return {};
  }

  const MeshRecord& record_;
  std::size_t palette_size_;
  Mesh& mesh_;
  std::size_t count_;
  std::array<int, kScaledAxes.size()> seen_{};
  VertexLinks links_;
  std::vector<std::vector<std::uint16_t>> joints_, weights_;
};

Status check_counts(const MeshRecord& record, std::size_t morph_weight_count) {
  if (record.vertex_count == 0 || record.vertex_count > limits::kVerticesPerMesh) {
    return fail(ErrorCode::kLimit, place(record) + ": " + std::to_string(record.vertex_count) +
                                       " vertices; 1 to " +
                                       std::to_string(limits::kVerticesPerMesh) + " are allowed");
  }
  if (record.index_count > limits::kIndicesPerMesh) {
    return fail(ErrorCode::kLimit, place(record) + ": " + std::to_string(record.index_count) +
                                       " indices; at most " +
                                       std::to_string(limits::kIndicesPerMesh) + " are allowed");
  }
  if (record.index_count == 0 || record.index_count % 3 != 0) {
    return fail(ErrorCode::kCorrupt, place(record) + ": " + std::to_string(record.index_count) +
                                         " indices are no list of triangles");
  }
  const std::size_t targets = record.morph_targets.size();
  if (targets > limits::kMorphTargets) {
    return fail(ErrorCode::kLimit, place(record) + ": " + std::to_string(targets) +
                                       " morph targets; at most " +
                                       std::to_string(limits::kMorphTargets) + " are allowed");
  }
  if (targets > 0 && (record.first_morph_weight > morph_weight_count ||
                      targets > morph_weight_count - record.first_morph_weight)) {
    return fail(ErrorCode::kCorrupt, place(record) + ": morph weights " +
                                         std::to_string(record.first_morph_weight) + " and " +
                                         std::to_string(targets) + " following exceed the " +
                                         std::to_string(morph_weight_count) + " of the skeleton");
  }
  return {};
}

Status decode_indices(const MeshRecord& record, Mesh& mesh) {
  const std::string what = place(record) + ", indices";
  const std::size_t count = record.index_count;
  RELIT_ASSIGN(const std::vector<std::uint8_t> coded,
               inflate(record.indices, coded_limit(count * sizeof(std::uint32_t)), what));
  // Decoded as 32 bits, so that an index beyond 65535 is seen and not wrapped.
  std::vector<std::uint32_t> wide(count);
  const int code = meshopt_decodeIndexBuffer(wide.data(), count, sizeof(std::uint32_t),
                                             coded.data(), coded.size());
  if (code != 0) {
    return fail(ErrorCode::kCorrupt, what + ": meshoptimizer's index codec rejects the data (" +
                                         std::to_string(code) + ")");
  }
  mesh.indices.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    if (wide[i] >= record.vertex_count) {
      return fail(ErrorCode::kCorrupt, what + ": index " + std::to_string(wide[i]) + " at " +
                                           std::to_string(i) + " of a mesh of " +
                                           std::to_string(record.vertex_count) + " vertices");
    }
    mesh.indices[i] = static_cast<std::uint16_t>(wide[i]);
  }
  return {};
}

}  // namespace

Result<Mesh> decode_mesh(const container::MeshRecord& record, std::size_t palette_size,
                         std::size_t morph_weight_count) {
  return catch_out_of_memory("decoding a mesh", [&]() -> Result<Mesh> {
    RELIT_TRY(check_counts(record, morph_weight_count));
    Mesh mesh;
    mesh.name = record.name;
    mesh.id = record.id;
    mesh.material_id = record.material_id;
    RELIT_TRY(decode_indices(record, mesh));
    RELIT_TRY(StreamDecoder(record, palette_size, mesh).run());
    return mesh;
  });
}

}  // namespace relit::decoders
