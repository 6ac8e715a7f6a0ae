// SPDX-License-Identifier: MIT
#include "decoders/sh.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <utility>

#include "decoders/sh_constants.hpp"

namespace relit::decoders {
namespace {

template <class T>
void evaluate(int order, T x, T y, T z, std::span<T> out) {
  assert(order >= 0 && order <= 3);
  assert(out.size() >= static_cast<std::size_t>(coefficient_count(order)));
  out[0] = T(kBand0);
  if (order < 1) return;
  out[1] = T(kBand1) * y;
  out[2] = T(kBand1) * z;
  out[3] = T(kBand1) * x;
  if (order < 2) return;
  const T xx = x * x, yy = y * y, zz = z * z;
  out[4] = T(kBand2Xy) * x * y;
  out[5] = T(kBand2Xy) * y * z;
  out[6] = T(kBand2Zz) * (3 * zz - 1);
  out[7] = T(kBand2Xy) * x * z;
  out[8] = T(kBand2Xy / 2) * (xx - yy);
  if (order < 3) return;
  out[9] = T(kBand3M3) * y * (3 * xx - yy);
  out[10] = T(kBand3M2) * x * y * z;
  out[11] = T(kBand3M1) * y * (5 * zz - 1);
  out[12] = T(kBand3M0) * z * (5 * zz - 3);
  out[13] = T(kBand3M1) * x * (5 * zz - 1);
  out[14] = T(kBand3M2 / 2) * z * (xx - yy);
  out[15] = T(kBand3M3) * x * (xx - 3 * yy);
}

/// (a, b) := (ca·a + cb·b, cb·a − ca·b).
void reflect(std::array<double, 3>& a, std::array<double, 3>& b, double ca, double cb) {
  for (std::size_t c = 0; c < 3; ++c) {
    const double old_a = a[c];
    a[c] = ca * old_a + cb * b[c];
    b[c] = cb * old_a - ca * b[c];
  }
}

}  // namespace

void evaluate_sh(int order, const glm::dvec3& direction, std::span<double> y) {
  evaluate<double>(order, direction.x, direction.y, direction.z, y);
}

void evaluate_sh(int order, const glm::vec3& direction, std::span<float> y) {
  evaluate<float>(order, direction.x, direction.y, direction.z, y);
}

double clamped_cosine(int band) {
  constexpr std::array<double, 4> kCoefficients{std::numbers::pi, 2 * std::numbers::pi / 3,
                                                std::numbers::pi / 4, 0};
  return band >= 0 && band < 4 ? kCoefficients[static_cast<std::size_t>(band)] : 0;
}

int Light::order() const {
  for (int order = 0; order <= 3; ++order) {
    if (sh.size() == static_cast<std::size_t>(coefficient_count(order))) return order;
  }
  return -1;
}

void exchange_y_and_z(Light& light) {
  auto& l = light.sh;
  const int order = light.order();
  if (order >= 1) std::swap(l[1], l[2]);
  if (order >= 2) {
    std::swap(l[4], l[7]);
    reflect(l[6], l[8], -0.5, -std::sqrt(3.0) / 2);
  }
  if (order >= 3) {
    const double p = std::sqrt(10.0) / 4;
    const double q = std::sqrt(6.0) / 4;
    for (std::size_t c = 0; c < 3; ++c) {
      const double l9 = l[9][c], l11 = l[11][c], l12 = l[12][c], l14 = l[14][c];
      l[9][c] = q * l14 - p * l12;
      l[11][c] = -q * l12 - p * l14;
      l[12][c] = -p * l9 - q * l11;
      l[14][c] = q * l9 - p * l11;
    }
    reflect(l[13], l[15], -0.25, -std::sqrt(15.0) / 4);
  }
}

void rotate_light_y(Light& light, double angle_rad) {
  const int order = light.order();
  if (order < 1 || angle_rad == 0) return;  // not turned is the same to the bit
  // The harmonics' polar axis is z. With y and z exchanged the turn is about the polar axis, where
  // it mixes only m and −m, by the angle mφ.
  exchange_y_and_z(light);
  for (int band = 1; band <= order; ++band) {
    for (int m = 1; m <= band; ++m) {
      const double cosine = std::cos(m * angle_rad);
      const double sine = std::sin(m * angle_rad);
      auto& cos_row = light.sh[static_cast<std::size_t>(band * band + band + m)];
      auto& sin_row = light.sh[static_cast<std::size_t>(band * band + band - m)];
      for (std::size_t c = 0; c < 3; ++c) {
        const double a = cos_row[c];
        const double b = sin_row[c];
        cos_row[c] = a * cosine - b * sine;
        sin_row[c] = a * sine + b * cosine;
      }
    }
  }
  exchange_y_and_z(light);
}

void window_light(Light& light) {
  for (std::size_t n = 0; n < light.sh.size(); ++n) {
    const double window = (1 + std::cos(std::numbers::pi * band_of(static_cast<int>(n)) / 5)) / 2;
    for (double& value : light.sh[n]) value *= window;
  }
}

std::array<double, 3> radiance(const Light& light, const glm::dvec3& direction) {
  std::array<double, 16> y{};
  evaluate_sh(3, direction, y);
  std::array<double, 3> sum{};
  for (std::size_t n = 0; n < std::min<std::size_t>(light.sh.size(), y.size()); ++n) {
    for (std::size_t c = 0; c < 3; ++c) sum[c] += light.sh[n][c] * y[n];
  }
  return sum;
}

}  // namespace relit::decoders
