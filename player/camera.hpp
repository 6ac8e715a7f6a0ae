// SPDX-License-Identifier: MIT
#pragma once

#include <glm/glm.hpp>
#include <string_view>

#include "container/base/result.hpp"

namespace relit::player {

/// A camera that circles the middle of a bounding box.
struct OrbitCamera {
  double azimuth_deg = 25;   ///< 0 looks from +Z at the front, positive moves the camera towards +X
  double elevation_deg = 8;  ///< positive looks down
  double distance = 0;       ///< from the middle, in metres; 0: as far as the whole box needs
  double field_of_view_deg = 30;  ///< vertical
};

/// Parses "orbit:AZIMUTH,ELEVATION[,DISTANCE]", degrees and metres. Errors: kInvalid (says the
/// form).
[[nodiscard]] Result<OrbitCamera> parse_camera(std::string_view text);

struct CameraMatrices {
  glm::mat4 view;
  glm::mat4 projection;
  glm::vec3 eye;
};

/// View and projection (OpenGL clip space) for a picture of `aspect` = width / height. With
/// distance 0 the sphere around the box just fits the picture. The near and far planes enclose the
/// box.
[[nodiscard]] CameraMatrices camera_matrices(const OrbitCamera& camera, const glm::vec3& bounds_min,
                                             const glm::vec3& bounds_max, double aspect);

}  // namespace relit::player
