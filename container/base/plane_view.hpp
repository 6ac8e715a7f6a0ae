// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace relit {

using Rgb = std::array<float, 3>;

/// A rectangle of unsigned samples that somebody else owns. Samples of more than 8 bits take two
/// bytes in the machine's byte order. Row y starts at data + y * stride_bytes.
struct SampleView {
  const std::uint8_t* data = nullptr;  ///< null: no samples
  std::ptrdiff_t stride_bytes = 0;
  int width = 0;
  int height = 0;
  int bytes_per_sample = 1;  ///< 1 or 2

  [[nodiscard]] bool empty() const { return data == nullptr; }
  [[nodiscard]] int at(int x, int y) const {
    const std::uint8_t* p = data + y * stride_bytes + std::ptrdiff_t{x} * bytes_per_sample;
    if (bytes_per_sample == 1) return *p;
    std::uint16_t v;
    __builtin_memcpy(&v, p, sizeof v);
    return v;
  }
};

/// One plane of a W×H light map, as decoded. Its value at texel (x, y) is
///
///     scale * (mantissa(x >> mantissa_shift, y >> mantissa_shift) - mantissa_zero)
///           * 2^(E - exponent_zero),   E = exponent(x >> exponent_shift, y >> exponent_shift)
///
/// and exactly 0 where E = 0. Without an exponent view, E = exponent_zero everywhere.
/// Mantissa and exponent views belong to the decoder and live as long as the frame they came with.
struct PlaneView {
  SampleView mantissa;
  int mantissa_shift = 0;   ///< 1 for the chroma of 4:2:0, else 0; the same on both axes
  int mantissa_zero = 128;  ///< 128 for 8-bit mantissas, 512 for 10-bit ones
  SampleView exponent;
  int exponent_shift = 0;  ///< log2 of the exponent block's side: 0..5
  int exponent_zero = 135;
  float scale = 1;
};

/// A light folded into a model's matrix M: all that a composite needs to know of both.
///
///     light map(p) = s(p) * E(N(p)) + constant + Σ_k weights[k] * value_k(p)
///
/// Everything is divided by `magnitude`, the largest |L_n| of the light, which the picture's
/// exposure multiplies back, so that no shader sees absolute radiance. A weight that is zero means
/// that the plane need not be fetched, decoded or uploaded.
struct FoldedLight {
  std::span<const Rgb> weights;  ///< one for each plane of the model, in the model's order
  Rgb constant{};                ///< Σ_n L_n μ[n]
  std::array<Rgb, 16>
      irradiance{};           ///< L_n A_l/π for the prediction E(N) = Σ_n irradiance[n] Y_n(N)
  int prediction_plane = -1;  ///< index of s among the planes; -1: the model has no prediction
  float magnitude = 1;        ///< > 0, finite
};

}  // namespace relit
