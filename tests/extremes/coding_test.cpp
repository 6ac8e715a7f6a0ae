// SPDX-License-Identifier: MIT
// What the baker makes of extreme transfer: exponents of blocks, and principal planes of little
// rank.
#include <cfloat>
#include <cmath>
#include <functional>

#include "tests/bake_minimal/principal_clip.hpp"
#include "tests/extremes/rows.hpp"

using namespace relit;
using namespace relit::bake;
using namespace relit::bake::test;
using relit::test::hold;
using relit::test::hold_exact;
using relit::test::Worst;

namespace {

constexpr int kSide = 64;

/// Two frames of order 0, grey.
Clip grey_clip(const std::function<float(int x, int y)>& value) {
  std::vector<float> frame;
  for (int c = 0; c < 3; ++c)
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) frame.push_back(value(x, y));
  return {{0, kSide, kSide}, {frame, frame}};
}

struct Coded {
  /// Against half a step: 2^(E-136) with 8 bits, 2^(E-138) with 10; what is below FLT_MIN in a
  /// whole block is 0. Steps are powers of two, and nothing else is rounded.
  Worst steps;
  std::vector<double> errors;  ///< of the first channel of the last frame
};

Coded code(const Clip& clip, int bits, int block) {
  const Encoded encoded = must_encode(clip, quick("ffv1", bits, container::Chroma::k444, block, 1));
  auto decoder = decoder_with_all(encoded);
  REQUIRE(decoder);
  Coded coded;
  std::vector<float> values(clip.frames[0].size());
  decoders::FrameView view;
  for (std::size_t f = 0; f < clip.frames.size(); ++f) {
    REQUIRE(decoder->frame(f, view));
    REQUIRE(decoders::reconstruct(view.planes(), encoded.model, encoded.layers, values));
    coded.errors.clear();
    for (std::size_t i = 0; i < values.size(); ++i) {
      const int x = static_cast<int>(i) % kSide, y = static_cast<int>(i) / kSide % kSide;
      const PlaneView& plane = view.planes()[0];
      const int e = plane.exponent.at(x >> plane.exponent_shift, y >> plane.exponent_shift);
      const double error = std::abs(double{values[i]} - double{clip.frames[f][i]});
      coded.steps.add(error, e == 0 ? double{FLT_MIN} : std::exp2(e - plane.exponent_zero - 1));
      if (i < clip.shape.texels()) coded.errors.push_back(error);
    }
  }
  return coded;
}

/// From 0 to 1, at random by place.
float noise(int x, int y) {
  const std::uint32_t hash =
      static_cast<std::uint32_t>(x) * 73856093u ^ static_cast<std::uint32_t>(y) * 19349663u;
  return static_cast<float>((hash * 2654435761u >> 8) & 0xffff) / 65536.0f;
}

PredictedClip random_clip_of(int order, int width, int height, int frames) {
  return random_clip(order, width, height, frames, 0.1);
}

void hold_principal(const std::string& name, const PredictedClip& made) {
  for (const bool predict : {true, false}) {
    const PrincipalPlanes planes = analyse(made, predict, 48);
    Worst worst;
    worst.add(worst_share(made, encode_principal(made, planes, lossless(10))), 1);
    hold(name + (predict ? ", predicted" : ", not predicted") + " (" +
             std::to_string(planes.energy.size()) + " planes)",
         "of half a step of each plane", worst);
  }
}

}  // namespace

TEST_CASE("transfer of any sign and size is within half a step of its block") {
  struct Case {
    const char* name;
    std::function<float(int, int)> value;
  };
  const Case cases[] = {
      {"all negative", [](int x, int y) { return -0.1f - 0.8f * noise(x, y); }},
      {"signs that alternate",
       [](int x, int y) { return ((x + y) % 2 ? 1.0f : -1.0f) * noise(x, y); }},
      {"2^-126 to 2^122, both signs",
       [](int x, int y) {
         return std::ldexp(noise(x, y) < 0.5f ? 1.37f : -1.73f, (x * 31 + y * 17) % 249 - 126);
       }},
      {"alone in a dark block",
       [](int x, int y) { return x % 32 == 5 && y % 32 == 9 ? noise(x, y) : 0.0f; }},
  };
  for (const Case& c : cases) {
    for (const int bits : {8, 10}) {
      Worst worst;
      for (const int block : {1, 4, 32}) {
        const Coded coded = code(grey_clip(c.value), bits, block);
        worst.add(coded.steps.error(), coded.steps.bound());
      }
      hold(std::string(c.name) + ", " + std::to_string(bits) + " bits, blocks of 1, 4, 32",
           bits == 8 ? "2^(E-136)" : "2^(E-138)", worst);
    }
  }
}

TEST_CASE("zeros of both signs and subnormal transfer are coded as zero") {
  const float values[] = {0.0f, -0.0f, 1e-42f, -1e-42f, FLT_MIN / 2};
  long wrong = 0;
  for (const int block : {1, 4, 32}) {
    const Clip clip = grey_clip([&](int x, int y) { return values[(x + 3 * y) % 5]; });
    for (const double error : code(clip, 8, block).errors) wrong += error >= double{FLT_MIN};
    const auto decoded =
        decode(must_encode(clip, quick("ffv1", 8, container::Chroma::k444, block, 1)), 2);
    REQUIRE(decoded);
    for (const float value : (*decoded)[1]) wrong += value != 0 || std::signbit(value);
  }
  hold_exact("0, -0 and subnormals", "E = 0, which is +0", wrong);
}

TEST_CASE("a huge texel among tiny ones costs its own block alone") {
  const auto value = [](int x, int y) { return x == 37 && y == 21 ? 1e6f : 1e-3f * noise(x, y); };
  // In a block of its own kind the least E that reaches 1e-3 has more than 63.75 steps up to it.
  const double fine = 1e-3 / 63.75 / 2;
  for (const int block : {32, 16, 8, 4, 2, 1}) {
    const Coded coded = code(grey_clip(value), 8, block);
    hold("1e6 among 1e-3, block " + std::to_string(block), "2^(E-136)", coded.steps);
    long harmed = -1;  // the huge one itself
    for (const double error : coded.errors) harmed += error > fine;
    Worst worst;
    worst.add(static_cast<double>(std::max(harmed, 0L)), block * block - 1);
    hold("texels that it takes with it, block " + std::to_string(block), "g² - 1", worst);
  }
}

TEST_CASE("clips of no or little rank come back from principal planes") {
  hold_principal("one texel, one frame", random_clip_of(2, 1, 1, 1));
  hold_principal("one texel, 6 frames", random_clip_of(3, 1, 1, 6));
  hold_principal("one frame", random_clip_of(2, 12, 9, 1));
  PredictedClip still = random_clip_of(2, 12, 9, 4);
  for (std::size_t f = 1; f < 4; ++f)
    still.clip.frames[f] = still.clip.frames[0], still.normals[f] = still.normals[0];
  hold_principal("all frames equal", still);
  PredictedClip even = random_clip_of(2, 12, 9, 4);
  for (std::size_t f = 0; f < 4; ++f) {
    std::vector<float>& frame = even.clip.frames[f];
    for (std::size_t i = 0; i < frame.size(); ++i) frame[i] = frame[i / 108 * 108];
    even.normals[f].assign(108, even.normals[f][0]);
  }
  hold_principal("all texels equal", even);
  PredictedClip bare = random_clip_of(2, 12, 9, 3);
  for (auto& normals : bare.normals) normals.assign(108, glm::vec3(0));
  hold_principal("normals of length zero", bare);
}
