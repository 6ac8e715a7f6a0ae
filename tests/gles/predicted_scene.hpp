// SPDX-License-Identifier: MIT
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "tests/gles/plane_scene.hpp"
#include "tests/reference/composite_reference.hpp"

namespace relit::test {

/// A model with a prediction: s, which may have another bit depth, the planes of a Scene, each
/// weighing on all channels, and the normals, their planes one below the other in a picture.
class PredictedScene {
 public:
  PredictedScene(const Case& planes, Case s)
      : width_(planes.width),
        height_(planes.height),
        planes_(std::make_unique<Scene>(planes)),
        s_(std::make_unique<Scene>(s)),
        normals_(static_cast<std::size_t>(width_ * height_)),
        samples_(3 * normals_.size()) {
    // A wavy surface; now and then no normal, as outside the charts.
    for (std::size_t i = 0; i < normals_.size(); ++i) {
      const auto x = static_cast<float>(i % static_cast<std::size_t>(width_));
      const auto y = static_cast<float>(i / static_cast<std::size_t>(width_));
      const auto turn = static_cast<float>(planes.seed);
      const glm::vec3 n{std::sin(0.31f * x + turn), std::cos(0.23f * y), std::sin(0.11f * (x - y))};
      normals_[i] = i % 13 == 5 ? glm::vec3(0) : glm::normalize(n + glm::vec3(0.01f));
    }
    set_samples();

    description_ = planes_->description_;
    PlaneDescription first = s_->description_.planes[0];
    first.mantissa.picture = planes.hints ? 3 : -1;
    first.exponent.picture = planes.hints ? 1 : -1;
    // A plane of residuals is smaller than s, as s times the light is what there is most of.
    views_ = {s_->views_[0]};
    views_[0].scale = 1.0f / static_cast<float>(views_[0].mantissa_zero);
    for (PlaneView view : planes_->views_) {
      view.scale /= 4 * static_cast<float>(view.mantissa_zero);
      views_.push_back(view);
    }
    description_.planes.insert(description_.planes.begin(), first);
    weights_ = planes_->weights_;
    weights_.insert(weights_.begin(), Rgb{});
    model_planes_ = views_.size();
    description_.prediction_plane = 0;
    description_.normal_planes = static_cast<int>(model_planes_);
    for (int i = 0; i < 3; ++i) {
      PlaneDescription plane;
      plane.bit_depth = 16;
      plane.mantissa = {planes.hints ? 4 : -1, 0, planes.hints ? i * height_ : 0};
      description_.planes.push_back(plane);
      PlaneView view;
      view.mantissa = {reinterpret_cast<const std::uint8_t*>(
                           samples_.data() + static_cast<std::size_t>(i) * normals_.size()),
                       2 * std::ptrdiff_t{width_}, width_, height_, 2};
      view.mantissa_zero = 32768;
      view.scale = gles::kNormalScale;
      views_.push_back(view);
      weights_.push_back({});
    }

    light_ = planes_->light_;
    light_.weights = weights_;
    light_.prediction_plane = 0;
    std::mt19937 random(5);
    std::uniform_real_distribution<float> coefficient(-0.5f, 0.5f);
    for (std::size_t n = 0; n < 9; ++n)
      for (float& c : light_.irradiance[n]) c = n == 0 ? 1.0f : coefficient(random);
  }

  void clear_normals() {
    std::fill(normals_.begin(), normals_.end(), glm::vec3(0));
    set_samples();
  }
  /// Has the reference take the normals of 16 bits.
  void round_normals() {
    for (std::size_t i = 0; i < normals_.size(); ++i)
      for (std::size_t c = 0; c < 3; ++c)
        normals_[i][static_cast<int>(c)] =
            static_cast<float>((samples_[c * normals_.size() + i] - 32768.0) / 32767);
  }

  /// The same composite on the CPU, by the normals that were not rounded to 16 bits; without `out`.
  [[nodiscard]] decoders::CompositeJob job() const {
    decoders::CompositeJob job;
    job.planes = std::span(views_).first(model_planes_);
    job.light = light_;
    job.light.weights = light_.weights.first(model_planes_);
    job.width = width_;
    job.height = height_;
    job.predictions[0] = {0, normals_, 1};
    return job;
  }
  /// And in double precision.
  [[nodiscard]] Scene::Reference reference() const {
    reference::Composite composite = reference::composite(job());
    Scene::Reference r;
    r.values = std::move(composite.value);
    for (const double v : r.values) r.peak = std::max(r.peak, std::abs(v));
    for (const double m : composite.magnitude) r.absolute_sum = std::max(r.absolute_sum, m);
    return r;
  }

  int width_, height_;
  PlaneSetDescription description_;
  std::vector<PlaneView> views_;  // s, the other planes, the normals
  std::vector<Rgb> weights_;
  FoldedLight light_;
  std::size_t model_planes_ = 0;  // views without the normals

 private:
  void set_samples() {
    for (std::size_t i = 0; i < normals_.size(); ++i)
      for (std::size_t c = 0; c < 3; ++c)
        samples_[c * normals_.size() + i] = static_cast<std::uint16_t>(
            32768 + std::lround(32767.0 * static_cast<double>(normals_[i][static_cast<int>(c)])));
  }
  std::unique_ptr<Scene> planes_, s_;  // own what the views look at
  std::vector<glm::vec3> normals_;
  std::vector<std::uint16_t> samples_;
};

/// How far a predicted composite may be from the reference. As for the sum of planes
/// (compositor_test.cpp), where a pass with half-float fragments adds 16 at most. Besides, E(N) is
/// by normals of 16 bits: a coordinate is off by ½/32767, N by √3 times that, and Y_n changes
/// by 1.9 of it at most (Y_6); |s| is at most `most`. And a term of s · E(N) is rounded 17 times at
/// most: its factor, N's coordinates (2 in degree 2), the polynomial's products and difference (3),
/// the product with the factor, 8 sums, s and its exponent, the product with it.
inline double predicted_bound(const gles::Device& device, double passes, const Scene::Reference& r,
                              const PredictedScene& scene, double frames = 1, double most = 1) {
  double irradiance = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    double sum = 0;
    for (const Rgb& row : scene.light_.irradiance) sum += std::abs(double{row[c]});
    irradiance = std::max(irradiance, sum);
  }
  const double normals = most * 1.9 * std::sqrt(3.0) * 0.5 / 32767 * irradiance;
  const auto terms = frames * static_cast<double>(scene.model_planes_);
  if (device.profile() != gles::Profile::kEs2Mediump)
    return passes * std::exp2(-10) * r.peak + (terms + 8 + 17) * std::exp2(-24) * r.absolute_sum +
           normals;
  return (std::min(terms, 16.0) + 4 + 17) * std::exp2(-11) * r.absolute_sum +
         passes * std::exp2(-10) * r.absolute_sum + normals;
}

}  // namespace relit::test
