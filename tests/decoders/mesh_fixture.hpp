// SPDX-License-Identifier: MIT
#pragma once

#include <meshoptimizer.h>
#include <zstd.h>

#include <cstdint>
#include <span>
#include <vector>

#include "container/records.hpp"
#include "decoders/mesh.hpp"

/// Small encoders for records, written from FORMAT.md and not shared with the baker.
namespace relit::test {

inline std::vector<std::uint8_t> zstd(std::span<const std::uint8_t> bytes) {
  std::vector<std::uint8_t> out(ZSTD_compressBound(bytes.size()));
  out.resize(ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 3));
  return out;
}

inline std::vector<std::uint8_t> bytes_of(std::span<const std::uint16_t> words) {
  std::vector<std::uint8_t> out;
  for (const std::uint16_t w : words) {
    out.push_back(static_cast<std::uint8_t>(w & 255));
    out.push_back(static_cast<std::uint8_t>(w >> 8));
  }
  return out;
}

inline std::vector<std::uint8_t> vertex_bytes(std::span<const std::uint8_t> plain,
                                              std::size_t stride) {
  const std::size_t count = plain.size() / stride;
  std::vector<std::uint8_t> coded(meshopt_encodeVertexBufferBound(count, stride));
  coded.resize(meshopt_encodeVertexBuffer(coded.data(), coded.size(), plain.data(), count, stride));
  return zstd(coded);
}

inline std::vector<std::uint8_t> index_bytes(std::span<const std::uint32_t> indices,
                                             std::size_t vertex_count) {
  std::vector<std::uint8_t> coded(meshopt_encodeIndexBufferBound(indices.size(), vertex_count));
  coded.resize(
      meshopt_encodeIndexBuffer(coded.data(), coded.size(), indices.data(), indices.size()));
  return zstd(coded);
}

inline container::VertexStream stream(container::Semantic semantic, std::uint8_t stride,
                                      std::span<const std::uint8_t> plain,
                                      std::array<float, 3> offset = {},
                                      std::array<float, 3> scale = {1, 1, 1}) {
  return {semantic, stride, offset, scale, vertex_bytes(plain, stride)};
}

inline container::VertexStream stream(container::Semantic semantic, std::uint8_t stride,
                                      std::span<const std::uint16_t> words,
                                      std::array<float, 3> offset = {},
                                      std::array<float, 3> scale = {1, 1, 1}) {
  return stream(semantic, stride, bytes_of(words), offset, scale);
}

/// A quad of four vertices and two triangles at integer positions; rigid with palette entry 0 or,
/// with `streams` = 2, eight influences.
inline container::MeshRecord quad(std::size_t influence_streams = 1) {
  using container::Semantic;
  container::MeshRecord record;
  record.id = 7;
  record.name = "quad";
  record.vertex_count = 4;
  record.index_count = 6;
  const std::vector<std::uint16_t> positions{0, 0, 0, 0, 2, 0, 0, 0, 2, 4, 0, 0, 0, 4, 6, 0};
  const std::vector<std::uint16_t> uv{0, 0, 65535, 0, 65535, 65535, 0, 65535};
  record.streams.push_back(
      stream(Semantic::kPosition, 8, positions, {1, 2, 3}, {0.5f, 0.25f, 2.0f}));
  record.streams.push_back(
      stream(Semantic::kLightMapUv, 4, uv, {}, {1.0f / 65535, 1.0f / 65535, 1}));
  for (std::size_t s = 0; s < influence_streams; ++s) {
    std::vector<std::uint16_t> joints(16, 0);
    std::vector<std::uint8_t> weights(16, 0);
    for (std::size_t v = 0; v < 4; ++v) {
      if (influence_streams == 1) weights[4 * v] = 255;
      if (influence_streams == 2) weights[4 * v + 1] = s == 0 ? 55 : 200;
      joints[4 * v + 1] = static_cast<std::uint16_t>(s);
    }
    record.streams.push_back(stream(Semantic::kJoints, 8, joints));
    record.streams.push_back(stream(Semantic::kWeights, 4, weights));
  }
  const std::vector<std::uint32_t> indices{0, 1, 2, 0, 2, 3};
  record.indices = index_bytes(indices, 4);
  return record;
}

inline decoders::Mesh decoded_quad(std::size_t influence_streams = 1) {
  return decoders::decode_mesh(quad(influence_streams), 2, 4).value();
}

}  // namespace relit::test
