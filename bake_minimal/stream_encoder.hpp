// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

/// The byte codecs of meshes and poses: the writing side of decoders/inflate.hpp and of
/// meshoptimizer. Deterministic for one version of either library.
namespace relit::bake {

/// One zstd frame that states its content size. `level`: 1..22.
[[nodiscard]] std::vector<std::uint8_t> deflate(std::span<const std::uint8_t> bytes,
                                                int level = 19);

/// meshoptimizer's vertex codec (format 0), then zstd. `bytes` holds whole vertices of `stride`
/// bytes, a multiple of 4.
[[nodiscard]] std::vector<std::uint8_t> encode_vertex_stream(std::span<const std::uint8_t> bytes,
                                                             std::size_t stride);

/// meshoptimizer's index codec (format 1), then zstd. Triangles keep their order and orientation,
/// but may start at another of their corners.
[[nodiscard]] std::vector<std::uint8_t> encode_index_stream(std::span<const std::uint32_t> indices,
                                                            std::size_t vertex_count);

}  // namespace relit::bake
