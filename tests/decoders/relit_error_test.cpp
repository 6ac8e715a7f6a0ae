// SPDX-License-Identifier: MIT
#include "decoders/relit_error.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
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

TEST_CASE("a light map counts as the transfer that it was made of does") {
  std::mt19937 random(4);
  std::normal_distribution<float> gauss;
  const std::size_t texels = 12, coefficients = 4;
  const std::vector<std::uint8_t> covered(texels, 1);
  const std::vector<Light> lights = standard_lights();
  std::vector<float> reference(3 * coefficients * texels), decoded(reference.size());
  for (std::size_t i = 0; i < reference.size(); ++i) {
    reference[i] = 0.2f + 0.1f * gauss(random);
    decoded[i] = reference[i] + 0.05f * gauss(random);
  }
  RelitError of_transfer(lights, 4, covered, 2), of_maps(lights, 4, covered, 2);
  of_transfer.add_frame(reference, decoded);
  for (std::size_t l = 0; l < lights.size(); ++l) {
    std::vector<float> map(3 * texels);
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t p = 0; p < texels; ++p) {
        double sum = 0;
        for (std::size_t n = 0; n < coefficients; ++n)
          sum += lights[l].sh[n][c] * static_cast<double>(decoded[(3 * n + c) * texels + p]);
        map[c * texels + p] = static_cast<float>(sum);
      }
    REQUIRE(of_maps.add_light_map(l, reference, map));
  }
  // The map is rounded to floats: 2^-24 of values of about 1, beside errors of about 0.1.
  CHECK(of_maps.figures().psnr_db == Approx(of_transfer.figures().psnr_db).epsilon(1e-5));
  CHECK(of_maps.figures().log_psnr_db == Approx(of_transfer.figures().log_psnr_db).epsilon(1e-5));
  CHECK(of_maps.figures().largest == Approx(of_transfer.figures().largest).epsilon(1e-5));
  CHECK(of_maps.figures().peak == 2);

  std::vector<float> broken(3 * texels, 1);
  broken[5] = std::numeric_limits<float>::infinity();
  CHECK_FALSE(of_maps.add_light_map(0, reference, broken));
}

TEST_CASE("the log-PSNR counts stops above a floor of 2^-10 of the peak") {
  Light light;
  light.sh = {{1, 1, 1}};
  const std::vector<Light> lights{light};
  const std::vector<std::uint8_t> covered(1, 1);
  const auto log_psnr = [&](float truth, float shown) {
    RelitError error(lights, 1, covered, 4);  // peak 4
    const std::vector<float> a(3, truth), b(3, shown);
    error.add_frame(a, b);
    return error.figures().log_psnr_db;
  };
  // Black for the peak: log2((1 + 2^-10) / 2^-10) = 10.0014 stops off, of ten.
  CHECK(log_psnr(4, 0) == Approx(20 * std::log10(10 / std::log2(1025.0))));
  // Below black is black.
  CHECK(log_psnr(4, -1) == Approx(log_psnr(4, 0)));
  CHECK(std::isinf(log_psnr(0, -1)));
  // From one floor to three: (2^-9 + 2^-10) to (2^-10): log2(3) stops.
  CHECK(log_psnr(0, 4 * 2 / 1024.0f) == Approx(20 * std::log10(10 / std::log2(3.0))));
  RelitError unknown(lights, 1, covered);
  const std::vector<float> one(3, 1);
  unknown.add_frame(one, one);
  CHECK(unknown.figures().log_psnr_db == 0);
}

TEST_CASE("a resized map is bilinear between texel centres, and clamped beyond them") {
  const std::vector<float> map{0, 4, 8, 12};  // 2 x 2
  std::vector<float> large(16), same(4), row(3);
  resize_map(map, {2, 2}, same, {2, 2});
  CHECK(same == map);
  resize_map(map, {2, 2}, large, {4, 4});
  CHECK(large[0] == 0);  // beyond the first centre
  CHECK(large[1] == 1);  // a quarter of the way from 0 to 4
  CHECK(large[2] == 3);
  CHECK(large[3] == 4);
  CHECK(large[5] == 3);  // a quarter down as well: 1 + 2
  CHECK(large[15] == 12);
  resize_map(std::vector<float>{5}, {1, 1}, row, {3, 1});
  CHECK(row == std::vector<float>{5, 5, 5});
}
