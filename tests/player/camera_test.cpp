// SPDX-License-Identifier: MIT
#include "player/camera.hpp"

#include <cmath>

#include "tests/test.hpp"

using namespace relit;
using namespace relit::player;

TEST_CASE("camera descriptions are parsed, and refused with their form") {
  const auto camera = parse_camera("orbit:30,-10.5,3.25");
  REQUIRE(camera);
  CHECK(camera->azimuth_deg == 30);
  CHECK(camera->elevation_deg == -10.5);
  CHECK(camera->distance == 3.25);
  REQUIRE(parse_camera("orbit:0,0"));
  CHECK(parse_camera("orbit:0,0")->distance == 0);
  for (const char* bad : {"", "orbit", "orbit:", "orbit:1", "orbit:1,2,3,4", "orbit:1,2,-3",
                          "orbit:a,b", "orbit:1,2x", "orbit:nan,0", "orbit:inf,0"}) {
    INFO(bad);
    const auto refused = parse_camera(bad);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().message.find("orbit:AZIMUTH,ELEVATION") != std::string::npos);
  }
}

TEST_CASE("the fitting distance shows the whole box from every side") {
  const glm::vec3 low(-1, 0, -0.3f), high(0.5f, 1.8f, 0.4f);
  for (const double aspect : {0.4, 1.0, 2.5}) {
    for (const double azimuth : {0.0, 77.0, 190.0}) {
      OrbitCamera camera;
      camera.azimuth_deg = azimuth, camera.elevation_deg = 25;
      const CameraMatrices m = camera_matrices(camera, low, high, aspect);
      for (int corner = 0; corner < 8; ++corner) {
        const glm::vec4 p((corner & 1) != 0 ? high.x : low.x, (corner & 2) != 0 ? high.y : low.y,
                          (corner & 4) != 0 ? high.z : low.z, 1);
        const glm::vec4 clip = m.projection * (m.view * p);
        CHECK(std::abs(clip.x) <= clip.w);
        CHECK(std::abs(clip.y) <= clip.w);
        CHECK(std::abs(clip.z) <= clip.w);
      }
    }
  }
}

TEST_CASE("azimuth 0 looks from +Z, and positive azimuth goes towards +X") {
  OrbitCamera camera;
  camera.azimuth_deg = 0, camera.elevation_deg = 0, camera.distance = 2;
  CHECK(camera_matrices(camera, glm::vec3(-1), glm::vec3(1), 1).eye.z == Approx(2));
  camera.azimuth_deg = 90;
  CHECK(camera_matrices(camera, glm::vec3(-1), glm::vec3(1), 1).eye.x == Approx(2));
}

namespace {

// Where a point is seen, -1..1 in both directions.
glm::vec2 seen(const OrbitCamera& camera, const glm::vec3& at, double aspect) {
  const CameraMatrices m = camera_matrices(camera, glm::vec3(-1), glm::vec3(1), aspect);
  const glm::vec4 clip = m.projection * (m.view * glm::vec4(at, 1));
  return glm::vec2(clip) / clip.w;
}

}  // namespace

TEST_CASE("panning moves the picture by the part of its height that is asked for") {
  for (const double azimuth : {0.0, 130.0}) {
    OrbitCamera camera;
    camera.azimuth_deg = azimuth, camera.elevation_deg = 35, camera.distance = 4;
    pan(camera, 0.25, -0.1);
    // Half the picture's height is 1, and half its width: twice that here.
    const glm::vec2 at = seen(camera, glm::vec3(0), 2);
    CHECK(at.x == Approx(2 * 0.25 / 2).margin(1e-5));
    CHECK(at.y == Approx(-0.2).margin(1e-5));
    // And it orbits around the new place.
    orbit(camera, 77, 20);
    const glm::vec2 still = seen(camera, glm::vec3(camera.offset), 2);
    CHECK(glm::length(still) < 1e-5f);
  }
}

TEST_CASE("orbiting stops at the poles and goes round the equator") {
  OrbitCamera camera;
  orbit(camera, 0, 500);
  CHECK(camera.elevation_deg == 89);
  orbit(camera, 0, -500);
  CHECK(camera.elevation_deg == -89);
  camera.azimuth_deg = 170;
  orbit(camera, 20, 0);
  CHECK(camera.azimuth_deg == Approx(-170));
}

TEST_CASE("distance 0 is the fitting distance") {
  OrbitCamera camera;
  const CameraMatrices fitted = camera_matrices(camera, glm::vec3(-1), glm::vec3(1), 1.5);
  camera.distance = fitting_distance(camera, glm::vec3(-1), glm::vec3(1), 1.5);
  const CameraMatrices same = camera_matrices(camera, glm::vec3(-1), glm::vec3(1), 1.5);
  CHECK(glm::length(fitted.eye - same.eye) < 1e-6f);
}
