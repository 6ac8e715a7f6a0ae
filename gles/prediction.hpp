// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>

#include "container/base/plane_view.hpp"

/// The prediction E(N) = Σ_{n<9} irradiance[n] · Y_n(N), by which the plane s is multiplied: the
/// numbers for the shader's polynomial (shaders/composite_predict.glsl), and E itself for what is
/// looked at on the CPU.
namespace relit::gles {

/// Bands 0 to 2; band 3 of the clamped cosine is zero.
inline constexpr std::size_t kHarmonics = 9;

/// Y_n is its factor times its polynomial of x, y, z: 1, y, z, x, xy, yz, 3z² - 1, xz, x² - y².
inline constexpr std::array<double, kHarmonics> kHarmonicFactors{
    0.28209479177387814347,                          // √(1/(4π))
    0.48860251190291992159, 0.48860251190291992159,  // √(3/(4π))
    0.48860251190291992159, 1.09254843059207907055,  // √(15/(4π))
    1.09254843059207907055, 0.31539156525252000603,  // √(5/(16π))
    1.09254843059207907055, 0.54627421529603953527,  // √(15/(16π))
};

/// The polynomials' largest magnitudes over the unit ball.
inline constexpr std::array<double, kHarmonics> kPolynomialPeaks{1, 1, 1, 1, 0.5, 0.5, 2, 0.5, 1};

/// E(N), by colour; N is of unit length or zero.
[[nodiscard]] inline std::array<double, 3> predicted_irradiance(
    const FoldedLight& light, const std::array<double, 3>& normal) {
  const auto [x, y, z] = normal;
  const std::array<double, kHarmonics> polynomials{
      1, y, z, x, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y};
  std::array<double, 3> sum{};
  for (std::size_t n = 0; n < kHarmonics; ++n)
    for (std::size_t c = 0; c < 3; ++c)
      sum[c] += static_cast<double>(light.irradiance[n][c]) * kHarmonicFactors[n] * polynomials[n];
  return sum;
}

/// At most so much is |E(N)| of any N, by colour.
[[nodiscard]] inline std::array<double, 3> irradiance_bound(const FoldedLight& light) {
  std::array<double, 3> bound{};
  for (std::size_t n = 0; n < kHarmonics; ++n)
    for (std::size_t c = 0; c < 3; ++c) {
      const double term = static_cast<double>(light.irradiance[n][c]) * kHarmonicFactors[n];
      bound[c] += (term < 0 ? -term : term) * kPolynomialPeaks[n];
    }
  return bound;
}

}  // namespace relit::gles
