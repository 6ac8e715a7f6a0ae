// SPDX-License-Identifier: MIT
#include "media/skeleton.hpp"

namespace relit::media {
namespace {

std::array<JointInfo, kJointCount> make_skeleton() {
  const Proportions& b = kBody;
  std::array<JointInfo, kJointCount> out;
  out[kPelvis] = {"pelvis", -1, {0.0, b.pelvis_height, 0.0}};
  out[kWaist] = {"waist", kPelvis, {0.0, b.waist_rise, 0.0}};
  out[kChest] = {"chest", kWaist, {0.0, b.chest_rise, 0.0}};
  out[kNeck] = {"neck", kChest, {0.0, b.neck_rise, 0.0}};
  out[kHead] = {"head", kNeck, {0.0, b.head_rise, 0.0}};
  for (const bool left : {true, false}) {
    const double side = left ? 1.0 : -1.0;
    const std::string tag = left ? "_left" : "_right";
    const int arm = left ? kUpperArmL : kUpperArmR, leg = left ? kThighL : kThighR;
    const auto at = [](int joint) { return static_cast<std::size_t>(joint); };
    out[at(arm)] = {"upper_arm" + tag, kChest, {side * b.shoulder_half, b.shoulder_rise, 0.0}};
    out[at(arm + 1)] = {"forearm" + tag, arm, {0.0, -b.upper_arm, 0.0}};
    out[at(arm + 2)] = {"hand" + tag, arm + 1, {0.0, -b.forearm, 0.0}};
    out[at(leg)] = {"thigh" + tag, kPelvis, {side * b.hip_half, -b.hip_drop, 0.0}};
    out[at(leg + 1)] = {"shin" + tag, leg, {0.0, -b.thigh, 0.0}};
    out[at(leg + 2)] = {"foot" + tag, leg + 1, {0.0, -b.shin, 0.0}};
  }
  for (const int first : {static_cast<int>(kFrontTail), static_cast<int>(kSideTail)}) {
    const bool front = first == kFrontTail;
    const double segment = front ? b.front_tail_segment : b.side_tail_segment;
    for (int k = 0; k < kTailJoints; ++k) {
      const glm::dvec3 offset = k == 0 ? tail_root(first) : glm::dvec3(0.0, -segment, 0.0);
      out[static_cast<std::size_t>(first + k)] = {
          (front ? "front_tail_" : "side_tail_") + std::to_string(k),
          k == 0 ? kPelvis : first + k - 1, offset};
    }
  }
  return out;
}

}  // namespace

glm::dvec3 tail_root(int first_joint) {
  const double angle = kKnotAngle + (first_joint == kFrontTail ? -7.5 : 8.5) * kDegree;
  return {0.148 * exact_sin(angle), 0.061, 0.124 * exact_cos(angle)};
}

glm::dvec3 tail_facing(int first_joint) {
  const double angle = kKnotAngle + (first_joint == kFrontTail ? -20.0 : 34.0) * kDegree;
  return {exact_sin(angle), 0.0, exact_cos(angle)};
}

const std::array<JointInfo, kJointCount>& skeleton() {
  static const std::array<JointInfo, kJointCount> joints = make_skeleton();
  return joints;
}

WorldPose to_world(const Pose& pose) {
  WorldPose out;
  const auto& joints = skeleton();
  for (std::size_t j = 0; j < joints.size(); ++j) {
    if (joints[j].parent < 0) {
      out.origin[j] = pose.pelvis;
      out.rotation[j] = pose.local[j];
      continue;
    }
    const auto parent = static_cast<std::size_t>(joints[j].parent);
    out.origin[j] = out.origin[parent] + out.rotation[parent] * joints[j].offset;
    out.rotation[j] = glm::normalize(out.rotation[parent] * pose.local[j]);
  }
  return out;
}

Pose rest_pose() {
  Pose pose;
  pose.pelvis = skeleton()[kPelvis].offset;
  pose.local.fill(glm::dquat(1.0, 0.0, 0.0, 0.0));
  return pose;
}

glm::dquat turn_about(int axis, double radians) {
  glm::dquat q(exact_cos(0.5 * radians), 0.0, 0.0, 0.0);
  const double s = exact_sin(0.5 * radians);
  (axis == 0 ? q.x : axis == 1 ? q.y : q.z) = s;
  return q;
}

glm::dquat from_axes(const glm::dvec3& x, const glm::dvec3& y, const glm::dvec3& z) {
  return glm::normalize(glm::quat_cast(glm::dmat3(x, y, z)));
}

}  // namespace relit::media
