// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "container/base/result.hpp"

/// The forms of codec_private and of packets (FORMAT.md, section 3.4): what encoders give -> what
/// is stored, and whether what is stored has that form. Codecs without rules of their own pass.
namespace relit::decoders {

using Bytes = std::vector<std::uint8_t>;

/// An encoder's extradata -> codec_private: parameter sets with start codes become an
/// AVCDecoderConfigurationRecord (h264) or HEVCDecoderConfigurationRecord (hevc), a sequence header
/// OBU an AV1CodecConfigurationRecord (av1), vp9's becomes empty, everything else is copied. What
/// has the stored form already is copied too, but for hevc, whose record is made anew, so that
/// array_completeness is 1. Errors: kCorrupt when `extradata` has neither form.
[[nodiscard]] Result<Bytes> stored_private(std::string_view codec,
                                           std::span<const std::uint8_t> extradata);

/// An encoder's packet -> a stored one. h264, hevc: NAL units after start codes of 3 or 4 bytes get
/// a length of 4 bytes instead; parameter sets, delimiters, supplemental information and filler are
/// left out. av1: temporal delimiters are left out, every other OBU gets its size. Errors: kCorrupt
/// for an empty packet, and where there are no units, or nothing of a picture among them.
[[nodiscard]] Result<Bytes> stored_packet(std::string_view codec,
                                          std::span<const std::uint8_t> packet);

/// Whether a decoder may be opened with these bytes. Errors: kCorrupt, saying what is wrong.
[[nodiscard]] Status check_private(std::string_view codec,
                                   std::span<const std::uint8_t> codec_private);

/// Whether a stored packet is made of whole units, none of which may not be there. Parameter sets
/// inside the packets could change a stream under way. Errors: kCorrupt.
[[nodiscard]] Status check_packet(std::string_view codec, std::span<const std::uint8_t> packet);

/// Pictures that a decoder holds at once (LayerRecord::mantissa_pictures), from codec_private where
/// it says so: h264 and hevc. Otherwise what the codec allows: mpeg4 3, ffv1 1, vp9 and av1 9.
/// Errors: kCorrupt; kUnsupported for other codecs.
[[nodiscard]] Result<std::uint8_t> decoder_pictures(std::string_view codec,
                                                    std::span<const std::uint8_t> codec_private);

}  // namespace relit::decoders
