// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace relit::bake {

/// A grid of 16-bit integers over a box: value = offset + step × integer, rounded to the nearest.
struct Grid {
  std::array<float, 3> offset{};
  std::array<float, 3> step{1, 1, 1};

  [[nodiscard]] std::uint16_t nearest(float value, std::size_t axis) const;
};

/// A grid over [low, high] whose step is the same on every axis: the longest axis takes 2^bits − 1
/// of them. A box without extent gets a step of 1. `bits`: 1..16.
[[nodiscard]] Grid uniform_grid(const glm::vec3& low, const glm::vec3& high, int bits);

/// Steps of texture coordinates a texel: half a step, which a corner may be off by, is 1/32 texel
/// of a light map and 1/8 texel of a picture.
inline constexpr double kLightMapSteps = 16;
inline constexpr double kAlbedoSteps = 4;

/// The fewest bits, 10 to 16, that hold so many steps.
[[nodiscard]] int uv_bits(double steps);

/// A palette index and how much it counts.
struct Influence {
  std::uint16_t joint = 0;
  float weight = 0;
};

/// Rounds the influences of a vertex to 8 bits so that they sum to exactly 255: equal joints are
/// added up, then the largest remainders take what rounding down left over (the earlier joint where
/// they tie). Returns those that count, heaviest first. Without any positive weight the first joint
/// takes all.
[[nodiscard]] std::vector<Influence> quantize_weights(std::span<const Influence> influences);

/// The octahedral map of a unit vector, 8 bits a component, as decode_mesh inverts it.
[[nodiscard]] std::array<std::int8_t, 2> encode_octahedral(const glm::vec3& n);

/// Appends little-endian 16-bit integers.
void append_u16(std::vector<std::uint8_t>& bytes, unsigned value);

}  // namespace relit::bake
