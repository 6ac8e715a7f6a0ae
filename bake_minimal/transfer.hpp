// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "bake_minimal/atlas.hpp"
#include "bake_minimal/scene.hpp"
#include "container/base/result.hpp"

namespace relit::bake {

inline constexpr std::uint32_t kNoOtherSide = 0xffffffffu;

/// What a ray needs to know of a surface it hits: its albedo as the player will see it. The image
/// is borrowed.
struct HitSurface {
  glm::vec4 base_color{1.0f};  ///< linear, straight alpha
  const Image* image = nullptr;
  container::Wrap wrap_u = container::Wrap::kRepeat;
  container::Wrap wrap_v = container::Wrap::kRepeat;
  bool linear_filter = true;
  bool masked = false;  ///< rays pass where alpha < cutoff
  float alpha_cutoff = 0.5f;
};

/// The geometry of a clip that does not change from frame to frame. Vertices of all meshes follow
/// one another; everything per vertex has the same length, everything per triangle indices.size()
/// / 3.
struct TraceGeometry {
  std::vector<std::uint32_t> indices;
  std::vector<std::uint32_t> surface;     ///< of each triangle, into `surfaces`
  std::vector<std::uint32_t> other_side;  ///< of each triangle, or kNoOtherSide
  std::vector<glm::vec2> lightmap_uv;     ///< per vertex
  std::vector<glm::vec2> albedo_uv;       ///< per vertex, transformed
  std::vector<glm::vec4> colors;          ///< per vertex; may be empty
  std::vector<HitSurface> surfaces;
};

struct TransferOptions {
  int order = 2;
  int directions = 1024;  ///< over the whole sphere; multiples of 16 waste no lane
  int bounces = 1;
  std::uint64_t seed = 0;  ///< turns the directions
  int threads = 0;         ///< 0: one per processor
  int width = 128;         ///< of the light map, texels
  int height = 128;
};

/// `count` directions spread evenly over the sphere (a spherical Fibonacci lattice turned by
/// `seed`), in an order in which neighbours point alike. The same for every texel and every frame,
/// so that the sampling error does not flicker (Fatahalian, A.2).
[[nodiscard]] std::vector<glm::vec3> sphere_directions(int count, std::uint64_t seed);

/// Linear albedo and alpha of a surface at texture coordinates.
[[nodiscard]] glm::vec4 surface_albedo(const HitSurface& surface, glm::vec2 uv, glm::vec4 color);

/// Traces transfer vectors (Fatahalian, appendix A with the errata): for unit albedo at the texel,
///
///     T_n = (1/π) ∫ max(N·s, 0) [V(s) Y_n(s) + (1 − V(s)) ρ(hit) T_n(hit)] ds,
///
/// the second term once per bounce with the increment of the bounce before. Owns an Embree device.
class TransferTracer {
 public:
  /// Errors: kInvalid (sizes that do not fit, options out of range), kEnvironment (Embree).
  static Result<TransferTracer> create(TraceGeometry geometry, std::vector<TexelSample> samples,
                                       const TransferOptions& options);
  TransferTracer(TransferTracer&&) noexcept;
  TransferTracer& operator=(TransferTracer&&) noexcept;
  ~TransferTracer();

  /// One frame. `positions` and `normals` (unit) per vertex. Writes
  /// transfer [coefficients][3][samples] and, where `buried` is not empty, 1 for a sample that lies
  /// inside closed geometry (most of its rays hit back faces): nobody sees it, and its value, which
  /// is written all the same, is better taken from its neighbours. The result does not depend on
  /// the number of threads. Errors: kInvalid for positions that are not finite (says which vertex).
  Status trace(std::span<const glm::vec3> positions, std::span<const glm::vec3> normals,
               std::span<float> transfer, std::span<std::uint8_t> buried);

  [[nodiscard]] std::span<const TexelSample> samples() const;
  [[nodiscard]] const TransferOptions& options() const;
  /// Rays traced by the last call.
  [[nodiscard]] std::uint64_t rays() const;

 private:
  struct Impl;
  explicit TransferTracer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace relit::bake
