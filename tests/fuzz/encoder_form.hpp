// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "tests/fuzz/fuzz.hpp"

/// What the container stores, in the form in which encoders give it: parameter sets and units
/// behind start codes, OBUs with temporal delimiters. Other codecs' bytes stay as they are.
namespace relit::fuzz {

Bytes encoder_private(std::string_view codec, Input stored);
Bytes encoder_packet(std::string_view codec, Input stored);

}  // namespace relit::fuzz
