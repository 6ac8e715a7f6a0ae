// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "media/surface.hpp"

namespace relit::media {

/// The turned wooden parts and the balls between them, each in the frame of its joint.
[[nodiscard]] std::vector<Surface> body_surfaces();

/// The round plate the figure walks on, its top at y = 0.
[[nodiscard]] std::vector<Surface> base_surfaces();

/// Radius of the thigh at a distance below the hip, for what must stay outside it.
[[nodiscard]] double thigh_radius(double below_hip_m);

}  // namespace relit::media
