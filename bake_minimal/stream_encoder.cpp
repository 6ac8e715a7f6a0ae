// SPDX-License-Identifier: MIT
#include "bake_minimal/stream_encoder.hpp"

#include <meshoptimizer.h>
#include <zstd.h>

#include <mutex>
#include <new>

namespace relit::bake {
namespace {

/// The library keeps its format version in a global and newer releases default to newer ones.
void fix_format() {
  static std::once_flag once;
  std::call_once(once, [] { meshopt_encodeIndexVersion(1); });
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
                                               const decoders::VertexStreamForm& form,
                                               const decoders::VertexLinks& links) {
  const std::size_t components = form.components();
  const std::size_t count = bytes.size() / form.stride;
  const std::size_t stored = links.stored(form);
  std::vector<std::uint16_t> values(count * components);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = static_cast<std::uint16_t>(
        form.value_bytes == 2 ? bytes[2 * i] | bytes[2 * i + 1] << 8 : bytes[i]);
  }
  std::vector<std::uint8_t> planes(stored * form.stride);
  for (std::size_t v = 0, at = 0; v < count; ++v) {
    if (form.of_points && links.has_twin(v)) continue;
    for (std::size_t c = 0; c < components; ++c) {
      const std::uint16_t prediction =
          predict_vertex_value(form, links.neighbours(form, v), values, {v, c});
      const std::uint16_t folded = decoders::fold_residual(
          form, static_cast<std::uint16_t>(values[v * components + c] - prediction));
      planes[c * stored + at] = static_cast<std::uint8_t>(folded & 255);
      if (form.value_bytes == 2) {
        planes[(components + c) * stored + at] = static_cast<std::uint8_t>(folded >> 8);
      }
    }
    ++at;
  }
  return deflate(planes);
}

std::vector<std::uint8_t> encode_twins(std::span<const std::uint16_t> twins) {
  std::vector<std::uint8_t> planes(2 * twins.size());
  std::uint16_t last = 0;
  for (std::size_t v = 0; v < twins.size(); ++v) {
    if (twins[v] == decoders::kNoTwin) continue;
    const std::uint16_t folded = decoders::fold_residual(
        decoders::form_of(container::Semantic::kTwin), static_cast<std::uint16_t>(twins[v] - last));
    const auto word = static_cast<std::uint16_t>(folded + 1);
    planes[v] = static_cast<std::uint8_t>(word & 255);
    planes[twins.size() + v] = static_cast<std::uint8_t>(word >> 8);
    last = twins[v];
  }
  return deflate(planes);
}

std::vector<std::uint8_t> encode_index_stream(std::span<const std::uint32_t> indices,
                                              std::size_t vertex_count) {
  fix_format();
  std::vector<std::uint8_t> coded(meshopt_encodeIndexBufferBound(indices.size(), vertex_count));
  coded.resize(
      meshopt_encodeIndexBuffer(coded.data(), coded.size(), indices.data(), indices.size()));
  return deflate(coded);
}

}  // namespace relit::bake
