// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "player/light.hpp"
#include "tests/places.hpp"

/// Files of lights, made or found, for the tests of load_light().
namespace relit::player {

namespace fs = std::filesystem;
using decoders::Environment;
using decoders::Light;

/// A folder of its own that goes with the test.
struct Folder {
  fs::path path;
  Folder() {
    std::string name = (fs::temp_directory_path() / "relit-light-XXXXXX").string();
    REQUIRE(mkdtemp(name.data()) != nullptr);
    path = name;
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() { fs::remove_all(path); }

  [[nodiscard]] std::string write(const std::string& name, const std::string& bytes) const {
    std::ofstream(path / name, std::ios::binary) << bytes;
    return (path / name).string();
  }
};

inline std::string read_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Pixels as RGBE holds them: (byte + ½) · 2^(e − 136), one of the three bytes ≥ 128.
inline std::vector<std::array<std::uint8_t, 4>> rgbe_pixels(int count) {
  std::mt19937 random(1);
  std::vector<std::array<std::uint8_t, 4>> pixels(static_cast<std::size_t>(count));
  for (auto& pixel : pixels) {
    pixel = {static_cast<std::uint8_t>(128 + random() % 128),
             static_cast<std::uint8_t>(random() % 256), static_cast<std::uint8_t>(random() % 256),
             static_cast<std::uint8_t>(125 + random() % 9)};
  }
  return pixels;
}

inline Environment decoded(const std::vector<std::array<std::uint8_t, 4>>& pixels, int width) {
  Environment environment{width, static_cast<int>(pixels.size()) / width, {}};
  for (const auto& pixel : pixels) {
    for (std::size_t c = 0; c < 3; ++c) {
      environment.rgb.push_back(std::ldexp(static_cast<float>(pixel[c]) + 0.5f, pixel[3] - 136));
    }
  }
  return environment;
}

inline std::string hdr_header(int width, int height) {
  return "#?RADIANCE\n# a comment\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=1\n\n-Y " +
         std::to_string(height) + " +X " + std::to_string(width) + "\n";
}

inline std::string flat_hdr(const std::vector<std::array<std::uint8_t, 4>>& pixels, int width) {
  std::string bytes = hdr_header(width, static_cast<int>(pixels.size()) / width);
  for (const auto& pixel : pixels) bytes.append(reinterpret_cast<const char*>(pixel.data()), 4);
  return bytes;
}

/// Run-length coded: each channel of a row as one dump and one run of the last value.
inline std::string coded_hdr(std::vector<std::array<std::uint8_t, 4>>& pixels, int width) {
  const auto columns = static_cast<std::size_t>(width);
  std::string bytes = hdr_header(width, static_cast<int>(pixels.size()) / width);
  for (std::size_t row = 0; row < pixels.size(); row += columns) {
    bytes += {2, 2, static_cast<char>(width >> 8), static_cast<char>(width & 255)};
    for (std::size_t c = 0; c < 4; ++c) {
      bytes += static_cast<char>(columns - 3);
      for (std::size_t x = 0; x < columns - 3; ++x) bytes += static_cast<char>(pixels[row + x][c]);
      for (std::size_t x = columns - 2; x < columns; ++x)
        pixels[row + x][c] = pixels[row + columns - 3][c];
      bytes += static_cast<char>(128 + 3);
      bytes += static_cast<char>(pixels[row + columns - 3][c]);
    }
  }
  return bytes;
}

struct Window {
  std::int32_t min_x, min_y, max_x, max_y;
};

/// An uncompressed OpenEXR file of float channels. `value(channel, x, y)`.
struct ExrWriter {
  Window display{0, 0, 7, 3};
  Window data{0, 0, 7, 3};
  std::string channels = "BGR";  // sorted by name, as the format wants
  std::uint32_t type = 2;        // 0 uint, 1 half, 2 float
  char compression = 0;

  std::string bytes;
  void u32(std::uint32_t v) { bytes.append(reinterpret_cast<const char*>(&v), 4); }
  void u64(std::uint64_t v) { bytes.append(reinterpret_cast<const char*>(&v), 8); }
  void attribute(const char* name, const char* kind, std::size_t size) {
    bytes += std::string(name) + '\0' + kind + '\0';
    u32(static_cast<std::uint32_t>(size));
  }
  void box(const char* name, const Window& w) {
    attribute(name, "box2i", 16);
    for (std::int32_t v : {w.min_x, w.min_y, w.max_x, w.max_y})
      u32(std::bit_cast<std::uint32_t>(v));
  }
  void header() {
    u32(20000630);
    u32(2);
    attribute("channels", "chlist", channels.size() * 18 + 1);
    for (char name : channels) {
      bytes += std::string(1, name) + '\0';
      for (std::uint32_t v : {type, 0u, 1u, 1u}) u32(v);
    }
    bytes += '\0';
    attribute("compression", "compression", 1);
    bytes += compression;
    box("dataWindow", data);
    box("displayWindow", display);
    attribute("lineOrder", "lineOrder", 1);
    bytes += '\0';
    attribute("pixelAspectRatio", "float", 4);
    u32(std::bit_cast<std::uint32_t>(1.0f));
    attribute("screenWindowCenter", "v2f", 8);
    u64(0);
    attribute("screenWindowWidth", "float", 4);
    u32(std::bit_cast<std::uint32_t>(1.0f));
    bytes += '\0';
  }
  template <class F>
  std::string write(F value) {
    bytes.clear();
    header();
    const auto rows = static_cast<std::uint64_t>(data.max_y - data.min_y + 1);
    const auto row_bytes =
        4 * channels.size() * static_cast<std::size_t>(data.max_x - data.min_x + 1);
    const std::uint64_t first = bytes.size() + 8 * rows;
    for (std::uint64_t i = 0; i < rows; ++i) u64(first + i * (8 + row_bytes));
    for (std::int32_t y = data.min_y; y <= data.max_y; ++y) {
      u32(std::bit_cast<std::uint32_t>(y));
      u32(static_cast<std::uint32_t>(row_bytes));
      for (char channel : channels) {
        for (std::int32_t x = data.min_x; x <= data.max_x; ++x) {
          u32(std::bit_cast<std::uint32_t>(static_cast<float>(value(channel, x, y))));
        }
      }
    }
    return bytes;
  }
};

inline float exr_value(char channel, int x, int y) {
  // Beyond 1 and uneven, so that a transfer curve or a clamp would show.
  const float base = channel == 'R'   ? 0.3f
                     : channel == 'G' ? 5.7f
                     : channel == 'B' ? 1000.25f
                                      : 0.5f;
  return base + 0.37f * static_cast<float>(x) + 3.1f * static_cast<float>(y);
}

inline std::string message(const Result<LoadedLight>& result) {
  return result ? "loaded" : result.error().message;
}

inline bool says(const Result<LoadedLight>& result, const std::string& text) {
  INFO(message(result));
  CHECK_FALSE(result);
  return !result && result.error().message.find(text) != std::string::npos;
}

inline void check_same(const Light& a, const Light& b, double tolerance) {
  REQUIRE(a.sh.size() == b.sh.size());
  for (std::size_t n = 0; n < a.sh.size(); ++n) {
    for (std::size_t c = 0; c < 3; ++c) {
      CAPTURE(n, c);
      CHECK(std::abs(a.sh[n][c] - b.sh[n][c]) <= tolerance);
    }
  }
}

inline bool finite(const Light& light) {
  return std::all_of(light.sh.begin(), light.sh.end(), [](const auto& row) {
    return std::all_of(row.begin(), row.end(), [](double v) { return std::isfinite(v); });
  });
}

}  // namespace relit::player
