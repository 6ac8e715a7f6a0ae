// SPDX-License-Identifier: MIT
#pragma once

#include <glm/glm.hpp>
#include <string_view>

#include "container/base/result.hpp"

namespace relit::player {

/// A camera that circles the middle of a bounding box, or a place beside it.
struct OrbitCamera {
  double azimuth_deg = 25;   ///< 0 looks from +Z at the front, positive moves the camera towards +X
  double elevation_deg = 8;  ///< positive looks down
  double distance = 0;       ///< from the middle, in metres; 0: as far as the whole box needs
  double field_of_view_deg = 30;  ///< vertical
  glm::dvec3 offset{0.0};         ///< of what it circles from the middle of the box, metres
};

/// Parses "orbit:AZIMUTH,ELEVATION[,DISTANCE]", degrees and metres. Errors: kInvalid (says the
/// form).
[[nodiscard]] Result<OrbitCamera> parse_camera(std::string_view text);

/// The distance that `distance` 0 stands for: the sphere around the box just fits a picture of
/// `aspect` = width / height.
[[nodiscard]] double fitting_distance(const OrbitCamera& camera, const glm::vec3& bounds_min,
                                      const glm::vec3& bounds_max, double aspect);

/// Turns the camera; it never goes over the top.
void orbit(OrbitCamera& camera, double azimuth_deg, double elevation_deg);

/// Moves what it circles along the picture, in parts of the picture's height; `distance` must not
/// be 0.
void pan(OrbitCamera& camera, double right, double up);

struct CameraMatrices {
  glm::mat4 view;
  glm::mat4 projection;
  glm::vec3 eye;
};

/// View and projection (OpenGL clip space) for a picture of `aspect` = width / height. The near and
/// far planes enclose the box.
[[nodiscard]] CameraMatrices camera_matrices(const OrbitCamera& camera, const glm::vec3& bounds_min,
                                             const glm::vec3& bounds_max, double aspect);

}  // namespace relit::player
