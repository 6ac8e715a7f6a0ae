// SPDX-License-Identifier: MIT
#include "decoders/relit_error.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace relit::decoders {

void Histogram::add(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(std::max(value, 0.0f));
  ++counts_[bits >> (32 - kBits)];
  ++total_;
}

double Histogram::percentile(double percent) const {
  if (total_ == 0) return 0;
  const double rank = std::clamp(percent, 0.0, 100.0) / 100 * static_cast<double>(total_ - 1);
  double below = 0;
  for (std::size_t bin = 0; bin < counts_.size(); ++bin) {
    const auto count = static_cast<double>(counts_[bin]);
    if (below + count <= rank) {
      below += count;
      continue;
    }
    const auto edge = [](std::size_t i) {
      return static_cast<double>(
          std::bit_cast<float>(static_cast<std::uint32_t>(i) << (32 - kBits)));
    };
    return std::lerp(edge(bin), edge(bin + 1), (rank - below + 0.5) / count);
  }
  return 0;
}

RelitError::RelitError(std::span<const Light> lights, int coefficients,
                       std::span<const std::uint8_t> covered)
    : coefficients_(static_cast<std::size_t>(coefficients)), texel_count_(covered.size()) {
  for (const Light& light : lights) {
    auto& channels = lights_.emplace_back();
    for (std::size_t c = 0; c < 3; ++c) {
      channels[c].resize(coefficients_);
      for (std::size_t n = 0; n < std::min(coefficients_, light.sh.size()); ++n)
        channels[c][n] = light.sh[n][c];
    }
  }
  for (std::size_t p = 0; p < covered.size(); ++p)
    if (covered[p] != 0) texels_.push_back(p);
}

void RelitError::add_frame(std::span<const float> reference, std::span<const float> decoded) {
  std::vector<double> truth(coefficients_), error(coefficients_);
  for (std::size_t c = 0; c < 3; ++c) {
    for (const std::size_t p : texels_) {
      for (std::size_t n = 0; n < coefficients_; ++n) {
        const std::size_t at = (3 * n + c) * texel_count_ + p;
        truth[n] = static_cast<double>(reference[at]);
        error[n] = static_cast<double>(decoded[at]) - truth[n];
      }
      for (const auto& light : lights_) {
        double composite = 0, difference = 0;
        for (std::size_t n = 0; n < coefficients_; ++n) {
          composite += light[c][n] * truth[n];
          difference += light[c][n] * error[n];
        }
        difference = std::abs(difference);
        composites_.add(static_cast<float>(composite));
        errors_.add(static_cast<float>(difference));
        squares_ += difference * difference;
        largest_ = std::max(largest_, difference);
      }
    }
  }
  samples_ += 3 * texels_.size() * lights_.size();
}

RelitError::Figures RelitError::figures() const {
  Figures figures;
  figures.peak = composites_.percentile(99.9);
  if (samples_ == 0 || !(figures.peak > 0)) return figures;
  const double mean_square = squares_ / static_cast<double>(samples_);
  figures.psnr_db = mean_square > 0 ? 10 * std::log10(figures.peak * figures.peak / mean_square)
                                    : std::numeric_limits<double>::infinity();
  figures.p99 = errors_.percentile(99) / figures.peak;
  figures.largest = largest_ / figures.peak;
  return figures;
}

}  // namespace relit::decoders
