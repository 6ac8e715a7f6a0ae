// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "container/base/result.hpp"
#include "decoders/mesh.hpp"
#include "decoders/pose.hpp"

namespace relit::decoders {

/// The normals of a light map's texels, as the prediction of a model takes them (FORMAT.md,
/// "Texels and the surface"): the posed mesh's own at a texel's centre, or at the surface point
/// nearest to it where only its square touches a chart; the mean of its neighbours' where it is
/// next to such a texel, so that bilinear lookups inside charts never meet one without; zero
/// elsewhere. Not thread-safe.
class TexelNormals {
 public:
  /// `meshes` are those of the clip in order and must outlive this. Errors: kLimit for UVs that
  /// overlap beyond sense, kOutOfMemory.
  static Result<TexelNormals> create(std::span<const Mesh> meshes, int width, int height);

  /// The normals at a pose, unit vectors in model space or zero, into `out`, which is
  /// [height][width]. Allocates nothing.
  void compute(const Pose& pose, std::span<glm::vec3> out);

  /// Sets mask[y × width + x] to 1 where a texel has a normal; others are left as they are.
  void mark(std::span<std::uint8_t> mask) const;

  /// Of all that it keeps, for a light map of so many texels and meshes of so many vertices and
  /// indices, the largest of them having `most_vertices`.
  [[nodiscard]] static std::size_t memory_bytes(std::size_t texels, std::size_t vertices,
                                                std::size_t most_vertices, std::size_t indices);

 private:
  /// A texel on the surface, with its barycentrics in 1/65535, whose rounding turns a normal by
  /// less than 2^-15 of the angle between its corners'; or one beside it, with a bit in b1 for each
  /// of its eight neighbours that is on the surface.
  struct Place {
    std::uint32_t texel;
    std::uint32_t triangle;  ///< kBeside: beside the surface
    std::uint16_t b1, b2;
  };

  TexelNormals() = default;
  void add_fringe();

  std::span<const Mesh> meshes_;
  int width_ = 0, height_ = 0;
  std::vector<std::uint32_t> indices_;  ///< of all meshes, into normals_
  std::vector<Place> places_;           ///< those on the surface, then those beside it, by texel
  std::size_t on_surface_ = 0;          ///< of places_
  std::vector<glm::vec3> positions_;    ///< of the largest mesh: working memory
  std::vector<glm::vec3> normals_;      ///< of all meshes' vertices
};

}  // namespace relit::decoders
