// SPDX-License-Identifier: MIT
#include "decoders/decoder_memory.hpp"

#include <algorithm>

namespace relit::decoders {
namespace {

using ByteCount = std::uint64_t;

struct PictureSize {
  ByteCount width, height;
  [[nodiscard]] ByteCount area() const { return width * height; }
};

PictureSize size_of(const VideoFormat& format) {
  return {static_cast<ByteCount>(std::max(format.width, 1)),
          static_cast<ByteCount>(std::max(format.height, 1))};
}

/// libavcodec/h264_slice.c: the context with its parameter sets; scratch rows; tables by macroblock
/// of the context (100 bytes) and of every picture (141: motion, reference and quantiser tables).
ByteCount h264(const VideoFormat& format, ByteCount pictures, ByteCount threads) {
  const PictureSize size = size_of(format);
  const ByteCount macroblocks = (size.width / 16 + 2) * (size.height / 16 + 2);
  const ByteCount scratch = 138 * (size.width * (format.bit_depth > 8 ? 2 : 1) + 64);
  const ByteCount fixed = threads == 1 ? 1'330'000 : 1'020'000 + 1'120'000 * threads;
  return fixed + threads * (scratch + 100 * macroblocks) + 141 * macroblocks * pictures;
}

/// 12 bytes of motion for every 4x4 samples of every picture, twice as much in the context.
ByteCount hevc(const VideoFormat& format, ByteCount pictures, ByteCount threads) {
  const ByteCount area = size_of(format).area();
  const ByteCount fixed = threads == 1 ? 850'000 : 820'000 + 800'000 * threads;
  return fixed + threads * area * 17 / 10 + pictures * area * 3 / 4;
}

ByteCount mpeg4(const VideoFormat& format, ByteCount pictures, ByteCount threads) {
  const ByteCount area = size_of(format).area();
  return 96'000 * threads + threads * area * 47 / 10 + pictures * area / 5;
}

/// Contexts of the Rice coder and sample rows for each slice (one in small pictures, else four),
/// and a copy of the packet, which lossless coding makes large.
ByteCount ffv1(const VideoFormat& format, ByteCount threads) {
  const PictureSize size = size_of(format);
  const ByteCount slices = size.width <= 352 && size.height <= 288 ? 1 : 4;
  const ByteCount packet =
      picture_bytes(format.width, format.height, format.chroma, format.bit_depth) / 3;
  return 240'000 + slices * 60'000 + 300 * size.width + threads * packet;
}

ByteCount vp9(const VideoFormat& format, ByteCount pictures, ByteCount threads) {
  const ByteCount area = size_of(format).area();
  return 150'000 * threads + threads * area * 4 / 10 + pictures * area / 6;
}

/// dav1d.
ByteCount av1(const VideoFormat& format, ByteCount threads) {
  return 280'000 + 260'000 * threads + threads * size_of(format).area() * 32 / 10;
}

}  // namespace

DecoderMemory decoder_memory(const VideoFormat& format, int pictures, int threads) {
  const auto t = static_cast<ByteCount>(std::clamp(threads, 1, 64));
  DecoderMemory memory;
  // Frame threads work on a picture each, and one waits to be shown; hevc and ffv1 give a picture
  // out before they drop the one that it replaces.
  const bool late = format.codec == "hevc" || format.codec == "ffv1";
  memory.pictures = static_cast<ByteCount>(std::max(pictures, 1)) + (late ? 1 : 0);
  if (t > 1 && format.codec != "ffv1") memory.pictures += late ? t : t + 1;
  if (format.codec == "h264") {
    memory.context_bytes = h264(format, memory.pictures, t);
  } else if (format.codec == "mpeg4") {
    memory.context_bytes = mpeg4(format, memory.pictures, t);
  } else if (format.codec == "ffv1") {
    memory.context_bytes = ffv1(format, t);
  } else if (format.codec == "vp9") {
    memory.context_bytes = vp9(format, memory.pictures, t);
  } else if (format.codec == "av1") {
    memory.context_bytes = av1(format, t);
  } else {
    memory.context_bytes = hevc(format, memory.pictures, t);
  }
  return memory;
}

}  // namespace relit::decoders
