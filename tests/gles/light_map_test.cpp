// SPDX-License-Identifier: MIT
#include "gles/light_map.hpp"

#include <bit>
#include <cmath>
#include <random>

#include "tests/gles/backends.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::gles;
using namespace relit::test;

TEST_CASE("half floats are the nearest, ties to even", "[gles]") {
  CHECK(to_half(0.0f) == 0);
  CHECK(from_half(0x3555) == Approx(1 / 3.0).epsilon(5e-4));
  CHECK(from_half(0xC100) == -2.5f);
  CHECK(from_half(0x0001) == std::ldexp(1.0f, -24));
  CHECK(to_half(1.0f) == 0x3C00);
  CHECK(to_half(-2.0f) == 0xC000);
  CHECK(to_half(65504.0f) == 0x7BFF);
  CHECK(to_half(65519.0f) == 0x7BFF);
  CHECK(to_half(1e30f) == 0x7BFF);
  CHECK(to_half(-INFINITY) == 0xFBFF);
  CHECK(to_half(NAN) == 0);
  CHECK(to_half(1.0f + 1.0f / 2048) == 0x3C00);     // a tie, to even
  CHECK(to_half(1.0f + 3.0f / 2048) == 0x3C02);     // a tie, to even
  CHECK(to_half(6.103515625e-5f) == 0x0400);        // the least normal one
  CHECK(to_half(std::ldexp(1.0f, -24)) == 0x0001);  // the least of all
  CHECK(to_half(std::ldexp(1.0f, -26)) == 0x0000);
  for (std::uint32_t h = 0; h < 0x7C00; ++h)
    REQUIRE(to_half(from_half(static_cast<std::uint16_t>(h))) == h);
  std::mt19937 random(7);
  for (int i = 0; i < 20000; ++i) {
    const float value = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
    if (!(std::abs(value) < 65504)) continue;
    const std::uint16_t half = to_half(value);
    const double error = std::abs(double{from_half(half)} - value);
    // No neighbour is nearer.
    for (const int step : {-1, 1}) {
      const int neighbour = (half & 0x7FFF) + step;
      if (neighbour < 0 || neighbour >= 0x7C00) continue;
      const auto other = static_cast<std::uint16_t>((half & 0x8000) | neighbour);
      REQUIRE(error <= std::abs(double{from_half(other)} - value));
    }
  }
}

TEST_CASE("light maps from the CPU reach the GPU in every format", "[gles][es2]") {
  constexpr int kWidth = 13, kHeight = 7;
  std::vector<float> values;
  for (int i = 0; i < 3 * kWidth * kHeight; ++i)
    values.push_back(0.7f * std::sin(0.3f * static_cast<float>(i)) + 0.4f);
  for (const LightMapFormat format :
       {LightMapFormat::kHalfFloat, LightMapFormat::kSquareRoot8, LightMapFormat::kFloat}) {
    on_each_backend([&](const Device& device, const Backend&) {
      auto uploader = LightMapUploader::create(device, kWidth, kHeight, format);
      if (!uploader && uploader.error().code == ErrorCode::kUnsupported &&
          device.profile() == Profile::kEs2Mediump)
        return;  // floats that it cannot filter
      if (!uploader) FAIL(uploader.error().message);
      auto map = uploader->upload(values, 2.5f);
      REQUIRE(map);
      CHECK(map->magnitude == 2.5f);
      CHECK(map->square_root == (format == LightMapFormat::kSquareRoot8));
      CHECK(uploader->gpu_bytes() >= 2 * 4 * kWidth * kHeight);
      // Read through a framebuffer, where the format can be one.
      const Functions& gl = device.gl();
      FramebufferObject framebuffer(gl);
      gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
      gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, map->texture, 0);
      if (gl.CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) {
        std::vector<float> pixels(4 * kWidth * kHeight);
        std::vector<std::uint8_t> bytes(4 * kWidth * kHeight);
        if (map->square_root)
          gl.ReadPixels(0, 0, kWidth, kHeight, GL_RGBA, GL_UNSIGNED_BYTE, bytes.data());
        else
          REQUIRE(read_float_pixels(device, kWidth, kHeight, pixels));
        for (std::size_t i = 0; i < kWidth * kHeight; ++i)
          for (std::size_t c = 0; c < 3; ++c) {
            const double expected = values[c * kWidth * kHeight + i];
            double got = pixels[4 * i + c];
            double slack =
                std::abs(expected) * std::exp2(format == LightMapFormat::kFloat ? -24 : -11);
            if (map->square_root) {
              const double root = bytes[4 * i + c] / 255.0;
              got = root * root;
              // The root is dithered by less than one step.
              slack = (2 * std::sqrt(std::max(expected, 0.0) / map->scale) / 255 + 1.0 / 65025) *
                      map->scale;
            }
            got *= map->scale;
            const double wanted = map->square_root ? std::max(expected, 0.0) : expected;
            CHECK(std::abs(got - wanted) <= slack + 1e-9);
          }
      }
      gl.BindFramebuffer(GL_FRAMEBUFFER, 0);
      CHECK_FALSE(uploader->upload(std::span(values).first(5), 1));
      CHECK_FALSE(uploader->upload(values, 0));
      CHECK_FALSE(uploader->upload(values, NAN));
      values[3] = NAN;
      values[4] = -INFINITY;
      CHECK(uploader->upload(values, 1));
      values[3] = values[4] = 0.25f;
    });
  }
}

TEST_CASE("light maps that textures cannot hold are refused", "[gles][es2]") {
  on_each_backend([&](const Device& device, const Backend&) {
    CHECK(LightMapUploader::create(device, 0, 4).error().code == ErrorCode::kInvalid);
    CHECK(LightMapUploader::create(device, 5000, 4).error().code == ErrorCode::kLimit);
  });
}
