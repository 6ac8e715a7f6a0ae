// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "decoders/composite.hpp"
#include "tests/extremes/rows.hpp"
#include "tests/gles/backends.hpp"

/// Models whose transfer is known in closed form, and their way through every composite.
namespace relit::test {

/// A frame of a model of order N with one plane a coefficient, which adds to the channels by
/// kChannels. Samples are the same over squares of `block` texels, so that inside a square of 4 a
/// bilinear lookup changes nothing.
class LitClip {
 public:
  struct Shape {
    int order = 2;
    int width = 32, height = 32;
    int bit_depth = 8;
    bool exponents = false;
    int block = 4;  ///< power of two, also the exponents' block
  };
  struct Sample {
    int mantissa = 0;
    int exponent = 0;
  };
  /// The sample of coefficient n in the square (x, y).
  using Source = std::function<Sample(int n, int x, int y)>;
  static constexpr std::array<float, 3> kChannels{1.0f, 0.8f, -0.6f};

  LitClip(const Shape& shape, float scale, const Source& source);
  LitClip(const LitClip&) = delete;  // the views look at the pictures
  LitClip& operator=(const LitClip&) = delete;

  /// What the light map is at a texel, in double precision from L and T themselves.
  struct Term {
    double value = 0;  ///< Σ_n L_n T_n
    double sum = 0;    ///< S = Σ_n |L_n T_n|
    double bias = 0;   ///< B: S if every mantissa were 0, -M₀ from its zero
  };
  [[nodiscard]] std::array<Term, 3> at(const decoders::Light& light, int x, int y) const;
  [[nodiscard]] decoders::FoldedWeights fold(const decoders::Light& light) const;
  [[nodiscard]] int terms() const { return static_cast<int>(views_.size()); }

  Shape shape_;
  container::ModelRecord model_;
  std::vector<container::LayerRecord> layers_;  ///< one
  std::vector<PlaneView> views_;

 private:
  std::vector<std::uint8_t> mantissas_, exponents_;
};

/// Random mantissas over their whole range and, with exponents, E of `least_exponent` to E₀.
[[nodiscard]] LitClip::Source random_samples(const LitClip::Shape& shape, unsigned seed,
                                             int least_exponent = 125);

/// A light of that order whose coefficients are from -size to size.
[[nodiscard]] decoders::Light random_light(int order, double size, unsigned seed);

/// How far a texel of a composite on the GPU may be from the reference, u = 2^-24.
///
/// Highp: a term is rounded when its weight becomes a float, where the sample becomes a mantissa
/// (whose bias may be taken out of the sum in full precision, hence B), in its product and in every
/// sum after it, (n + 8) roundings of at most u·(S + 2B); then the half-float target truncates to
/// 11 bits, 2^-10 of the value, or of S where several passes add up in it.
///
/// Mediump: a term is rounded to 2^-11 when its weight becomes a half, twice where it is multiplied
/// (with an exponent), once more for what its exponent's power is off, and in the sums of its pass;
/// each pass truncates to 2^-10 of S at most.
///
/// Either way what lies below the least half float, 2^-24 of the map's scale, is lost; in mediump
/// from every term, and the powers of two by which exponents multiply, 1 at most, are off by half
/// of 2^-24: of sums that reach 2^6 of the scale that is 32 such steps.
[[nodiscard]] double gpu_bound(const gles::Device& device, const LitClip& clip,
                               const LitClip::Term& term, int passes, double step);

struct Observed {
  Worst cpu, highp, mediump;
};

/// Composites the clip under each of the lights, by every CPU kernel and in texture space on every
/// backend, and adds up errors and bounds, both divided by the largest S of the light (where there
/// is none, by 1).
void composite_everywhere(const LitClip& clip, std::span<const decoders::Light> lights,
                          Observed& observed);
/// A row for each of the three.
void hold(const std::string& name, const Observed& observed);

}  // namespace relit::test
