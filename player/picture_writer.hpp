// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "container/base/result.hpp"
#include "container/records.hpp"

namespace relit::player {

/// Writes pictures by the extension of the path: `.png` (one picture, or several when the name
/// holds one
/// `%d` or `%04d`), `.mp4` (H.264, 4:2:0), `.webp` and `.gif` (animated, endless). Files appear
/// under their name when finish() succeeds, and not at all otherwise; the pictures of a numbered
/// sequence appear one by one.
class PictureWriter {
 public:
  struct Options {
    std::filesystem::path path;
    int width = 0;  ///< pixels; .mp4 needs even numbers
    int height = 0;
    container::Rational tick_rate{25, 1};  ///< per second; GIF rounds to 1/100 s
    std::uint64_t pictures = 1;            ///< that will be added
  };

  /// Errors: kInvalid (extension, size, several pictures for one .png), kEnvironment (FFmpeg
  /// without the encoder), kIo.
  static Result<std::unique_ptr<PictureWriter>> create(const Options& options);
  virtual ~PictureWriter() = default;

  /// The next picture, shown for so many ticks: RGBA, 8 bits, sRGB, rows from the top, width ×
  /// height × 4 bytes. Alpha is ignored.
  virtual Status add(std::span<const std::uint8_t> rgba, std::uint32_t ticks = 1) = 0;
  virtual Status finish() = 0;
};

/// The colours of one picture reduced to at most 256 (median cut), for GIF.
struct PalettePicture {
  std::array<std::uint32_t, 256> palette{};  ///< 0xAARRGGBB
  std::span<std::uint8_t> indices;           ///< width × height, written
};
void quantize_to_palette(std::span<const std::uint8_t> rgba, int width, PalettePicture& out);

}  // namespace relit::player
