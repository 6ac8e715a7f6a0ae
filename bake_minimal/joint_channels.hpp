// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bake_minimal/mesh_packer.hpp"
#include "bake_minimal/scene.hpp"
#include "container/records.hpp"

namespace relit::bake {

/// The kJoints form of a clip: channels and rest values for the track record, and the integers.
struct JointChannels {
  std::vector<container::RestTrs> rest;
  std::vector<container::PoseChannel> channels;
  std::vector<std::vector<std::uint16_t>> words;  ///< [value][frame], channel by channel
};

/// How far quantisation may move the surface, and what that means at each node.
struct PoseTolerance {
  double surface = 0;         ///< metres
  std::vector<double> reach;  ///< by skeleton node: how far vertices that it moves are from it
  std::vector<double> parent_scale;  ///< by skeleton node: metres per unit of its translation
  std::vector<double> mesh_scale;    ///< by packed mesh: metres per unit of its positions
};

/// Samples nodes and morph weights at every frame and keeps as channels what moves by more than its
/// step; the rest becomes the middle of what little it did. `poses` are the frames' poses.
[[nodiscard]] JointChannels build_joint_channels(const Scene& scene, const PackedScene& packed,
                                                 std::span<const ScenePose> poses,
                                                 const PoseTolerance& tolerance);

}  // namespace relit::bake
