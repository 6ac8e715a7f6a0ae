// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace relit::gles {

/// 8-bit RGBA texels, sRGB colour and linear straight alpha, row 0 is v = 0 (a picture's top).
struct ImageView {
  int width = 0;
  int height = 0;
  std::span<const std::uint8_t> rgba;  ///< height × width × 4
};

/// Resamples to width × height: each texel is the mean of the area it covers where the picture
/// shrinks, a linear interpolation where it grows; averages are taken in linear light, weighted by
/// nothing else. `smooth` false takes the nearest texel. Neighbours beyond an edge are the edge's,
/// or those of the other side where it `wraps`. Sizes > 0, the view complete.
struct ResampleOptions {
  int width = 0;
  int height = 0;
  bool smooth = true;
  bool wrap_x = false;
  bool wrap_y = false;
};
[[nodiscard]] std::vector<std::uint8_t> resample(const ImageView& image,
                                                 const ResampleOptions& options);

/// The least power of two that is not below `size`, which is 1 to 2^30.
[[nodiscard]] int power_of_two_above(int size);

}  // namespace relit::gles
