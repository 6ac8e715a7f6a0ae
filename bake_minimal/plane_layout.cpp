// SPDX-License-Identifier: MIT
#include "bake_minimal/plane_layout.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "container/base/limits.hpp"

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

Rect tile_rect(int index, const Tiling& tiling, int pitch_x, int pitch_y, int width, int height) {
  return {static_cast<std::uint16_t>(index % tiling.columns * pitch_x),
          static_cast<std::uint16_t>(index / tiling.columns * pitch_y),
          static_cast<std::uint16_t>(width), static_cast<std::uint16_t>(height)};
}

Result<LayerPlan> plan_layer(const PlaneSplit& split, std::vector<int> tiles,
                             const CodingOptions& o) {
  LayerPlan plan;
  LayerRecord& record = plan.record;
  const int width = split.shape().width, height = split.shape().height;
  const Tiling tiling =
      tiling_of(static_cast<int>(tiles.size()), padded_side(width), o.layout, split.shape().order);
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
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    for (int c = 0; c < split.components(); ++c) {
      PlaneRecord plane;
      plane.component = static_cast<std::uint8_t>(c);
      plane.mantissa_rect = tile_rect(static_cast<int>(i), tiling, padded_side(width),
                                      padded_side(height), width, height);
      if (record.has_exponents) {
        plane.exponent_rect =
            tile_rect(static_cast<int>(i), tiling, blocks_x, blocks_y, blocks_x, blocks_y);
      }
      plane.matrix = split.column(tiles[i], c);
      record.planes.push_back(std::move(plane));
    }
  }
  plan.tiles = std::move(tiles);
  return plan;
}

}  // namespace

Result<std::vector<LayerPlan>> plan_layers(const PlaneSplit& split, const CodingOptions& resolved,
                                           const LayoutIds& ids) {
  const int side = static_cast<int>(limits::kLightMapSide);
  const TransferShape& shape = split.shape();
  if (shape.order < 0 || shape.order > static_cast<int>(limits::kShOrder)) {
    return fail(ErrorCode::kInvalid, "--order is 0 to 3, not " + std::to_string(shape.order));
  }
  if (shape.width < 1 || shape.height < 1 || shape.width > side || shape.height > side) {
    return fail(ErrorCode::kInvalid, "a light map has 1 to " + std::to_string(side) +
                                         " texels a side, not " + std::to_string(shape.width) +
                                         "x" + std::to_string(shape.height));
  }
  std::vector<LayerPlan> plans;
  std::uint32_t track = ids.first_track_id;
  int tile = 0;
  for (const int count : split.layer_tiles(resolved.layout == Layout::kGrid)) {
    std::vector<int> tiles(static_cast<std::size_t>(count));
    for (int& each : tiles) each = tile++;
    RELIT_ASSIGN(LayerPlan plan, plan_layer(split, std::move(tiles), resolved));
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
