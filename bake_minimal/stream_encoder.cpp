// SPDX-License-Identifier: MIT
#include "bake_minimal/stream_encoder.hpp"

#include <meshoptimizer.h>
#include <zstd.h>

#include <mutex>
#include <new>

namespace relit::bake {
namespace {

/// The library keeps its format versions in globals and newer releases default to newer ones.
void fix_formats() {
  static std::once_flag once;
  std::call_once(once, [] {
    meshopt_encodeVertexVersion(0);
    meshopt_encodeIndexVersion(1);
  });
}

}  // namespace

std::vector<std::uint8_t> deflate(std::span<const std::uint8_t> bytes, int level) {
  std::vector<std::uint8_t> out(ZSTD_compressBound(bytes.size()));
  const std::size_t size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), level);
  // Only a failed allocation gets here: the output is large enough for anything.
  if (ZSTD_isError(size)) throw std::bad_alloc();
  out.resize(size);
  return out;
}

std::vector<std::uint8_t> encode_vertex_stream(std::span<const std::uint8_t> bytes,
                                               std::size_t stride) {
  fix_formats();
  const std::size_t count = bytes.size() / stride;
  std::vector<std::uint8_t> coded(meshopt_encodeVertexBufferBound(count, stride));
  coded.resize(meshopt_encodeVertexBuffer(coded.data(), coded.size(), bytes.data(), count, stride));
  return deflate(coded);
}

std::vector<std::uint8_t> encode_index_stream(std::span<const std::uint32_t> indices,
                                              std::size_t vertex_count) {
  fix_formats();
  std::vector<std::uint8_t> coded(meshopt_encodeIndexBufferBound(indices.size(), vertex_count));
  coded.resize(
      meshopt_encodeIndexBuffer(coded.data(), coded.size(), indices.data(), indices.size()));
  return deflate(coded);
}

}  // namespace relit::bake
