// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "container/records.hpp"
#include "decoders/pose_packet.hpp"

namespace relit::bake {

/// Integers of one channel, [component][frame], and how they become values.
struct QuantizedChannel {
  std::array<float, 3> offset{};
  std::array<float, 3> step{1, 1, 1};
  std::vector<std::vector<std::uint16_t>> words;
};

/// Rounds `values` to 16 bits, one vector of frames per component (1 or 3), in steps of at least
/// `least_step`, more where the range needs it: the error is at most half a step.
[[nodiscard]] QuantizedChannel quantize_linear(std::span<const std::vector<double>> values,
                                               double least_step);

/// Whether every component stays within `step` over all frames. Then `middle` is off by half of it.
[[nodiscard]] bool constant_within(std::span<const std::vector<double>> values, double step);
/// Half way between the least and the largest value; that value itself where they are equal.
[[nodiscard]] double middle(std::span<const double> values);

/// Smallest steps for rotations: 15 bits must span every component's range.
inline constexpr double kFinestRotationStep = 1.0 / 16384;

/// Rounds rotations (x, y, z, w, unit length) as FORMAT.md says. The component left out is the same
/// over the whole channel wherever it stays above 0.35, so that the words move smoothly; else it
/// changes only when it falls below that.
///
/// With steps of h each word is off by h/2, the three by |e| <= √3·h/2, the rebuilt component w by
/// |e|·√(1-w²)/w, so the quaternion by at most |e|/w and the rotation by at most 2·|e|/w
/// <= √3·h/0.35 = 4.95·h; typically, with w near 1, by h.
[[nodiscard]] QuantizedChannel quantize_rotation(std::span<const glm::dvec4> rotations,
                                                 double step);

/// Flips signs so that each rotation is on the same side as the one before it.
void make_continuous(std::span<glm::dvec4> rotations);

/// Encodes [frames][values] as a packet, with the prediction that turns out smallest.
[[nodiscard]] std::vector<std::uint8_t> encode_pose_packet(std::span<const std::uint16_t> values,
                                                           const decoders::PosePacketShape& shape);

}  // namespace relit::bake
