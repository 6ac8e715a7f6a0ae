// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace relit::gles {

/// A picture of the light in all directions, or its spherical harmonics. Model space, +Y up.
struct EnvironmentView {
  /// Equirectangular linear radiance, height × width × 3; row 0 is +Y, pixel (x, y) is the
  /// direction (sin θ cos φ, cos θ, sin θ sin φ), θ = π(y+½)/height, φ = 2π(x+½)/width.
  int width = 0;
  int height = 0;
  std::span<const float> rgb;
};

/// A cube map, made face by face so that one at a time need be in memory. Texel i of a face lies at
/// 2i/(side-1) - 1, so that neighbouring faces hold the same values on the edge they share and
/// filtering needs not cross it.
struct CubeMap {
  int side = 0;
  float scale =
      1;  ///< radiance = rgb × scale; rgb's mean over the faces is about 1, its most 60000
  /// Writes a face, numbered in GL's order (+X, -X, +Y, -Y, +Z, -Z): side × side × 3, rows by
  /// increasing t.
  std::function<void(int face, std::span<float> rgb)> write;
};

/// Blurs by a Gaussian of `blur_rad` (standard deviation; 0: sharp) and resamples. `max_side` >= 2.
/// Values that are not finite or are negative count as 0. The picture is borrowed as long as the
/// cube map is used.
[[nodiscard]] CubeMap make_cube_map(const EnvironmentView& environment, float blur_rad,
                                    int max_side);

/// Σ L_n Y_n(direction) for 1, 4, 9 or 16 coefficients (real, orthonormal, n = l² + l + m, no
/// Condon-Shortley sign); negative values, where the truncated series rings, become 0. Borrows
/// them.
[[nodiscard]] CubeMap make_cube_map(std::span<const std::array<float, 3>> sh, int side);

/// The direction, of unit length, of a texel of such a cube map.
[[nodiscard]] glm::vec3 cube_direction(int face, int x, int y, int side);

}  // namespace relit::gles
