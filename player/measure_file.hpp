// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "player/measure.hpp"
#include "player/memory_plan.hpp"

namespace relit::player {

/// What a file says of itself, from its records alone. Errors, with the path: those of
/// survey_file(); kNotFound for a clip that is not there, kUnsupported for one without a model.
[[nodiscard]] Result<MeasuredFile> read_measured_file(const std::string& path,
                                                      const std::string& clip);

/// What playing it so takes, by the account of `relit plan`: no budget, a picture of
/// `picture_side`² pixels with one sample, or without GL what `relit plan --headless` tells.
/// Errors: those of plan_memory().
[[nodiscard]] Result<MemoryPlan> plan_for_point(const MeasuredFile& file, const MeasureKnobs& knobs,
                                                int picture_side);

/// The time that decoding takes for each tick of the clip, milliseconds: the whole clip through a
/// Prefetcher, as fast as it goes, `repeats` times; the median. Errors: those of Prefetcher.
[[nodiscard]] Result<double> time_decoding(const MeasuredFile& file, const MeasureKnobs& knobs,
                                           int repeats);

}  // namespace relit::player
