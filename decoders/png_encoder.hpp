// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "container/base/result.hpp"

namespace relit::decoders {

/// Encodes [height][width][4] bytes, straight alpha, as a PNG; without an alpha channel where all
/// alphas are 255. Deterministic. Errors: kInvalid for sizes that do not fit, kEnvironment without
/// an encoder.
[[nodiscard]] Result<std::vector<std::uint8_t>> encode_png(int width, int height,
                                                           std::span<const std::uint8_t> rgba);

}  // namespace relit::decoders
