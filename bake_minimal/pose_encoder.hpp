// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bake_minimal/mesh_packer.hpp"
#include "bake_minimal/scene.hpp"
#include "container/base/result.hpp"
#include "container/records.hpp"

namespace relit::bake {

enum class PoseChoice {
  kAuto,      ///< the one of the two below that makes the file smaller
  kJoints,    ///< nodes and morph weights
  kVertices,  ///< positions of every vertex
};

struct PoseOptions {
  PoseChoice choice = PoseChoice::kAuto;
  int clip = 0;  ///< into Scene::clips; -1: the rest pose
  std::uint32_t track_id = 0;
  std::uint32_t clip_id = 0;
  std::uint32_t segment_frames = 25;  ///< frames a packet; the last one may have fewer
  /// Steps are chosen so that one of them moves the surface by at most about the longest side of
  /// the posed meshes / 2^precision_bits. 8..20.
  int precision_bits = 14;
};

struct PoseEncoding {
  container::PoseTrackRecord track;
  /// By segment: packet s holds the frames from s × segment_frames.
  std::vector<std::vector<std::uint8_t>> packets;
  /// Track record, packets, and what of meshes and skeleton only this kind needs (for kVertices
  /// nothing: drop_rig() then removes the rest). 0: not tried, or abandoned when it grew beyond the
  /// other.
  std::uint64_t joints_bytes = 0;
  std::uint64_t vertices_bytes = 0;
};

/// Encodes the pose of `packed` at each of `frame_times` (seconds in the clip).
/// Errors: kInvalid (no frames, times or poses that are not finite, options), kLimit.
/// Deterministic.
[[nodiscard]] Result<PoseEncoding> encode_pose(const Scene& scene,
                                               std::span<const double> frame_times,
                                               const PackedScene& packed,
                                               const PoseOptions& options);

}  // namespace relit::bake
