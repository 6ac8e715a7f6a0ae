// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "container/records.hpp"

/// What the values of a vertex are predicted from, as reader and writer compute it; FORMAT.md,
/// section 3.6.
namespace relit::decoders {

/// How a vertex stream is predicted, and what its values are.
struct VertexStreamForm {
  enum class Prediction : std::uint8_t { kNone, kNear, kMean, kWeights, kParallelogram };
  const char* name = "";
  std::uint8_t stride = 0;       ///< bytes a vertex
  std::uint8_t value_bytes = 2;  ///< 1 or 2
  bool is_signed = false;
  bool of_points = true;  ///< not stored for vertices with a twin
  Prediction prediction = Prediction::kParallelogram;

  [[nodiscard]] std::size_t components() const { return stride / std::size_t{value_bytes}; }
};

/// That of a known semantic.
[[nodiscard]] const VertexStreamForm& form_of(container::Semantic semantic);
[[nodiscard]] const VertexStreamForm& morph_target_form();

/// Vertices that a vertex is predicted from, all of them below it: `near` where there is one,
/// `other` where there are two, and the `far` corner across their edge where there are three.
struct VertexNeighbours {
  std::uint16_t near = 0, other = 0, far = 0;
  std::uint8_t count = 0;
};

/// Marks vertices without a twin.
inline constexpr std::uint16_t kNoTwin = 0xffff;

/// How the vertices of a mesh hang together.
struct VertexLinks {
  /// The earlier vertex that each vertex shares everything but its UVs with, or kNoTwin; empty
  /// where no vertex has one.
  std::vector<std::uint16_t> twins;
  std::vector<VertexNeighbours> of_vertices;
  std::vector<VertexNeighbours> of_points;  ///< those of the vertices that have no twin; may be
                                            ///< empty where there are no twins

  [[nodiscard]] bool has_twin(std::size_t v) const { return !twins.empty() && twins[v] != kNoTwin; }
  [[nodiscard]] const VertexNeighbours& neighbours(const VertexStreamForm& form,
                                                   std::size_t v) const {
    return form.of_points && !of_points.empty() ? of_points[v] : of_vertices[v];
  }
  /// Vertices that a stream of this form stores values for.
  [[nodiscard]] std::size_t stored(const VertexStreamForm& form) const;
};

/// `indices`: a triangle list of vertices below `vertex_count`; `twins`: empty or one a vertex,
/// each below its vertex.
[[nodiscard]] VertexLinks link_vertices(std::span<const std::uint16_t> indices,
                                        std::size_t vertex_count, std::vector<std::uint16_t> twins);

/// Component `c` of vertex `v`.
struct VertexValue {
  std::size_t v = 0, c = 0;
};

/// The prediction of a value, modulo 2^16. `values`: [vertex][component] of everything before it,
/// as stored (bytes without sign extension).
[[nodiscard]] std::uint16_t predict_vertex_value(const VertexStreamForm& form,
                                                 const VertexNeighbours& neighbours,
                                                 std::span<const std::uint16_t> values,
                                                 const VertexValue& of);

/// A residual as it is stored, and back: 2r for r >= 0, -2r - 1 below, in `value_bytes`.
[[nodiscard]] std::uint16_t fold_residual(const VertexStreamForm& form, std::uint16_t residual);
[[nodiscard]] std::uint16_t unfold_residual(std::uint16_t folded);

}  // namespace relit::decoders
