// SPDX-License-Identifier: MIT
#include "player/light.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <string>

#include "tests/test.hpp"

namespace relit::player {
namespace {

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

std::string read_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The folder of the shared assets, or nothing.
std::optional<fs::path> assets() {
  if (const char* named = std::getenv("RELIT_ASSETS")) return fs::path(named);
  if (const char* source = std::getenv("RELIT_SOURCE_DIR")) {
    const fs::path beside = fs::path(source).parent_path() / "shared" / "assets";
    if (fs::exists(beside)) return beside;
  }
  WARN("skipped: no assets; set RELIT_ASSETS to their folder");
  return std::nullopt;
}

/// Pixels as RGBE holds them: (byte + ½) · 2^(e − 136), one of the three bytes ≥ 128.
std::vector<std::array<std::uint8_t, 4>> rgbe_pixels(int count) {
  std::mt19937 random(1);
  std::vector<std::array<std::uint8_t, 4>> pixels(static_cast<std::size_t>(count));
  for (auto& pixel : pixels) {
    pixel = {static_cast<std::uint8_t>(128 + random() % 128),
             static_cast<std::uint8_t>(random() % 256), static_cast<std::uint8_t>(random() % 256),
             static_cast<std::uint8_t>(125 + random() % 9)};
  }
  return pixels;
}

Environment decoded(const std::vector<std::array<std::uint8_t, 4>>& pixels, int width) {
  Environment environment{width, static_cast<int>(pixels.size()) / width, {}};
  for (const auto& pixel : pixels) {
    for (std::size_t c = 0; c < 3; ++c) {
      environment.rgb.push_back(std::ldexp(static_cast<float>(pixel[c]) + 0.5f, pixel[3] - 136));
    }
  }
  return environment;
}

std::string hdr_header(int width, int height) {
  return "#?RADIANCE\n# a comment\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=1\n\n-Y " +
         std::to_string(height) + " +X " + std::to_string(width) + "\n";
}

std::string flat_hdr(const std::vector<std::array<std::uint8_t, 4>>& pixels, int width) {
  std::string bytes = hdr_header(width, static_cast<int>(pixels.size()) / width);
  for (const auto& pixel : pixels) bytes.append(reinterpret_cast<const char*>(pixel.data()), 4);
  return bytes;
}

/// Run-length coded: each channel of a row as one dump and one run of the last value.
std::string coded_hdr(std::vector<std::array<std::uint8_t, 4>>& pixels, int width) {
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

float exr_value(char channel, int x, int y) {
  // Beyond 1 and uneven, so that a transfer curve or a clamp would show.
  const float base = channel == 'R'   ? 0.3f
                     : channel == 'G' ? 5.7f
                     : channel == 'B' ? 1000.25f
                                      : 0.5f;
  return base + 0.37f * static_cast<float>(x) + 3.1f * static_cast<float>(y);
}

std::string message(const Result<LoadedLight>& result) {
  return result ? "loaded" : result.error().message;
}

bool says(const Result<LoadedLight>& result, const std::string& text) {
  INFO(message(result));
  CHECK_FALSE(result);
  return !result && result.error().message.find(text) != std::string::npos;
}

void check_same(const Light& a, const Light& b, double tolerance) {
  REQUIRE(a.sh.size() == b.sh.size());
  for (std::size_t n = 0; n < a.sh.size(); ++n) {
    for (std::size_t c = 0; c < 3; ++c) {
      CAPTURE(n, c);
      CHECK(std::abs(a.sh[n][c] - b.sh[n][c]) <= tolerance);
    }
  }
}

bool finite(const Light& light) {
  return std::all_of(light.sh.begin(), light.sh.end(), [](const auto& row) {
    return std::all_of(row.begin(), row.end(), [](double v) { return std::isfinite(v); });
  });
}

Light sample_centres(const Environment& environment) {
  constexpr double kPi = std::numbers::pi;
  Light light;
  light.sh.assign(16, {});
  std::array<double, 16> y_n{};
  for (int y = 0; y < environment.height; ++y) {
    const double theta = kPi * (y + 0.5) / environment.height;
    const double area = std::sin(theta) * kPi / environment.height * 2 * kPi / environment.width;
    for (int x = 0; x < environment.width; ++x) {
      const double phi = 2 * kPi * (x + 0.5) / environment.width;
      decoders::evaluate_sh(3,
                            glm::dvec3(std::sin(theta) * std::cos(phi), std::cos(theta),
                                       std::sin(theta) * std::sin(phi)),
                            y_n);
      const float* pixel =
          environment.rgb.data() + std::ptrdiff_t{3} * (std::ptrdiff_t{y} * environment.width + x);
      for (std::size_t n = 0; n < 16; ++n) {
        for (std::size_t c = 0; c < 3; ++c)
          light.sh[n][c] += area * y_n[n] * static_cast<double>(pixel[c]);
      }
    }
  }
  return light;
}

/// Of the three channels, over the sphere.
double mean_radiance(const Light& light) {
  const auto& first = light.sh[0];
  return (first[0] + first[1] + first[2]) / 3 / std::sqrt(4 * std::numbers::pi);
}

}  // namespace

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

TEST_CASE("order, turn and window are applied, the turn is told to who draws the picture") {
  const Folder folder;
  auto pixels = rgbe_pixels(16 * 8);
  const std::string path = folder.write("a.hdr", flat_hdr(pixels, 16));
  LightOptions options;
  options.order = 2;
  options.rotate_rad = 0.7;
  options.window = true;
  const auto loaded = load_light(path, options);
  REQUIRE(loaded);
  Light expected = *decoders::project_environment(decoded(pixels, 16), 2);
  decoders::rotate_light_y(expected, 0.7);
  decoders::window_light(expected);
  check_same(loaded->light, expected, 0);
  CHECK(loaded->environment_rotation_rad == 0.7);
  CHECK(loaded->environment->rgb == decoded(pixels, 16).rgb);

  const auto json = load_light(folder.write("a.json", *light_json(expected)), options);
  REQUIRE(json);
  CHECK(json->environment_rotation_rad == 0);
  options.order = 1;
  CHECK(load_light(folder.write("b.json", *light_json(expected)), options)->light.order() == 1);
}

TEST_CASE("options that make no sense are refused") {
  const Folder folder;
  const std::string path = folder.write("a.json", R"({"sh": [[1,1,1]]})");
  REQUIRE(load_light(path));
  for (const LightOptions& options :
       {LightOptions{4, 0, false}, LightOptions{-1, 0, false}, LightOptions{3, NAN, false}}) {
    const auto loaded = load_light(path, options);
    REQUIRE_FALSE(loaded);
    CHECK(loaded.error().code == ErrorCode::kInvalid);
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

TEST_CASE("a damaged Radiance picture gives an error or another picture, never more") {
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

TEST_CASE("a damaged OpenEXR picture gives an error or another picture, never more") {
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

TEST_CASE("a JSON light of every order is read") {
  const Folder folder;
  for (int order = 0; order <= 3; ++order) {
    std::string text = " \n{\"about\": 1, \"sh\": [";
    for (int n = 0; n < decoders::coefficient_count(order); ++n) {
      text += (n > 0 ? ", [" : "[") + std::to_string(n) + ", -0.5, 1e-3]";
    }
    const auto loaded = load_light(folder.write("light.json", text + "]}"));
    INFO(message(loaded));
    REQUIRE(loaded);
    CHECK(loaded->light.order() == order);
    CHECK_FALSE(loaded->environment);
    CHECK(loaded->light.sh.back() ==
          std::array<double, 3>{static_cast<double>(loaded->light.sh.size() - 1), -0.5, 1e-3});
    CHECK(loaded->minimum_radiance[1] < 0);
  }
}

TEST_CASE("JSON that is no light is refused by place") {
  const Folder folder;
  const auto load = [&](const std::string& text) {
    return load_light(folder.write("a.json", text));
  };
  CHECK(says(load("{}"), "no array \"sh\""));
  CHECK(says(load("[[1,2,3]]"), "no array \"sh\""));
  CHECK(says(load(R"({"sh": 3})"), "no array \"sh\""));
  CHECK(says(load(R"({"sh": []})"), "0 rows"));
  CHECK(says(load(R"({"sh": [[1,1,1],[1,1,1]]})"), "2 rows"));
  CHECK(says(load(R"({"sh": [[1,1]]})"), "sh[0] is not three numbers"));
  CHECK(says(load(R"({"sh": [[1,1,1],[1,1,1],7,[1,1,1]]})"), "sh[2] is not three numbers"));
  CHECK(says(load(R"({"sh": [[1,"1",1]]})"), "sh[0][1] is not a number"));
  CHECK(says(load(R"({"sh": [[1,null,1]]})"), "sh[0][1] is not a number"));
  CHECK(says(load(R"({"sh": [[1,1,1e39]]})"), "sh[0][2] is beyond"));
  CHECK(says(load(R"({"sh": [[1,1,1e999]]})"), "not JSON"));
  CHECK(says(load(R"({"sh": [[1,1,NaN]]})"), "line 1, column"));
  CHECK(says(load(R"({"sh": [[1,1,1]]} x)"), "not JSON"));
  CHECK_FALSE(load("{\"sh\": \"\xff\"}"));
  CHECK_FALSE(load("{\"sh\":" + std::string(100000, '[')));
  std::string rows = "[1,1,1]";
  for (int n = 1; n < 25; ++n) rows += ",[1,1,1]";
  CHECK(says(load("{\"sh\": [" + rows + "]}"), "25 rows"));
  CHECK(load("{\"sh\": [[1,1,1]]" + std::string(2 << 20, ' ') + "}").error().code ==
        ErrorCode::kLimit);
}

TEST_CASE("every truncation of a JSON light is refused") {
  const Folder folder;
  const std::string text = R"({"sh": [[1,2,3],[4.5,-6e1,7],[8,9,10],[11,12,13]]})";
  REQUIRE(load_light(folder.write("a.json", text)));
  for (std::size_t length = 0; length < text.size(); ++length) {
    const auto loaded = load_light(folder.write("a.json", text.substr(0, length)));
    REQUIRE_FALSE(loaded);
    CHECK(loaded.error().message.find("a.json: ") != std::string::npos);
  }
}

TEST_CASE("a written light is read back to the bit, and writing is deterministic") {
  const Folder folder;
  std::mt19937_64 random(4);
  Light light;
  for (std::size_t n = 0; n < 16; ++n) {
    std::array<double, 3> row{};
    for (double& value : row) {
      do {
        value = std::bit_cast<double>(random());
      } while (!(std::abs(value) < 3e38));
    }
    light.sh.push_back(row);
  }
  light.sh[0] = {0.0, -0.0, 5e-324};
  light.sh[1] = {1.0, 0.1, 1e22};
  const std::string path = (folder.path / "light.json").string();
  REQUIRE(write_light_json(path, light));
  const auto loaded = load_light(path);
  INFO(message(loaded));
  REQUIRE(loaded);
  for (std::size_t n = 0; n < 16; ++n) {
    for (std::size_t c = 0; c < 3; ++c) {
      CHECK(std::bit_cast<std::uint64_t>(loaded->light.sh[n][c]) ==
            std::bit_cast<std::uint64_t>(light.sh[n][c]));
    }
  }
  CHECK(*light_json(light) == read_bytes(path));
  Light small;
  small.sh = {{1, -0.0, 0.25}};
  CHECK(*light_json(small) == "{\"sh\": [\n  [1.0, -0.0, 0.25]\n]}\n");
  small.sh = {{1, NAN, 1}};
  CHECK(light_json(small).error().code == ErrorCode::kInvalid);
  small.sh.resize(2);
  CHECK_FALSE(light_json(small));
  small.sh = {{1, 1, 1}};
  CHECK(write_light_json((folder.path / "none" / "x.json").string(), small).error().code ==
        ErrorCode::kIo);
}

TEST_CASE("what is no light at all is refused with the path") {
  const Folder folder;
  CHECK(load_light((folder.path / "none.hdr").string()).error().code == ErrorCode::kIo);
  CHECK(load_light(folder.path.string()).error().code == ErrorCode::kIo);
  CHECK(load_light(folder.write("empty.hdr", "")).error().code == ErrorCode::kTruncated);
  const auto unknown = load_light(folder.write("photo.png", "\x89PNG\r\n"));
  CHECK(says(unknown, "photo.png: neither"));
  CHECK(unknown.error().code == ErrorCode::kUnsupported);
  CHECK(says(load_light(folder.write("a.HDR", "nothing")), "Radiance"));
  CHECK(says(load_light(folder.write("a.exr", "nothing")), "not an OpenEXR"));
}

TEST_CASE("the content decides over the suffix") {
  const Folder folder;
  auto pixels = rgbe_pixels(8);
  CHECK(load_light(folder.write("a.json", flat_hdr(pixels, 4)))->environment);
  CHECK(load_light(folder.write("a.hdr", R"({"sh": [[1,1,1]]})"))->light.order() == 0);
}

TEST_CASE("the assets' lights are the standard lights") {
  const auto folder = assets();
  if (!folder) return;
  const fs::path lights = folder->parent_path() / "tools" / "standard_lights.json";
  if (!fs::exists(lights)) {
    WARN("skipped: no " << lights.string());
    return;
  }
  const auto standard = nlohmann::json::parse(read_bytes(lights.string()));
  int compared = 0;
  for (const auto& entry : standard["lights"]) {
    const auto name = entry["name"].get<std::string>();
    const std::size_t space = name.find(" rotated ");
    if (space == std::string::npos) continue;
    const std::string stem = name.substr(0, space);
    const std::string suffix = stem == "courtyard_512" ? ".exr" : ".hdr";
    LightOptions options;
    options.rotate_rad = std::stod(name.substr(space + 9)) * std::numbers::pi / 180;
    options.window = true;
    const auto loaded = load_light((*folder / (stem + suffix)).string(), options);
    INFO(message(loaded));
    REQUIRE(loaded);
    // They were made by sampling pixel centres and rounded to 6 digits; so is this. The exact
    // integrals differ by the midpoint rule's error, at the sun's few pixels some 1e-4.
    Light sampled = sample_centres(*loaded->environment);
    decoders::rotate_light_y(sampled, options.rotate_rad);
    decoders::window_light(sampled);
    for (std::size_t n = 0; n < 16; ++n) {
      for (std::size_t c = 0; c < 3; ++c) {
        CAPTURE(name, n, c);
        const auto expected = entry["sh"][n][c].get<double>();
        CHECK(std::abs(sampled.sh[n][c] / mean_radiance(sampled) - expected) < 1e-6);
        CHECK(std::abs(loaded->light.sh[n][c] / mean_radiance(loaded->light) - expected) < 2e-4);
      }
    }
    ++compared;
  }
  CHECK(compared == 12);
}

TEST_CASE("an OpenEXR asset is refused at every length, compressed blocks included") {
  const auto folder = assets();
  if (!folder) return;
  const Folder scratch;
  const std::string bytes = read_bytes((*folder / "courtyard_512.exr").string());
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
