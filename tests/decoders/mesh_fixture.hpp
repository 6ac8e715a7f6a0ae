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

/// FORMAT.md, section 3.6, for the four vertices of quad(): vertex 1 has 0 near, vertex 2 has 1 and
/// the other corner 0, vertex 3 has 2, the other corner 0, and 1 across their edge.
inline int quad_prediction(container::Semantic semantic, const std::vector<int>& values,
                           std::size_t v, std::size_t c, std::size_t components) {
  const auto at = [&](std::size_t vertex) { return values[vertex * components + c]; };
  if (semantic == container::Semantic::kWeights && c == 3) {
    return 255 - values[4 * v] - values[4 * v + 1] - values[4 * v + 2];
  }
  if (v == 0) return 0;
  switch (semantic) {
    case container::Semantic::kJoints:
      return at(v - 1);
    case container::Semantic::kNormal:
    case container::Semantic::kColor:
    case container::Semantic::kWeights:
      return v == 1 ? at(0) : (at(v - 1) + at(0)) >> 1;
    default:
      return v == 3 ? at(2) + at(0) - at(1) : at(v - 1);
  }
}

/// The bytes of a stream of quad(); those of a morph target are coded like a position's.
inline std::vector<std::uint8_t> vertex_bytes(
    std::span<const std::uint8_t> plain, std::size_t stride,
    container::Semantic semantic = container::Semantic::kPosition) {
  using container::Semantic;
  const bool bytes = semantic == Semantic::kNormal || semantic == Semantic::kColor ||
                     semantic == Semantic::kWeights;
  const std::size_t components = bytes ? stride : stride / 2;
  std::vector<int> values(4 * components);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = bytes ? plain[i] : plain[2 * i] | plain[2 * i + 1] << 8;
    if (semantic == Semantic::kNormal) values[i] = static_cast<std::int8_t>(values[i]);
  }
  std::vector<std::uint8_t> low(values.size()), high(bytes ? 0 : values.size());
  for (std::size_t v = 0; v < 4; ++v) {
    for (std::size_t c = 0; c < components; ++c) {
      int r = values[v * components + c] - quad_prediction(semantic, values, v, c, components);
      r = bytes ? int{static_cast<std::int8_t>(r)} : int{static_cast<std::int16_t>(r)};
      const int folded = r >= 0 ? 2 * r : -2 * r - 1;
      low[4 * c + v] = static_cast<std::uint8_t>(folded & 255);
      if (!bytes) high[4 * c + v] = static_cast<std::uint8_t>(folded >> 8);
    }
  }
  low.insert(low.end(), high.begin(), high.end());
  return zstd(low);
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
  return {semantic, stride, offset, scale, vertex_bytes(plain, stride, semantic)};
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
