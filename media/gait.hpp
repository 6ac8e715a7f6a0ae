// SPDX-License-Identifier: MIT
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "media/skeleton.hpp"

namespace relit::media {

/// A walk on the spot: the ground moves backwards (-z) at constant speed under the feet.
struct Walk {
  double stride_s = 1.2;   ///< two steps
  int strides = 2;         ///< the clip's length; what varies does so once over all of them
  double stride_m = 1.22;  ///< ground covered in one
  double stance = 0.62;    ///< share of the stride a foot is on the ground
  double rate_hz = 50;     ///< of the keys

  [[nodiscard]] double duration_s() const { return stride_s * strides; }
  [[nodiscard]] double speed() const { return stride_m / stride_s; }
};

/// Where the ankle is while the sole touches the ground.
struct SoleContact {
  glm::dvec2 ankle{
      0.0};  ///< (z, y) of the ankle from the point on the ground under the ankle of the flat foot
};

/// Rolls the sole on flat ground without slipping, from flat (0) to `toe_down` radians; negative:
/// onto the heel.
[[nodiscard]] SoleContact roll_sole(double toe_down);

/// Height of the sole's outline at `z` from the ankle, against the ground of the flat foot, for
/// shaping the foot.
[[nodiscard]] double sole_height(double z);
/// Where the outline begins and ends.
[[nodiscard]] double sole_back();
[[nodiscard]] double sole_front();

/// The pose at `time_s`, all joints but the sash's tails (left at rest). Periodic in duration_s().
/// `pelvis_height` is the mean height of the pelvis' origin.
[[nodiscard]] Pose walk_pose(const Walk& walk, double time_s, double pelvis_height);

/// The mean height at which the legs are never stretched beyond 99.4 % of their length.
[[nodiscard]] double find_pelvis_height(const Walk& walk);

}  // namespace relit::media
