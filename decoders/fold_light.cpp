// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <numbers>
#include <string>

#include "decoders/composite.hpp"

namespace relit::decoders {
namespace {

using Rgb64 = std::array<double, 3>;

/// The divisor of everything. A light fainter than the least normal float counts as none: 1, and
/// zeros.
Result<float> magnitude_of(const Light& light) {
  double largest = 0;
  for (const Rgb64& row : light.sh) {
    for (double value : row) {
      if (!std::isfinite(value)) {
        return fail(ErrorCode::kInvalid, "coefficient " + std::to_string(&row - light.sh.data()) +
                                             " of the light is not finite");
      }
      largest = std::max(largest, std::abs(value));
    }
  }
  if (largest > static_cast<double>(FLT_MAX)) {
    return fail(ErrorCode::kInvalid,
                "the light's largest coefficient is beyond the range of float");
  }
  return static_cast<float>(largest);
}

Result<Rgb> to_float(const Rgb64& value, const char* what) {
  Rgb rgb;
  for (std::size_t c = 0; c < 3; ++c) {
    rgb[c] = static_cast<float>(value[c]);
    if (!std::isfinite(rgb[c])) {
      return fail(ErrorCode::kInvalid, std::string(what) + " is beyond the range of float");
    }
  }
  return rgb;
}

}  // namespace

Status fold_light(const container::ModelRecord& model,
                  std::span<const container::LayerRecord> layers, const Light& light,
                  FoldedWeights& out) {
  if (light.order() < 0) {
    return fail(ErrorCode::kInvalid,
                "a light has 1, 4, 9 or 16 coefficients, not " + std::to_string(light.sh.size()));
  }
  RELIT_ASSIGN(float magnitude, magnitude_of(light));
  const bool black = magnitude < FLT_MIN;
  if (black) magnitude = 1;

  const auto count = static_cast<std::size_t>(coefficient_count(std::min<int>(model.order, 3)));
  std::array<Rgb64, 16> normalised{};
  if (!black) {
    for (std::size_t n = 0; n < std::min(count, light.sh.size()); ++n) {
      for (std::size_t c = 0; c < 3; ++c) {
        normalised[n][c] = light.sh[n][c] / static_cast<double>(magnitude);
      }
    }
  }

  FoldedLight folded;
  folded.magnitude = magnitude;
  folded.prediction_plane = model.prediction_plane;
  Rgb64 constant{};
  for (std::size_t n = 0; n < std::min(count, model.mean.size()); ++n) {
    for (std::size_t c = 0; c < 3; ++c) {
      constant[c] += normalised[n][c] * static_cast<double>(model.mean[n][c]);
    }
  }
  RELIT_ASSIGN(folded.constant, to_float(constant, "the light times the model's mean"));
  for (std::size_t n = 0; n < count; ++n) {
    const double cosine = clamped_cosine(band_of(static_cast<int>(n))) / std::numbers::pi;
    for (std::size_t c = 0; c < 3; ++c) {
      folded.irradiance[n][c] = static_cast<float>(normalised[n][c] * cosine);
    }
  }

  out.weights.clear();
  for (const container::LayerRecord& layer : layers) {
    for (const container::PlaneRecord& plane : layer.planes) {
      Rgb64 weight{};
      for (const container::MatrixEntry& entry : plane.matrix) {
        if (entry.coefficient >= count || entry.channel >= 3) {
          return fail(ErrorCode::kInvalid, "plane " + std::to_string(out.weights.size()) +
                                               " has a matrix entry for coefficient " +
                                               std::to_string(entry.coefficient) + ", channel " +
                                               std::to_string(entry.channel) + "; the model has " +
                                               std::to_string(count) +
                                               " coefficients of 3 channels");
        }
        weight[entry.channel] +=
            normalised[entry.coefficient][entry.channel] * static_cast<double>(entry.value);
      }
      RELIT_ASSIGN(const Rgb rgb, to_float(weight, "the weight of a plane"));
      out.weights.push_back(rgb);
    }
  }
  if (model.prediction_plane < -1 ||
      model.prediction_plane >= static_cast<std::int64_t>(out.weights.size())) {
    return fail(ErrorCode::kInvalid, "prediction plane " + std::to_string(model.prediction_plane) +
                                         " is not one of " + std::to_string(out.weights.size()));
  }
  folded.weights = out.weights;
  out.view = folded;
  return {};
}

}  // namespace relit::decoders
