// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "container/base/plane_view.hpp"
#include "container/base/result.hpp"

/// Real, orthonormal spherical harmonics without the Condon-Shortley sign, n = l² + l + m, orders
/// 0..3.
namespace relit::decoders {

[[nodiscard]] constexpr int coefficient_count(int order) { return (order + 1) * (order + 1); }
[[nodiscard]] constexpr int band_of(int n) { return n < 1 ? 0 : n < 4 ? 1 : n < 9 ? 2 : 3; }

/// Y_n(direction) for n < (order+1)²; `direction` of unit length. Order 0..3.
void evaluate_sh(int order, const glm::dvec3& direction, std::span<double> y);
void evaluate_sh(int order, const glm::vec3& direction, std::span<float> y);

/// A_l: the clamped cosine's zonal coefficients π, 2π/3, π/4, 0 for l = 0..3.
[[nodiscard]] double clamped_cosine(int band);

/// SH coefficients L_n of incident radiance in model space, RGB; order 0..3.
struct Light {
  std::vector<std::array<double, 3>> sh;  ///< 1, 4, 9 or 16 rows
  [[nodiscard]] int order() const;        ///< of `sh`; -1 where the number of rows is none of these
};

/// An equirectangular picture of linear radiance. Row 0 is +Y; pixel (x, y) is the direction
/// (sin θ cos φ, cos θ, sin θ sin φ), θ = π(y+½)/height, φ = 2π(x+½)/width.
struct Environment {
  int width = 0;
  int height = 0;
  std::vector<float> rgb;  ///< height × width × 3
};

/// Exchanges the axes y and z: L(x, y, z) becomes L(x, z, y). It is its own inverse. The harmonics'
/// polar axis is z, so what goes on about +Y is simple only between two such exchanges.
void exchange_y_and_z(Light& light);

/// Projects with the exact solid angle of every pixel and the mean of Y_n over it; a constant image
/// of radiance 1 gives L_0 = √(4π) to 1e-12. Errors: kInvalid for non-finite or negative pixels
/// (says where) and for a size that `rgb` does not have, kLimit for sides beyond
/// limits::kImageSide.
[[nodiscard]] Result<Light> project_environment(const Environment& environment, int order);

/// Turns the light about +Y by `angle_rad`, added to φ: what shone from φ shines from φ +
/// angle_rad.
void rotate_light_y(Light& light, double angle_rad);

/// Multiplies band l by (1 + cos(πl/5)) / 2, against ringing.
void window_light(Light& light);

/// The least radiance of the light's reconstruction over the sphere, per channel, by dense sampling
/// and refinement; negative where the truncation rings.
[[nodiscard]] std::array<double, 3> minimum_radiance(const Light& light);

/// Σ_n L_n Y_n(direction).
[[nodiscard]] std::array<double, 3> radiance(const Light& light, const glm::dvec3& direction);

}  // namespace relit::decoders
