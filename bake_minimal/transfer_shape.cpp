// SPDX-License-Identifier: MIT
#include "bake_minimal/transfer_shape.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace relit::bake {
namespace {

std::string place(std::uint64_t frame, std::size_t index, const TransferShape& shape) {
  const std::size_t texel = index % shape.texels();
  const std::size_t plane = index / shape.texels();
  const auto width = static_cast<std::size_t>(shape.width);
  return "frame " + std::to_string(frame) + ", coefficient " + std::to_string(plane / 3) +
         ", channel " + std::to_string(plane % 3) + ", texel (" + std::to_string(texel % width) +
         ", " + std::to_string(texel / width) + ")";
}

}  // namespace

Status check_transfer(const TransferShape& shape, std::span<const float> transfer,
                      std::uint64_t frame) {
  const std::size_t expected = static_cast<std::size_t>(shape.coefficients()) * 3 * shape.texels();
  if (transfer.size() != expected) {
    return fail(ErrorCode::kInvalid, "frame " + std::to_string(frame) + " has " +
                                         std::to_string(transfer.size()) + " values, expected " +
                                         std::to_string(expected));
  }
  // The negated comparison also catches NaN.
  const auto bad = std::find_if(transfer.begin(), transfer.end(),
                                [](float v) { return !(std::abs(v) <= kLargestTransfer); });
  if (bad == transfer.end()) return {};
  return fail(ErrorCode::kInvalid,
              place(frame, static_cast<std::size_t>(bad - transfer.begin()), shape) +
                  ": transfer is " + std::to_string(*bad) +
                  ", it has to be finite and at most 1e37 in magnitude");
}

}  // namespace relit::bake
