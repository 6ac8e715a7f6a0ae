// SPDX-License-Identifier: MIT
#include "player/plane_needs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace relit::player {
namespace {

constexpr double kHalfStep = 0.5 / 255;
constexpr double kSteepest = 2 * 12.92;  // of the tone map times that of the sRGB curve

double largest_weight(const Rgb& weight) {
  return static_cast<double>(
      std::max({std::abs(weight[0]), std::abs(weight[1]), std::abs(weight[2])}));
}

}  // namespace

PlaneNeeds::PlaneNeeds(std::span<const container::LayerRecord> layers) {
  for (std::size_t l = 0; l < layers.size(); ++l) {
    for (const container::PlaneRecord& plane : layers[l].planes) {
      const double zero = layers[l].bit_depth == 8 ? 128 : 512;
      layer_of_.push_back(l);
      largest_.push_back(layers[l].has_exponents
                             ? std::numeric_limits<double>::infinity()
                             : std::abs(static_cast<double>(plane.scale)) * zero);
    }
  }
  planes_.resize(layer_of_.size());
  layers_.resize(layers.size());
  faint_.reserve(layer_of_.size());
}

void PlaneNeeds::update(const FoldedLight& light, const RelightQuality& quality, float exposure) {
  const std::size_t kept = quality.planes < 0
                               ? planes_.size()
                               : std::min(planes_.size(), static_cast<std::size_t>(quality.planes));
  faint_.clear();
  for (std::size_t k = 0; k < planes_.size(); ++k) {
    const double weight = largest_weight(light.weights[k]);
    const bool predicts = static_cast<int>(k) == light.prediction_plane;
    planes_[k] = k < kept && (weight > 0 || predicts) ? 1 : 0;
    if (planes_[k] != 0 && !predicts) faint_.push_back({weight * largest_[k], k});
  }
  const double shown = static_cast<double>(exposure) * static_cast<double>(light.magnitude);
  if (shown > 0) {
    std::sort(faint_.begin(), faint_.end(), [](const Faint& a, const Faint& b) {
      return a.most != b.most ? a.most < b.most : a.plane > b.plane;
    });
    double moved = 0;
    for (const Faint& faint : faint_) {
      moved += kSteepest * shown * faint.most;
      if (!(moved < kHalfStep)) break;
      planes_[faint.plane] = 0;
    }
  }
  std::fill(layers_.begin(), layers_.end(), std::uint8_t{0});
  for (std::size_t k = 0; k < planes_.size(); ++k)
    if (planes_[k] != 0) layers_[layer_of_[k]] = 1;
}

}  // namespace relit::player
