// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "bake_minimal/transfer_shape.hpp"
#include "container/base/result.hpp"

/// Transfer as the mesh's own normals predict it, and what is left as principal planes.
///
/// The prediction of texel p is s·b with b_n = A_l/π · Y_n(N), the transfer of an unoccluded convex
/// body (design, section 1), the same for all channels, and s, about the ambient occlusion, the
/// least squares best in the metric W of light_metric(). What is left after it and after its mean
/// μ, as a vector of coefficients × channels and multiplied by √W, is turned into the axes of its
/// covariance over all texels and frames (the Karhunen-Loève transform). There an error of one in
/// any plane is an error of one in the composites, on the average over lights, so that one
/// quantisation step serves all planes, and leaving planes out from the end costs least.
namespace relit::bake {

/// One frame as the planes are made of it.
struct TransferFrame {
  std::span<const float> transfer;       ///< [coefficients][3][H][W]
  std::span<const glm::vec3> normals{};  ///< [H][W], unit or zero; empty without prediction
};

struct PrincipalPlanes {
  bool predicted = false;
  int coefficients = 0;
  std::vector<double> metric;  ///< W, [coefficients][coefficients]
  std::vector<double> mean;    ///< μ, [coefficients × 3]
  /// Of each plane after s, by falling energy: value = Σ_i analysis[i]·(T − s·b − μ)[i], and T −
  /// s·b − μ ≈ Σ_k value_k·synthesis_k[i]; i = 3·coefficient + channel.
  std::vector<std::vector<double>> analysis, synthesis;
  std::vector<double> energy;  ///< mean square of each plane's values
  double prediction_gain = 1;  ///< RMS error in composites that an error of one in s makes
  double mean_square = 0;      ///< of the composites, channels added up; compares with `energy`
};

/// b of a normal; nothing where there is none (zero): `b` has one entry for each coefficient.
void predicted_transfer(const glm::vec3& normal, std::span<double> b);

/// s of every texel, [H][W]; 0 where there is no normal.
void fit_prediction(const PrincipalPlanes& planes, const TransferFrame& frame,
                    std::span<double> scales);

/// First pass over a clip: gathers the moments from which the planes follow. Frames in order.
class PrincipalAnalysis {
 public:
  /// `counted`: [H][W], nonzero where a texel is of the surface.
  PrincipalAnalysis(const TransferShape& shape, bool predict, std::vector<std::uint8_t> counted);
  /// Errors: those of check_transfer().
  Status add_frame(const TransferFrame& frame);
  /// At most `count` planes besides s, fewer where the others hold no energy at all (rank-deficient
  /// clips: less than 1e-12 of the composites' mean square); 0: as many as leave less than 1e-5 of
  /// it out.
  [[nodiscard]] PrincipalPlanes finish(int count) const;

 private:
  [[nodiscard]] double square(std::span<const float> transfer, std::size_t texel) const;

  TransferShape shape_;
  PrincipalPlanes planes_;  ///< what is known beforehand
  std::vector<std::uint8_t> counted_;
  std::vector<double> scales_;
  std::vector<double> sum_;       ///< of the residual, [i]
  std::vector<double> products_;  ///< [i][i], the upper triangle
  double gain_ = 0;
  double shown_ = 0;  ///< sum of the composites' squares
  double samples_ = 0;
  std::uint64_t frames_ = 0;
};

}  // namespace relit::bake
