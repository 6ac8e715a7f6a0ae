// SPDX-License-Identifier: MIT
#include "bake_minimal/principal_planes.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "bake_minimal/light_metric.hpp"
#include "tests/bake_minimal/coding_clip.hpp"
#include "tests/bake_minimal/principal_clip.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::bake;
using namespace relit::bake::test;

namespace {

/// yᵀ W y.
double form(const std::vector<double>& w, const std::vector<double>& y) {
  double sum = 0;
  for (std::size_t i = 0; i < y.size(); ++i)
    for (std::size_t j = 0; j < y.size(); ++j) sum += y[i] * w[i * y.size() + j] * y[j];
  return sum;
}

}  // namespace

TEST_CASE("the light metric is the mean over its lights, and the same for every turn about +Y") {
  const std::vector<double> w = light_metric(3);
  // A thousand heights and 64 turns, in place of Gauss's four and eight.
  std::vector<double> mean(256), y(16);
  const double even = std::sqrt(4 * std::numbers::pi);
  for (int i = 0; i < 1000; ++i) {
    const double height = -0.2 + 1.2 * (i + 0.5) / 1000, radius = std::sqrt(1 - height * height);
    for (int j = 0; j < 64; ++j) {
      const double phi = 2 * std::numbers::pi * (j + 0.3) / 64;
      decoders::evaluate_sh(3, glm::dvec3(radius * std::cos(phi), height, radius * std::sin(phi)),
                            y);
      for (const double share : {0.3, 0.5, 0.7}) {
        std::vector<double> light(16);
        for (std::size_t n = 0; n < 16; ++n) {
          const int band = decoders::band_of(static_cast<int>(n));
          light[n] = (1 + std::cos(std::numbers::pi * band / 5)) / 2 *
                     (share * 4 * std::numbers::pi * y[n] + (n == 0 ? (1 - share) * even : 0));
        }
        for (std::size_t k = 0; k < 256; ++k) mean[k] += light[k / 16] * light[k % 16] / 192000;
      }
    }
  }
  // The midpoint rule's error, (1.2 / 1000)² / 24 of the second derivative.
  for (std::size_t k = 0; k < 256; ++k) CHECK(std::abs(w[k] - mean[k]) < 1e-4);
  std::vector<double> turned(16);
  for (const double phi : {0.4, 1.1, 2.9}) {
    decoders::evaluate_sh(3, glm::dvec3(0.48, 0.6, 0.64), y);
    decoders::evaluate_sh(3,
                          glm::dvec3(0.8 * std::cos(phi + std::atan2(0.64, 0.48)), 0.6,
                                     0.8 * std::sin(phi + std::atan2(0.64, 0.48))),
                          turned);
    CHECK(form(w, turned) == Approx(form(w, y)).epsilon(1e-12));
  }
  // Lower orders are its upper left corner.
  const std::vector<double> lower = light_metric(1);
  for (std::size_t k = 0; k < 16; ++k) CHECK(lower[k] == w[k / 4 * 16 + k % 4]);
}

TEST_CASE("an unoccluded body is all prediction") {
  const PredictedClip made = random_clip(2, 9, 7, 3, 0);
  const PrincipalPlanes planes = analyse(made, true, 0);
  CHECK(planes.energy.empty());
  std::vector<double> s(made.clip.shape.texels());
  fit_prediction(planes, made.frame(1), s);
  for (std::size_t p = 0; p < s.size(); ++p) {
    // T is kept in floats.
    const double expected = made.normals[1][p] == glm::vec3(0)
                                ? 0
                                : 0.5 + 0.4 * std::sin(0.3 * static_cast<double>(p) + 1);
    CHECK(std::abs(s[p] - expected) < 1e-6);
  }
}

TEST_CASE("s is the least squares best in the light's metric") {
  const PredictedClip made = random_clip(3, 5, 4, 1, 0.3);
  const PrincipalPlanes planes = analyse(made, true, 0);
  const std::size_t texels = made.clip.shape.texels();
  std::vector<double> s(texels), b(16), residual(16);
  fit_prediction(planes, made.frame(0), s);
  for (std::size_t p = 0; p < texels; ++p) {
    if (made.normals[0][p] == glm::vec3(0)) continue;
    predicted_transfer(made.normals[0][p], b);
    const auto error = [&](double scale) {
      double sum = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t n = 0; n < 16; ++n)
          residual[n] =
              static_cast<double>(made.clip.frames[0][(3 * n + c) * texels + p]) - scale * b[n];
        sum += form(planes.metric, residual);
      }
      return sum;
    };
    CHECK(error(s[p]) < error(s[p] + 1e-3));
    CHECK(error(s[p]) < error(s[p] - 1e-3));
  }
}

TEST_CASE("what planes leave out is their energy, and planes are orthonormal in the metric") {
  const PredictedClip made = random_clip(2, 8, 8, 4, 0.1);
  for (const bool predict : {true, false}) {
    const PrincipalPlanes planes = analyse(made, predict, 48);
    REQUIRE(planes.energy.size() == 27);
    double total = 0;
    for (std::size_t k = 0; k < 27; ++k) {
      CHECK((k == 0 || planes.energy[k] <= planes.energy[k - 1]));
      total += planes.energy[k];
      for (std::size_t j = 0; j < 27; ++j) {
        double product = 0;  // analysis and synthesis are inverse to each other
        for (std::size_t i = 0; i < 27; ++i)
          product += planes.analysis[k][i] * planes.synthesis[j][i];
        CHECK(product == Approx(k == j ? 1.0 : 0.0).margin(1e-9));
        double composites = 0;  // of a unit of one plane and a unit of another
        for (std::size_t n = 0; n < 9; ++n)
          for (std::size_t m = 0; m < 9; ++m)
            for (std::size_t c = 0; c < 3; ++c)
              composites += planes.synthesis[k][3 * n + c] * planes.metric[9 * n + m] *
                            planes.synthesis[j][3 * m + c];
        CHECK(composites == Approx(k == j ? 1.0 : 0.0).margin(1e-9));
      }
    }
    CHECK(total < planes.mean_square);
  }
}

TEST_CASE("losslessly coded, all planes give the transfer back to half a step of each") {
  for (const int bits : {8, 10}) {
    for (const bool predict : {true, false}) {
      const PredictedClip made = random_clip(2, 20, 18, 6, 0.1);
      const PrincipalPlanes planes = analyse(made, predict, 48);
      const Encoded encoded = encode_principal(made, planes, lossless(bits));
      CHECK(encoded.model.prediction_plane == (predict ? 0 : -1));
      REQUIRE(encoded.layers.size() == (predict ? 3u : 2u));
      const double most = worst_share(made, encoded);
      CHECK(most <= 1);
      CHECK(most > 0.3);  // the bound says something
    }
  }
}

TEST_CASE("clips of little rank, of zeros and of extreme values are split without harm") {
  // Grey: red, green and blue are the same, so that a third of the axes is left.
  PredictedClip grey = random_clip(2, 8, 8, 3, 0.1);
  const std::size_t texels = grey.clip.shape.texels();
  for (auto& frame : grey.clip.frames)
    for (std::size_t i = 0; i < frame.size(); ++i)
      frame[i] = frame[i / (3 * texels) * 3 * texels + i % texels];
  CHECK(analyse(grey, true, 0).energy.size() == 9);
  CHECK(analyse(grey, true, 48).energy.size() == 9);

  for (const float value : {0.0f, 1e-42f, 1e-30f, -1e30f, 1e37f}) {
    INFO(value);
    PredictedClip flat = random_clip(1, 6, 5, 2, 0);
    for (auto& frame : flat.clip.frames) std::fill(frame.begin(), frame.end(), value);
    for (const bool predict : {true, false}) {
      const PrincipalPlanes planes = analyse(flat, predict, 0);
      const Encoded encoded = encode_principal(flat, planes, lossless(10));
      auto decoder = decoder_with_all(encoded);
      REQUIRE(decoder);
      auto view = decoder->frame(1);
      REQUIRE(view);
      std::vector<float> t(12 * flat.clip.shape.texels());
      REQUIRE(
          decoders::reconstruct(view->planes(), encoded.model, encoded.layers, t, flat.normals[1]));
      for (const float decoded : t) {
        CHECK(std::isfinite(decoded));
        // Steps are a thousandth of the largest value and add up over at most 13 planes.
        CHECK(std::abs(double{decoded} - double{value}) <= 0.05 * std::abs(double{value}) + 1e-37);
      }
    }
  }
}

TEST_CASE("transfer that is not finite is refused by place, and normals have to be there") {
  PredictedClip made = random_clip(1, 4, 4, 1, 0.1);
  PrincipalAnalysis analysis(made.clip.shape, true, std::vector<std::uint8_t>(16, 1));
  made.clip.frames[0][(3 * 2 + 1) * 16 + 6] = std::numeric_limits<float>::quiet_NaN();
  const Status refused = analysis.add_frame(made.frame(0));
  REQUIRE(!refused);
  CHECK(refused.error().message.find("coefficient 2, channel 1, texel (2, 1)") !=
        std::string::npos);
  PlaneSplit split =
      PlaneSplit::principal(made.clip.shape, analyse(random_clip(1, 4, 4, 1, 0.1), true, 0),
                            std::vector<std::uint8_t>(16, 1));
  made.clip.frames[0].assign(12 * 16, 0.5f);
  CHECK(split.begin_frame(made.frame(0), 0));
  const Status without = split.begin_frame({made.clip.frames[0]}, 0);
  REQUIRE(!without);
  CHECK(without.error().code == ErrorCode::kInvalid);
}
