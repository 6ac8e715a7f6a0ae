// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bake_minimal/coding_options.hpp"
#include "bake_minimal/plane_split.hpp"
#include "container/base/plane_view.hpp"
#include "container/base/result.hpp"

/// Values of planes -> exponents and mantissas (design, section 4, step 2).
namespace relit::bake {

/// The planes of one tile in one frame, [component][texels]; memory is reused.
struct Components {
  std::vector<std::vector<double>> full;  ///< at full resolution
  std::vector<std::vector<double>> half;  ///< means of 2×2, of components 1 and 2; only with 4:2:0
};

/// Turns values into exponents and mantissas. Immutable after construction, so that it may be
/// shared by threads.
class PlaneQuantiser {
 public:
  PlaneQuantiser(const TransferShape& shape, const CodingOptions& resolved);

  [[nodiscard]] bool halved(int component) const { return halves_ && component > 0; }
  [[nodiscard]] int blocks_x() const { return (shape_.width + block_ - 1) / block_; }
  [[nodiscard]] int blocks_y() const { return (shape_.height + block_ - 1) / block_; }
  [[nodiscard]] std::size_t blocks() const {
    return static_cast<std::size_t>(blocks_x()) * static_cast<std::size_t>(blocks_y());
  }

  /// Fills `half` from `full`; the last column and row of odd maps are replicated.
  void halve_chroma(Components& components) const;

  /// Raises `exponents` (one for each block, row-major) to the least E with which every mantissa of
  /// the block is within ±mantissa_top(): over all full-resolution planes and, for blocks of at
  /// least 2×2, the means of halved ones. Blocks of a single texel bound the halved planes' own
  /// values, of whose mantissas the mean is then coded: the tear of the paper's scheme. E = 0 where
  /// all are zero (below the smallest normal float); else E ≥ exponent_least().
  void raise_exponents(const Components& components, std::span<std::uint8_t> exponents) const;

  /// How one plane is quantised: m = M₀ + round_half_away((value − middle) / scale / 2^(E−E₀)).
  struct Step {
    double middle = 0;
    double scale = 1;
  };
  /// Mantissas of a component, row-major, at the resolution at which it is coded. `exponents` are
  /// the blocks', or empty. Returns false when a mantissa is out of range.
  bool quantise(const Components& components, int component, const Step& step,
                std::span<const std::uint8_t> exponents, std::vector<std::uint16_t>& out) const;

 private:
  [[nodiscard]] std::size_t block_of(int x, int y) const;
  void halve(const std::vector<double>& full, std::vector<double>& half) const;
  void halve_scaled(const std::vector<double>& full, std::span<const std::uint8_t> exponents,
                    std::vector<double>& half) const;

  TransferShape shape_;
  bool halves_;
  int bit_depth_;
  int block_;
  std::vector<double> inverse_power_;  ///< 2^(E₀−E) by E; 0 for E = 0
};

/// First pass over a clip: ranges of all planes, and exponents that are held over several frames.
class RangeScan {
 public:
  /// Errors: those of resolve() and plan_layers().
  static Result<RangeScan> create(PlaneSplit split, const CodingOptions& options);
  /// Of colour planes.
  static Result<RangeScan> create(const TransferShape& shape, const CodingOptions& options);

  /// Frames in order, filled outside the charts. Errors: those of PlaneSplit::begin_frame().
  Status add_frame(const TransferFrame& frame);

  [[nodiscard]] std::uint64_t frame_count() const { return frame_count_; }
  [[nodiscard]] const PlaneSplit& split() const { return split_; }
  [[nodiscard]] const CodingOptions& options() const { return options_; }
  /// Takes all that ranges and steps do not depend on: `resolved` is of same_planes().
  void set_stream(const CodingOptions& resolved) { options_ = resolved; }

  /// μ[n]: the middles of the ranges where options.centred and there are no exponents, else zero.
  [[nodiscard]] std::vector<Rgb> mean() const;
  /// Step of every plane, [tile][component], for that mean. With exponents the scale is 1. Without,
  /// scales are in inverse proportion to PlaneSplit::weight() (or equal), and the largest |value|
  /// of the clip just fits. Always finite and positive, also for a clip of zeros.
  [[nodiscard]] std::vector<std::vector<PlaneQuantiser::Step>> steps() const;

  /// Frames that share one exponent picture, and whether frame k begins such a run.
  [[nodiscard]] int hold_frames() const;
  [[nodiscard]] bool begins_hold(std::uint64_t frame) const;
  /// Exponents of a tile at a frame, [blocks]; empty unless exponents are held over frames.
  [[nodiscard]] std::span<const std::uint8_t> held_exponents(std::uint64_t frame, int tile) const;

 private:
  struct Range {
    double least = 0;
    double most = 0;
  };
  RangeScan(PlaneSplit split, const CodingOptions& resolved);
  [[nodiscard]] std::vector<std::array<double, 3>> wanted_middles() const;
  [[nodiscard]] std::size_t hold_index(std::uint64_t frame) const;

  PlaneSplit split_;
  CodingOptions options_;
  PlaneQuantiser quantiser_;
  Components scratch_;
  std::uint64_t frame_count_ = 0;
  std::vector<std::array<Range, 3>> ranges_;          ///< [tile][component]
  std::vector<std::vector<std::uint8_t>> exponents_;  ///< [hold][tile × blocks]
};

}  // namespace relit::bake
