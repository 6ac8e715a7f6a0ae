// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "decoders/composite.hpp"

/// The composite by its definition, in double precision, texel by texel.
namespace relit::reference {

struct Composite {
  std::vector<double> value;  ///< [3][height][width]
  std::vector<double>
      magnitude;  ///< the sum of the terms' absolute values, by which errors are bounded
};

/// PlaneView's formula.
inline double plane_value(const PlaneView& plane, int x, int y) {
  const int mantissa = plane.mantissa.at(x >> plane.mantissa_shift, y >> plane.mantissa_shift);
  double value = static_cast<double>(plane.scale) * (mantissa - plane.mantissa_zero);
  if (plane.exponent.empty()) return value;
  const int exponent = plane.exponent.at(x >> plane.exponent_shift, y >> plane.exponent_shift);
  return exponent == 0 ? 0 : std::ldexp(value, exponent - plane.exponent_zero);
}

/// Takes the same planes and light as the job; its `out` is not used.
inline Composite composite(const decoders::CompositeJob& job) {
  const auto texels = static_cast<std::size_t>(job.width) * static_cast<std::size_t>(job.height);
  Composite result{std::vector<double>(3 * texels), std::vector<double>(3 * texels)};
  std::size_t texel = 0;
  for (int y = 0; y < job.height; ++y) {
    for (int x = 0; x < job.width; ++x, ++texel) {
      for (std::size_t c = 0; c < 3; ++c) {
        double sum = static_cast<double>(job.light.constant[c]);
        double magnitude = std::abs(sum);
        const auto add = [&](double term, double term_magnitude) {
          sum += term;
          magnitude += term_magnitude;
        };
        for (std::size_t k = 0; k < job.planes.size(); ++k) {
          const decoders::CompositePrediction* predicts = nullptr;
          for (const decoders::CompositePrediction& each : job.predictions)
            if (each.plane == static_cast<int>(k)) predicts = &each;
          const auto weight = static_cast<double>(job.light.weights[k][c]);
          if (job.planes[k].mantissa.empty() || (weight == 0 && predicts == nullptr)) continue;
          const double value = plane_value(job.planes[k], x, y);
          add(weight * value, std::abs(weight * value));
          if (predicts == nullptr) continue;
          const double s = value * static_cast<double>(predicts->share);
          const glm::dvec3 normal(predicts->normals[texel]);
          std::array<double, 16> harmonics{};
          decoders::evaluate_sh(3, normal, harmonics);
          // |3z² − 1| is the difference of two terms, each of which rounds: bound it by their sum.
          std::array<double, 16> largest{};
          for (std::size_t n = 0; n < 16; ++n) largest[n] = std::abs(harmonics[n]);
          largest[6] = 0.31539156525252 * (3 * normal.z * normal.z + 1);
          largest[8] = 0.54627421529604 * (normal.x * normal.x + normal.y * normal.y);
          for (std::size_t n = 0; n < 16; ++n) {
            const auto irradiance = static_cast<double>(job.light.irradiance[n][c]);
            add(s * irradiance * harmonics[n], std::abs(s * irradiance * largest[n]));
          }
        }
        result.value[c * texels + texel] = sum;
        result.magnitude[c * texels + texel] = magnitude;
      }
    }
  }
  return result;
}

/// How far a float composite of the job may be from the reference where the terms' magnitudes sum
/// to `magnitude`: with u = 2^-24, a term is rounded where its weight takes the plane's scale,
/// where it is multiplied and at each of the K additions after it; a predicted term, besides, at
/// most 14 times inside E(N) (folded factor, polynomial 3, product, 8 additions, product with s).
/// First order and 1 % for the rest. Results near zero are multiples of 2^-149.
inline double composite_bound(const decoders::CompositeJob& job, double magnitude) {
  const bool predicted = job.predictions[0].plane >= 0 || job.predictions[1].plane >= 0;
  const double roundings = static_cast<double>(job.planes.size()) + 2 + (predicted ? 16 : 0);
  return 1.01 * roundings * std::ldexp(magnitude, -24) +
         std::ldexp(static_cast<double>(job.planes.size()) + 2, -149);
}

}  // namespace relit::reference
