// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "player/measure.hpp"

namespace relit::player {

/// The values of each knob, the base's first.
struct MeasureSweep {
  struct Path {
    CompositePath path = CompositePath::kCpu;
    std::optional<Backend> backend;
  };
  std::vector<std::string> planes;  ///< numbers, "all", or "layers": the end of each layer
  std::vector<Path> paths;
  std::vector<int> threads;
  std::vector<std::uint64_t> every;
  bool product = false;  ///< all combinations; else the base, and each knob by itself
};

/// What the options say; an empty text is a default. Of one file the defaults vary every knob, of
/// several none: then files are what is compared.
struct MeasureSweepText {
  std::string planes, composite, backend, threads, every;
  bool product = false;
};
/// `backends` are those that this machine has. Errors: kInvalid for values that make no sense,
/// naming the option; kEnvironment for a backend that was asked for and is not there.
[[nodiscard]] Result<MeasureSweep> parse_measure_sweep(const MeasureSweepText& text, bool one_file,
                                                       const std::vector<Backend>& backends);

/// The points of a file, the base first, none twice. Errors: kInvalid, with the file, for more
/// planes than it has.
[[nodiscard]] Result<std::vector<MeasureKnobs>> expand_measure_sweep(const MeasureSweep& sweep,
                                                                     const MeasuredFile& file);

}  // namespace relit::player
