// SPDX-License-Identifier: MIT
// relit_psnr REFERENCE.npy DECODED.npy MASK.npy: the figure by which lossy choices are compared, of
// arrays (decoders/relit_error.hpp). A decoded array of lower order counts what it lacks as zero, a
// smaller map is enlarged bilinearly.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>
#include <vector>

#include "decoders/npy.hpp"
#include "decoders/relit_error.hpp"

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

NpyArray load(const char* path) {
  auto array = relit::decoders::read_npy(path);
  if (!array) {
    std::fprintf(stderr, "relit_psnr: %s\n", array.error().message.c_str());
    std::exit(1);
  }
  return std::move(*array);
}

// One frame of `decoded` at the reference's order and size.
std::vector<float> conform(const NpyArray& decoded, const Shape& d, const Shape& r,
                           std::size_t frame) {
  const std::vector<Tap> rows = taps(d.height, r.height), columns = taps(d.width, r.width);
  std::vector<float> out(r.coefficients * 3 * r.height * r.width);
  for (std::size_t plane = 0; plane < 3 * d.coefficients; ++plane) {
    const float* const tile =
        &decoded.values[(frame * d.coefficients * 3 + plane) * d.height * d.width];
    const auto at = [&](std::size_t i, std::size_t j) {
      return static_cast<double>(tile[i * d.width + j]);
    };
    float* target = out.data() + plane * r.height * r.width;
    for (const Tap& y : rows) {
      for (const Tap& x : columns) {
        const double low = (1 - x.t) * at(y.low, x.low) + x.t * at(y.low, x.high);
        const double high = (1 - x.t) * at(y.high, x.low) + x.t * at(y.high, x.high);
        *target++ = static_cast<float>((1 - y.t) * low + y.t * high);
      }
    }
  }
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: relit_psnr REFERENCE.npy DECODED.npy MASK.npy\n");
    return 2;
  }
  const NpyArray reference = load(argv[1]), decoded = load(argv[2]), mask = load(argv[3]);
  const Shape r = shape_of(reference), d = shape_of(decoded);
  if (r.frames != d.frames || d.coefficients > r.coefficients ||
      mask.values.size() != r.height * r.width) {
    std::fprintf(stderr, "relit_psnr: frames, coefficients or mask do not fit\n");
    return 1;
  }
  std::vector<std::uint8_t> covered(mask.values.size());
  for (std::size_t i = 0; i < covered.size(); ++i) covered[i] = mask.values[i] > 0 ? 1 : 0;
  relit::decoders::RelitError error(relit::decoders::standard_lights(),
                                    static_cast<int>(r.coefficients), covered);
  const std::size_t frame = r.coefficients * 3 * r.height * r.width;
  for (std::size_t f = 0; f < r.frames; ++f)
    error.add_frame(std::span(reference.values).subspan(f * frame, frame),
                    conform(decoded, d, r, f));
  const auto figures = error.figures();
  std::printf("%.2f dB  p99 %.5f  max %.5f  peak %.4f\n", figures.psnr_db, figures.p99,
              figures.largest, figures.peak);
  return 0;
}
