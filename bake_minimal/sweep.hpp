// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "bake_minimal/coding_options.hpp"
#include "container/base/result.hpp"

namespace relit::bake {

/// One way to code a clip, and the name that tells it from the others: "crf18", "hevc-crf18".
struct CodingVariant {
  std::string name;
  CodingOptions coding;
};

/// All combinations of a sweep such as "codec=h264,hevc crf=12,18,24", each over `base`; the last
/// knob varies fastest. Knobs: codec, crf, planes, principal-count, prediction (on, off),
/// bit-depth, chroma, exponent-block, exponent-hold, frame-step, layout, encoder-preset. Errors:
/// kInvalid for a knob or a value that does not exist, for a combination that resolve() refuses,
/// naming it, and for more than 1000 of them.
[[nodiscard]] Result<std::vector<CodingVariant>> expand_sweep(std::string_view text,
                                                              const CodingOptions& base);

}  // namespace relit::bake
