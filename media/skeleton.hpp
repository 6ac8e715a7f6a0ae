// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <string>
#include <vector>

#include "media/exact_math.hpp"

namespace relit::media {

/// Joints, parents first. The figure faces +z, its left is +x.
enum Joint : int {
  kPelvis,
  kWaist,
  kChest,
  kNeck,
  kHead,
  kUpperArmL,
  kForearmL,
  kHandL,
  kUpperArmR,
  kForearmR,
  kHandR,
  kThighL,
  kShinL,
  kFootL,
  kThighR,
  kShinR,
  kFootR,
  kFrontTail,                  ///< first joint of the longer tail of the sash
  kSideTail = kFrontTail + 5,  ///< and of the shorter one
  kJointCount = kSideTail + 5,
};

inline constexpr int kTailJoints = 5;

/// Lengths in metres, shared by the shapes and the walk.
struct Proportions {
  double hip_half = 0.09, hip_drop = 0.092;
  double thigh = 0.41, shin = 0.385;
  double ankle_height = 0.075;
  double shoulder_half = 0.200, shoulder_rise = 0.285;
  double upper_arm = 0.285, forearm = 0.24;
  double waist_rise = 0.105, chest_rise = 0.025, neck_rise = 0.352, head_rise = 0.084;
  double pelvis_height = 0.962;  ///< standing straight

  /// Foot: the sole seen from the side is a heel arc, a flat, a rocker and a toe arc; z from the
  /// ankle.
  double heel_centre = -0.034, heel_radius = 0.034;
  double rocker_start = 0.088, rocker_radius = 0.13, rocker_angle = 0.60;
  double toe_radius = 0.018;

  double front_tail_segment = 0.094, side_tail_segment = 0.068;
};

inline constexpr Proportions kBody;

/// Where the sash is knotted, from the front towards the left.
inline constexpr double kKnotAngle = 40.0 * kDegree;

/// Where the tails leave the knot, in the pelvis' frame, and the direction they face.
[[nodiscard]] glm::dvec3 tail_root(int first_joint);
[[nodiscard]] glm::dvec3 tail_facing(int first_joint);

struct JointInfo {
  std::string name;
  int parent = -1;
  glm::dvec3 offset{0.0};  ///< from the parent, in its frame
};

[[nodiscard]] const std::array<JointInfo, kJointCount>& skeleton();

/// One instant: the pelvis' place and every joint's rotation against its parent.
struct Pose {
  glm::dvec3 pelvis{0.0};
  std::array<glm::dquat, kJointCount> local;
};

struct WorldPose {
  std::array<glm::dvec3, kJointCount> origin;
  std::array<glm::dquat, kJointCount> rotation;
};

[[nodiscard]] WorldPose to_world(const Pose& pose);

/// Standing straight: all rotations identity.
[[nodiscard]] Pose rest_pose();

/// Rotation by `radians` about a coordinate axis (0, 1, 2).
[[nodiscard]] glm::dquat turn_about(int axis, double radians);

/// Rotation with the given orthonormal axes.
[[nodiscard]] glm::dquat from_axes(const glm::dvec3& x, const glm::dvec3& y, const glm::dvec3& z);

}  // namespace relit::media
