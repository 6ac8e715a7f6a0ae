// SPDX-License-Identifier: MIT
#include "tests/extremes/lit_clip.hpp"

#include <algorithm>
#include <bit>
#include <random>

#include "decoders/composite_kernels.hpp"
#include "gles/compositor.hpp"
#include "player/relighter.hpp"
#include "tests/reference/composite_reference.hpp"
#include "tests/results.hpp"

namespace relit::test {
namespace {

int squares(int side, int block) { return (side + block - 1) / block; }

/// The largest S of the light over all texels and channels; 1 where it is dark.
double largest_sum(const LitClip& clip, const decoders::Light& light) {
  double most = 0;
  for (int y = 0; y < clip.shape_.height; ++y)
    for (int x = 0; x < clip.shape_.width; ++x)
      for (const LitClip::Term& term : clip.at(light, x, y)) most = std::max(most, term.sum);
  return most > 0 ? most : 1;
}

/// Compares a light map with the reference; `bound` is of a term.
template <class Bound>
void compare(const LitClip& clip, const decoders::Light& light, std::span<const float> values,
             double magnitude, double unit, Bound bound, Worst& worst) {
  const auto texels =
      static_cast<std::size_t>(clip.shape_.width) * static_cast<std::size_t>(clip.shape_.height);
  std::size_t texel = 0;
  for (int y = 0; y < clip.shape_.height; ++y) {
    for (int x = 0; x < clip.shape_.width; ++x, ++texel) {
      const std::array<LitClip::Term, 3> terms = clip.at(light, x, y);
      for (std::size_t c = 0; c < 3; ++c) {
        const double value = static_cast<double>(values[c * texels + texel]) * magnitude;
        // Where nothing shines nothing is seen.
        const double allowed = terms[c].bias == 0 ? 0 : bound(terms[c]);
        worst.add(std::abs(value - terms[c].value) / unit, allowed / unit);
      }
    }
  }
}

// A term is rounded when its weight becomes a float, when that takes the plane's scale, in the
// product and in the n sums after it; 1 % is for the second order. Every value before its weight is
// exact. What is subnormal is a multiple of 2^-149.
double cpu_bound(const LitClip& clip, const LitClip::Term& term, double magnitude) {
  const double n = clip.terms();
  return 1.01 * (n + 3) * std::exp2(-24) * term.sum + (n + 2) * std::exp2(-149) * magnitude;
}

void composite_on_cpu(const LitClip& clip, const decoders::Light& light, double unit,
                      Worst& worst) {
  const decoders::FoldedWeights folded = clip.fold(light);
  std::vector<float> values(static_cast<std::size_t>(3 * clip.shape_.width * clip.shape_.height));
  decoders::CompositeJob job;
  job.planes = clip.views_;
  job.light = folded.view;
  job.light.weights = folded.weights;
  job.width = clip.shape_.width, job.height = clip.shape_.height;
  job.out = values;
  require(job.validate());
  for (const decoders::CompositeKernel& kernel : decoders::composite_kernels()) {
    kernel.run(job);
    const auto magnitude = static_cast<double>(folded.view.magnitude);
    const auto bound = [&](const LitClip::Term& term) { return cpu_bound(clip, term, magnitude); };
    compare(clip, light, values, magnitude, unit, bound, worst);
  }
}

}  // namespace

LitClip::LitClip(const Shape& shape, float scale, const Source& source) : shape_(shape) {
  const int count = decoders::coefficient_count(shape.order), bytes = shape.bit_depth > 8 ? 2 : 1;
  const int w = shape.width, h = shape.height;
  const int ew = squares(w, shape.block), eh = squares(h, shape.block);
  const int zero = 1 << (shape.bit_depth - 1), exponent_zero = shape.bit_depth > 8 ? 137 : 135;
  mantissas_.resize(static_cast<std::size_t>(bytes) * static_cast<std::size_t>(count * w) *
                    static_cast<std::size_t>(h));
  exponents_.resize(static_cast<std::size_t>(count * ew * eh));
  model_.order = static_cast<std::uint8_t>(shape.order);
  model_.width = static_cast<std::uint16_t>(w);
  model_.height = static_cast<std::uint16_t>(h);
  container::LayerRecord layer;
  layer.bit_depth = static_cast<std::uint8_t>(shape.bit_depth);
  layer.chroma = container::Chroma::kLuma;
  layer.has_exponents = shape.exponents;
  layer.exponent_block = static_cast<std::uint8_t>(shape.block);
  for (int n = 0; n < count; ++n) {
    PlaneView view;
    view.mantissa = {mantissas_.data() + std::ptrdiff_t{n} * w * bytes,
                     std::ptrdiff_t{count} * w * bytes, w, h, bytes};
    view.mantissa_zero = zero;
    view.exponent_zero = exponent_zero;
    view.scale = scale;
    if (shape.exponents) {
      view.exponent = {exponents_.data() + n * ew, std::ptrdiff_t{count} * ew, ew, eh, 1};
      view.exponent_shift = std::countr_zero(static_cast<unsigned>(shape.block));
    }
    views_.push_back(view);
    container::PlaneRecord record;
    record.scale = scale;
    record.mantissa_rect.x = static_cast<std::uint16_t>(n * w);
    record.exponent_rect.x = static_cast<std::uint16_t>(n * ew);
    for (std::uint8_t c = 0; c < 3; ++c)
      record.matrix.push_back({static_cast<std::uint8_t>(n), c, kChannels[c]});
    layer.planes.push_back(record);
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x) {
        const int sx = x / shape.block, sy = y / shape.block;
        const Sample sample = source(n, sx, sy);
        const auto word = static_cast<std::uint16_t>(sample.mantissa);
        const auto byte = static_cast<std::uint8_t>(sample.mantissa);
        std::uint8_t* const at = mantissas_.data() + ((y * count + n) * w + x) * bytes;
        std::memcpy(at, bytes == 2 ? static_cast<const void*>(&word) : &byte,
                    static_cast<std::size_t>(bytes));
        exponents_[static_cast<std::size_t>((sy * count + n) * ew + sx)] =
            static_cast<std::uint8_t>(sample.exponent);
      }
    }
  }
  layers_.push_back(std::move(layer));
}

std::array<LitClip::Term, 3> LitClip::at(const decoders::Light& light, int x, int y) const {
  std::array<Term, 3> terms{};
  for (std::size_t n = 0; n < std::min(views_.size(), light.sh.size()); ++n) {
    const PlaneView& view = views_[n];
    const double value = reference::plane_value(view, x, y);
    double most = std::abs(static_cast<double>(view.scale)) * view.mantissa_zero;
    if (!view.exponent.empty())
      most = std::ldexp(most, view.exponent.at(x >> view.exponent_shift, y >> view.exponent_shift) -
                                  view.exponent_zero);
    for (std::size_t c = 0; c < 3; ++c) {
      const double weight = light.sh[n][c] * static_cast<double>(kChannels[c]);
      terms[c].value += weight * value;
      terms[c].sum += std::abs(weight * value);
      terms[c].bias += std::abs(weight) * most;
    }
  }
  return terms;
}

decoders::FoldedWeights LitClip::fold(const decoders::Light& light) const {
  decoders::FoldedWeights folded;
  require(decoders::fold_light(model_, layers_, light, folded));
  return folded;
}

LitClip::Source random_samples(const LitClip::Shape& shape, unsigned seed, int least_exponent) {
  const int range = 1 << shape.bit_depth, zero = shape.bit_depth > 8 ? 137 : 135;
  return [=](int n, int x, int y) {
    // By place, so that every texel of a square gets the same.
    std::seed_seq place{static_cast<int>(seed), n, x, y};
    std::minstd_rand random(place);
    const int mantissa = std::uniform_int_distribution<int>(0, range - 1)(random);
    return LitClip::Sample{mantissa,
                           std::uniform_int_distribution<int>(least_exponent, zero)(random)};
  };
}

decoders::Light random_light(int order, double size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> coefficient(-size, size);
  decoders::Light light;
  light.sh.resize(static_cast<std::size_t>(decoders::coefficient_count(order)));
  for (auto& row : light.sh)
    for (double& value : row) value = coefficient(random);
  return light;
}

double gpu_bound(const gles::Device& device, const LitClip& clip, const LitClip::Term& term,
                 int passes, double step) {
  const double n = clip.terms(), u = std::exp2(-24);
  if (device.profile() != gles::Profile::kEs2Mediump)
    return (n + 8) * u * (term.sum + 2 * term.bias) +
           passes * std::exp2(-10) * (passes > 1 ? term.sum : std::abs(term.value)) + step;
  return ((n / passes + 4) * std::exp2(-11) + passes * std::exp2(-10)) * term.sum +
         (n + (clip.shape_.exponents ? 32 : 0)) * step;
}

void composite_everywhere(const LitClip& clip, std::span<const decoders::Light> lights,
                          Observed& observed) {
  std::vector<double> units;
  for (const decoders::Light& light : lights) {
    units.push_back(largest_sum(clip, light));
    composite_on_cpu(clip, light, units.back(), observed.cpu);
  }
  on_each_backend([&](const gles::Device& device, const Backend&) {
    const gles::PlaneSetDescription description =
        player::describe_planes(clip.model_, clip.layers_);
    auto compositor = take(gles::Compositor::create(device, description));
    REQUIRE(compositor->format() == gles::LightMapFormat::kHalfFloat);
    require(compositor->upload(clip.views_, 0));
    std::vector<float> values(static_cast<std::size_t>(3 * clip.shape_.width * clip.shape_.height));
    const bool half = device.profile() == gles::Profile::kEs2Mediump;
    for (std::size_t i = 0; i < lights.size(); ++i) {
      const decoders::FoldedWeights folded = clip.fold(lights[i]);
      const gles::LightMap map = take(compositor->composite(folded.view, {0, -1, 0}));
      require(compositor->read_back(values));
      const auto magnitude = static_cast<double>(map.magnitude);
      const double step = std::exp2(-24) * static_cast<double>(map.scale) * magnitude;
      const auto bound = [&](const LitClip::Term& term) {
        return gpu_bound(device, clip, term, compositor->pass_count(), step);
      };
      compare(clip, lights[i], values, magnitude, units[i], bound,
              half ? observed.mediump : observed.highp);
    }
  });
}

void hold(const std::string& name, const Observed& observed) {
  hold(name + ", CPU", "(n+3) u S", observed.cpu);
  hold(name + ", ES 3, ES 2, OSMesa", "(n+8) u (S+2B) + t V + step", observed.highp);
  hold(name + ", ES 2 mediump", "(n/p+4) h S + p t S + (n+32) step", observed.mediump);
}

}  // namespace relit::test
