// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <nlohmann/json.hpp>

#include "container/base/result.hpp"
#include "container/byte_source.hpp"

namespace relit::conformance {

/// What a player sees of a file, as tests/conformance/README.md describes under "frames": the
/// samples of every plane as CRC-32, coefficients at probe texels, posed vertices. What damage took
/// is null. Errors: those of opening the file and its decoders.
Result<nlohmann::ordered_json> decode_frames(std::unique_ptr<container::ByteSource> source);

}  // namespace relit::conformance
