// SPDX-License-Identifier: MIT
#include "decoders/relit_error.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/test.hpp"

using namespace relit;
using namespace relit::decoders;

TEST_CASE("the standard lights have a mean radiance of one") {
  const std::vector<Light> lights = standard_lights();
  REQUIRE(lights.size() == 16);
  for (const Light& light : lights) {
    REQUIRE(light.order() == 3);
    double mean = 0;
    for (const double value : light.sh[0]) mean += value / std::sqrt(4 * 3.14159265358979) / 3;
    CHECK(mean == Approx(1).epsilon(1e-5));  // numbers of six digits
  }
  // The first and the last number of the file.
  CHECK(lights[0].sh[0][0] == Approx(3.382791));
  CHECK(lights[15].sh[15][2] != 0);
}

TEST_CASE("percentiles of a histogram are those of the sorted values to a step of it") {
  std::mt19937 random(3);
  std::lognormal_distribution<float> values(0, 3);
  Histogram histogram;
  std::vector<double> sorted;
  for (int i = 0; i < 20000; ++i) {
    const float value = values(random);
    histogram.add(value);
    sorted.push_back(static_cast<double>(value));
  }
  std::sort(sorted.begin(), sorted.end());
  for (const double percent : {0.0, 1.0, 50.0, 99.0, 99.9, 100.0}) {
    const auto rank = static_cast<std::size_t>(percent / 100 * 19999);
    // A bin is 2^-12 wide at most, and the next value may lie one further on.
    CHECK(histogram.percentile(percent) >= sorted[rank] * (1 - std::ldexp(1.0, -11)));
    CHECK(histogram.percentile(percent) <=
          sorted[std::min<std::size_t>(rank + 1, 19999)] * (1 + std::ldexp(1.0, -11)));
  }
  CHECK(Histogram().percentile(50) == 0);
  Histogram negative;
  negative.add(-3);
  CHECK(negative.percentile(50) < 1e-40);
}

TEST_CASE("the relit PSNR is that of the definition, on what is covered") {
  std::mt19937 random(9);
  std::normal_distribution<float> gauss;
  const std::size_t texels = 40, coefficients = 9;
  std::vector<std::uint8_t> covered(texels, 1);
  covered[7] = covered[30] = 0;
  const std::vector<Light> lights = standard_lights();
  RelitError error(lights, 9, covered);
  std::vector<double> composites, errors;
  for (int f = 0; f < 5; ++f) {
    std::vector<float> reference(3 * coefficients * texels), decoded(reference.size());
    for (std::size_t i = 0; i < reference.size(); ++i) {
      reference[i] = 0.2f + 0.1f * gauss(random);
      decoded[i] = reference[i] + 0.01f * gauss(random);
    }
    for (std::size_t p = 0; p < texels; ++p) {
      if (covered[p] == 0) decoded[p] = 1e6f;  // is not looked at
    }
    error.add_frame(reference, decoded);
    for (const Light& light : lights)
      for (std::size_t p = 0; p < texels; ++p)
        for (std::size_t c = 0; c < 3 && covered[p] != 0; ++c) {
          double truth = 0, difference = 0;
          for (std::size_t n = 0; n < coefficients; ++n) {
            const std::size_t i = (3 * n + c) * texels + p;
            truth += light.sh[n][c] * static_cast<double>(reference[i]);
            difference += light.sh[n][c] *
                          (static_cast<double>(decoded[i]) - static_cast<double>(reference[i]));
          }
          composites.push_back(truth);
          errors.push_back(std::abs(difference));
        }
  }
  std::sort(composites.begin(), composites.end());
  std::sort(errors.begin(), errors.end());
  double squares = 0;
  for (const double e : errors) squares += e * e;
  const double peak =
      composites[static_cast<std::size_t>(0.999 * static_cast<double>(composites.size() - 1))];
  const RelitError::Figures figures = error.figures();
  // The peak may lie between two values that differ by more than a step.
  CHECK(figures.peak == Approx(peak).epsilon(0.01));
  CHECK(figures.psnr_db == Approx(10 * std::log10(figures.peak * figures.peak *
                                                  static_cast<double>(errors.size()) / squares))
                               .epsilon(1e-9));
  CHECK(figures.largest == Approx(errors.back() / figures.peak));
  CHECK(figures.p99 ==
        Approx(errors[static_cast<std::size_t>(0.99 * static_cast<double>(errors.size() - 1))] /
               figures.peak)
            .epsilon(0.01));

  RelitError exact(lights, 1, covered);
  const std::vector<float> same(3 * texels, 0.25f);
  exact.add_frame(same, same);
  CHECK(std::isinf(exact.figures().psnr_db));
  CHECK(RelitError(lights, 9, covered).figures().psnr_db == 0);  // no frames
}
