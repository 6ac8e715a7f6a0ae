// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include "tests/test.hpp"

/// The table of README.md, printed and held to by the tests themselves.
namespace relit::test {

/// Of many observations with a bound each, the one that comes closest to its own or goes beyond.
class Worst {
 public:
  void add(double error, double bound) {
    const double ratio = ratio_of(error, bound);
    if (ratio <= ratio_) return;
    ratio_ = ratio, error_ = error, bound_ = bound;
  }
  [[nodiscard]] double error() const { return error_; }
  [[nodiscard]] double bound() const { return bound_; }
  /// Nothing observed is nothing proven.
  [[nodiscard]] bool holds() const { return ratio_ >= 0 && ratio_ <= 1; }

 private:
  static double ratio_of(double error, double bound) {
    if (!(error >= 0)) return std::numeric_limits<double>::infinity();  // NaN, too
    if (error == 0) return 0;
    return bound > 0 ? error / bound : std::numeric_limits<double>::infinity();
  }
  double ratio_ = -1, error_ = 0, bound_ = 0;
};

/// Prints `| case | expected | observed |`, the bound after where it comes from.
inline void hold(const std::string& name, const std::string& why, const Worst& worst) {
  std::printf("| %s | %s: %.3g | %.3g |\n", name.c_str(), why.c_str(), worst.bound(),
              worst.error());
  INFO(name);
  CAPTURE(worst.error(), worst.bound());
  CHECK(worst.holds());
}

/// The same of what has to be exact: how many were wrong.
inline void hold_exact(const std::string& name, const std::string& why, long wrong) {
  std::printf("| %s | %s: 0 | %ld |\n", name.c_str(), why.c_str(), wrong);
  INFO(name);
  CHECK(wrong == 0);
}

}  // namespace relit::test
