// SPDX-License-Identifier: MIT
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>

#include "player/light.hpp"
#include "tests/player/light_pictures.hpp"
#include "tests/test.hpp"

namespace relit::player {

TEST_CASE("a Radiance picture is read exactly, flat and run-length coded") {
  const Folder folder;
  for (bool coded : {false, true}) {
    auto pixels = rgbe_pixels(16 * 8);
    const std::string bytes = coded ? coded_hdr(pixels, 16) : flat_hdr(pixels, 16);
    const auto loaded = load_light(folder.write("studio.small.hdr", bytes));
    INFO(message(loaded));
    REQUIRE(loaded);
    CHECK(loaded->name == "studio.small");
    CHECK(loaded->warnings.empty());
    REQUIRE(loaded->environment);
    const Environment expected = decoded(pixels, 16);
    CHECK(loaded->environment->width == 16);
    CHECK(loaded->environment->height == 8);
    CHECK(loaded->environment->rgb == expected.rgb);
    check_same(loaded->light, *decoders::project_environment(expected, 3), 0);
    CHECK(loaded->minimum_radiance == decoders::minimum_radiance(loaded->light));
  }
}

TEST_CASE("every truncation of a Radiance picture is refused") {
  const Folder folder;
  for (bool coded : {false, true}) {
    auto pixels = rgbe_pixels(12 * 6);
    const std::string bytes = coded ? coded_hdr(pixels, 12) : flat_hdr(pixels, 12);
    REQUIRE(load_light(folder.write("a.hdr", bytes)));
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      CAPTURE(coded, length);
      const auto loaded = load_light(folder.write("a.hdr", bytes.substr(0, length)));
      REQUIRE_FALSE(loaded);
      CHECK(loaded.error().message.find("a.hdr: ") != std::string::npos);
      CHECK((loaded.error().code == ErrorCode::kTruncated ||
             loaded.error().code == ErrorCode::kCorrupt));
    }
  }
}

TEST_CASE("a damaged Radiance picture gives an error or another picture, never more", "[long]") {
  const Folder folder;
  auto pixels = rgbe_pixels(12 * 6);
  const std::string bytes = coded_hdr(pixels, 12);
  const std::size_t header = hdr_header(12, 6).size();
  std::mt19937 random(2);
  for (int i = 0; i < 400; ++i) {
    std::string damaged = bytes;
    for (int k = 0; k < 3; ++k) {
      const std::size_t place = i % 4 == 0 ? random() % header : random() % bytes.size();
      damaged[place] = static_cast<char>(random() % 3 == 0 ? 0 : random());
    }
    const auto loaded = load_light(folder.write("a.hdr", damaged));
    if (loaded) CHECK(finite(loaded->light));
  }
  // All counts zero: the run-length decoder waits for a row that never fills.
  std::string zeros = bytes.substr(0, header + 4) + std::string(1000, '\0');
  CHECK(load_light(folder.write("a.hdr", zeros)).has_value() == false);
}

TEST_CASE("a Radiance picture that claims more than it holds is refused before it is allocated") {
  const Folder folder;
  const auto large = [&](int width, int height) {
    return load_light(folder.write("a.hdr", hdr_header(width, height) + std::string(100, 'x')));
  };
  CHECK(large(16384, 4096).error().code == ErrorCode::kTruncated);
  CHECK(large(16384, 16384).error().code == ErrorCode::kLimit);
  CHECK_FALSE(large(16385, 2));
  CHECK_FALSE(large(2000000000, 2000000000));
  CHECK_FALSE(large(-4, 2));
  CHECK_FALSE(large(0, 0));
}

TEST_CASE("an OpenEXR picture is read as it is, without a transfer curve") {
  const Folder folder;
  for (const char* channels : {"BGR", "ABGR", "Y"}) {
    CAPTURE(channels);
    ExrWriter writer;
    writer.channels = channels;
    const auto loaded = load_light(folder.write("a.exr", writer.write(exr_value)));
    INFO(message(loaded));
    REQUIRE(loaded);
    CHECK(loaded->warnings.empty());
    REQUIRE(loaded->environment->width == 8);
    REQUIRE(loaded->environment->height == 4);
    std::size_t i = 0;
    for (int y = 0; y < 4; ++y) {
      for (int x = 0; x < 8; ++x) {
        for (char channel : {'R', 'G', 'B'}) {
          CHECK(loaded->environment->rgb[i++] == exr_value(*channels == 'Y' ? 'Y' : channel, x, y));
        }
      }
    }
    check_same(loaded->light, *decoders::project_environment(*loaded->environment, 3), 0);
  }
}

TEST_CASE(
    "what an OpenEXR data window leaves out is black, with a warning; what it has besides is cut") {
  const Folder folder;
  ExrWriter writer;
  writer.data = {2, 1, 6, 2};
  auto loaded = load_light(folder.write("a.exr", writer.write(exr_value)));
  INFO(message(loaded));
  REQUIRE(loaded);
  REQUIRE(loaded->warnings.size() == 1);
  CHECK(loaded->warnings[0].find("a.exr: ") != std::string::npos);
  CHECK(loaded->warnings[0].find("(2, 1) to (6, 2)") != std::string::npos);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 8; ++x) {
      CAPTURE(x, y);
      const bool inside = x >= 2 && x <= 6 && y >= 1 && y <= 2;
      CHECK(loaded->environment->rgb[static_cast<std::size_t>(3 * (8 * y + x) + 1)] ==
            (inside ? exr_value('G', x, y) : 0));
    }
  }
  writer.data = {-1, -2, 9, 5};
  loaded = load_light(folder.write("a.exr", writer.write(exr_value)));
  INFO(message(loaded));
  REQUIRE(loaded);
  CHECK(loaded->warnings.empty());
  CHECK(loaded->environment->rgb[0] == exr_value('R', 0, 0));
  CHECK(loaded->environment->rgb[3 * 31 + 2] == exr_value('B', 7, 3));
}

TEST_CASE("OpenEXR pictures that the decoder would get wrong are refused with what to do") {
  const Folder folder;
  const auto load = [&](ExrWriter writer) {
    return load_light(folder.write("a.exr", writer.write(exr_value)));
  };
  ExrWriter writer;
  for (const char compression : {'\x08', '\x09'}) {
    writer.compression = compression;
    CHECK(says(load(writer), "DWAA"));
    CHECK(load(writer).error().code == ErrorCode::kUnsupported);
  }
  writer = {};
  writer.display = writer.data = {1, 0, 8, 3};
  CHECK(says(load(writer), "must begin at (0, 0)"));
  writer = {};
  writer.type = 0;
  CHECK(says(load(writer), "half or float"));
  writer = {};
  writer.channels = "Z";
  CHECK_FALSE(load(writer));
  writer = {};
  writer.display = {0, 0, 1 << 30, 1 << 30};
  CHECK(load(writer).error().code == ErrorCode::kLimit);
  writer.display = {0, 0, -5, 3};
  CHECK_FALSE(load(writer));
  writer.display = {std::numeric_limits<std::int32_t>::min(), 0,
                    std::numeric_limits<std::int32_t>::max(), 3};
  CHECK_FALSE(load(writer));
}

TEST_CASE("negative and not finite pixels are refused by place") {
  const Folder folder;
  for (float value : {-1e-6f, std::numeric_limits<float>::infinity(), std::nanf("")}) {
    ExrWriter writer;
    const auto loaded = load_light(folder.write("a.exr", writer.write([&](char c, int x, int y) {
      return c == 'B' && x == 5 && y == 2 ? value : 1.0f;
    })));
    CHECK(says(loaded, "pixel (5, 2) of the environment has blue"));
    CHECK(loaded.error().code == ErrorCode::kInvalid);
  }
}

TEST_CASE("every truncation of an OpenEXR picture is refused") {
  const Folder folder;
  ExrWriter writer;
  const std::string bytes = writer.write(exr_value);
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    CAPTURE(length);
    REQUIRE_FALSE(load_light(folder.write("a.exr", bytes.substr(0, length))));
  }
}

TEST_CASE("a damaged OpenEXR picture gives an error or another picture, never more", "[long]") {
  const Folder folder;
  ExrWriter writer;
  const std::string bytes = writer.write(exr_value);
  std::mt19937 random(3);
  for (int i = 0; i < 400; ++i) {
    std::string damaged = bytes;
    for (int k = 0; k < 2; ++k) damaged[random() % bytes.size()] = static_cast<char>(random());
    const auto loaded = load_light(folder.write("a.exr", damaged));
    if (loaded) CHECK(finite(loaded->light));
  }
}

TEST_CASE("a picture that is not 2:1 is stretched, with a warning") {
  const Folder folder;
  auto pixels = rgbe_pixels(9 * 6);
  const auto loaded = load_light(folder.write("a.hdr", flat_hdr(pixels, 9)));
  REQUIRE(loaded);
  REQUIRE(loaded->warnings.size() == 1);
  CHECK(loaded->warnings[0].find("9x6") != std::string::npos);
  auto one = rgbe_pixels(1);
  const auto constant = load_light(folder.write("b.hdr", flat_hdr(one, 1)));
  REQUIRE(constant);
  CHECK(constant->light.sh[0][0] == Approx(static_cast<double>(constant->environment->rgb[0]) *
                                           std::sqrt(4 * std::numbers::pi)));
}

TEST_CASE("an OpenEXR asset is refused at every length, compressed blocks included") {
  const auto asset = relit::test::shared_asset("courtyard_512.exr");
  if (!asset) return;
  const Folder scratch;
  const std::string bytes = read_bytes(asset->string());
  REQUIRE(load_light(scratch.write("a.exr", bytes)));
  for (std::size_t length :
       {bytes.size() - 1, bytes.size() - 100, bytes.size() / 2, bytes.size() / 10,
        std::size_t{6000}, std::size_t{3000}, std::size_t{700}}) {
    CAPTURE(length);
    CHECK_FALSE(load_light(scratch.write("a.exr", bytes.substr(0, length))));
  }
  std::string damaged = bytes;
  for (std::size_t i = 0; i < 64; ++i)
    damaged[bytes.size() / 2 + i] = static_cast<char>(~damaged[bytes.size() / 2 + i]);
  const auto loaded = load_light(scratch.write("a.exr", damaged));
  CHECK(says(loaded, "cannot be decoded"));
}

}  // namespace relit::player
