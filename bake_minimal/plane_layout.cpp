// SPDX-License-Identifier: MIT
#include "bake_minimal/plane_layout.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "container/base/limits.hpp"
#include "decoders/sh.hpp"

namespace relit::bake {
namespace {

using container::Chroma;
using container::LayerRecord;
using container::PlaneRecord;
using container::Rect;

/// Textures of the smallest machines end here.
constexpr int kRowSamples = 2048;

/// FFmpeg 5.1 does not give smaller FFV1 pictures back (2x1, 1x4);
/// the decoder refuses them.
constexpr int kLeastFfv1Side = 16;

struct Tiling {
  int columns = 1;
  int rows = 1;
};

Tiling tiling_of(int tiles, int tile_width, Layout layout, int order) {
  if (layout == Layout::kGrid) return {order + 1, order + 1};
  Tiling tiling;
  tiling.columns = std::clamp(kRowSamples / tile_width, 1, tiles);
  tiling.rows = (tiles + tiling.columns - 1) / tiling.columns;
  tiling.columns = (tiles + tiling.rows - 1) / tiling.rows;
  return tiling;
}

std::vector<container::MatrixEntry> matrix_column(Basis basis, int coefficient, int component) {
  std::array<double, 3> unit{};
  unit[static_cast<std::size_t>(component)] = 1;
  const std::array<double, 3> rgb = to_rgb(basis, unit);
  std::vector<container::MatrixEntry> column;
  for (std::size_t c = 0; c < 3; ++c) {
    if (rgb[c] == 0) continue;
    column.push_back({static_cast<std::uint8_t>(coefficient), static_cast<std::uint8_t>(c),
                      static_cast<float>(rgb[c])});
  }
  return column;
}

Rect tile_rect(int index, const Tiling& tiling, int pitch_x, int pitch_y, int width, int height) {
  return {static_cast<std::uint16_t>(index % tiling.columns * pitch_x),
          static_cast<std::uint16_t>(index / tiling.columns * pitch_y),
          static_cast<std::uint16_t>(width), static_cast<std::uint16_t>(height)};
}

Result<LayerPlan> plan_layer(std::vector<int> coefficients, int order, int width, int height,
                             const CodingOptions& o) {
  LayerPlan plan;
  LayerRecord& record = plan.record;
  const Tiling tiling =
      tiling_of(static_cast<int>(coefficients.size()), padded_side(width), o.layout, order);
  const int coded_width = tiling.columns * padded_side(width);
  const int coded_height = tiling.rows * padded_side(height);
  if (coded_width > static_cast<int>(limits::kVideoSide) ||
      coded_height > static_cast<int>(limits::kVideoSide)) {
    return fail(ErrorCode::kLimit,
                "pictures of " + std::to_string(coded_width) + "x" + std::to_string(coded_height) +
                    " samples are too large: use a smaller --size, or --layout layered");
  }
  record.codec = o.codec;
  record.coded_width = static_cast<std::uint16_t>(coded_width);
  record.coded_height = static_cast<std::uint16_t>(coded_height);
  record.bit_depth = static_cast<std::uint8_t>(*o.bit_depth);
  record.chroma = *o.chroma;
  record.lossless = o.lossless;
  record.has_exponents = o.exponent_block > 0;
  const int g = std::max(o.exponent_block, 1);
  const int blocks_x = (width + g - 1) / g, blocks_y = (height + g - 1) / g;
  if (record.has_exponents) {
    record.exponent_codec = "ffv1";
    record.exponent_block = static_cast<std::uint8_t>(g);
    record.exponent_width =
        static_cast<std::uint16_t>(std::max(tiling.columns * blocks_x, kLeastFfv1Side));
    record.exponent_height =
        static_cast<std::uint16_t>(std::max(tiling.rows * blocks_y, kLeastFfv1Side));
  }
  const Basis basis = basis_of(o);
  for (std::size_t i = 0; i < coefficients.size(); ++i) {
    for (int c = 0; c < component_count(basis); ++c) {
      PlaneRecord plane;
      plane.component = static_cast<std::uint8_t>(c);
      plane.mantissa_rect = tile_rect(static_cast<int>(i), tiling, padded_side(width),
                                      padded_side(height), width, height);
      if (record.has_exponents) {
        plane.exponent_rect =
            tile_rect(static_cast<int>(i), tiling, blocks_x, blocks_y, blocks_x, blocks_y);
      }
      plane.matrix = matrix_column(basis, coefficients[i], c);
      record.planes.push_back(std::move(plane));
    }
  }
  plan.coefficients = std::move(coefficients);
  return plan;
}

}  // namespace

Basis basis_of(const CodingOptions& o) {
  if (*o.chroma == Chroma::kLuma) return Basis::kLuma;
  return o.lossless ? Basis::kGbr : Basis::kYCoCg;
}

int component_count(Basis basis) { return basis == Basis::kLuma ? 1 : 3; }

std::array<double, 3> to_components(Basis basis, const std::array<double, 3>& rgb) {
  const auto [r, g, b] = rgb;
  switch (basis) {
    case Basis::kYCoCg:
      return {(r + 2 * g + b) / 4, (r - b) / 2, (2 * g - r - b) / 4};
    case Basis::kGbr:
      return {g, b, r};
    case Basis::kLuma:
      return {(r + g + b) / 3, 0, 0};
  }
  return {};
}

std::array<double, 3> to_rgb(Basis basis, const std::array<double, 3>& components) {
  const auto [x, y, z] = components;
  switch (basis) {
    case Basis::kYCoCg:
      return {x + y - z, x + z, x - y - z};
    case Basis::kGbr:
      return {z, x, y};
    case Basis::kLuma:
      return {x, x, x};
  }
  return {};
}

Result<std::vector<LayerPlan>> plan_layers(int order, int width, int height,
                                           const CodingOptions& resolved, const LayoutIds& ids) {
  const int side = static_cast<int>(limits::kLightMapSide);
  if (order < 0 || order > static_cast<int>(limits::kShOrder)) {
    return fail(ErrorCode::kInvalid, "--order is 0 to 3, not " + std::to_string(order));
  }
  if (width < 1 || height < 1 || width > side || height > side) {
    return fail(ErrorCode::kInvalid, "a light map has 1 to " + std::to_string(side) +
                                         " texels a side, not " + std::to_string(width) + "x" +
                                         std::to_string(height));
  }
  std::vector<std::vector<int>> groups(
      resolved.layout == Layout::kGrid ? 1u : static_cast<std::size_t>(order) + 1);
  for (int n = 0; n < decoders::coefficient_count(order); ++n) {
    const int group = resolved.layout == Layout::kGrid ? 0 : decoders::band_of(n);
    groups[static_cast<std::size_t>(group)].push_back(n);
  }
  std::vector<LayerPlan> plans;
  std::uint32_t track = ids.first_track_id;
  for (std::vector<int>& group : groups) {
    RELIT_ASSIGN(LayerPlan plan, plan_layer(std::move(group), order, width, height, resolved));
    plan.record.id = ids.first_layer_id + static_cast<std::uint32_t>(plans.size());
    plan.record.model_id = ids.model_id;
    plan.record.mantissa_track = track++;
    if (plan.record.has_exponents) plan.record.exponent_track = track++;
    plans.push_back(std::move(plan));
  }
  return plans;
}

double quantiser_bound(std::span<const LayerRecord> layers, int coefficient, int channel,
                       int exponent) {
  double bound = 0;
  for (const LayerRecord& layer : layers) {
    const int shift = layer.has_exponents ? exponent - exponent_zero(layer.bit_depth) : 0;
    if (layer.has_exponents && exponent == 0) continue;
    for (const PlaneRecord& plane : layer.planes) {
      for (const container::MatrixEntry& entry : plane.matrix) {
        if (entry.coefficient != coefficient || entry.channel != channel) continue;
        bound += std::abs(double{entry.value}) * std::ldexp(double{plane.scale}, shift) / 2;
      }
    }
  }
  return bound;
}

}  // namespace relit::bake
