// SPDX-License-Identifier: MIT
#include "decoders/image.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>

#include "container/base/limits.hpp"
#include "tests/decoders/image_samples.hpp"
#include "tests/test.hpp"

using relit::ErrorCode;
using relit::decoders::decode_image;
using relit::decoders::image_media_type;
using relit::test::Bytes;
using relit::test::make_flat_jpeg;
using relit::test::make_png;
using relit::test::make_rgba_png;

namespace {

Bytes decoded_rgba(const Bytes& file, int width, int height) {
  const auto image = decode_image(file, "");
  INFO((image ? std::string() : image.error().message));
  REQUIRE(image.has_value());
  REQUIRE(image->width == width);
  REQUIRE(image->height == height);
  REQUIRE(image->rgba.size() == static_cast<std::size_t>(width * height * 4));
  return image->rgba;
}

ErrorCode failure(const Bytes& file, const char* media_type = "") {
  const auto image = decode_image(file, media_type);
  REQUIRE(!image.has_value());
  CHECK(image.error().message.size() > 20);
  return image.error().code;
}

Bytes ramp(std::size_t size, int factor) {
  Bytes out(size);
  for (std::size_t i = 0; i < size; ++i) {
    out[i] = static_cast<std::uint8_t>(i * static_cast<std::size_t>(factor) & 0xff);
  }
  return out;
}

}  // namespace

TEST_CASE("RGBA and RGB pictures come out as they went in", "[image]") {
  const Bytes rgba = ramp(16 * 5 * 4, 37);
  CHECK(decoded_rgba(make_rgba_png(16, 5, rgba), 16, 5) == rgba);

  const Bytes rgb = ramp(7 * 3 * 3, 11);
  const Bytes out = decoded_rgba(make_png({7, 3, 8, 2, rgb, {}, {}}), 7, 3);
  for (std::size_t i = 0; i < 21; ++i) {
    for (std::size_t c = 0; c < 3; ++c) CHECK(out[i * 4 + c] == rgb[i * 3 + c]);
    CHECK(out[i * 4 + 3] == 255);
  }
}

TEST_CASE("every grey value stays what it is", "[image]") {
  Bytes grey(256);
  for (std::size_t i = 0; i < 256; ++i) grey[i] = static_cast<std::uint8_t>(i);
  const Bytes out = decoded_rgba(make_png({256, 1, 8, 0, grey, {}, {}}), 256, 1);
  for (std::size_t i = 0; i < 256; ++i) {
    CHECK(out[i * 4] == i);
    CHECK(out[i * 4 + 2] == i);
    CHECK(out[i * 4 + 3] == 255);
  }
  const Bytes alpha = decoded_rgba(make_png({2, 1, 8, 4, {10, 20, 250, 0}, {}, {}}), 2, 1);
  CHECK(alpha == Bytes{10, 10, 10, 20, 250, 250, 250, 0});
}

TEST_CASE("palettes, transparency, one bit and sixteen bits are expanded", "[image]") {
  const Bytes palette = decoded_rgba(
      make_png({3, 1, 8, 3, {2, 0, 1}, {255, 0, 0, 0, 255, 0, 1, 2, 3}, {255, 128}}), 3, 1);
  CHECK(palette == Bytes{1, 2, 3, 255, 255, 0, 0, 255, 0, 255, 0, 128});
  const Bytes bits = decoded_rgba(make_png({8, 1, 1, 0, {0b10110001}, {}, {}}), 8, 1);
  for (std::size_t i = 0; i < 8; ++i) CHECK(bits[i * 4] == ((0b10110001 >> (7 - i) & 1) ? 255 : 0));
  // 16 bits: v / 257 to the nearest, up to the scaler's dither of one step.
  const Bytes deep = decoded_rgba(
      make_png({2, 1, 16, 2, {0, 0, 128, 128, 255, 255, 64, 64, 32, 32, 1, 1}, {}, {}}), 2, 1);
  const int expected[] = {0, 128, 255, 255, 64, 32, 1, 255};
  for (std::size_t i = 0; i < 8; ++i) CHECK(std::abs(deep[i] - expected[i]) <= 1);
}

TEST_CASE("JPEG is full range BT.601", "[image]") {
  for (const int grey : {0, 1, 16, 128, 235, 254, 255}) {
    const Bytes out = decoded_rgba(make_flat_jpeg({grey}), 8, 8);
    CHECK(out[0] == grey);
    CHECK(out[63 * 4 + 1] == grey);
    CHECK(out[3] == 255);
  }
  // R = Y + 1.402 (Cr - 128), G = Y - 0.344136 (Cb - 128) - 0.714136 (Cr - 128),
  // B = Y + 1.772 (Cb - 128); the scaler's fixed point adds at most one step.
  const Bytes out = decoded_rgba(make_flat_jpeg({120, 100, 160}), 8, 8);
  CHECK(std::abs(out[0] - 165) <= 1);
  CHECK(std::abs(out[1] - 107) <= 1);
  CHECK(std::abs(out[2] - 70) <= 1);
}

TEST_CASE("every truncation of a picture is an error", "[image]") {
  for (const Bytes& file : {make_rgba_png(3, 3, ramp(36, 5)), make_flat_jpeg({10, 100, 200})}) {
    for (std::size_t size = 0; size < file.size(); ++size) {
      INFO(size << " of " << file.size());
      const auto image = decode_image(std::span(file).first(size), "");
      CHECK(!image.has_value());
    }
    Bytes longer = file;
    longer.push_back(0);
    CHECK(decode_image(longer, "").has_value());
  }
}

TEST_CASE("flipped bytes never crash the decoder", "[image]") {
  for (const Bytes& file : {make_rgba_png(4, 4, ramp(64, 5)), make_flat_jpeg({10, 100, 200})}) {
    for (std::size_t i = 0; i < file.size(); ++i) {
      for (const int flip : {0x01, 0x80, 0xff}) {
        Bytes damaged = file;
        damaged[i] = static_cast<std::uint8_t>(damaged[i] ^ flip);
        const auto image = decode_image(damaged, "");
        if (image) {
          CHECK(image->rgba.size() == static_cast<std::size_t>(image->width) *
                                          static_cast<std::size_t>(image->height) * 4);
        }
      }
    }
  }
}

TEST_CASE("a damaged checksum in a PNG is an error", "[image]") {
  Bytes file = make_rgba_png(4, 4, ramp(64, 5));
  file[8 + 25 + 8 + 20] ^= 0x10;  // inside IDAT
  CHECK(failure(file) == ErrorCode::kCorrupt);
}

TEST_CASE("sizes beyond the limits are refused by name", "[image]") {
  const auto side = static_cast<int>(relit::limits::kImageSide);
  CHECK(failure(make_png({side + 1, 1, 8, 6, {}, {}, {}})) == ErrorCode::kLimit);
  CHECK(failure(make_png({side, side, 8, 6, Bytes(static_cast<std::size_t>(side)), {}, {}})) ==
        ErrorCode::kLimit);
  Bytes jpeg = make_flat_jpeg({1});
  jpeg[2 + 69 + 5] = jpeg[2 + 69 + 7] = 0xff;
  CHECK(failure(jpeg) == ErrorCode::kLimit);
}

TEST_CASE("other types are named and refused", "[image]") {
  const std::string webp = "RIFF....WEBPVP8 ";
  const Bytes bytes(webp.begin(), webp.end());
  CHECK(image_media_type(bytes) == "image/webp");
  CHECK(failure(bytes) == ErrorCode::kUnsupported);
  CHECK(decode_image(bytes, "image/png").error().message.find("webp") != std::string::npos);
  CHECK(failure({}) == ErrorCode::kUnsupported);
  CHECK(decode_image(Bytes{1, 2, 3}, "image/ktx2").error().message.find("ktx2") !=
        std::string::npos);
  CHECK(failure(make_flat_jpeg({1, 2, 3, 4})) == ErrorCode::kUnsupported);
  CHECK(image_media_type(make_flat_jpeg({1})) == "image/jpeg");
  CHECK(image_media_type(make_rgba_png(1, 1, {1, 2, 3, 4})) == "image/png");
}

TEST_CASE("texts and profiles beside a PNG's picture are not unpacked", "[image]") {
  const Bytes rgba = ramp(64, 5);
  const Bytes plain = make_rgba_png(4, 4, rgba);
  constexpr std::size_t kBehindHeader = 8 + 25;
  for (const char* type : {"zTXt", "iTXt", "iCCP"}) {
    // A name, a method, and what no decompressor takes.
    Bytes chunk;
    relit::test::append_png_chunk(chunk, type, {'n', 0, 0, 0xff, 0xff, 0xff, 0xff});
    Bytes file = plain;
    file.insert(file.begin() + kBehindHeader, chunk.begin(), chunk.end());
    CHECK(decoded_rgba(file, 4, 4) == rgba);
  }
}

TEST_CASE("a JPEG of more scans than any encoder writes is refused", "[image]") {
  const auto with_scans = [](std::size_t scans) {
    const Bytes one = make_flat_jpeg({90});
    // Its header and its data.
    constexpr std::array<std::uint8_t, 2> kScan{0xff, 0xda};
    // Clang 14 cannot compile the library's ranges::search.
    const auto scan = std::search(one.begin(), one.end(), kScan.begin(), kScan.end());
    Bytes file(one.begin(), scan);
    for (std::size_t i = 0; i < scans; ++i) file.insert(file.end(), scan, one.end() - 2);
    file.insert(file.end(), {0xff, 0xd9});
    return file;
  };
  CHECK(decoded_rgba(with_scans(2), 8, 8).size() == 256);
  CHECK(failure(with_scans(relit::limits::kImageScans + 1)) == ErrorCode::kLimit);
}
