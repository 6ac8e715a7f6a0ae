// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relit::bake {

/// Fills the texels of a light map that have no sample from those that do, smoothly, so that a
/// video codec sees no cliffs at the borders of charts: averages down a pyramid (pull),
/// interpolates back up (push; Gortler et al. 1996, The Lumigraph, section 3.4), then relaxes the
/// filled texels towards the mean of their neighbours. Linear in the samples; a constant stays that
/// constant. Everything that depends on the mask alone is computed once. Any size from 1×1.
/// Deterministic.
class PushPull {
 public:
  /// `valid`: width × height, nonzero where the texel has a sample.
  PushPull(int width, int height, std::span<const std::uint8_t> valid);

  /// Floats of scratch that fill() needs.
  [[nodiscard]] std::size_t scratch_size() const { return scratch_size_; }

  /// Fills one [height][width] plane in place. Texels with a sample are not touched; without any,
  /// the plane becomes 0. What the others held is ignored. Any number of threads at once, each with
  /// a scratch of its own. Allocates nothing.
  void fill(std::span<float> plane, std::span<float> scratch) const;

  /// The same with a scratch allocated for the call.
  void fill(std::span<float> plane) const;

 private:
  struct Level {
    int width = 0;
    int height = 0;
    std::size_t offset = 0;                      ///< into the scratch; unused at level 0
    std::vector<float> weight;                   ///< 0..1: how much of the texel is known
    std::vector<std::array<float, 4>> children;  ///< share of the 2×2 texels below, 0 or sum 1
  };

  void pull(std::span<const float> fine, const Level& below, const Level& level,
            std::span<float> out) const;
  void push(std::span<const float> coarse, const Level& above, const Level& level,
            std::span<float> out) const;
  void relax(std::span<float> plane) const;

  std::vector<Level> levels_;         ///< from the full size to 1×1
  std::vector<std::uint32_t> holes_;  ///< texels of level 0 without a sample
  std::size_t scratch_size_ = 0;
  bool any_ = false;
};

}  // namespace relit::bake
