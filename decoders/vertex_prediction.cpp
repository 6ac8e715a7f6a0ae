// SPDX-License-Identifier: MIT
#include "decoders/vertex_prediction.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace relit::decoders {
namespace {

using Prediction = VertexStreamForm::Prediction;

constexpr std::array<VertexStreamForm, 8> kForms{{
    {"position", 8, 2, false, true, Prediction::kParallelogram},
    {"normal", 4, 1, true, true, Prediction::kMean},
    {"light-map UV", 4, 2, false, false, Prediction::kParallelogram},
    {"albedo UV", 4, 2, false, false, Prediction::kParallelogram},
    {"colour", 4, 1, false, true, Prediction::kMean},
    {"joints", 8, 2, false, true, Prediction::kNear},
    {"weights", 4, 1, false, true, Prediction::kWeights},
    {"twin", 2, 2, false, false, Prediction::kNone},
}};
constexpr VertexStreamForm kMorphTarget{"morph target", 8,    2,
                                        true,           true, Prediction::kParallelogram};

/// How many triangles before a vertex's own are searched for the far corner.
constexpr std::size_t kFarTriangles = 16;

/// The third corner of the nearest triangle before `triangle` that has a and b; none: `none`.
std::uint16_t far_corner(std::span<const std::uint16_t> corners, std::size_t triangle,
                         const std::array<std::uint16_t, 2>& edge, std::uint16_t none) {
  const auto [a, b] = edge;
  if (a == b) return none;
  const std::size_t last = triangle > kFarTriangles ? triangle - kFarTriangles : 0;
  for (std::size_t t = triangle; t-- > last;) {
    const std::uint16_t* y = &corners[3 * t];
    if (std::find(y, y + 3, a) == y + 3 || std::find(y, y + 3, b) == y + 3) continue;
    return static_cast<std::uint16_t>(y[0] + y[1] + y[2] - a - b);
  }
  return none;
}

std::vector<VertexNeighbours> find_neighbours(std::span<const std::uint16_t> corners,
                                              std::size_t vertex_count) {
  std::vector<VertexNeighbours> out(vertex_count);
  for (std::size_t v = 1; v < vertex_count; ++v) {
    out[v] = {static_cast<std::uint16_t>(v - 1), 0, 0, 1};
  }
  std::vector<bool> found(vertex_count);
  for (std::size_t t = 0; 3 * t + 2 < corners.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint16_t v = corners[3 * t + i];
      std::uint16_t a = corners[3 * t + (i + 1) % 3], b = corners[3 * t + (i + 2) % 3];
      if (a >= v) std::swap(a, b);
      if (found[v] || a >= v) continue;
      found[v] = true;
      if (b >= v) {
        out[v] = {a, 0, 0, 1};
        continue;
      }
      const std::uint16_t far = far_corner(corners, t, {a, b}, v);
      out[v] = {std::max(a, b), std::min(a, b), far, static_cast<std::uint8_t>(far < v ? 3 : 2)};
    }
  }
  return out;
}

int extended(const VertexStreamForm& form, std::uint16_t value) {
  return form.is_signed && form.value_bytes == 1 ? static_cast<std::int8_t>(value) : value;
}

}  // namespace

const VertexStreamForm& form_of(container::Semantic semantic) {
  return kForms[static_cast<std::size_t>(semantic)];
}

const VertexStreamForm& morph_target_form() { return kMorphTarget; }

std::size_t VertexLinks::stored(const VertexStreamForm& form) const {
  if (!form.of_points || twins.empty()) return of_vertices.size();
  return static_cast<std::size_t>(std::count(twins.begin(), twins.end(), kNoTwin));
}

VertexLinks link_vertices(std::span<const std::uint16_t> indices, std::size_t vertex_count,
                          std::vector<std::uint16_t> twins) {
  VertexLinks out;
  out.of_vertices = find_neighbours(indices, vertex_count);
  if (!twins.empty()) {
    std::vector<std::uint16_t> point(vertex_count);
    for (std::size_t v = 0; v < vertex_count; ++v) {
      point[v] = twins[v] == kNoTwin ? static_cast<std::uint16_t>(v) : point[twins[v]];
    }
    std::vector<std::uint16_t> corners(indices.size());
    std::transform(indices.begin(), indices.end(), corners.begin(),
                   [&](std::uint16_t v) { return point[v]; });
    out.of_points = find_neighbours(corners, vertex_count);
  }
  out.twins = std::move(twins);
  return out;
}

std::uint16_t predict_vertex_value(const VertexStreamForm& form, const VertexNeighbours& neighbours,
                                   std::span<const std::uint16_t> values, const VertexValue& of) {
  const auto at = [&](std::uint16_t v) {
    return extended(form, values[v * form.components() + of.c]);
  };
  const bool weights = form.prediction == Prediction::kWeights;
  if (weights && of.c == 3) {
    const std::uint16_t* w = &values[of.v * 4];
    return static_cast<std::uint16_t>(255 - w[0] - w[1] - w[2]);
  }
  if (form.prediction == Prediction::kNone || neighbours.count == 0) return 0;
  if ((weights || form.prediction == Prediction::kMean) && neighbours.count >= 2) {
    // Shifting right rounds down, below zero too.
    return static_cast<std::uint16_t>((at(neighbours.near) + at(neighbours.other)) >> 1);
  }
  if (form.prediction == Prediction::kParallelogram && neighbours.count == 3) {
    return static_cast<std::uint16_t>(at(neighbours.near) + at(neighbours.other) -
                                      at(neighbours.far));
  }
  return static_cast<std::uint16_t>(at(neighbours.near));
}

std::uint16_t fold_residual(const VertexStreamForm& form, std::uint16_t residual) {
  const int bits = 8 * form.value_bytes;
  const bool negative = (residual >> (bits - 1) & 1) != 0;
  const int folded = residual << 1 ^ (negative ? -1 : 0);
  return static_cast<std::uint16_t>(folded & ((1 << bits) - 1));
}

std::uint16_t unfold_residual(std::uint16_t folded) {
  return static_cast<std::uint16_t>(folded >> 1 ^ -(folded & 1));
}

}  // namespace relit::decoders
