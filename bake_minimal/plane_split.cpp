// SPDX-License-Identifier: MIT
#include "bake_minimal/plane_split.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "bake_minimal/light_metric.hpp"
#include "decoders/sh.hpp"

namespace relit::bake {
namespace {

using container::Chroma;

/// Principal planes of the layers after s; those that remain are the last layer's.
constexpr int kFirstLayers[] = {3};

}  // namespace

Basis basis_of(const CodingOptions& o) {
  if (*o.chroma == Chroma::kLuma) return Basis::kLuma;
  return o.lossless ? Basis::kGbr : Basis::kYCoCg;
}

int component_count(Basis basis) { return basis == Basis::kLuma ? 1 : 3; }

std::array<double, 3> to_components(Basis basis, const std::array<double, 3>& rgb) {
  const auto [r, g, b] = rgb;
  switch (basis) {
    case Basis::kYCoCg:
      return {(r + 2 * g + b) / 4, (r - b) / 2, (2 * g - r - b) / 4};
    case Basis::kGbr:
      return {g, b, r};
    case Basis::kLuma:
      return {(r + g + b) / 3, 0, 0};
  }
  return {};
}

std::array<double, 3> to_rgb(Basis basis, const std::array<double, 3>& components) {
  const auto [x, y, z] = components;
  switch (basis) {
    case Basis::kYCoCg:
      return {x + y - z, x + z, x - y - z};
    case Basis::kGbr:
      return {z, x, y};
    case Basis::kLuma:
      return {x, x, x};
  }
  return {};
}

PlaneSplit PlaneSplit::colour(const TransferShape& shape, const CodingOptions& resolved) {
  PlaneSplit split;
  split.shape_ = shape;
  split.basis_ = basis_of(resolved);
  // Orders that there are not are plan_layers()'s to refuse.
  const int order = std::clamp(shape.order, 0, 3);
  const auto count = static_cast<std::size_t>(decoders::coefficient_count(order));
  const std::vector<double> metric = light_metric(order);
  for (std::size_t n = 0; n < count; ++n) {
    const int band = decoders::band_of(static_cast<int>(n));
    split.band_rms_[static_cast<std::size_t>(band)] += metric[n * count + n] / (2 * band + 1);
  }
  for (double& rms : split.band_rms_) rms = std::sqrt(rms);
  return split;
}

PlaneSplit PlaneSplit::principal(const TransferShape& shape, PrincipalPlanes planes,
                                 std::span<const std::uint8_t> known) {
  PlaneSplit split;
  split.shape_ = shape;
  split.principal_ = std::move(planes);
  split.known_.assign(known.begin(), known.end());
  split.fill_ = std::make_shared<PushPull>(shape.width, shape.height, known);
  split.scales_.resize(shape.texels());
  return split;
}

int PlaneSplit::tiles() const {
  if (!principal_) return shape_.coefficients();
  // A clip without any energy still needs a plane to play.
  return std::max(static_cast<int>(principal_->energy.size()) + (predicted() ? 1 : 0), 1);
}

std::vector<int> PlaneSplit::layer_tiles(bool one) const {
  if (one) return {tiles()};
  std::vector<int> layers;
  if (!principal_) {
    for (int band = 0; band <= shape_.order; ++band) layers.push_back(2 * band + 1);
    return layers;
  }
  int left = tiles();
  if (predicted()) layers.push_back(1), --left;
  for (const int count : kFirstLayers) {
    if (left == 0) break;
    layers.push_back(std::min(count, left));
    left -= layers.back();
  }
  if (left > 0) layers.push_back(left);
  return layers;
}

Status PlaneSplit::begin_frame(const TransferFrame& frame, std::uint64_t number) {
  RELIT_TRY(check_transfer(shape_, frame.transfer, number));
  frame_ = frame;
  if (!predicted()) return {};
  if (frame.normals.size() != shape_.texels()) {
    return fail(ErrorCode::kInvalid, "frame " + std::to_string(number) + " has " +
                                         std::to_string(frame.normals.size()) +
                                         " normals, expected " + std::to_string(shape_.texels()));
  }
  fit_prediction(*principal_, frame, scales_);
  return {};
}

void PlaneSplit::split(int tile, std::vector<std::vector<double>>& out) const {
  out.resize(static_cast<std::size_t>(components()));
  for (std::vector<double>& plane : out) plane.resize(shape_.texels());
  if (principal_) {
    split_principal(tile, out.front());
  } else {
    split_colour(tile, out);
  }
}

void PlaneSplit::split_colour(int tile, std::vector<std::vector<double>>& out) const {
  const std::size_t texels = shape_.texels();
  const float* r = frame_.transfer.data() + static_cast<std::size_t>(tile) * 3 * texels;
  const float* g = r + texels;
  const float* b = g + texels;
  for (std::size_t p = 0; p < texels; ++p) {
    const std::array<double, 3> value = to_components(basis_, {r[p], g[p], b[p]});
    for (std::size_t c = 0; c < out.size(); ++c) out[c][p] = value[c];
  }
}

void PlaneSplit::split_principal(int tile, std::vector<double>& out) const {
  const PrincipalPlanes& planes = *principal_;
  const int plane = tile - (predicted() ? 1 : 0);
  if (plane >= static_cast<int>(planes.energy.size())) {
    std::fill(out.begin(), out.end(), 0.0);
    return;
  }
  std::vector<float> values(out.size());
  if (plane < 0) {
    for (std::size_t p = 0; p < out.size(); ++p) values[p] = static_cast<float>(scales_[p]);
  } else {
    const std::vector<double>& axis = planes.analysis[static_cast<std::size_t>(plane)];
    const auto count = static_cast<std::size_t>(planes.coefficients);
    std::vector<double> b(count);
    for (std::size_t p = 0; p < out.size(); ++p) {
      if (known_[p] == 0) continue;
      if (predicted()) predicted_transfer(frame_.normals[p], b);
      double value = 0;
      for (std::size_t i = 0; i < axis.size(); ++i) {
        const double t = static_cast<double>(frame_.transfer[i * out.size() + p]);
        const double predicted_t = predicted() ? scales_[p] * b[i / 3] : 0;
        value += axis[i] * (t - predicted_t - planes.mean[i]);
      }
      values[p] = static_cast<float>(value);
    }
  }
  fill_->fill(values);
  std::copy(values.begin(), values.end(), out.begin());
}

double PlaneSplit::weight(int tile) const {
  if (!principal_) return band_rms_[static_cast<std::size_t>(decoders::band_of(tile))];
  return predicted() && tile == 0 ? principal_->prediction_gain : 1;
}

bool PlaneSplit::centred(int tile) const { return !predicted() || tile > 0; }

std::vector<container::MatrixEntry> PlaneSplit::column(int tile, int component) const {
  std::vector<container::MatrixEntry> column;
  const auto add = [&](std::size_t coefficient, std::size_t channel, double value) {
    if (value == 0) return;
    column.push_back({static_cast<std::uint8_t>(coefficient), static_cast<std::uint8_t>(channel),
                      static_cast<float>(value)});
  };
  if (!principal_) {
    std::array<double, 3> unit{};
    unit[static_cast<std::size_t>(component)] = 1;
    const std::array<double, 3> rgb = to_rgb(basis_, unit);
    for (std::size_t c = 0; c < 3; ++c) add(static_cast<std::size_t>(tile), c, rgb[c]);
    return column;
  }
  const int plane = tile - (predicted() ? 1 : 0);
  if (plane < 0 || plane >= static_cast<int>(principal_->energy.size())) return column;
  const std::vector<double>& axis = principal_->synthesis[static_cast<std::size_t>(plane)];
  for (std::size_t i = 0; i < axis.size(); ++i) add(i / 3, i % 3, axis[i]);
  return column;
}

std::vector<Rgb> PlaneSplit::mean(std::span<const std::array<double, 3>> middles) const {
  std::vector<Rgb> mean(static_cast<std::size_t>(shape_.coefficients()));
  if (!principal_) {
    for (std::size_t n = 0; n < mean.size(); ++n) {
      const std::array<double, 3> rgb = to_rgb(basis_, middles[n]);
      for (std::size_t c = 0; c < 3; ++c) mean[n][c] = static_cast<float>(rgb[c]);
    }
    return mean;
  }
  std::vector<double> sum = principal_->mean;
  const std::size_t first = predicted() ? 1 : 0;
  for (std::size_t k = 0; k < principal_->energy.size(); ++k)
    for (std::size_t i = 0; i < sum.size(); ++i)
      sum[i] += middles[first + k][0] * principal_->synthesis[k][i];
  for (std::size_t i = 0; i < sum.size(); ++i) mean[i / 3][i % 3] = static_cast<float>(sum[i]);
  return mean;
}

std::vector<std::array<double, 3>> PlaneSplit::middles(
    std::span<const std::array<double, 3>> wanted, std::span<const Rgb> mean) const {
  std::vector<std::array<double, 3>> middles(wanted.begin(), wanted.end());
  // What rounding the mean of principal planes costs is far below a step of theirs: 2^-24 of μ.
  if (principal_) return middles;
  for (std::size_t n = 0; n < middles.size(); ++n)
    middles[n] = to_components(basis_, {mean[n][0], mean[n][1], mean[n][2]});
  return middles;
}

}  // namespace relit::bake
