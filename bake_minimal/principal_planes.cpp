// SPDX-License-Identifier: MIT
#include "bake_minimal/principal_planes.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "bake_minimal/light_metric.hpp"
#include "decoders/sh.hpp"

namespace relit::bake {
namespace {

/// Of the composites' mean square: what is less is rounding, and what may be left out unasked.
constexpr double kLeastEnergy = 1e-12, kSpare = 1e-5;

using DenseMatrix = Eigen::MatrixXd;

DenseMatrix to_matrix(const std::vector<double>& values, Eigen::Index side) {
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      values.data(), side, side);
}

/// W for coefficients × channels: the channels do not mix.
DenseMatrix for_channels(const DenseMatrix& per_coefficient) {
  const Eigen::Index n = per_coefficient.rows();
  DenseMatrix all = DenseMatrix::Zero(3 * n, 3 * n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      for (Eigen::Index c = 0; c < 3; ++c) all(3 * i + c, 3 * j + c) = per_coefficient(i, j);
  return all;
}

/// An eigenvector's sign is free: its largest entry becomes positive.
void settle_sign(Eigen::Ref<Eigen::VectorXd> axis) {
  Eigen::Index largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  if (axis[largest] < 0) axis = -axis;
}

}  // namespace

void predicted_transfer(const glm::vec3& normal, std::span<double> b) {
  if (normal == glm::vec3(0.0f)) {
    std::fill(b.begin(), b.end(), 0.0);
    return;
  }
  int order = 0;
  while (decoders::coefficient_count(order) < static_cast<int>(b.size())) ++order;
  decoders::evaluate_sh(order, glm::dvec3(normal), b);
  for (std::size_t n = 0; n < b.size(); ++n)
    b[n] *= decoders::clamped_cosine(decoders::band_of(static_cast<int>(n))) / std::numbers::pi;
}

void fit_prediction(const PrincipalPlanes& planes, const TransferFrame& frame,
                    std::span<double> scales) {
  const auto count = static_cast<std::size_t>(planes.coefficients);
  const std::size_t texels = scales.size();
  std::vector<double> b(count), weighted(count);
  for (std::size_t p = 0; p < texels; ++p) {
    predicted_transfer(frame.normals[p], b);
    double energy = 0, match = 0;
    for (std::size_t n = 0; n < count; ++n) {
      weighted[n] = 0;
      for (std::size_t m = 0; m < count; ++m) weighted[n] += planes.metric[n * count + m] * b[m];
      energy += 3 * weighted[n] * b[n];
    }
    for (std::size_t n = 0; n < count; ++n) {
      const float* const t = frame.transfer.data() + 3 * n * texels + p;
      match += weighted[n] * (static_cast<double>(t[0]) + static_cast<double>(t[texels]) +
                              static_cast<double>(t[2 * texels]));
    }
    scales[p] = energy > 0 ? match / energy : 0;
  }
}

PrincipalAnalysis::PrincipalAnalysis(const TransferShape& shape, bool predict,
                                     std::vector<std::uint8_t> counted)
    : shape_(shape), counted_(std::move(counted)), scales_(shape.texels(), 0.0) {
  planes_.predicted = predict;
  planes_.coefficients = shape.coefficients();
  planes_.metric = light_metric(shape.order);
  const auto values = static_cast<std::size_t>(3 * planes_.coefficients);
  sum_.resize(values);
  products_.resize(values * values);
}

// Of the composite of a texel, its mean over lights, channels added up.
double PrincipalAnalysis::square(std::span<const float> transfer, std::size_t texel) const {
  const auto count = static_cast<std::size_t>(planes_.coefficients);
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t n = 0; n < count; ++n)
      for (std::size_t m = 0; m < count; ++m)
        sum += planes_.metric[n * count + m] *
               static_cast<double>(transfer[(3 * n + c) * shape_.texels() + texel]) *
               static_cast<double>(transfer[(3 * m + c) * shape_.texels() + texel]);
  return sum;
}

Status PrincipalAnalysis::add_frame(const TransferFrame& frame) {
  RELIT_TRY(check_transfer(shape_, frame.transfer, frames_));
  if (planes_.predicted) fit_prediction(planes_, frame, scales_);
  const auto count = static_cast<std::size_t>(planes_.coefficients);
  const std::size_t values = 3 * count, texels = shape_.texels();
  std::vector<double> b(count), residual(values);
  for (std::size_t p = 0; p < texels; ++p) {
    if (counted_[p] == 0) continue;
    if (planes_.predicted) predicted_transfer(frame.normals[p], b);
    for (std::size_t n = 0; n < count; ++n) {
      for (std::size_t m = 0; m < count; ++m)
        gain_ += 3 * b[n] * planes_.metric[n * count + m] * b[m];
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t i = 3 * n + c;
        residual[i] = static_cast<double>(frame.transfer[i * texels + p]) - scales_[p] * b[n];
        sum_[i] += residual[i];
      }
    }
    shown_ += square(frame.transfer, p);
    for (std::size_t i = 0; i < values; ++i)
      for (std::size_t j = i; j < values; ++j)
        products_[i * values + j] += residual[i] * residual[j];
    samples_ += 1;
  }
  ++frames_;
  return {};
}

PrincipalPlanes PrincipalAnalysis::finish(int count) const {
  PrincipalPlanes planes = planes_;
  const Eigen::Index values = 3 * planes.coefficients;
  const double samples = std::max(samples_, 1.0);
  Eigen::VectorXd mean(values);
  DenseMatrix covariance(values, values);
  for (Eigen::Index i = 0; i < values; ++i) mean[i] = sum_[static_cast<std::size_t>(i)] / samples;
  for (Eigen::Index i = 0; i < values; ++i)
    for (Eigen::Index j = i; j < values; ++j) {
      const double product = products_[static_cast<std::size_t>(i * values + j)] / samples;
      covariance(i, j) = covariance(j, i) = product - mean[i] * mean[j];
    }
  const Eigen::SelfAdjointEigenSolver<DenseMatrix> metric(
      for_channels(to_matrix(planes.metric, planes.coefficients)));
  const DenseMatrix root = metric.operatorSqrt(), inverse_root = metric.operatorInverseSqrt();
  const Eigen::SelfAdjointEigenSolver<DenseMatrix> axes(root * covariance * root);
  planes.mean.assign(mean.data(), mean.data() + values);
  planes.mean_square = shown_ / samples;
  double left = axes.eigenvalues().sum();
  const int most = count > 0 ? count : static_cast<int>(values);
  for (Eigen::Index k = values; k-- > 0 && static_cast<int>(planes.energy.size()) < most;) {
    const double energy = axes.eigenvalues()[k];
    if (!(energy > kLeastEnergy * planes.mean_square)) break;
    if (count == 0 && !(left > kSpare * planes.mean_square)) break;
    left -= energy;
    Eigen::VectorXd axis = axes.eigenvectors().col(k);
    settle_sign(axis);
    const Eigen::VectorXd analysis = root * axis, synthesis = inverse_root * axis;
    planes.analysis.emplace_back(analysis.data(), analysis.data() + values);
    planes.synthesis.emplace_back(synthesis.data(), synthesis.data() + values);
    planes.energy.push_back(energy);
  }
  if (gain_ > 0) planes.prediction_gain = std::sqrt(gain_ / samples);
  return planes;
}

}  // namespace relit::bake
