// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>

#include "container/base/limits.hpp"
#include "player/light_file.hpp"

#define STBI_ONLY_HDR
#define STBI_NO_STDIO
#define STBI_MAX_DIMENSIONS 16384
#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#include <stb_image.h>

namespace relit::player {
namespace {

static_assert(STBI_MAX_DIMENSIONS == limits::kImageSide);

/// Feeds stb_image and remembers whether it wanted more than there is. The decoder does not check
/// for the end inside a run-length coded row, where zeros would keep it waiting for ever: after the
/// end it gets 0xFF, runs that no row has room for, and then the end.
struct Source {
  std::span<const std::uint8_t> bytes;
  std::size_t position = 0;
  std::size_t padding_left = 8 * STBI_MAX_DIMENSIONS;
  bool exhausted = false;

  static int read(void* user, char* data, int size) {
    Source& source = *static_cast<Source*>(user);
    const auto wanted = static_cast<std::size_t>(size);
    const std::size_t left = source.bytes.size() - source.position;
    if (left > 0) {
      const std::size_t count = std::min(wanted, left);
      std::memcpy(data, source.bytes.data() + source.position, count);
      source.position += count;
      // Only the refilling of its buffer may end short; else it wants what it asks for.
      if (count < wanted && wanted != sizeof(stbi__context::buffer_start)) source.exhausted = true;
      return static_cast<int>(count);
    }
    source.exhausted = true;
    const std::size_t count = std::min(wanted, source.padding_left);
    std::memset(data, 0xFF, count);
    source.padding_left -= count;
    return static_cast<int>(count);
  }
  static void skip(void*, int) {}  // only other formats skip
  static int eof(void* user) {
    const Source& source = *static_cast<Source*>(user);
    return source.position == source.bytes.size() ? 1 : 0;
  }
};

struct FreeImage {
  void operator()(float* image) const { stbi_image_free(image); }
};

std::string reason() {
  const char* text = stbi_failure_reason();
  return text != nullptr ? text : "unknown reason";
}

/// The least bytes that rows of this width take: flat, or four channels of runs of 127.
std::int64_t least_row_bytes(std::int64_t width) {
  const std::int64_t flat = 4 * width;
  if (width < 8 || width >= 32768) return flat;
  return std::min(flat, 4 + 4 * 2 * ((width + 126) / 127));
}

/// RGBE writers cut off, so a byte b stands for b to b + 1 steps, and Radiance reads it as b + ½;
/// stb_image gives b. The step shows in the largest channel, whose byte is 128 to 255.
void centre_steps(std::span<float> rgb) {
  for (std::size_t i = 0; i + 2 < rgb.size(); i += 3) {
    const float largest = std::max({rgb[i], rgb[i + 1], rgb[i + 2]});
    if (!(largest > 0)) continue;
    const float half = std::ldexp(0.5f, std::ilogb(largest) - 7);
    for (std::size_t c = 0; c < 3; ++c) rgb[i + c] += half;
  }
}

}  // namespace

bool is_hdr(std::span<const std::uint8_t> bytes) {
  return bytes.size() >= 2 && bytes[0] == '#' && bytes[1] == '?';
}

Result<decoders::Environment> read_hdr(std::span<const std::uint8_t> bytes) {
  int width = 0, height = 0, channels = 0;
  if (stbi_info_from_memory(bytes.data(), static_cast<int>(bytes.size()), &width, &height,
                            &channels) == 0) {
    return fail(ErrorCode::kCorrupt,
                "no Radiance header of the form \"#?RADIANCE\", \"FORMAT=32-bit_rle_rgbe\", "
                "\"-Y height +X width\" (" +
                    reason() + ")");
  }
  RELIT_TRY(check_picture_size(width, height));
  const std::int64_t least = least_row_bytes(width) * height;
  if (static_cast<std::int64_t>(bytes.size()) < least) {
    return fail(ErrorCode::kTruncated, "a picture of " + std::to_string(width) + "x" +
                                           std::to_string(height) + " takes at least " +
                                           std::to_string(least) + " bytes; the file has " +
                                           std::to_string(bytes.size()));
  }
  Source source{bytes};
  const stbi_io_callbacks callbacks{Source::read, Source::skip, Source::eof};
  const std::unique_ptr<float, FreeImage> pixels(
      stbi_loadf_from_callbacks(&callbacks, &source, &width, &height, &channels, 3));
  if (source.exhausted) {
    return fail(ErrorCode::kTruncated, "the picture of " + std::to_string(width) + "x" +
                                           std::to_string(height) + " pixels ends early, after " +
                                           std::to_string(bytes.size()) + " bytes");
  }
  if (!pixels) return fail(ErrorCode::kCorrupt, "the Radiance picture is damaged: " + reason());
  decoders::Environment environment{width, height, {}};
  const auto count =
      std::size_t{3} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  environment.rgb.assign(pixels.get(), pixels.get() + count);
  centre_steps(environment.rgb);
  return environment;
}

}  // namespace relit::player
