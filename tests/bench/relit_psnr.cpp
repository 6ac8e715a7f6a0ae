// SPDX-License-Identifier: MIT
// relit_psnr REFERENCE.npy DECODED.npy MASK.npy: the figure by which lossy choices are compared, of
// arrays (decoders/relit_error.hpp). A decoded array of lower order counts what it lacks as zero, a
// smaller map is enlarged bilinearly.
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
  const std::size_t from = d.height * d.width, to = r.height * r.width;
  std::vector<float> out(r.coefficients * 3 * to);
  for (std::size_t plane = 0; plane < 3 * d.coefficients; ++plane) {
    relit::decoders::resize_map(
        std::span(decoded.values).subspan((frame * d.coefficients * 3 + plane) * from, from),
        {d.width, d.height}, std::span(out).subspan(plane * to, to), {r.width, r.height});
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
