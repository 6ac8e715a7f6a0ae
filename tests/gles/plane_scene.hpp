// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "gles/compositor.hpp"

/// Planes as a decoder would leave them, for whatever composites on the GPU.
namespace relit::test {

using gles::PlaneDescription;
using gles::PlaneSetDescription;

struct Case {
  const char* name;
  int width = 64, height = 64;
  int tiles = 9;  // RGB groups; planes = 3 × tiles
  int bit_depth = 8;
  bool chroma_420 = false;
  int exponent_shift = -1;  // -1: no exponents
  bool hints = true;        // pictures are described, so that they are uploaded whole
  unsigned seed = 0;        // of the samples; everything else stays the same
};

// A model with its frame as a decoder would leave it: one picture of three components with a grid
// of tiles, rows padded, and an exponent picture whose tiles the planes of a group share.
class Scene {
 public:
  explicit Scene(const Case& c) : width_(c.width), height_(c.height) {
    std::mt19937 random(static_cast<unsigned>(c.tiles * 1000 + c.width) + 7919 * c.seed);
    const int columns = static_cast<int>(std::ceil(std::sqrt(c.tiles)));
    const int rows = (c.tiles + columns - 1) / columns;
    // Tiles start on even samples, as 4:2:0 needs.
    const int tile_w = (c.width + 15) / 16 * 16, tile_h = (c.height + 15) / 16 * 16;
    const int bytes = c.bit_depth > 8 ? 2 : 1;
    for (int component = 0; component < 3; ++component) {
      const int shift = c.chroma_420 && component > 0 ? 1 : 0;
      const int w = (tile_w * columns) >> shift, h = (tile_h * rows) >> shift;
      stride_[component] = w * bytes + 32;
      std::vector<std::uint8_t>& data = pictures_[component];
      data.resize(static_cast<std::size_t>(stride_[component] * h));
      for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x)
          put(component, x, y, bytes, draw_mantissa(random, c.bit_depth, x, y));
    }
    exponent_stride_ = tile_w * columns + 7;
    exponents_.resize(static_cast<std::size_t>(exponent_stride_ * tile_h * rows));
    // E from a range of 12, and 0 now and then: exactly zero.
    for (std::uint8_t& e : exponents_)
      e = random() % 16 == 0 ? std::uint8_t{0} : static_cast<std::uint8_t>(122 + random() % 12);

    description_.width = c.width;
    description_.height = c.height;
    std::mt19937 weights(static_cast<unsigned>(c.tiles));
    std::uniform_real_distribution<float> weight(-1, 1);
    for (int tile = 0; tile < c.tiles; ++tile) {
      for (int component = 0; component < 3; ++component) {
        const int shift = c.chroma_420 && component > 0 ? 1 : 0;
        const int x = (tile % columns) * tile_w, y = (tile / columns) * tile_h;
        PlaneView view;
        view.mantissa = {
            pictures_[component].data() + (y >> shift) * stride_[component] + (x >> shift) * bytes,
            stride_[component], (c.width + shift) >> shift, (c.height + shift) >> shift, bytes};
        view.mantissa_shift = shift;
        view.mantissa_zero = 1 << (c.bit_depth - 1);
        view.exponent_zero = c.bit_depth > 8 ? 137 : 135;
        view.scale = 1.0f / (1 + static_cast<float>(tile));
        PlaneDescription plane;
        plane.bit_depth = c.bit_depth;
        plane.mantissa_shift = shift;
        plane.mantissa = {c.hints ? component : -1, x >> shift, y >> shift};
        if (c.exponent_shift >= 0) {
          const int s = c.exponent_shift;
          const int ex = (tile % columns) * (tile_w >> s), ey = (tile / columns) * (tile_h >> s);
          view.exponent = {exponents_.data() + ey * exponent_stride_ + ex, exponent_stride_,
                           (c.width + (1 << s) - 1) >> s, (c.height + (1 << s) - 1) >> s, 1};
          view.exponent_shift = s;
          plane.has_exponent = true;
          plane.exponent_shift = s;
          plane.exponent = {c.hints ? 0 : -1, ex, ey};
        }
        views_.push_back(view);
        description_.planes.push_back(plane);
        weights_.push_back({weight(weights), weight(weights), weight(weights)});
      }
    }
    light_.weights = weights_;
    light_.constant = {0.11f, -0.07f, 0.05f};
    light_.magnitude = 3;
  }

  // The formula of plane_view.hpp in double precision; also Σ |terms| at its largest.
  struct Reference {
    std::vector<double> values;  // [3][H][W]
    double peak = 0;
    double absolute_sum = 0;
  };
  [[nodiscard]] Reference reference() const {
    Reference r;
    const auto texels = static_cast<std::size_t>(width_ * height_);
    r.values.resize(3 * texels);
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        for (std::size_t c = 0; c < 3; ++c) {
          double sum = light_.constant[c], absolute = std::abs(sum);
          for (std::size_t k = 0; k < views_.size(); ++k) {
            const PlaneView& v = views_[k];
            const int e = v.exponent.empty()
                              ? v.exponent_zero
                              : v.exponent.at(x >> v.exponent_shift, y >> v.exponent_shift);
            if (e == 0) continue;
            const double term =
                double{weights_[k][c]} * v.scale *
                (v.mantissa.at(x >> v.mantissa_shift, y >> v.mantissa_shift) - v.mantissa_zero) *
                std::exp2(e - v.exponent_zero);
            sum += term;
            absolute += std::abs(term);
          }
          r.values[c * texels + static_cast<std::size_t>(y * width_ + x)] = sum;
          r.peak = std::max(r.peak, std::abs(sum));
          r.absolute_sum = std::max(r.absolute_sum, absolute);
        }
      }
    }
    return r;
  }

  PlaneSetDescription description_;
  std::vector<PlaneView> views_;
  std::vector<Rgb> weights_;
  FoldedLight light_;
  int width_, height_;

 private:
  static int draw_mantissa(std::mt19937& random, int bit_depth, int x, int y) {
    const int range = 1 << bit_depth;
    // Smooth with noise over the whole range, the ends included: 0 is what a lossy decoder may
    // yield.
    const double smooth = 0.5 + 0.5 * std::sin(0.13 * x + 0.07 * y);
    const double noise = static_cast<double>(random() % 1000) / 1000 - 0.5;
    return std::clamp(static_cast<int>(range * (smooth + 0.3 * noise)), 0, range - 1);
  }
  void put(int component, int x, int y, int bytes, int value) {
    std::uint8_t* p = pictures_[component].data() + y * stride_[component] + x * bytes;
    const auto wide = static_cast<std::uint16_t>(value);
    if (bytes == 1)
      *p = static_cast<std::uint8_t>(value);
    else
      __builtin_memcpy(p, &wide, 2);
  }
  std::vector<std::uint8_t> pictures_[3];
  std::ptrdiff_t stride_[3] = {};
  std::vector<std::uint8_t> exponents_;
  std::ptrdiff_t exponent_stride_ = 0;
};

/// What the player counts on, relative to the peak.
inline double required(const gles::Device& device) {
  switch (device.profile()) {
    case gles::Profile::kEs3:
      return 1.5e-3;
    case gles::Profile::kEs2:
      return 4e-3;
    case gles::Profile::kEs2Mediump:
      break;
  }
  return 2e-2;
}

inline double largest_difference(std::span<const float> values,
                                 const std::vector<double>& reference) {
  double worst = 0;
  for (std::size_t i = 0; i < values.size(); ++i)
    worst = std::max(worst, std::abs(values[i] - reference[i]));
  return worst;
}

}  // namespace relit::test
