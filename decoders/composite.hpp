// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "container/base/plane_view.hpp"
#include "container/base/result.hpp"
#include "container/records.hpp"
#include "decoders/sh.hpp"

namespace relit::decoders {

/// Owns what a FoldedLight views.
struct FoldedWeights {
  std::vector<Rgb> weights;
  FoldedLight view;  ///< view.weights points at `weights`; copy with care: refold instead
};

/// Folds a light into a model: w[k] = Σ_n L_n M[n,·,k] (design, section 2), in double precision,
/// then divided by the light's largest magnitude. Coefficients that the light or the model lacks
/// count as zero. A light without any coefficient of FLT_MIN or more is black: magnitude 1, weights
/// 0. `layers` are the model's, in order; planes are numbered through them. Reuses `out`'s memory.
/// Errors: kInvalid for a light that is not finite or has not 1, 4, 9 or 16 rows, for matrix
/// entries beyond the model's order and for a prediction plane that is none of the planes; `out` is
/// then unusable.
Status fold_light(const container::ModelRecord& model,
                  std::span<const container::LayerRecord> layers, const Light& light,
                  FoldedWeights& out);

/// s·E(N) of one frame, with its share of a blend; 0 ≤ share ≤ 1.
struct CompositePrediction {
  int plane = -1;                      ///< s among the job's planes; -1: none
  std::span<const glm::vec3> normals;  ///< of each texel of the job's `out`; finite
  float share = 1;
};

/// The composite, on the CPU: light map = s·E(N) + constant + Σ_k w[k]·value_k for every texel. A
/// blend of frames is the same sum over the planes of both, each with its share of the weight.
///
/// All kernels give the same bits: float, planes added in order, no fused multiply-adds. Every
/// 2^(E - E₀), subnormal ones included, and with it every value before its scale is exact, so that
/// the error is at most (K + 2)·2⁻²⁴·(|constant| + Σ_k |w[k]·value_k|) for K planes, to first
/// order; a predicted plane counts with |s|·Σ_n |irradiance[n]|·|Y_n|, and 16 more roundings.
/// Beyond that, results below 2⁻¹²⁶ round to multiples of 2⁻¹⁴⁹ (a processor that flushes
/// subnormals: to 0). The output is always finite: what overflows, which only files that nobody
/// baked do, becomes ±FLT_MAX.
struct CompositeJob {
  /// As many as light.weights. Where w[k] is zero a view may be empty; run() takes any empty view
  /// for 0. Samples may be unaligned; nothing beyond the light map's width is read.
  std::span<const PlaneView> planes;
  FoldedLight light;  ///< of `irradiance`, bands 0..2 are read: A_3 is 0
  int width = 0;      ///< of the light map; every plane covers it
  int height = 0;
  /// 1: every texel. 2: every second one of every second row, from (0, 0) on: a light map of half
  /// the size, rounded up, whose texels are bit for bit those of the full one.
  int every = 1;
  /// One, or for a blend of frames two. (Of `light`, prediction_plane is not looked at.)
  std::array<CompositePrediction, 2> predictions{};
  std::span<float> out;  ///< [3][out_height()][out_width()], linear, divided by light.magnitude,
                         ///< may be negative

  [[nodiscard]] int out_width() const { return (width + every - 1) / every; }
  [[nodiscard]] int out_height() const { return (height + every - 1) / every; }

  /// Sizes, shifts and finiteness; call once per configuration. E₀ must be 128 to 150, where every
  /// 2^(E - E₀) is a float. Errors: kInvalid.
  [[nodiscard]] Status validate() const;
  /// Runs the fastest kernel the processor has, on the calling thread. Allocates nothing. The job
  /// must be valid.
  void run() const;
  /// The scalar kernel by which the others are tested.
  void run_scalar() const;
};

/// Which kernel run() takes: "scalar", "sse2", "avx2" or "neon".
[[nodiscard]] const char* composite_kernel();

}  // namespace relit::decoders
