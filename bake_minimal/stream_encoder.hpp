// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "decoders/vertex_prediction.hpp"

/// The byte codecs of meshes and poses: the writing side of decoders/inflate.hpp and of
/// decoders/vertex_prediction.hpp. Deterministic for one version of either library.
namespace relit::bake {

/// One zstd frame that states its content size. `level`: 1..22.
[[nodiscard]] std::vector<std::uint8_t> deflate(std::span<const std::uint8_t> bytes,
                                                int level = 19);

/// What the prediction of a vertex stream leaves, in planes of bytes, as one zstd frame. `bytes`
/// holds whole vertices of `form.stride` bytes, those with a twin included.
[[nodiscard]] std::vector<std::uint8_t> encode_vertex_stream(std::span<const std::uint8_t> bytes,
                                                             const decoders::VertexStreamForm& form,
                                                             const decoders::VertexLinks& links);

/// The stream of twins, decoders::kNoTwin for none. The distance from one to the next, modulo 2^16,
/// must not be 2^15.
[[nodiscard]] std::vector<std::uint8_t> encode_twins(std::span<const std::uint16_t> twins);

/// meshoptimizer's index codec (format 1), then zstd. Triangles keep their order and orientation,
/// but may start at another of their corners.
[[nodiscard]] std::vector<std::uint8_t> encode_index_stream(std::span<const std::uint32_t> indices,
                                                            std::size_t vertex_count);

}  // namespace relit::bake
