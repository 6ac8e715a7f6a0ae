// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "container/base/plane_view.hpp"
#include "container/records.hpp"

namespace relit::player {

/// What a hurried player gives up of a light map.
struct RelightQuality {
  int planes = -1;  ///< only the first so many, in the model's order of importance; -1: all
  /// Composites every second texel of every second row, filtered as ever: a quarter of the work.
  /// (On the mannequin that is 31 to 34 dB from the full map, 0.3 to 0.6 dB more than means of four
  /// texels would give for all of the work. Where the sum is fused into the meshes' shader there is
  /// no light map to make smaller.)
  bool half_size = false;
  bool operator==(const RelightQuality&) const = default;
};

/// Which planes of a model a light needs. Left out are planes without a weight, those beyond the
/// quality's, and, where the exposure is known, the faintest as long as all of them together could
/// not move any pixel by half an 8-bit step.
///
/// That bound: plane k adds at most |w[k]|·max|value_k| to each channel of a texel, filtering does
/// not raise it, and albedo is at most 1. What is displayed is sRGB(tone map(exposure · magnitude ·
/// composite)). sRGB is nowhere steeper than 12.92, at black, where no tone map is steeper than 2
/// (linear 1, filmic 0.21; neutral 1 for a channel and 1 more for the least of the three, which is
/// taken off it); filmic's steepest, 1.5, is where sRGB has slopes below 3. So the planes left out
/// move a pixel by at most 25.84 · exposure · magnitude · Σ |w[k]|·max|value_k|, which is kept
/// below 0.5/255. Only planes without exponents have a max|value| that is known beforehand, scale ·
/// mantissa zero; of the others only those without a weight are left out.
class PlaneNeeds {
 public:
  explicit PlaneNeeds(std::span<const container::LayerRecord> layers = {});

  /// `exposure` of the view; 0: unknown. Allocates nothing.
  void update(const FoldedLight& light, const RelightQuality& quality, float exposure);

  /// 1: needed.
  [[nodiscard]] std::span<const std::uint8_t> planes() const { return planes_; }
  /// 1: one of its planes is needed.
  [[nodiscard]] std::span<const std::uint8_t> layers() const { return layers_; }

 private:
  struct Faint {
    double most = 0;  // that the plane can add
    std::size_t plane = 0;
  };
  std::vector<std::size_t> layer_of_;
  std::vector<double> largest_;  // max|value|; infinite: not known
  std::vector<Faint> faint_;
  std::vector<std::uint8_t> planes_, layers_;
};

}  // namespace relit::player
