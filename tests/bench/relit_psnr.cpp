// SPDX-License-Identifier: MIT
// relit_psnr REFERENCE.npy DECODED.npy MASK.npy LIGHTS.json: the figure by which lossy choices are
// compared. Composite of every light, frame and covered texel; peak = 99.9th percentile of the
// reference's composites; PSNR = 10 log10(peak² / MSE) over lights, frames, texels and channels. A
// decoded array of lower order counts what it lacks as zero, a smaller map is enlarged bilinearly.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "decoders/npy.hpp"

using relit::decoders::NpyArray;

namespace {

struct Shape {
  std::size_t frames, coefficients, height, width;
};

Shape shape_of(const NpyArray& a) {
  const auto& s = a.shape;
  if (s.size() == 4) return {1, s[0], s[2], s[3]};
  return {s.at(0), s.at(1), s.at(3), s.at(4)};
}

// One axis of a bilinear enlargement whose texel centres line up.
struct Tap {
  std::size_t low, high;
  double t;
};

std::vector<Tap> taps(std::size_t from, std::size_t to) {
  std::vector<Tap> result(to);
  for (std::size_t i = 0; i < to; ++i) {
    const double x = std::clamp(
        (static_cast<double>(i) + 0.5) * static_cast<double>(from) / static_cast<double>(to) - 0.5,
        0.0, static_cast<double>(from - 1));
    const auto low = std::min(static_cast<std::size_t>(x), from > 1 ? from - 2 : 0);
    result[i] = {low, std::min(low + 1, from - 1), x - static_cast<double>(low)};
  }
  return result;
}

double percentile(std::vector<float>& values, double percent) {
  const double at = percent / 100 * static_cast<double>(values.size() - 1);
  const auto low = static_cast<std::ptrdiff_t>(at);
  std::nth_element(values.begin(), values.begin() + low, values.end());
  const double a = values[static_cast<std::size_t>(low)];
  if (low + 1 == static_cast<std::ptrdiff_t>(values.size())) return a;
  const double b = *std::min_element(values.begin() + low + 1, values.end());
  return a + (b - a) * (at - static_cast<double>(low));
}

NpyArray load(const char* path) {
  auto array = relit::decoders::read_npy(path);
  if (!array) {
    std::fprintf(stderr, "relit_psnr: %s\n", array.error().message.c_str());
    std::exit(1);
  }
  return std::move(*array);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: relit_psnr REFERENCE.npy DECODED.npy MASK.npy LIGHTS.json\n");
    return 2;
  }
  const NpyArray reference = load(argv[1]), decoded = load(argv[2]), mask = load(argv[3]);
  const Shape r = shape_of(reference), d = shape_of(decoded);
  if (r.frames != d.frames || d.coefficients > r.coefficients) {
    std::fprintf(stderr, "relit_psnr: frames or coefficients do not fit\n");
    return 1;
  }
  std::ifstream in(argv[4]);
  const auto lights = nlohmann::json::parse(in).at("lights");
  std::vector<std::size_t> texels;
  for (std::size_t i = 0; i < mask.values.size(); ++i) {
    if (mask.values[i] > 0) texels.push_back(i);
  }
  const auto rows = taps(d.height, r.height), columns = taps(d.width, r.width);
  // Weights out of the JSON tree once: [channel][light][coefficient].
  std::vector<double> weights;
  for (std::size_t c = 0; c < 3; ++c) {
    for (const auto& light : lights) {
      for (std::size_t n = 0; n < r.coefficients; ++n)
        weights.push_back(light.at("sh").at(n).at(c).get<double>());
    }
  }
  std::vector<float> composites, errors;
  const std::size_t total = lights.size() * r.frames * texels.size() * 3;
  composites.reserve(total), errors.reserve(total);
  std::vector<double> truth(r.coefficients), error(r.coefficients);
  double squares = 0;
  for (std::size_t f = 0; f < r.frames; ++f) {
    for (std::size_t c = 0; c < 3; ++c) {
      for (const std::size_t texel : texels) {
        const Tap& y = rows[texel / r.width];
        const Tap& x = columns[texel % r.width];
        for (std::size_t n = 0; n < r.coefficients; ++n) {
          double value = 0;
          if (n < d.coefficients) {
            const float* tile =
                &decoded.values[((f * d.coefficients + n) * 3 + c) * d.height * d.width];
            const auto at = [&](std::size_t i, std::size_t j) {
              return static_cast<double>(tile[i * d.width + j]);
            };
            value = (1 - y.t) * ((1 - x.t) * at(y.low, x.low) + x.t * at(y.low, x.high)) +
                    y.t * ((1 - x.t) * at(y.high, x.low) + x.t * at(y.high, x.high));
          }
          truth[n] = static_cast<double>(
              reference.values[((f * r.coefficients + n) * 3 + c) * r.height * r.width + texel]);
          error[n] = value - truth[n];
        }
        for (std::size_t l = 0; l < lights.size(); ++l) {
          const double* weight = &weights[(c * lights.size() + l) * r.coefficients];
          double composite = 0, difference = 0;
          for (std::size_t n = 0; n < r.coefficients; ++n) {
            composite += weight[n] * truth[n];
            difference += weight[n] * error[n];
          }
          composites.push_back(static_cast<float>(composite));
          errors.push_back(static_cast<float>(std::abs(difference)));
          squares += difference * difference;
        }
      }
    }
  }
  const double peak = percentile(composites, 99.9);
  const double mse = squares / static_cast<double>(errors.size());
  const double largest = *std::max_element(errors.begin(), errors.end());
  std::printf("%.2f dB  p99 %.5f  max %.5f  peak %.4f\n",
              mse > 0 ? 10 * std::log10(peak * peak / mse) : INFINITY,
              percentile(errors, 99) / peak, largest / peak, peak);
  return 0;
}
