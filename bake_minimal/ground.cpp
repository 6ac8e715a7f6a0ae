// SPDX-License-Identifier: MIT
#include "bake_minimal/ground.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace relit::bake {
namespace {

// A clip without horizontal extent still gets a disc.
constexpr double kLeastRadius = 1e-3;

Status check(const glm::vec3& lo, const glm::vec3& hi, const GroundOptions& o) {
  for (int k = 0; k < 3; ++k) {
    // Written so that NaN fails it.
    if (!(std::isfinite(lo[k]) && std::isfinite(hi[k]) && lo[k] <= hi[k])) {
      return fail(ErrorCode::kInvalid, "ground: the clip's bounds are not finite and ascending");
    }
    if (!(o.albedo[k] >= 0 && o.albedo[k] <= 1)) {
      return fail(ErrorCode::kInvalid, "ground: the albedo must be within 0..1");
    }
  }
  if (!(o.radius > 0 && o.radius <= 1000)) {
    return fail(ErrorCode::kInvalid, "ground: the radius must be above 0 and at most 1000");
  }
  if (o.segments < 3 || o.segments > 4096 || o.rings < 1 || o.rings > 1024) {
    return fail(ErrorCode::kInvalid,
                "ground: segments must be within 3..4096, rings within 1..1024");
  }
  return {};
}

void add_vertex(Primitive& disc, const glm::dvec3& centre, const glm::dvec2& unit, double radius) {
  disc.positions.emplace_back(centre + radius * glm::dvec3(unit.x, 0.0, unit.y));
  disc.normals.emplace_back(0.0f, 1.0f, 0.0f);
  disc.texcoords.front().emplace_back(0.5 + 0.5 * unit);
}

Primitive make_disc(const glm::dvec3& centre, double radius, const GroundOptions& o) {
  Primitive disc;
  disc.name = "ground";
  disc.texcoords.resize(1);
  add_vertex(disc, centre, glm::dvec2(0.0), radius);
  for (int ring = 1; ring <= o.rings; ++ring) {
    // Shadows and contact lie in the middle; quantised positions and normals do not care.
    const double r = std::pow(static_cast<double>(ring) / o.rings, 1.25);
    for (int s = 0; s < o.segments; ++s) {
      const double angle = 2 * std::numbers::pi * s / o.segments;
      add_vertex(disc, centre, r * glm::dvec2(std::cos(angle), std::sin(angle)), radius);
    }
  }
  const auto n = static_cast<std::uint32_t>(o.segments);
  // x to the right, z towards the viewer: counter-clockwise from above runs against the angle.
  for (std::uint32_t s = 0; s < n; ++s) {
    disc.indices.insert(disc.indices.end(), {0u, 1 + (s + 1) % n, 1 + s});
  }
  for (std::uint32_t ring = 1; ring < static_cast<std::uint32_t>(o.rings); ++ring) {
    const std::uint32_t inner = 1 + (ring - 1) * n;
    const std::uint32_t outer = inner + n;
    for (std::uint32_t s = 0; s < n; ++s) {
      const std::uint32_t next = (s + 1) % n;
      disc.indices.insert(disc.indices.end(), {inner + s, inner + next, outer + next});
      disc.indices.insert(disc.indices.end(), {inner + s, outer + next, outer + s});
    }
  }
  return disc;
}

}  // namespace

Result<std::uint32_t> add_ground(Scene& scene, const glm::vec3& bounds_min,
                                 const glm::vec3& bounds_max, const GroundOptions& options) {
  RELIT_TRY(check(bounds_min, bounds_max, options));
  const glm::dvec3 lo(bounds_min), hi(bounds_max);
  const glm::dvec3 centre((lo.x + hi.x) / 2, lo.y, (lo.z + hi.z) / 2);
  const double half = std::max(hi.x - lo.x, hi.z - lo.z) / 2;
  Primitive disc = make_disc(centre, std::max(kLeastRadius, options.radius * half), options);

  Material material;
  material.name = "ground";
  material.base_color = glm::vec4(options.albedo, 1.0f);
  disc.material = static_cast<int>(scene.materials.size());
  scene.materials.push_back(std::move(material));

  Node node;
  node.name = "ground";
  disc.node = static_cast<int>(scene.nodes.size());
  scene.nodes.push_back(std::move(node));

  scene.primitives.push_back(std::move(disc));
  return static_cast<std::uint32_t>(scene.primitives.size() - 1);
}

}  // namespace relit::bake
