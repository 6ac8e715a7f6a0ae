// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "bake_minimal/principal_planes.hpp"
#include "tests/bake_minimal/coding_clip.hpp"

/// Clips with normals, and their way through principal planes.
namespace relit::bake::test {

struct PredictedClip {
  Clip clip;
  std::vector<std::vector<glm::vec3>> normals;  ///< by frame
  [[nodiscard]] TransferFrame frame(std::size_t f) const { return {clip.frames[f], normals[f]}; }
};

/// Transfer at random around s·b, with normals that turn from frame to frame; a few texels have
/// none.
inline PredictedClip random_clip(int order, int width, int height, int frames, double noise) {
  std::mt19937 random(5);
  std::normal_distribution<double> gauss;
  PredictedClip made{{{order, width, height}, {}}, {}};
  const auto count = static_cast<std::size_t>(made.clip.shape.coefficients());
  const std::size_t texels = made.clip.shape.texels();
  std::vector<double> b(count);
  for (int f = 0; f < frames; ++f) {
    std::vector<float> t(3 * count * texels);
    std::vector<glm::vec3> normals(texels, glm::vec3(0));
    for (std::size_t p = 0; p < texels; ++p) {
      if (p % 17 != 3)
        normals[p] = glm::normalize(glm::vec3(gauss(random), gauss(random), gauss(random)));
      predicted_transfer(normals[p], b);
      const double s = 0.5 + 0.4 * std::sin(0.3 * static_cast<double>(p) + f);
      for (std::size_t i = 0; i < 3 * count; ++i)
        t[i * texels + p] = static_cast<float>(s * b[i / 3] + noise * gauss(random));
    }
    made.clip.frames.push_back(std::move(t));
    made.normals.push_back(std::move(normals));
  }
  return made;
}

inline PrincipalPlanes analyse(const PredictedClip& made, bool predict, int count) {
  PrincipalAnalysis analysis(made.clip.shape, predict,
                             std::vector<std::uint8_t>(made.clip.shape.texels(), 1));
  for (std::size_t f = 0; f < made.clip.frames.size(); ++f)
    REQUIRE(analysis.add_frame(made.frame(f)));
  return analysis.finish(count);
}

inline Encoded encode_principal(const PredictedClip& made, const PrincipalPlanes& planes,
                                CodingOptions o) {
  o.planes = Planes::kPrincipal;
  o.segment_frames = 5;
  o.predict = planes.predicted;
  const std::vector<std::uint8_t> known(made.clip.shape.texels(), 1);
  auto scan = RangeScan::create(PlaneSplit::principal(made.clip.shape, planes, known), o);
  REQUIRE(scan);
  for (std::size_t f = 0; f < made.clip.frames.size(); ++f) REQUIRE(scan->add_frame(made.frame(f)));
  auto encoder = PlaneEncoder::begin(std::move(*scan), {7, 3, 10, 20, 0});
  REQUIRE(encoder);
  Encoded encoded;
  for (std::size_t f = 0; f < made.clip.frames.size(); ++f)
    REQUIRE(encoder->encode_frame(made.frame(f)));
  REQUIRE(encoder->finish());
  while (auto segment = encoder->take_segment()) encoded.segments.push_back(std::move(*segment));
  encoded.model = encoder->model();
  encoded.layers = encoder->layers();
  return encoded;
}

inline CodingOptions lossless(int bits) {
  CodingOptions o;
  o.codec = "ffv1";
  o.bit_depth = bits;
  return o;
}

/// The largest error of what comes back from a lossless file, as a share of what is allowed: half a
/// step of each plane, and 1e-6 as matrix, mean and values pass through floats, 2^-20 of 1.
inline double worst_share(const PredictedClip& made, const Encoded& encoded) {
  auto decoder = decoder_with_all(encoded);
  REQUIRE(decoder);
  const std::size_t texels = made.clip.shape.texels();
  const auto count = static_cast<std::size_t>(made.clip.shape.coefficients());
  std::vector<float> t(3 * count * texels);
  std::vector<double> bound(3 * count), b(count);
  double s_step = 0;
  for (const container::LayerRecord& layer : encoded.layers) {
    for (const container::PlaneRecord& plane : layer.planes) {
      for (const container::MatrixEntry& e : plane.matrix)
        bound[3u * e.coefficient + e.channel] +=
            std::abs(double{e.value}) * double{plane.scale} / 2;
      if (plane.matrix.empty()) s_step = double{plane.scale};
    }
  }
  double most = 0;
  for (std::size_t f = 0; f < made.clip.frames.size(); ++f) {
    auto view = decoder->frame(f);
    REQUIRE(view);
    REQUIRE(
        decoders::reconstruct(view->planes(), encoded.model, encoded.layers, t, made.normals[f]));
    for (std::size_t p = 0; p < texels; ++p) {
      predicted_transfer(made.normals[f][p], b);
      if (made.normals[f][p] == glm::vec3(0)) b[0] = 0.282095;  // Y_0 of no direction: E(0)
      for (std::size_t i = 0; i < t.size() / texels; ++i) {
        const double error =
            std::abs(double{t[i * texels + p]} - double{made.clip.frames[f][i * texels + p]});
        const double share = error / (bound[i] + std::abs(b[i / 3]) * s_step / 2 + 1e-6);
        if (std::isnan(share)) return HUGE_VAL;
        most = std::max(most, share);
      }
    }
  }
  return most;
}

}  // namespace relit::bake::test
