// SPDX-License-Identifier: MIT
#include "player/camera.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <string>

namespace relit::player {
namespace {

Unexpected bad_camera(std::string_view text) {
  return fail(ErrorCode::kInvalid,
              "--camera " + std::string(text) +
                  ": the form is orbit:AZIMUTH,ELEVATION[,DISTANCE], in degrees "
                  "and metres, for example orbit:30,10,3.5");
}

}  // namespace

Result<OrbitCamera> parse_camera(std::string_view text) {
  constexpr std::string_view kPrefix = "orbit:";
  if (text.substr(0, kPrefix.size()) != kPrefix) return bad_camera(text);
  double numbers[3] = {0, 0, 0};
  int count = 0;
  const char* at = text.data() + kPrefix.size();
  const char* end = text.data() + text.size();
  while (count < 3) {
    const auto [next, error] = std::from_chars(at, end, numbers[count]);
    if (error != std::errc() || !std::isfinite(numbers[count])) return bad_camera(text);
    ++count;
    at = next;
    if (at == end) break;
    if (*at++ != ',') return bad_camera(text);
  }
  if (at != end || count < 2 || numbers[2] < 0) return bad_camera(text);
  OrbitCamera camera;
  camera.azimuth_deg = numbers[0];
  camera.elevation_deg = std::clamp(numbers[1], -89.9, 89.9);
  camera.distance = numbers[2];
  return camera;
}

namespace {

// From what is circled to the camera.
glm::dvec3 direction(const OrbitCamera& camera) {
  const double azimuth = glm::radians(camera.azimuth_deg);
  const double elevation = glm::radians(camera.elevation_deg);
  return {std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
          std::cos(elevation) * std::cos(azimuth)};
}

double radius_of(const glm::vec3& bounds_min, const glm::vec3& bounds_max) {
  return std::max(0.5 * glm::length(glm::dvec3(bounds_max) - glm::dvec3(bounds_min)), 1e-6);
}

}  // namespace

double fitting_distance(const OrbitCamera& camera, const glm::vec3& bounds_min,
                        const glm::vec3& bounds_max, double aspect) {
  const double half_vertical = glm::radians(0.5 * camera.field_of_view_deg);
  const double half_narrow = std::min(half_vertical, std::atan(std::tan(half_vertical) * aspect));
  return 1.02 * radius_of(bounds_min, bounds_max) / std::sin(half_narrow);
}

void orbit(OrbitCamera& camera, double azimuth_deg, double elevation_deg) {
  camera.azimuth_deg = std::remainder(camera.azimuth_deg + azimuth_deg, 360.0);
  camera.elevation_deg = std::clamp(camera.elevation_deg + elevation_deg, -89.0, 89.0);
}

void pan(OrbitCamera& camera, double right, double up) {
  const glm::dvec3 towards = direction(camera);
  const glm::dvec3 across = glm::normalize(glm::cross(glm::dvec3(0, 1, 0), towards));
  const double height =
      2 * camera.distance * std::tan(glm::radians(0.5 * camera.field_of_view_deg));
  camera.offset -= height * (right * across + up * glm::cross(towards, across));
}

CameraMatrices camera_matrices(const OrbitCamera& camera, const glm::vec3& bounds_min,
                               const glm::vec3& bounds_max, double aspect) {
  const glm::dvec3 middle = 0.5 * (glm::dvec3(bounds_min) + glm::dvec3(bounds_max));
  const double radius = radius_of(bounds_min, bounds_max);
  const double distance = camera.distance > 0
                              ? camera.distance
                              : fitting_distance(camera, bounds_min, bounds_max, aspect);
  const glm::dvec3 centre = middle + camera.offset;
  const glm::dvec3 eye = centre + distance * direction(camera);
  const double depth = glm::length(eye - middle);
  const double far_plane = depth + 2 * radius;
  const double near_plane = std::max(depth - 1.5 * radius, 1e-3 * far_plane);
  CameraMatrices matrices;
  matrices.view = glm::mat4(glm::lookAt(eye, centre, glm::dvec3(0, 1, 0)));
  matrices.projection = glm::mat4(
      glm::perspective(glm::radians(camera.field_of_view_deg), aspect, near_plane, far_plane));
  matrices.eye = glm::vec3(eye);
  return matrices;
}

}  // namespace relit::player
