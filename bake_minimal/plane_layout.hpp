// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bake_minimal/coding_options.hpp"
#include "bake_minimal/plane_split.hpp"
#include "container/base/result.hpp"
#include "container/records.hpp"

/// Where the planes of a light-map model lie in which pictures.
namespace relit::bake {

/// A picture's side in whole macroblocks of 16 pixels.
[[nodiscard]] constexpr int padded_side(int side) { return (side + 15) & ~15; }

/// One layer before it is coded. `record` lacks scales and private data of the codecs.
struct LayerPlan {
  container::LayerRecord record;
  std::vector<int> tiles;  ///< planes [i·components, (i+1)·components) are those of tiles[i]
};

struct LayoutIds {
  std::uint32_t model_id = 0;
  std::uint32_t first_layer_id = 0;
  std::uint32_t first_track_id = 0;  ///< a layer takes one, or two with exponents, in order
};

/// Lays the planes of a model out: tiles of the light map's size, padded to multiples of 16, in
/// rows (as long as 2048 samples allow) by layer, or as the grid. Deterministic. Errors: kLimit
/// when a picture would be too large, kInvalid for a bad order or size.
[[nodiscard]] Result<std::vector<LayerPlan>> plan_layers(const PlaneSplit& split,
                                                         const CodingOptions& resolved,
                                                         const LayoutIds& ids);

/// 127 or 511: the largest |m − M₀| that a writer emits.
[[nodiscard]] constexpr int mantissa_top(int bit_depth) { return bit_depth == 8 ? 127 : 511; }
[[nodiscard]] constexpr int mantissa_zero(int bit_depth) { return bit_depth == 8 ? 128 : 512; }
[[nodiscard]] constexpr int exponent_zero(int bit_depth) { return bit_depth == 8 ? 135 : 137; }
/// 9 or 11: with it a step is the smallest normal number.
[[nodiscard]] constexpr int exponent_least(int bit_depth) { return bit_depth == 8 ? 9 : 11; }

/// Largest error that quantisation can cause in T[coefficient, channel] where the planes are coded
/// without loss at full resolution: Σ_k |M[n,c,k]| · scale_k · 2^(E−E₀) / 2. `exponent` is the
/// block's E; ignored without exponents. With E = 0 the bound is 0. Not counted: the rounding of
/// the sum to float, and what a luma-only model drops.
[[nodiscard]] double quantiser_bound(std::span<const container::LayerRecord> layers,
                                     int coefficient, int channel, int exponent = 0);

}  // namespace relit::bake
