// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bake_minimal/unwrap_surface.hpp"

namespace relit::bake {

/// Cuts a surface into connected patches that are nearly flat: patches grow from seeds, always by
/// the triangle that fits best anywhere (deviation from the patch's normal, length of its outline,
/// creases), no farther than a cone of 60° around the normal; then seeds move to the middle of
/// their patch and all grow anew (Lloyd's algorithm, as in variational shape approximation,
/// Cohen-Steiner et al. 2004). Every triangle with area is in exactly one patch; triangles ascend
/// within a patch.
[[nodiscard]] std::vector<std::vector<std::uint32_t>> grow_patches(const Surface& surface);

/// Cuts a connected patch of at least two triangles into two connected ones about its longest
/// extent.
[[nodiscard]] std::vector<std::vector<std::uint32_t>> split_patch(
    const Surface& surface, std::span<const std::uint32_t> patch);

/// The parts of a patch that hang together over edges.
[[nodiscard]] std::vector<std::vector<std::uint32_t>> connected_parts(
    const Surface& surface, std::span<const std::uint32_t> patch);

}  // namespace relit::bake
