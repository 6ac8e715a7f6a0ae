// SPDX-License-Identifier: MIT
#include "bake_minimal/light_metric.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include "decoders/sh.hpp"

namespace relit::bake {
namespace {

constexpr double kLowest = -0.2;  ///< height of the lowest source, as the sine of its elevation
constexpr std::array<double, 3> kShares{0.3, 0.5, 0.7};  ///< of the light that the source has
/// Enough that the mean over elevations, polynomials of degree 6, is exact by Gauss's rule, and
/// that over turns, trigonometric ones of degree 6, by even steps.
constexpr std::array<double, 4> kNodes{-0.861136311594053, -0.339981043584856, 0.339981043584856,
                                       0.861136311594053};
constexpr std::array<double, 4> kWeights{0.347854845137454, 0.652145154862546, 0.652145154862546,
                                         0.347854845137454};
constexpr int kTurns = 8;

double window(int n) { return (1 + std::cos(std::numbers::pi * decoders::band_of(n) / 5)) / 2; }

}  // namespace

std::vector<double> light_metric(int order) {
  const auto count = static_cast<std::size_t>(decoders::coefficient_count(order));
  std::vector<double> metric(count * count), y(count), light(count);
  const double even = std::sqrt(4 * std::numbers::pi);
  for (std::size_t node = 0; node < kNodes.size(); ++node) {
    const double height = kLowest + (1 - kLowest) * (kNodes[node] + 1) / 2;
    const double radius = std::sqrt(1 - height * height);
    for (int turn = 0; turn < kTurns; ++turn) {
      const double phi = 2 * std::numbers::pi * turn / kTurns;
      decoders::evaluate_sh(order,
                            glm::dvec3(radius * std::cos(phi), height, radius * std::sin(phi)), y);
      for (const double share : kShares) {
        for (std::size_t n = 0; n < count; ++n) {
          light[n] = window(static_cast<int>(n)) *
                     ((n == 0 ? (1 - share) * even : 0) + share * 4 * std::numbers::pi * y[n]);
        }
        const double weight = kWeights[node] / 2 / kTurns / static_cast<double>(kShares.size());
        for (std::size_t i = 0; i < count * count; ++i)
          metric[i] += weight * light[i / count] * light[i % count];
      }
    }
  }
  return metric;
}

}  // namespace relit::bake
