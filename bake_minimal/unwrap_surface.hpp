// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <span>
#include <vector>

namespace relit::bake {

inline constexpr std::uint32_t kNoTriangle = std::numeric_limits<std::uint32_t>::max();

/// What is to be unwrapped: all primitives' vertices one after the other.
struct SurfaceInput {
  std::span<const glm::vec3> positions;  ///< posed, metres × wanted density
  std::span<const glm::vec3> normals;    ///< unit length; as many, or none
  std::span<const std::uint32_t>
      vertex_group;  ///< surfaces of different groups never share a chart
  std::span<const std::uint32_t> indices;
};

/// How the shading bends across an edge.
enum class Crease : std::uint8_t {
  kSmooth,
  kHard,   ///< the vertex normals differ by more than 30°
  kSharp,  ///< and the triangles by more than 60°
};

/// Triangles joined over their edges, whatever vertices the file split. Vertices of one group
/// closer than a millionth of the extent are one point. Two triangles are neighbours across an edge
/// that they run through in opposite directions; where more than two meet (soup, thin sheets
/// modelled twice) the straightest pairs are. Triangles without area (height below 1e-4 of the
/// longest side, or not finite) have area 0 and no neighbours.
struct Surface {
  std::vector<glm::dvec3> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< into points
  std::vector<glm::dvec3> normals;                      ///< by triangle; 0 without area
  std::vector<double> areas;
  std::vector<std::array<std::uint32_t, 3>> neighbours;  ///< across corner i to i+1, or kNoTriangle
  std::vector<std::array<Crease, 3>> creases;            ///< across corner i to i+1

  explicit Surface(const SurfaceInput& input);

  [[nodiscard]] const glm::dvec3& corner(std::uint32_t t, std::size_t i) const {
    return points[triangles[t][i]];
  }
  [[nodiscard]] double edge_length(std::uint32_t t, std::size_t i) const {
    return glm::length(corner(t, (i + 1) % 3) - corner(t, i));
  }
  /// The side of `t` that `neighbour` lies across; they are neighbours.
  [[nodiscard]] std::size_t side_towards(std::uint32_t t, std::uint32_t neighbour,
                                         std::uint32_t first_point) const;
};

}  // namespace relit::bake
