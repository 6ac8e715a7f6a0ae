// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "container/base/result.hpp"

namespace relit::bake {

/// Transfer beyond this is refused: everything decoded from it stays finite in float.
inline constexpr float kLargestTransfer = 1e37f;

struct TransferShape {
  int order = 2;
  int width = 0;
  int height = 0;
  [[nodiscard]] int coefficients() const { return (order + 1) * (order + 1); }
  [[nodiscard]] std::size_t texels() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
};

/// Errors: kInvalid for a wrong size, and for a value that is not finite or beyond
/// kLargestTransfer, naming frame, coefficient, channel and texel. `transfer` is
/// [coefficients][3][H][W].
Status check_transfer(const TransferShape& shape, std::span<const float> transfer,
                      std::uint64_t frame);

}  // namespace relit::bake
