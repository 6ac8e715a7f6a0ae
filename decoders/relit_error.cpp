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
                       std::span<const std::uint8_t> covered, double peak)
    : coefficients_(static_cast<std::size_t>(coefficients)),
      texel_count_(covered.size()),
      peak_(peak) {
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

void RelitError::add(double truth, double difference) {
  const double error = std::abs(difference);
  composites_.add(static_cast<float>(truth));
  errors_.add(static_cast<float>(error));
  squares_ += error * error;
  largest_ = std::max(largest_, error);
  ++samples_;
  if (!(peak_ > 0)) return;
  const double floor = std::ldexp(1.0, -kStops);
  const double stops = std::log2((std::max(truth + difference, 0.0) / peak_ + floor) /
                                 (std::max(truth, 0.0) / peak_ + floor));
  log_squares_ += stops * stops;
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
        add(composite, difference);
      }
    }
  }
}

bool RelitError::add_light_map(std::size_t light, std::span<const float> reference,
                               std::span<const float> light_map) {
  for (std::size_t c = 0; c < 3; ++c) {
    const std::vector<double>& weights = lights_[light][c];
    for (const std::size_t p : texels_) {
      double composite = 0;
      for (std::size_t n = 0; n < coefficients_; ++n)
        composite += weights[n] * static_cast<double>(reference[(3 * n + c) * texel_count_ + p]);
      const auto shown = static_cast<double>(light_map[c * texel_count_ + p]);
      if (!std::isfinite(shown)) return false;
      add(composite, shown - composite);
    }
  }
  return true;
}

RelitError::Figures RelitError::figures() const {
  Figures figures;
  figures.peak = peak_ > 0 ? peak_ : composites_.percentile(99.9);
  if (samples_ == 0 || !(figures.peak > 0)) return figures;
  const double mean_square = squares_ / static_cast<double>(samples_);
  figures.psnr_db = mean_square > 0 ? 10 * std::log10(figures.peak * figures.peak / mean_square)
                                    : std::numeric_limits<double>::infinity();
  const double log_mean_square = log_squares_ / static_cast<double>(samples_);
  if (peak_ > 0) {
    figures.log_psnr_db = log_mean_square > 0 ? 10 * std::log10(kStops * kStops / log_mean_square)
                                              : std::numeric_limits<double>::infinity();
  }
  figures.p99 = errors_.percentile(99) / figures.peak;
  figures.largest = largest_ / figures.peak;
  return figures;
}

namespace {

// One axis of a bilinear filter whose texel centres line up.
struct MapTap {
  std::size_t low, high;
  double t;
};

std::vector<MapTap> map_taps(std::size_t from, std::size_t to) {
  std::vector<MapTap> result(to);
  for (std::size_t i = 0; i < to; ++i) {
    const double x = std::clamp(
        (static_cast<double>(i) + 0.5) * static_cast<double>(from) / static_cast<double>(to) - 0.5,
        0.0, static_cast<double>(from - 1));
    const auto low = std::min(static_cast<std::size_t>(x), from > 1 ? from - 2 : 0);
    result[i] = {low, std::min(low + 1, from - 1), x - static_cast<double>(low)};
  }
  return result;
}

}  // namespace

void resize_map(std::span<const float> from, const MapSize& from_size, std::span<float> to,
                const MapSize& to_size) {
  const std::vector<MapTap> rows = map_taps(from_size.height, to_size.height),
                            columns = map_taps(from_size.width, to_size.width);
  const auto at = [&](std::size_t i, std::size_t j) {
    return static_cast<double>(from[i * from_size.width + j]);
  };
  float* target = to.data();
  for (const MapTap& y : rows) {
    for (const MapTap& x : columns) {
      const double low = (1 - x.t) * at(y.low, x.low) + x.t * at(y.low, x.high);
      const double high = (1 - x.t) * at(y.high, x.low) + x.t * at(y.high, x.high);
      *target++ = static_cast<float>((1 - y.t) * low + y.t * high);
    }
  }
}

}  // namespace relit::decoders
