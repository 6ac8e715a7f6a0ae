// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "container/base/result.hpp"
#include "container/records.hpp"

/// The byte layer of pose packets, shared by PoseTrack and the encoder; FORMAT.md, "Pose packets".
namespace relit::decoders {

/// What a packet holds: `frames` × `values` integers of 16 bits.
struct PosePacketShape {
  std::size_t values = 0;  ///< a frame
  std::size_t frames = 0;
  /// kVertices orders residuals by frame and may predict a vertex from the one before it, kJoints
  /// orders them by value and knows no neighbours.
  container::PoseKind kind = container::PoseKind::kJoints;
};

/// The first byte of a packet: bits 0..1 are the order of the prediction in time, bit 2 adds
/// prediction along the vertices to every frame and not only to the first. Other bits are 0.
inline constexpr std::uint8_t kPoseOrderMask = 3;
inline constexpr std::uint8_t kPoseAlongVertices = 4;

/// Whether a first byte is one that a packet of `kind` may have.
[[nodiscard]] bool valid_pose_mode(std::uint8_t mode, container::PoseKind kind);

/// What the integer `v` of frame `t` is predicted as, modulo 2^16, from the values that precede it.
/// `values` is [frames][shape.values]; only entries before (t, v) are read. Both sides call it.
[[nodiscard]] std::uint16_t predict_pose_value(std::uint8_t mode, const PosePacketShape& shape,
                                               const std::uint16_t* values, std::size_t t,
                                               std::size_t v);

/// Where the residual of (t, v) stands in a byte plane.
[[nodiscard]] inline std::size_t pose_residual_index(const PosePacketShape& shape, std::size_t t,
                                                     std::size_t v) {
  return shape.kind == container::PoseKind::kVertices ? t * shape.values + v : v * shape.frames + t;
}

/// Bytes of a packet before zstd: the mode, then two planes.
[[nodiscard]] inline std::size_t pose_packet_bytes(const PosePacketShape& shape) {
  return 1 + 2 * shape.values * shape.frames;
}

/// Decodes a packet to [frames][values]. The shape has been checked against the limits. `bytes` is
/// working memory; both vectors' storage is used again. Errors: kCorrupt, and `values` is
/// undefined.
[[nodiscard]] Status decode_pose_packet(std::span<const std::uint8_t> packet,
                                        const PosePacketShape& shape,
                                        std::vector<std::uint8_t>& bytes,
                                        std::vector<std::uint16_t>& values);

}  // namespace relit::decoders
