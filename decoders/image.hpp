// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "container/base/result.hpp"

namespace relit::decoders {

/// A picture of 8 bits a channel, straight alpha, row 0 on top.
struct DecodedImage {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgba;  ///< height × width × 4
};

/// What the first bytes say: "image/png", "image/jpeg", or the type of a picture that
/// decode_image() does not take ("image/webp", "image/ktx2", "image/gif", "image/bmp",
/// "image/vnd-ms.dds"); empty: unknown.
[[nodiscard]] std::string_view image_media_type(std::span<const std::uint8_t> bytes);

struct ImageSize {
  int width = 0;
  int height = 0;
};

/// The size of a PNG or a JPEG, by its headers alone: nothing is decoded or allocated. Errors: as
/// decode_image()'s.
[[nodiscard]] Result<ImageSize> image_size(std::span<const std::uint8_t> bytes);

/// Decodes a PNG (any colour type and depth; 16 bits become 8) or a JPEG (baseline or progressive,
/// grey or YCbCr). `media_type` is what the container of the bytes claims ("image/png",
/// "image/jpeg" or empty); the bytes themselves decide. Colour profiles, gamma chunks and
/// orientation are ignored, as glTF asks. The same bytes give the same texels on every machine.
/// Errors: kUnsupported for other types, kLimit beyond limits::kImageSide or kImageTexels (before
/// anything of that size is allocated), kTruncated and kCorrupt for damaged pictures, kOutOfMemory.
/// Any thread.
[[nodiscard]] Result<DecodedImage> decode_image(std::span<const std::uint8_t> bytes,
                                                std::string_view media_type);

}  // namespace relit::decoders
