// SPDX-License-Identifier: MIT
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "container/base/plane_view.hpp"
#include "container/base/result.hpp"
#include "container/records.hpp"
#include "decoders/sh.hpp"

namespace relit::decoders {

/// Owns what a FoldedLight views.
struct FoldedWeights {
  std::vector<Rgb> weights;
  FoldedLight view;  ///< view.weights points at `weights`; copy with care: refold instead
};

/// Folds a light into a model: w[k] = Σ_n L_n M[n,·,k] (design, section 2), in double precision, then
/// divided by the light's largest magnitude. Coefficients that the light or the model lacks count as
/// zero. `layers` are the model's, in order; planes are numbered through them. Reuses `out`'s memory.
/// Errors: kInvalid for a light that is not finite.
Status fold_light(const container::ModelRecord& model, std::span<const container::LayerRecord> layers,
                  const Light& light, FoldedWeights& out);

/// The composite, on the CPU: light map = s·E(N) + constant + Σ_k w[k]·value_k for every texel.
struct CompositeJob {
  std::span<const PlaneView> planes;  ///< as many as light.weights; empty views where w[k] is zero
  FoldedLight light;
  int width = 0;   ///< of the light map; every plane covers it
  int height = 0;
  std::span<const glm::vec3> normals;  ///< width × height, only with a prediction plane
  std::span<float> out;  ///< [3][height][width], linear, divided by light.magnitude, may be negative

  /// Sizes, shifts and finiteness; call once per configuration. Errors: kInvalid.
  [[nodiscard]] Status validate() const;
  /// Runs the fastest kernel the processor has. Allocates nothing.
  void run() const;
  /// The scalar kernel by which the others are tested.
  void run_scalar() const;
};

/// Which kernel run() takes: "scalar", "sse2", "avx2" or "neon".
[[nodiscard]] const char* composite_kernel();

}  // namespace relit::decoders
