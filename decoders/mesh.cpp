// SPDX-License-Identifier: MIT
#include "decoders/mesh.hpp"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "container/base/limits.hpp"
#include "container/base/out_of_memory.hpp"
#include "decoders/inflate.hpp"

namespace relit::decoders {
namespace {

using container::MeshRecord;
using container::Semantic;
using container::VertexStream;

struct SemanticInfo {
  const char* name;
  std::uint8_t stride;
  int dimensions;  ///< that offset and scale apply to
};

constexpr std::array<SemanticInfo, 7> kSemantics{{{"position", 8, 3},
                                                  {"normal", 4, 0},
                                                  {"light-map UV", 4, 2},
                                                  {"albedo UV", 4, 2},
                                                  {"colour", 4, 0},
                                                  {"joints", 8, 0},
                                                  {"weights", 4, 0}}};

/// What a stream's meshoptimizer layer may decompress to: its worst case is a few bytes per group
/// of vertices above the plain size, so that twice that is generous to any encoder.
std::size_t coded_limit(std::size_t plain_bytes) { return 2 * plain_bytes + 4096; }

std::uint16_t load_u16(const std::uint8_t* p) {
  return static_cast<std::uint16_t>(p[0] | p[1] << 8);
}
std::int16_t load_i16(const std::uint8_t* p) { return static_cast<std::int16_t>(load_u16(p)); }

std::string place(const MeshRecord& record) {
  return "mesh " + std::to_string(record.id) + " (\"" + record.name + "\")";
}

Result<std::vector<std::uint8_t>> decode_vertex_bytes(const std::vector<std::uint8_t>& bytes,
                                                      std::size_t count, std::size_t stride,
                                                      const std::string& what) {
  RELIT_ASSIGN(const std::vector<std::uint8_t> coded,
               inflate(bytes, coded_limit(count * stride), what));
  std::vector<std::uint8_t> out(count * stride);
  const int code =
      meshopt_decodeVertexBuffer(out.data(), count, stride, coded.data(), coded.size());
  if (code != 0) {
    return fail(ErrorCode::kCorrupt, what + ": meshoptimizer's vertex codec rejects the data (" +
                                         std::to_string(code) + ")");
  }
  return out;
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

/// Decodes the streams of one mesh into a Mesh, one after the other.
class StreamDecoder {
 public:
  StreamDecoder(const MeshRecord& record, std::size_t palette_size, Mesh& mesh)
      : record_(record), palette_size_(palette_size), mesh_(mesh), count_(record.vertex_count) {}

  Status run() {
    for (const VertexStream& stream : record_.streams) RELIT_TRY(decode(stream));
    if (mesh_.positions.empty() || mesh_.lightmap_uv.empty()) {
      return fail(ErrorCode::kCorrupt, place(record_) + ": lacks its " +
                                           (mesh_.positions.empty() ? "position" : "light-map UV") +
                                           " stream");
    }
    return join_influences();
  }

 private:
  Status decode(const VertexStream& stream) {
    const auto semantic = static_cast<std::size_t>(stream.semantic);
    if (semantic >= kSemantics.size()) {
      return fail(ErrorCode::kUnsupported,
                  place(record_) + ": unknown vertex semantic " + std::to_string(semantic));
    }
    const SemanticInfo& info = kSemantics[semantic];
    const std::string what = place(record_) + ", " + info.name + " stream";
    if (stream.stride != info.stride) {
      return fail(ErrorCode::kCorrupt, what + ": stride " + std::to_string(stream.stride) +
                                           " instead of " + std::to_string(info.stride));
    }
    const bool per_influence =
        stream.semantic == Semantic::kJoints || stream.semantic == Semantic::kWeights;
    if (++seen_[semantic] > (per_influence ? 2 : 1)) {
      return fail(ErrorCode::kCorrupt, what + ": occurs too often");
    }
    RELIT_TRY(check_range(stream.offset, stream.scale, info.dimensions, 0.0f, 65535.0f, what));
    RELIT_ASSIGN(std::vector<std::uint8_t> bytes,
                 decode_vertex_bytes(stream.bytes, count_, stream.stride, what));
    return store(stream, std::move(bytes));
  }

  Status store(const VertexStream& stream, std::vector<std::uint8_t> bytes) {
    switch (stream.semantic) {
      case Semantic::kPosition:
        store_positions(stream, bytes);
        break;
      case Semantic::kNormal:
        store_normals(bytes);
        break;
      case Semantic::kLightMapUv:
        store_uv(stream, bytes, mesh_.lightmap_uv);
        for (glm::vec2& uv : mesh_.lightmap_uv) uv = glm::clamp(uv, 0.0f, 1.0f);
        break;
      case Semantic::kAlbedoUv:
        store_uv(stream, bytes, mesh_.albedo_uv);
        break;
      case Semantic::kColor:
        mesh_.colors.resize(count_);
        for (std::size_t v = 0; v < count_; ++v) {
          const std::uint8_t* p = &bytes[v * 4];
          mesh_.colors[v] = {p[0], p[1], p[2], p[3]};
        }
        break;
      case Semantic::kJoints:
        return store_joints(bytes);
      case Semantic::kWeights:
        weights_.push_back(std::move(bytes));
        break;
    }
    return {};
  }

  void store_positions(const VertexStream& stream, const std::vector<std::uint8_t>& bytes) {
    const glm::vec3 offset(stream.offset[0], stream.offset[1], stream.offset[2]);
    const glm::vec3 scale(stream.scale[0], stream.scale[1], stream.scale[2]);
    mesh_.positions.resize(count_);
    for (std::size_t v = 0; v < count_; ++v) {
      const std::uint8_t* p = &bytes[v * 8];
      mesh_.positions[v] =
          offset + scale * glm::vec3(load_u16(p), load_u16(p + 2), load_u16(p + 4));
    }
  }

  void store_normals(const std::vector<std::uint8_t>& bytes) {
    mesh_.normals.resize(count_);
    for (std::size_t v = 0; v < count_; ++v) {
      mesh_.normals[v] = decode_octahedral(static_cast<std::int8_t>(bytes[v * 4]),
                                           static_cast<std::int8_t>(bytes[v * 4 + 1]));
    }
  }

  void store_uv(const VertexStream& stream, const std::vector<std::uint8_t>& bytes,
                std::vector<glm::vec2>& out) const {
    const glm::vec2 offset(stream.offset[0], stream.offset[1]);
    const glm::vec2 scale(stream.scale[0], stream.scale[1]);
    out.resize(count_);
    for (std::size_t v = 0; v < count_; ++v) {
      const std::uint8_t* p = &bytes[v * 4];
      out[v] = offset + scale * glm::vec2(load_u16(p), load_u16(p + 2));
    }
  }

  Status store_joints(const std::vector<std::uint8_t>& bytes) {
    std::vector<std::uint16_t> joints(count_ * 4);
    for (std::size_t i = 0; i < joints.size(); ++i) {
      joints[i] = load_u16(&bytes[i * 2]);
      if (joints[i] >= palette_size_) {
        return fail(ErrorCode::kCorrupt, place(record_) + ", vertex " + std::to_string(i / 4) +
                                             ": joint " + std::to_string(joints[i]) +
                                             " of a palette of " + std::to_string(palette_size_));
      }
    }
    joints_.push_back(std::move(joints));
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

  const MeshRecord& record_;
  std::size_t palette_size_;
  Mesh& mesh_;
  std::size_t count_;
  std::array<int, kSemantics.size()> seen_{};
  std::vector<std::vector<std::uint16_t>> joints_;
  std::vector<std::vector<std::uint8_t>> weights_;
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

Status decode_morph_targets(const MeshRecord& record, Mesh& mesh) {
  mesh.first_morph_weight = record.first_morph_weight;
  mesh.morph_targets.reserve(record.morph_targets.size());
  for (const container::MorphTarget& target : record.morph_targets) {
    const std::string what =
        place(record) + ", morph target " + std::to_string(mesh.morph_targets.size());
    RELIT_TRY(check_range({}, target.scale, 3, -32768.0f, 32767.0f, what));
    RELIT_ASSIGN(const std::vector<std::uint8_t> bytes,
                 decode_vertex_bytes(target.bytes, record.vertex_count, 8, what));
    const glm::vec3 scale(target.scale[0], target.scale[1], target.scale[2]);
    std::vector<glm::vec3>& offsets = mesh.morph_targets.emplace_back(record.vertex_count);
    for (std::size_t v = 0; v < offsets.size(); ++v) {
      const std::uint8_t* p = &bytes[v * 8];
      offsets[v] = scale * glm::vec3(load_i16(p), load_i16(p + 2), load_i16(p + 4));
    }
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
    RELIT_TRY(StreamDecoder(record, palette_size, mesh).run());
    RELIT_TRY(decode_morph_targets(record, mesh));
    RELIT_TRY(decode_indices(record, mesh));
    return mesh;
  });
}

}  // namespace relit::decoders
