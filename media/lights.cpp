// SPDX-License-Identifier: MIT
#include "media/lights.hpp"

#include <cmath>

#include "media/exact_math.hpp"

namespace relit::media {
namespace {

constexpr int kWidth = 192, kHeight = 96;

// A direction by its angle from +z towards +x and its height over the horizon, degrees.
glm::dvec3 towards(double azimuth, double elevation) {
  const double a = azimuth * kDegree, e = elevation * kDegree;
  return {exact_cos(e) * exact_sin(a), exact_sin(e), exact_cos(e) * exact_cos(a)};
}

// A round glow: 1 in the middle, falling off as a Gaussian of the given width in degrees.
double glow(const glm::dvec3& d, const glm::dvec3& centre, double degrees) {
  const double spread = degrees * kDegree;
  return exact_exp((glm::dot(d, centre) - 1.0) / (spread * spread));
}

// A soft-edged rectangle of light, seen in the plane that touches the sphere at its centre.
double softbox(const glm::dvec3& d, double azimuth, double elevation, double half_width,
               double half_height) {
  const glm::dvec3 c = towards(azimuth, elevation);
  const double facing = glm::dot(d, c);
  if (facing <= 0.05) return 0.0;
  const glm::dvec3 right = glm::normalize(glm::cross(glm::dvec3(0, 1, 0), c)),
                   up = glm::cross(c, right);
  const double x = glm::dot(d, right) / facing / half_width,
               y = glm::dot(d, up) / facing / half_height;
  return exact_exp(-(x * x * x * x + y * y * y * y));
}

glm::dvec3 mix(const glm::dvec3& a, const glm::dvec3& b, double t) { return a + t * (b - a); }

// A large key from the front left, a weak fill, a cool rim behind, and a backdrop that sweeps into
// the floor.
glm::dvec3 studio_soft(const glm::dvec3& d) {
  const double h = d.y;
  const glm::dvec3 floor(0.36, 0.345, 0.33), horizon(0.50, 0.50, 0.51), top(0.105, 0.115, 0.14);
  glm::dvec3 c = h < 0.0 ? mix(horizon, floor, smooth_step(0.0, -0.55, h))
                         : mix(horizon, top, smooth_step(0.0, 0.85, h));
  c *= 0.72 + 0.28 * glow(d, towards(200.0, 8.0), 55.0);
  c += glm::dvec3(6.6, 6.1, 5.4) * softbox(d, -38.0, 40.0, 0.52, 0.42);
  c += glm::dvec3(0.75, 0.85, 1.0) * softbox(d, 82.0, 18.0, 0.50, 0.60);
  c += glm::dvec3(3.4, 3.9, 4.8) * softbox(d, 158.0, 34.0, 0.20, 0.62);
  c += glm::dvec3(1.1, 1.05, 1.0) * glow(d, towards(0.0, 88.0), 30.0);
  return 0.8 * c;
}

// A warm sun low over the horizon, its glow around it, and an evening sky.
glm::dvec3 low_sun(const glm::dvec3& d) {
  const glm::dvec3 sun = towards(-62.0, 19.0);
  const double h = d.y, near = 0.5 + 0.5 * glm::dot(d, sun);
  const glm::dvec3 zenith(0.12, 0.23, 0.46), middle(0.36, 0.43, 0.56);
  const glm::dvec3 warm(1.25, 0.62, 0.26), cool(0.50, 0.43, 0.50);
  const glm::dvec3 rim = mix(cool, warm, near * near);
  glm::dvec3 sky =
      mix(mix(rim, middle, smooth_step(-0.02, 0.42, h)), zenith, smooth_step(0.12, 0.95, h));
  sky += glm::dvec3(3.1, 1.72, 0.72) * glow(d, sun, 33.0);
  sky += glm::dvec3(12.0, 7.8, 4.1) * glow(d, sun, 7.5);
  const glm::dvec3 ground =
      mix(glm::dvec3(0.20, 0.155, 0.13), glm::dvec3(0.36, 0.235, 0.15), near) *
      (1.0 - 0.35 * smooth_step(0.0, -0.9, h));
  return mix(ground, sky, smooth_step(-0.07, 0.035, h));
}

// Teal on one side and orange running into magenta on the other, over a dim violet room. Between
// them, where a camera in front of the figure looks, it stays dark.
glm::dvec3 coloured_pair(const glm::dvec3& d) {
  const double h = d.y;
  const glm::dvec3 floor(0.110, 0.095, 0.120), wall(0.150, 0.135, 0.190),
      ceiling(0.060, 0.062, 0.105);
  glm::dvec3 c = mix(wall, ceiling, smooth_step(0.0, 0.85, h));
  c = mix(c, floor, smooth_step(0.02, -0.40, h));
  c += glm::dvec3(0.16, 2.35, 2.70) * softbox(d, 112.0, 26.0, 0.50, 0.66);
  c += glm::dvec3(0.03, 0.42, 0.50) * glow(d, towards(108.0, 16.0), 38.0);
  c += glm::dvec3(4.3, 1.40, 0.26) * softbox(d, -52.0, 30.0, 0.46, 0.56);
  c += glm::dvec3(1.15, 0.10, 0.62) * glow(d, towards(-92.0, 6.0), 24.0);
  c += glm::dvec3(0.66, 0.20, 0.15) * glow(d, towards(-60.0, 16.0), 42.0);
  c += glm::dvec3(0.16, 0.15, 0.20) * glow(d, towards(0.0, 80.0), 35.0);
  return c;
}

Panorama render(const char* name, glm::dvec3 (*radiance)(const glm::dvec3&)) {
  Panorama out{.name = name, .width = kWidth, .height = kHeight, .pixels = {}};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double theta = kPi * (y + 0.5) / kHeight, phi = kTau * (x + 0.5) / kWidth;
      const double s = exact_sin(theta);
      out.pixels.push_back(radiance({s * exact_cos(phi), exact_cos(theta), s * exact_sin(phi)}));
    }
  }
  return out;
}

}  // namespace

std::vector<Panorama> make_panoramas() {
  return {render("studio_soft", studio_soft), render("low_sun", low_sun),
          render("coloured_pair", coloured_pair)};
}

}  // namespace relit::media
