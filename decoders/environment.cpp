// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "container/base/limits.hpp"
#include "decoders/sh.hpp"

namespace relit::decoders {
namespace {

constexpr std::size_t kWaves = 7;  // 1, cos φ, sin φ, cos 2φ, sin 2φ, cos 3φ, sin 3φ
constexpr std::size_t wave_of(int m) {
  return m == 0 ? 0 : static_cast<std::size_t>(m > 0 ? 2 * m - 1 : -2 * m);
}

/// Neumaier's compensated sum: a sun of 1e9 must not swallow the sky that is added after it.
struct Sum {
  double total = 0;
  double lost = 0;
  void add(double value) {
    const double next = total + value;
    lost += std::abs(total) >= std::abs(value) ? (total - next) + value : (value - next) + total;
    total = next;
  }
  [[nodiscard]] double value() const { return total + lost; }
};

/// Gauss-Legendre on [-1, 1]. Sixteen nodes integrate sin⁴θ over the whole of [0, π], the worst
/// case (an image of one row), to 1e-16.
struct Quadrature {
  static constexpr int kNodes = 16;
  std::array<double, kNodes> node{};
  std::array<double, kNodes> weight{};
};

Quadrature gauss_legendre() {
  Quadrature q;
  constexpr int n = Quadrature::kNodes;
  for (int i = 0; i < n; ++i) {
    double x = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5));
    double slope = 1;
    for (int step = 0; step < 8; ++step) {  // Newton from this start has converged after 4
      double p0 = 1, p1 = x;
      for (int k = 2; k <= n; ++k) {
        const double p2 = ((2 * k - 1) * x * p1 - (k - 1) * p0) / k;
        p0 = p1;
        p1 = p2;
      }
      slope = n * (x * p1 - p0) / (x * x - 1);
      x -= p1 / slope;
    }
    q.node[static_cast<std::size_t>(i)] = x;
    q.weight[static_cast<std::size_t>(i)] = 2 / ((1 - x * x) * slope * slope);
  }
  return q;
}

/// ∫ of every wave over the φ interval of every column, [column][wave].
std::vector<std::array<double, kWaves>> column_integrals(int width) {
  std::vector<std::array<double, kWaves>> columns(static_cast<std::size_t>(width));
  const double dphi = 2 * std::numbers::pi / width;
  for (int x = 0; x < width; ++x) {
    auto& column = columns[static_cast<std::size_t>(x)];
    const double phi = dphi * (x + 0.5);
    column[0] = dphi;
    for (int m = 1; m <= 3; ++m) {
      const double chord = 2 * std::sin(m * dphi / 2) / m;  // ∫cos mφ = chord · cos(m·centre)
      column[wave_of(m)] = chord * std::cos(m * phi);
      column[wave_of(-m)] = chord * std::sin(m * phi);
    }
  }
  return columns;
}

/// ∫ Θ_n(θ) sin θ dθ over row y, where about the pole Y_n = Θ_n(θ) · wave(φ); at φ = 0 the waves of
/// m ≥ 0 are 1, so that Θ is Y there, and Θ_{l,-m} = Θ_{l,m}.
std::array<double, 16> row_integrals(int y, int height, const Quadrature& quadrature) {
  std::array<double, 16> row{};
  std::array<double, 16> at{};
  const double half = std::numbers::pi / (2.0 * height);
  for (std::size_t i = 0; i < Quadrature::kNodes; ++i) {
    const double theta = half * (2 * y + 1 + quadrature.node[i]);
    evaluate_sh(3, glm::dvec3(std::sin(theta), 0, std::cos(theta)), at);
    const double weight = quadrature.weight[i] * half * std::sin(theta);
    for (int band = 0; band <= 3; ++band) {
      for (int m = -band; m <= band; ++m) {
        const auto n = static_cast<std::size_t>(band * band + band + m);
        row[n] += weight * at[static_cast<std::size_t>(band * band + band + std::abs(m))];
      }
    }
  }
  return row;
}

using RowWaves = std::array<std::array<double, 3>, kWaves>;

/// Σ over the row of pixel × column integral. Short runs are summed plainly, runs with
/// compensation.
RowWaves sum_row(const float* pixels, std::span<const std::array<double, kWaves>> columns) {
  constexpr std::size_t kRun = 32;
  std::array<std::array<Sum, 3>, kWaves> sums{};
  for (std::size_t begin = 0; begin < columns.size(); begin += kRun) {
    RowWaves run{};
    const std::size_t end = std::min(begin + kRun, columns.size());
    for (std::size_t x = begin; x < end; ++x) {
      for (std::size_t w = 0; w < kWaves; ++w) {
        for (std::size_t c = 0; c < 3; ++c) {
          run[w][c] += columns[x][w] * static_cast<double>(pixels[3 * x + c]);
        }
      }
    }
    for (std::size_t w = 0; w < kWaves; ++w) {
      for (std::size_t c = 0; c < 3; ++c) sums[w][c].add(run[w][c]);
    }
  }
  RowWaves row{};
  for (std::size_t w = 0; w < kWaves; ++w) {
    for (std::size_t c = 0; c < 3; ++c) row[w][c] = sums[w][c].value();
  }
  return row;
}

Status check(const Environment& environment, int order) {
  if (order < 0 || order > 3) {
    return fail(ErrorCode::kInvalid,
                "the order of a light must be 0 to 3, not " + std::to_string(order));
  }
  const auto [width, height] = std::pair{environment.width, environment.height};
  const std::string size = std::to_string(width) + "x" + std::to_string(height);
  if (width < 1 || height < 1) {
    return fail(ErrorCode::kInvalid, "an environment of " + size + " pixels has no area");
  }
  constexpr auto kSide = static_cast<int>(limits::kImageSide);
  if (width > kSide || height > kSide) {
    return fail(ErrorCode::kLimit, "an environment of " + size + " pixels is larger than " +
                                       std::to_string(kSide) + " on a side");
  }
  if (environment.rgb.size() !=
      std::size_t{3} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    return fail(ErrorCode::kInvalid, "an environment of " + size +
                                         " pixels needs 3 values each, not " +
                                         std::to_string(environment.rgb.size()) + " in all");
  }
  for (std::size_t i = 0; i < environment.rgb.size(); ++i) {
    const float value = environment.rgb[i];
    if (std::isfinite(value) && value >= 0) continue;
    constexpr std::array<const char*, 3> kChannels{"red", "green", "blue"};
    const std::size_t pixel = i / 3;
    const auto columns = static_cast<std::size_t>(width);
    return fail(ErrorCode::kInvalid, "pixel (" + std::to_string(pixel % columns) + ", " +
                                         std::to_string(pixel / columns) +
                                         ") of the environment has " + kChannels[i % 3] + " " +
                                         std::to_string(value) +
                                         "; radiance must be finite and not negative");
  }
  return {};
}

}  // namespace

Result<Light> project_environment(const Environment& environment, int order) {
  RELIT_TRY(check(environment, order));
  const Quadrature quadrature = gauss_legendre();
  const auto columns = column_integrals(environment.width);
  const auto count = static_cast<std::size_t>(coefficient_count(order));
  std::array<std::array<Sum, 3>, 16> sums{};
  for (int y = 0; y < environment.height; ++y) {
    const float* pixels =
        environment.rgb.data() + std::size_t{3} * columns.size() * static_cast<std::size_t>(y);
    const RowWaves waves = sum_row(pixels, columns);
    const auto row = row_integrals(y, environment.height, quadrature);
    for (std::size_t n = 0; n < count; ++n) {
      const int band = band_of(static_cast<int>(n));
      const std::size_t wave = wave_of(static_cast<int>(n) - band * band - band);
      for (std::size_t c = 0; c < 3; ++c) sums[n][c].add(row[n] * waves[wave][c]);
    }
  }
  Light light;
  light.sh.resize(count);
  for (std::size_t n = 0; n < count; ++n) {
    for (std::size_t c = 0; c < 3; ++c) light.sh[n][c] = sums[n][c].value();
  }
  // So far the pole was the picture's, +Y; that of the harmonics is z.
  exchange_y_and_z(light);
  return light;
}

}  // namespace relit::decoders
