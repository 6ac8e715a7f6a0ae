// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>

namespace relit::decoders {

/// Sets mask[y × width + x] = 1 for every texel whose centre lies inside a triangle of light-map
/// UVs (design, section 1: covered), by the exact rule of FixedTriangle. `mask` is uint8
/// [height][width]; other texels are left as they are.
void mark_covered_texels(std::span<const glm::vec2> uv, std::span<const std::uint16_t> indices,
                         int width, int height, std::span<std::uint8_t> mask);

}  // namespace relit::decoders
