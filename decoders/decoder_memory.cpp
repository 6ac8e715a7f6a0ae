// SPDX-License-Identifier: MIT
#include "decoders/decoder_memory.hpp"

namespace relit::decoders {

DecoderMemory decoder_memory(const VideoFormat& format, int pictures, int threads) {
  DecoderMemory memory;
  memory.picture_bytes =
      picture_bytes(format.width, format.height, format.chroma, format.bit_depth);
  memory.context_bytes = static_cast<std::uint64_t>(pictures + threads);
  return memory;
}

}  // namespace relit::decoders
