// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "decoders/video_decoder.hpp"

/// What a track's decoder takes from the heap, before it is opened (design, section 5).
namespace relit::decoders {

struct DecoderMemory {
  /// Opened and in the middle of a stream, without the samples of its pictures: libavcodec's
  /// context, its tables by picture size, and what it keeps beside each picture that it refers to.
  std::uint64_t context_bytes = 0;
  /// How many pictures of picture_buffer_bytes() it holds at once, beside those that were taken
  /// from it.
  std::uint64_t pictures = 0;
};

/// `pictures` is what the file says of the track (LayerRecord::mantissa_pictures); `threads` as
/// VideoDecoder::open()'s, of which each beyond the first has a context and a picture of its own.
/// Upper bounds, fitted to measurements of libavcodec 59 on a 64-bit machine with one and two
/// threads; h264's are within a tenth. Other codecs than VideoDecoder's count as hevc. Never fails.
[[nodiscard]] DecoderMemory decoder_memory(const VideoFormat& format, int pictures, int threads);

}  // namespace relit::decoders
