// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include "container/records.hpp"

/// What texels mean, for those who read them outside a GPU.
namespace relit::bake {

/// The transfer curve of IEC 61966-2-1, values in [0,1].
inline double srgb_to_linear(double v) {
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}
inline double linear_to_srgb(double v) {
  return v <= 0.0031308 ? v * 12.92 : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055;
}

/// The texel in [0, size) that stands for texel `i` of an image continued by `wrap`.
inline int wrapped(int i, int size, container::Wrap wrap) {
  switch (wrap) {
    case container::Wrap::kRepeat:
      return ((i % size) + size) % size;
    case container::Wrap::kMirror: {
      const int j = ((i % (2 * size)) + 2 * size) % (2 * size);
      return j < size ? j : 2 * size - 1 - j;
    }
    case container::Wrap::kClamp:
      break;
  }
  return std::clamp(i, 0, size - 1);
}

}  // namespace relit::bake
