// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>
#include <string>

#include "container/base/result.hpp"

namespace relit::player {

/// Where planes and light are added up.
enum class CompositePath {
  kAuto,     ///< whichever was measured cheapest
  kCpu,      ///< on the CPU: a small light map is uploaded
  kTexture,  ///< on the GPU, texel by texel of the light map: planes are uploaded
  kFused,    ///< in the shader that draws the meshes, where they are seen: likewise
};
constexpr int kCompositePaths = 4;

/// "auto", "cpu", "texture" or "fused". Errors: kInvalid.
[[nodiscard]] Result<CompositePath> parse_composite_path(const std::string& name);
[[nodiscard]] const char* composite_path_name(CompositePath path);

/// Decides which path runs. Knows neither GL nor clocks: what is measured comes in as numbers, so
/// that the same numbers give the same decisions.
class PathChooser {
 public:
  /// By CompositePath: whether it can run here; kCpu always can. Begins with kTexture, kCpu without
  /// it.
  explicit PathChooser(std::array<bool, kCompositePaths> available = {});

  /// Whether it is time to measure: never where there is no choice; else when nothing was measured
  /// yet, or the character covers at least twice or at most half of the pixels that it covered when
  /// it was, for kSettleViews calls in a row, so that a zoom is measured when it has come to rest.
  /// Once a picture. `covered_pixels` not above 0 or not finite: no.
  bool wants_measuring(double covered_pixels);
  static constexpr int kSettleViews = 20;
  static constexpr double kOtherCoverage = 2;

  /// The cost of one frame by each path, in seconds, measured together; not above 0 or not finite:
  /// not measured. The path changes only to one that takes less than kClearlyCheaper of the time
  /// that the present one takes; the first measurement takes the cheapest.
  void take(const std::array<double, kCompositePaths>& cost_s);
  static constexpr double kClearlyCheaper = 0.85;

  /// Never kAuto.
  [[nodiscard]] CompositePath path() const { return path_; }
  /// Such as "fused: measured cpu 2.00 ms, texture 3.40 ms, fused 1.20 ms a frame, at 5000 covered
  /// pixels".
  [[nodiscard]] std::string why() const;
  [[nodiscard]] bool available(CompositePath path) const {
    return available_[static_cast<std::size_t>(path)];
  }

 private:
  std::array<bool, kCompositePaths> available_;
  std::array<double, kCompositePaths> cost_s_{};
  CompositePath path_;
  double covered_pixels_ = 0;   ///< of the last call
  double measured_pixels_ = 0;  ///< when it was measured
  int settled_ = 0;             ///< calls in a row with another coverage
  bool measured_ = false;
  bool kept_ = false;  ///< the last measurement found a cheaper one, but not clearly
};

}  // namespace relit::player
