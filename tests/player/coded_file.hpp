// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

/// A small file that plays: a quad of one rigged mesh that moves, a texture, and an order-0 model
/// whose plane is coded by an encoder that every libavcodec has.
namespace relit::player::test {

struct CodedFile {
  std::string codec = "ffv1";  ///< or "mpeg4": 16×16 light maps
  bool exponents = true;
  bool copies = true;
  bool uneven = false;  ///< frames of 1 and 2 ticks in turn
};

inline constexpr std::uint32_t kCodedFrames = 4;  ///< in segments of two

/// The same bytes for the same arguments. Throws std::runtime_error where an encoder is missing.
std::vector<std::uint8_t> coded_file(const CodedFile& how = {});

}  // namespace relit::player::test
