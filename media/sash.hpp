// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "media/gait.hpp"
#include "media/skeleton.hpp"
#include "media/surface.hpp"

namespace relit::media {

/// The joints that move the sash, in the order its Influence::joints count them.
[[nodiscard]] const std::vector<int>& sash_joints();

/// The wound cloth, its knot and its two tails, in the frame of the model at rest, with influences.
[[nodiscard]] std::vector<Surface> sash_surfaces();

/// Swings the tails: chains under gravity, the wind of the walk and the push of the thigh,
/// simulated until the motion repeats itself. `poses` are the keys of one clip (the last one is not
/// the first again); their tail joints are overwritten.
void swing_tails(const Walk& walk, std::vector<Pose>& poses);

}  // namespace relit::media
