// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "container/base/result.hpp"

/// What the sequence headers of H.264, HEVC and AV1 say that the container has to repeat: sample
/// format, profile, and how many pictures a decoder holds.
namespace relit::decoders {

struct SequenceHeader {
  std::uint8_t chroma_format = 1;  ///< chroma_format_idc: 0 luma, 1 4:2:0, 2 4:2:2, 3 4:4:4
  std::uint8_t luma_bits = 8;
  std::uint8_t chroma_bits = 8;
  /// Decoded pictures held at once, the one being decoded included: 1 to 17.
  std::uint8_t pictures = 1;
  /// HEVC: the 12 bytes from general_profile_space to general_level_idc.
  std::array<std::uint8_t, 12> profile_tier_level{};
  std::uint8_t temporal_layers = 1;  ///< HEVC: 1 to 7
  bool temporal_nesting = true;      ///< HEVC
};

/// ISO/IEC 14496-10, 7.3.2.1.1 and E.1.1. `unit` is the NAL unit with its one-byte header, as it
/// stands in the stream. Errors: kCorrupt.
[[nodiscard]] Result<SequenceHeader> parse_h264_sps(std::span<const std::uint8_t> unit);

/// ISO/IEC 23008-2, 7.3.2.2.1, as far as the sizes of the picture buffer; two-byte NAL header.
/// Errors: kCorrupt.
[[nodiscard]] Result<SequenceHeader> parse_hevc_sps(std::span<const std::uint8_t> unit);

/// AV1 specification, 5.5: the payload of a sequence header OBU -> the first four bytes of an
/// AV1CodecConfigurationRecord. Errors: kCorrupt.
[[nodiscard]] Result<std::array<std::uint8_t, 4>> av1_configuration(
    std::span<const std::uint8_t> payload);

}  // namespace relit::decoders
