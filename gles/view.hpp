// SPDX-License-Identifier: MIT
#pragma once

#include <glm/glm.hpp>

namespace relit::gles {

/// From exposed radiance to display values, before the sRGB curve.
enum class ToneMap {
  kLinear = 0,   ///< clamped at 1
  kFilmic = 1,   ///< Narkowicz's fit to ACES (2015): contrast, soft highlights
  kNeutral = 2,  ///< Khronos PBR Neutral: albedo colours stay, only highlights are compressed
};

/// One picture's camera and film.
struct View {
  glm::mat4 view{1.0f};        ///< model space to camera space: right-handed, looking along -z
  glm::mat4 projection{1.0f};  ///< to clip space with -w <= z <= w
  float exposure = 1;          ///< display value = tone map(radiance × exposure); finite, >= 0
  ToneMap tone_map = ToneMap::kLinear;
  int x = 0, y = 0;           ///< lower left corner in the framebuffer, pixels
  int width = 0, height = 0;  ///< pixels
};

}  // namespace relit::gles
