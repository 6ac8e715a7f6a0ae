// SPDX-License-Identifier: MIT
#include "decoders/pose_packet.hpp"

#include <string>

#include "decoders/inflate.hpp"

namespace relit::decoders {
namespace {

using container::PoseKind;

constexpr std::size_t kAxes =
    3;  // the neighbour of a coordinate is the same axis one vertex before

unsigned in_time(unsigned order, const PosePacketShape& shape, const std::uint16_t* values,
                 std::size_t t, std::size_t v) {
  if (t == 0 || order == 0) return 0;
  const unsigned last = values[(t - 1) * shape.values + v];
  if (t == 1 || order == 1) return last;
  return 2 * last - values[(t - 2) * shape.values + v];
}

}  // namespace

bool valid_pose_mode(std::uint8_t mode, PoseKind kind) {
  if ((mode & kPoseOrderMask) > 2) return false;
  const unsigned known = kind == PoseKind::kVertices ? kPoseOrderMask | kPoseAlongVertices
                                                     : static_cast<unsigned>(kPoseOrderMask);
  return (mode & ~known) == 0;
}

std::uint16_t predict_pose_value(std::uint8_t mode, const PosePacketShape& shape,
                                 const std::uint16_t* values, std::size_t t, std::size_t v) {
  const unsigned order = mode & kPoseOrderMask;
  unsigned prediction = in_time(order, shape, values, t, v);
  const bool along = shape.kind == PoseKind::kVertices && v >= kAxes &&
                     (t == 0 || (mode & kPoseAlongVertices) != 0);
  if (along) {
    // How far the neighbour's own prediction in time was off.
    prediction += values[t * shape.values + v - kAxes];
    prediction -= in_time(order, shape, values, t, v - kAxes);
  }
  return static_cast<std::uint16_t>(prediction);
}

Status decode_pose_packet(std::span<const std::uint8_t> packet, const PosePacketShape& shape,
                          std::vector<std::uint8_t>& bytes, std::vector<std::uint16_t>& values) {
  RELIT_TRY(inflate_exact_into(packet, pose_packet_bytes(shape), "pose packet", bytes));
  const std::uint8_t mode = bytes[0];
  if (!valid_pose_mode(mode, shape.kind)) {
    return fail(ErrorCode::kCorrupt,
                "pose packet: unknown prediction mode " + std::to_string(mode));
  }
  const std::size_t count = shape.values * shape.frames;
  const std::uint8_t* low = bytes.data() + 1;
  const std::uint8_t* high = low + count;
  values.resize(count);
  for (std::size_t t = 0; t < shape.frames; ++t) {
    for (std::size_t v = 0; v < shape.values; ++v) {
      const std::size_t at = pose_residual_index(shape, t, v);
      const unsigned zigzag = static_cast<unsigned>(low[at] | high[at] << 8);
      const unsigned residual = (zigzag >> 1) ^ (0u - (zigzag & 1u));
      const unsigned prediction = predict_pose_value(mode, shape, values.data(), t, v);
      values[t * shape.values + v] = static_cast<std::uint16_t>(prediction + residual);
    }
  }
  return {};
}

}  // namespace relit::decoders
