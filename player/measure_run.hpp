// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "player/measure.hpp"
#include "player/measure_point.hpp"
#include "player/measure_sweep.hpp"

namespace relit::player {

/// What `relit measure` was asked for.
struct MeasureRun {
  std::vector<std::string> files;
  std::string reference;  ///< .npy or .relit; empty: the first file
  std::string clip;
  std::vector<std::string> lights;  ///< files; empty: the standard lights
  std::uint64_t frames = 16;        ///< that are scored; 0: all
  MeasureSweepText sweep;
  MeasureOptions meter;
  bool pictures = false;
  int picture_frame = -1;                                  ///< -1: one third into the clip
  std::function<void(const std::string&)> progress, warn;  ///< take a line
};

/// Measures all points of all files. Errors, each naming the file: what a file or the reference is
/// lacking; kInvalid and kEnvironment for knobs that make no sense here. A point that fails by
/// itself is no error, see MeasuredPoint::failure.
[[nodiscard]] Result<MeasureReport> measure(const MeasureRun& run);

}  // namespace relit::player
