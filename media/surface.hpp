// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace relit::media {

/// What the triangles are made of; also the order of the materials in the file.
enum class Matter : std::uint8_t { kBeech, kWalnut, kCloth, kTrim, kPlaster, kCount };

/// Joints and weights of one vertex.
struct Influence {
  std::array<std::uint8_t, 4> joints{};
  std::array<float, 4> weights{1.0f, 0.0f, 0.0f, 0.0f};
};

/// How a light-map chart is unrolled.
enum class Unroll : std::uint8_t {
  kStrip,  ///< rows as wide as their perimeter, one below the other
  kDisc,   ///< radius = distance along the surface from the first row, which is a pole
};

/// A strip of another material across a surface, between two values of t.
struct Band {
  double t0 = 0, t1 = 0;
  Matter matter = Matter::kWalnut;
};

/// Where a turned part lay in the trunk it was cut from: the grain runs along y, and the year rings
/// are cylinders around a pith that lies `pith_m` from the part's axis in the direction `angle`.
struct Grain {
  double angle = 0;
  double pith_m = 0.12;
  double offset_m = 0;  ///< along the grain
};

/// A closed sweep: rings of points. point(t, angle) with t in 0..1 and angle in 0..2 pi from the
/// seam, metres, in the frame of its joint (of the model where it is skinned).
struct Surface {
  std::string name;
  int joint = -1;  ///< rigid with this joint, -1: rigid with the model
  std::function<glm::dvec3(double, double)> point{};
  std::function<Influence(const glm::dvec3&, double)> influence{};  ///< set: skinned
  Matter matter = Matter::kBeech;
  std::vector<Band> bands{};
  Unroll unroll = Unroll::kStrip;
  int columns = 20;
  double tolerance_m = 0.0017;  ///< how far a ring may lie from the chord of its neighbours
  double step_m = 0.05;         ///< between rings, at most
  double texel_weight = 1.0;    ///< linear density of light-map texels against the others'
  double narrowest = 0.35;      ///< of a strip, against its widest row
  Grain grain{};
};

/// Light-map chart before it has a place: metres of surface.
struct Chart {
  Unroll unroll = Unroll::kStrip;
  double weight = 1.0;
  std::vector<double> row_at{};     ///< distance of every row from the first
  std::vector<double> row_width{};  ///< perimeter of every row; strips only
};

struct Vertex {
  glm::vec3 position{0.0f};
  glm::vec3 normal{0.0f, 1.0f, 0.0f};
  glm::vec2 wood{0.0f};      ///< TEXCOORD_0
  glm::vec2 lightmap{0.0f};  ///< TEXCOORD_1
  Influence influence;
};

/// A tessellated surface. Vertices lie in rows of columns + 1 (the seam is there twice).
struct Patch {
  std::string name;
  int joint = -1;
  bool skinned = false;
  int columns = 0;
  std::vector<Vertex> vertices{};
  std::vector<std::array<std::uint32_t, 3>> triangles{};  ///< counter-clockwise seen from outside
  std::vector<Matter> matter{};                           ///< of every triangle
  Chart chart{};
};

/// One row of a profile: an ellipse in the plane y, with its front (+z) and back half-axes, the
/// place of its centre and a superellipse exponent (2: ellipse, more: boxier).
struct Ring {
  double y = 0, rx = 0, front = 0, back = 0;
  double cx = 0, cz = 0;
  double exponent = 2;
};

/// A surface through the rings (centripetal Catmull-Rom); a first or last ring of radius 0 is a
/// smooth pole. `seam` is the angle from +z (towards +x) at which the chart is cut open.
[[nodiscard]] std::function<glm::dvec3(double, double)> loft(std::vector<Ring> rings, double seam);

/// The t at which a surface that runs along y first reaches `y`.
[[nodiscard]] double find_height(const std::function<glm::dvec3(double, double)>& point, double y);

/// Chooses the rings by curvature, computes normals, grain coordinates and the chart.
[[nodiscard]] Patch tessellate(const Surface& surface);

}  // namespace relit::media
