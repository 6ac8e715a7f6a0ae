// SPDX-License-Identifier: MIT
#pragma once

/// Elementary functions from additions, multiplications, divisions and square roots alone. The C
/// library's differ in the last bit from machine to machine; what is generated here has to be the
/// same bytes everywhere.
namespace relit::media {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kTau = 2.0 * kPi;
inline constexpr double kDegree = kPi / 180.0;

/// Sine and cosine; error below 1e-14 for |radians| < 1e4.
[[nodiscard]] double exact_sin(double radians);
[[nodiscard]] double exact_cos(double radians);

/// e^x; relative error below 1e-14. Arguments below -700 give 0.
[[nodiscard]] double exact_exp(double x);

/// Natural logarithm of x > 0; error below 1e-14 × max(1, |log x|).
[[nodiscard]] double exact_log(double x);

/// x^y for x >= 0; 0^y is 0.
[[nodiscard]] double exact_pow(double x, double y);

/// The cubic 3t² - 2t³ of t = (x - a)/(b - a), clamped to 0..1.
[[nodiscard]] double smooth_step(double a, double b, double x);

}  // namespace relit::media
