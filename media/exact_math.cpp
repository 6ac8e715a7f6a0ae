// SPDX-License-Identifier: MIT
#include "media/exact_math.hpp"

#include <algorithm>
#include <cmath>

namespace relit::media {
namespace {

constexpr double kHalfPiHigh = 1.57079632673412561417e+00;  // the first 33 bits of pi/2
constexpr double kHalfPiLow = 6.07710050650619224932e-11;
constexpr double kLn2High = 6.93147180369123816490e-01;
constexpr double kLn2Low = 1.90821492927058770002e-10;

// Taylor series on |x| <= pi/4, where the first term left out is below 1e-17.
double sin_series(double x) {
  const double x2 = x * x;
  double sum = 0.0;
  for (int n = 17; n >= 3; n -= 2) sum = (1.0 + sum) * -x2 / static_cast<double>(n * (n - 1));
  return x * (1.0 + sum);
}

double cos_series(double x) {
  const double x2 = x * x;
  double sum = 0.0;
  for (int n = 18; n >= 2; n -= 2) sum = (1.0 + sum) * -x2 / static_cast<double>(n * (n - 1));
  return 1.0 + sum;
}

double sin_quadrant(double x, int shift) {
  const double turns = std::floor(x / (0.5 * kPi) + 0.5);
  const double rest = (x - turns * kHalfPiHigh) - turns * kHalfPiLow;
  const int quadrant = static_cast<int>(turns - 4.0 * std::floor(turns / 4.0)) + shift;
  const double value = (quadrant & 1) != 0 ? cos_series(rest) : sin_series(rest);
  return (quadrant & 2) != 0 ? -value : value;
}

}  // namespace

double exact_sin(double radians) { return sin_quadrant(radians, 0); }

double exact_cos(double radians) { return sin_quadrant(radians, 1); }

double exact_exp(double x) {
  if (x < -700.0) return 0.0;
  const double power = std::floor(x / (kLn2High + kLn2Low) + 0.5);
  const double rest = (x - power * kLn2High) - power * kLn2Low;
  double sum = 1.0;
  for (int n = 16; n >= 1; --n) sum = 1.0 + sum * rest / static_cast<double>(n);
  return std::ldexp(sum, static_cast<int>(power));
}

double exact_log(double x) {
  int exponent = 0;
  double mantissa = std::frexp(x, &exponent);
  if (mantissa < 0.70710678118654752440) {
    mantissa *= 2.0;
    --exponent;
  }
  const double s = (mantissa - 1.0) / (mantissa + 1.0);
  const double s2 = s * s;
  double sum = 0.0;
  for (int n = 23; n >= 1; n -= 2) sum = 1.0 / static_cast<double>(n) + sum * s2;
  return 2.0 * s * sum + static_cast<double>(exponent) * (kLn2High + kLn2Low);
}

double exact_pow(double x, double y) { return x <= 0.0 ? 0.0 : exact_exp(y * exact_log(x)); }

double smooth_step(double a, double b, double x) {
  const double t = std::clamp((x - a) / (b - a), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace relit::media
