// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "container/records.hpp"

namespace relit::decoders {

/// A decoded mesh in its own space; see container::MeshRecord. All vectors but the optional ones
/// have `positions.size()` entries.
struct Mesh {
  std::string name;
  std::uint32_t id = 0;
  std::uint32_t material_id = 0;
  std::vector<glm::vec3> positions;    ///< metres
  std::vector<glm::vec3> normals;      ///< unit length; may be empty
  std::vector<glm::vec2> lightmap_uv;  ///< in [0,1]
  std::vector<glm::vec2> albedo_uv;    ///< empty: the same as lightmap_uv
  std::vector<glm::u8vec4> colors;     ///< linear; may be empty
  std::vector<std::uint16_t> joints;   ///< influences_per_vertex palette indices a vertex
  std::vector<float> weights;          ///< as many; those of a vertex sum to 1
  int influences_per_vertex = 0;       ///< 0: the mesh stands still; else 4 or 8
  std::uint32_t first_morph_weight = 0;
  std::vector<std::vector<glm::vec3>> morph_targets;  ///< position offsets, one vector per target
  /// Normal offsets, one vector per target, or empty: files do not carry them, the baker adds its
  /// own.
  std::vector<std::vector<glm::vec3>> morph_normals;
  std::vector<std::uint16_t> indices;  ///< triangles, counter-clockwise from the front
};

/// Largest magnitude of a coordinate or texture coordinate that decode_mesh accepts, so that no
/// product with a pose overflows.
inline constexpr float kMaxCoordinate = 1e9f;

/// Decodes a mesh. Errors: kCorrupt, kLimit, kOutOfMemory. Every index, joint (< palette_size) and
/// morph weight
/// (< morph_weight_count) of the result is in range, every float finite.
[[nodiscard]] Result<Mesh> decode_mesh(const container::MeshRecord& record,
                                       std::size_t palette_size, std::size_t morph_weight_count);

}  // namespace relit::decoders
