// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <limits>

#include "bake_minimal/light_metric.hpp"
#include "tests/bake_minimal/coding_clip.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::bake;
using namespace relit::bake::test;
using container::Chroma;

namespace {

constexpr std::size_t kFrameCount = 8;

/// The definition of a coded mantissa, written out once more: value of a component at a texel in
/// units of its step, or the mean of four of them.
struct Expected {
  const Clip& clip;
  const Encoded& encoded;
  Basis basis;

  [[nodiscard]] double value(std::size_t frame, int n, int c, int x, int y) const {
    const auto texels = clip.shape.texels();
    const float* t = clip.frames[frame].data() + static_cast<std::size_t>(n) * 3 * texels +
                     static_cast<std::size_t>(y * clip.shape.width + x);
    const Rgb& mean = encoded.model.mean[static_cast<std::size_t>(n)];
    const double r = double{t[0]} - double{mean[0]}, g = double{t[texels]} - double{mean[1]},
                 b = double{t[2 * texels]} - double{mean[2]};
    if (basis == Basis::kLuma) return (r + g + b) / 3;
    if (basis == Basis::kGbr) return c == 0 ? g : c == 1 ? b : r;
    return c == 0 ? r / 4 + g / 2 + b / 4 : c == 1 ? (r - b) / 2 : g / 2 - r / 4 - b / 4;
  }

  /// In units of the step at (x, y) itself; 0 where E = 0.
  [[nodiscard]] double units(const PlaneView& plane, double v, int x, int y) const {
    int e = plane.exponent_zero;
    if (!plane.exponent.empty()) {
      e = plane.exponent.at(x >> plane.exponent_shift, y >> plane.exponent_shift);
      if (e == 0) return 0;
    }
    return v / double{plane.scale} / std::exp2(e - plane.exponent_zero);
  }

  /// Of the mantissa that covers texel (x, y).
  [[nodiscard]] double mantissa(const PlaneView& plane, std::size_t frame, int n, int c, int x,
                                int y) const {
    if (plane.mantissa_shift == 0) return units(plane, value(frame, n, c, x, y), x, y);
    double sum = 0;
    for (int i = 0; i < 4; ++i) {
      const int sx = std::min((x & ~1) + i % 2, clip.shape.width - 1);
      const int sy = std::min((y & ~1) + i / 2, clip.shape.height - 1);
      sum += units(plane, value(frame, n, c, sx, sy), sx, sy);
    }
    return sum / 4;
  }
};

struct MantissaError {
  double largest = 0;
  double rms = 0;
};

/// Error of all decoded mantissas against the definition. The coefficient and component of plane k
/// are counted off in the order that the layouts promise: bands, then components.
MantissaError mantissa_error(const Clip& clip, const Encoded& encoded,
                             const CodingOptions& options) {
  auto decoder = decoder_with_all(encoded);
  REQUIRE(decoder);
  const Basis basis = basis_of(*resolve(options));
  const Expected expected{clip, encoded, basis};
  const int components = component_count(basis);
  MantissaError error;
  double squares = 0, count = 0;
  decoders::FrameView view;
  for (std::size_t f = 0; f < clip.frames.size(); ++f) {
    const Status decoded = decoder->frame(f, view);
    INFO((decoded ? "" : decoded.error().message));
    REQUIRE(decoded);
    for (std::size_t k = 0; k < view.planes().size(); ++k) {
      const PlaneView& plane = view.planes()[k];
      const int n = static_cast<int>(k) / components, c = static_cast<int>(k) % components;
      for (int y = 0; y < clip.shape.height; ++y) {
        for (int x = 0; x < clip.shape.width; ++x) {
          const double q = expected.mantissa(plane, f, n, c, x, y);
          const int m = plane.mantissa.at(x >> plane.mantissa_shift, y >> plane.mantissa_shift);
          const double e = std::abs(q - (m - plane.mantissa_zero));
          error.largest = std::max(error.largest, e);
          squares += e * e;
          ++count;
        }
      }
    }
  }
  error.rms = std::sqrt(squares / count);
  return error;
}

/// Half a step, and the last bits of the double arithmetic on either side.
constexpr double kHalf = 0.5 + 1e-9;

}  // namespace

TEST_CASE("lossless files are exact to half a quantiser step in every combination") {
  const Clip clip = smooth_clip(2, 40, 24, static_cast<int>(kFrameCount));
  for (const char* codec : {"ffv1", "h264"}) {
    for (const Layout layout : {Layout::kLayered, Layout::kGrid}) {
      for (const int bits : {8, 10}) {
        for (const Chroma chroma : {Chroma::k444, Chroma::kLuma}) {
          for (const auto& [block, hold] : {std::pair{0, 0}, {1, 1}, {2, 0}, {16, 3}, {32, 0}}) {
            if (layout == Layout::kGrid && block > 1 && block < 32) continue;
            CodingOptions o = quick(codec, bits, chroma, block, hold);
            o.lossless = true;
            if (o.codec == "h264") o.preset = "ultrafast";
            o.layout = layout;
            const Encoded encoded = must_encode(clip, o);
            INFO(describe(o));
            CHECK(mantissa_error(clip, encoded, o).largest <= kHalf);
          }
        }
      }
    }
  }
}

TEST_CASE("lossless transfer stays within quantiser_bound") {
  const Clip clip = smooth_clip(3, 21, 17, 6);
  for (const int block : {0, 4}) {
    CodingOptions o = quick("ffv1", 8, Chroma::k444, block, 2);
    const Encoded encoded = must_encode(clip, o);
    auto decoder = decoder_with_all(encoded);
    REQUIRE(decoder);
    const auto decoded = decode(encoded, clip.frames.size());
    REQUIRE(decoded);
    decoders::FrameView view;
    double worst = 0;
    for (std::size_t f = 0; f < clip.frames.size(); ++f) {
      REQUIRE(decoder->frame(f, view));
      for (std::size_t i = 0; i < clip.frames[f].size(); ++i) {
        const auto p = static_cast<int>(i % clip.shape.texels());
        const auto nc = static_cast<int>(i / clip.shape.texels());
        const PlaneView& plane = view.planes()[static_cast<std::size_t>(nc)];
        const int e = plane.exponent.empty()
                          ? 0
                          : plane.exponent.at((p % clip.shape.width) >> plane.exponent_shift,
                                              (p / clip.shape.width) >> plane.exponent_shift);
        const double bound = quantiser_bound(encoded.layers, nc / 3, nc % 3, e);
        // The decoder rounds the sum, of magnitude below 1, to float once: 2^-25.
        const double error = std::abs(double{(*decoded)[f][i]} - double{clip.frames[f][i]});
        CHECK(error <= bound * (1 + 1e-9) + std::exp2(-25));
        if (bound > 0) worst = std::max(worst, error / bound);
      }
    }
    // A bound that is never approached would be no bound of this quantiser.
    CHECK(worst > 0.9);
  }
}

TEST_CASE("lossy mantissas keep to the quantiser of the rate factor") {
  const Clip clip = smooth_clip(2, 40, 24, static_cast<int>(kFrameCount));
  struct Case {
    const char* codec;
    std::vector<int> bits;
    std::vector<Chroma> chroma;
  };
  const std::vector<Case> cases = {
      {"h264", {8, 10}, {Chroma::k420, Chroma::k444, Chroma::kLuma}},
      {"mpeg4", {8}, {Chroma::k420}},
      {"hevc", {10}, {Chroma::k420, Chroma::kLuma}},
      {"vp9", {8, 10}, {Chroma::k420, Chroma::kLuma}},
      {"av1", {10}, {Chroma::k420, Chroma::kLuma}},
  };
  for (const Case& c : cases) {
    for (const int bits : c.bits) {
      for (const Chroma chroma : c.chroma) {
        for (const auto& [block, hold] : {std::pair{0, 0}, {1, 1}, {2, 1}, {16, 3}, {32, 0}}) {
          // The slower encoders only differ behind the quantiser.
          const bool slow = std::string(c.codec) != "h264" && std::string(c.codec) != "mpeg4";
          if (slow && block != 0 && block != 16) continue;
          CodingOptions o = quick(c.codec, bits, chroma, block, hold);
          o.crf = 10;
          o.layout = block == 2 ? Layout::kGrid : Layout::kLayered;
          const Encoded encoded = must_encode(clip, o);
          // Rate factor 10 is a step of 2^((10-4)/6) = 2 in 8-bit samples, and rate control adds at
          // most 6 to the quantiser of pictures nobody refers to. An error of that larger step, 4,
          // everywhere is more than a dead zone can cause; 10 bits count in quarters. VP9's and
          // AV1's scales are others, but finer at 10. A wrong exponent costs dozens.
          const double limit = (bits == 10 ? 4 : 1) * 4.0 + 0.5;
          INFO(describe(o));
          CHECK(mantissa_error(clip, encoded, o).rms < limit);
        }
      }
    }
  }
}

TEST_CASE("a better rate factor gives smaller errors and more bytes") {
  const Clip clip = smooth_clip(2, 40, 24, static_cast<int>(kFrameCount));
  for (const char* codec : {"h264", "mpeg4", "hevc"}) {
    CodingOptions o = quick(codec, std::string(codec) == "mpeg4" ? 8 : 10, Chroma::k420, 0, 0);
    o.crf = 14;
    const Encoded fine = must_encode(clip, o);
    o.crf = 32;
    const Encoded coarse = must_encode(clip, o);
    INFO(codec);
    CHECK(mantissa_error(clip, fine, o).rms < mantissa_error(clip, coarse, o).rms);
    CHECK(all_bytes(fine).size() > all_bytes(coarse).size());
  }
}

namespace {

/// Magnitudes from 1e-30 to 1e30, both signs, many zeros.
Clip wild_clip(int order, int width, int height, int frame_count) {
  Clip clip{{order, width, height}, {}};
  std::uint32_t state = 12345;
  const auto random = [&] {
    state = state * 1664525u + 1013904223u;
    return static_cast<int>(state >> 8);
  };
  for (int f = 0; f < frame_count; ++f) {
    std::vector<float> t(static_cast<std::size_t>(clip.shape.coefficients()) * 3 *
                         clip.shape.texels());
    for (float& v : t) {
      if (random() % 3 == 0) continue;
      v = static_cast<float>((random() % 2000 - 1000) * 1e-3 * std::pow(10.0, random() % 61 - 30));
    }
    clip.frames.push_back(std::move(t));
  }
  // One wholly zero 32×32 corner.
  for (auto& frame : clip.frames) {
    for (std::size_t i = 0; i < frame.size(); ++i) {
      const auto p = static_cast<int>(i % clip.shape.texels());
      if (p % width < 32 && p / width < 32) frame[i] = 0;
    }
  }
  return clip;
}

}  // namespace

TEST_CASE("the exponent is the smallest that holds every mantissa of block and hold") {
  const Clip clip = wild_clip(0, 70, 45, 7);
  for (const auto& [bits_of_case, chroma] :
       {std::pair{8, Chroma::k420}, {10, Chroma::k420}, {8, Chroma::kLuma}, {10, Chroma::k444}}) {
    const int bits = bits_of_case;  // Clang 14 lets no lambda see the binding
    for (const int block : {1, 2, 4, 8, 16, 32}) {
      for (const int hold : {1, 3, 0}) {
        CodingOptions o = quick("h264", bits, chroma, block, hold);
        o.lossless = chroma != Chroma::k420;
        o.preset = "ultrafast";
        const Encoded encoded = must_encode(clip, o);
        const Expected expected{clip, encoded, basis_of(*resolve(o))};
        auto decoder = decoder_with_all(encoded);
        REQUIRE(decoder);
        decoders::FrameView view;
        const int top = bits == 8 ? 127 : 511, least = bits == 8 ? 9 : 11;
        const int run = hold == 0 ? 5 : hold;
        int wrong = 0, zeros = 0;
        for (int f = 0; f < 7; ++f) {
          REQUIRE(decoder->frame(static_cast<std::uint64_t>(f), view));
          const int first = f / 5 * 5 + f % 5 / run * run;
          const int last = std::min({first + run, f / 5 * 5 + 5, 7});
          const PlaneView& grid = view.planes()[0];
          CHECK(grid.exponent.width == (70 + block - 1) / block);
          for (int by = 0; by < grid.exponent.height; ++by) {
            for (int bx = 0; bx < grid.exponent.width; ++bx) {
              double largest = 0;
              for (std::size_t k = 0; k < view.planes().size(); ++k) {
                // Blocks of a texel bound each plane's own values, larger ones the means that are
                // coded.
                const int step = view.planes()[k].mantissa_shift == 1 && block > 1 ? 2 : 1;
                for (int g = first; g < last; ++g) {
                  for (int y = by * block; y < std::min((by + 1) * block, 45); y += step) {
                    for (int x = bx * block; x < std::min((bx + 1) * block, 70); x += step) {
                      double v = 0;
                      for (int i = 0; i < step * step; ++i) {
                        v += expected.value(static_cast<std::size_t>(g), 0, static_cast<int>(k),
                                            std::min(x + i % 2, 69), std::min(y + i / 2, 44));
                      }
                      largest = std::max(largest, std::abs(v) / (step * step));
                    }
                  }
                }
              }
              const int e = grid.exponent.at(bx, by);
              const auto fits = [&](int candidate) {
                return std::round(largest / std::exp2(candidate - (bits == 8 ? 135 : 137))) <= top;
              };
              int smallest = 0;
              if (largest > 0) {
                smallest = least;
                while (!fits(smallest)) ++smallest;
              }
              zeros += e == 0;
              wrong += e != smallest;
            }
          }
        }
        INFO(describe(o));
        CHECK(wrong == 0);
        CHECK(zeros > 0);
      }
    }
  }
}

TEST_CASE("values of every magnitude survive a shared exponent") {
  const Clip clip = wild_clip(1, 37, 35, 3);
  for (const int bits : {8, 10}) {
    const CodingOptions o = quick("ffv1", bits, Chroma::k444, 1, 1);
    CHECK(mantissa_error(clip, must_encode(clip, o), o).largest <= kHalf);
  }
}

TEST_CASE("zeros stay zero and subnormal numbers become zero") {
  Clip clip{{0, 16, 16}, {std::vector<float>(3 * 256)}};
  clip.frames[0][0] = 1e-40f;           // G of no block else
  clip.frames[0][5] = FLT_MIN;          // R
  clip.frames[0][3 * 256 - 1] = -0.5f;  // B of the last texel
  const CodingOptions o = quick("ffv1", 8, Chroma::k444, 1, 1);
  const Encoded encoded = must_encode(clip, o);
  const auto decoded = decode(encoded, 1);
  REQUIRE(decoded);
  const std::vector<float>& t = decoded->front();
  CHECK(t[0] == 0);
  // E = 9 is a step of 2^-126, which is FLT_MIN.
  CHECK(t[5] == FLT_MIN);
  CHECK(t[3 * 256 - 1] == -0.5f);
  CHECK(std::count_if(t.begin(), t.end(), [](float v) { return v != 0; }) == 2);
}

TEST_CASE("a clip of zeros codes, with finite scales") {
  const Clip clip{{1, 20, 12}, Frames(3, std::vector<float>(4 * 3 * 240))};
  for (const int block : {0, 2, 16}) {
    const CodingOptions o = quick("h264", 8, Chroma::k420, block, 0);
    const Encoded encoded = must_encode(clip, o);
    for (const auto& layer : encoded.layers) {
      for (const auto& plane : layer.planes) {
        CHECK(plane.scale > 0);
        CHECK(std::isfinite(plane.scale));
      }
    }
    const auto decoded = decode(encoded, 3);
    REQUIRE(decoded);
    for (const auto& frame : *decoded) {
      CHECK(std::all_of(frame.begin(), frame.end(), [](float v) { return v == 0; }));
    }
  }
}

TEST_CASE("values that are not finite or too large are refused by frame and texel") {
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity(), 2e37f}) {
    Clip clip = smooth_clip(1, 20, 12, 3);
    // Coefficient 2, channel 1, texel (7, 4).
    clip.frames[1][(2 * 3 + 1) * 240 + 4 * 20 + 7] = bad;
    const auto encoded = encode(clip, {});
    REQUIRE(!encoded);
    CHECK(encoded.error().code == ErrorCode::kInvalid);
    CHECK(encoded.error().message.find("frame 1, coefficient 2, channel 1, texel (7, 4)") !=
          std::string::npos);
  }
}

TEST_CASE("without exponents the largest value just fits and steps follow the light") {
  const Clip clip = smooth_clip(3, 24, 24, 4);
  const std::vector<double> metric = light_metric(3);
  const auto rms = [&](std::size_t band) {
    double sum = 0;
    for (std::size_t n = band * band; n < (band + 1) * (band + 1); ++n) sum += metric[17 * n];
    return std::sqrt(sum / static_cast<double>(2 * band + 1));
  };
  for (const bool centred : {true, false}) {
    for (const Chroma chroma : {Chroma::k420, Chroma::k444}) {
      CodingOptions o = quick("h264", 10, chroma, 0, 0);
      o.centred = centred;
      o.preset = "ultrafast";
      const Encoded encoded = must_encode(clip, o);
      REQUIRE(encoded.layers.size() == 4);
      for (std::size_t l = 0; l < 4; ++l) {
        // Step × light is the same for all bands; scales are floats.
        CHECK(double{encoded.layers[l].planes[0].scale} * rms(l) ==
              Approx(double{encoded.layers[0].planes[0].scale} * rms(0)).epsilon(1e-6));
      }
      const Expected expected{clip, encoded, Basis::kYCoCg};
      auto decoder = decoder_with_all(encoded);
      REQUIRE(decoder);
      auto view = decoder->frame(0);
      REQUIRE(view);
      double largest = 0;
      for (std::size_t f = 0; f < clip.frames.size(); ++f) {
        for (int k = 0; k < 16 * 3; ++k) {
          const PlaneView& plane = view->planes()[static_cast<std::size_t>(k)];
          for (int p = 0; p < 24 * 24; ++p) {
            largest = std::max(largest,
                               std::abs(expected.mantissa(plane, f, k / 3, k % 3, p % 24, p / 24)));
          }
        }
      }
      CHECK(largest == Approx(511).epsilon(1e-6));
      const bool any_mean = std::any_of(encoded.model.mean.begin(), encoded.model.mean.end(),
                                        [](const Rgb& m) { return m != Rgb{}; });
      CHECK(any_mean == centred);
    }
  }
}

TEST_CASE("a frame that was not scanned is refused") {
  const Clip clip = smooth_clip(1, 16, 16, 2);
  for (const int block : {0, 4}) {
    auto scan = RangeScan::create(clip.shape, quick("ffv1", 8, Chroma::k444, block, 0));
    REQUIRE(scan);
    for (const auto& frame : clip.frames) REQUIRE(scan->add_frame({frame}));
    auto encoder = PlaneEncoder::begin(std::move(*scan), {});
    REQUIRE(encoder);
    std::vector<float> larger = clip.frames[0];
    for (float& v : larger) v *= 5;
    const Status status = encoder->encode_frame({larger});
    REQUIRE(!status);
    CHECK(status.error().code == ErrorCode::kInvalid);
  }
}

TEST_CASE("tiles are padded to sixteen by replication, also the halved ones") {
  const Clip clip = smooth_clip(1, 21, 19, 2);
  CodingOptions o = quick("h264", 8, Chroma::k444, 0, 0);
  o.lossless = true;
  const Encoded encoded = must_encode(clip, o);
  CHECK(encoded.layers[1].coded_width == 3 * 32);
  CHECK(encoded.layers[1].coded_height == 32);
  auto decoder = decoder_with_all(encoded);
  REQUIRE(decoder);
  auto view = decoder->frame(1);
  REQUIRE(view);
  for (const PlaneView& plane : view->planes()) {
    int wrong = 0;
    for (int y = 0; y < 32; ++y) {
      for (int x = 0; x < 32; ++x) {
        wrong += plane.mantissa.at(x, y) != plane.mantissa.at(std::min(x, 20), std::min(y, 18));
      }
    }
    CHECK(wrong == 0);
  }
}
