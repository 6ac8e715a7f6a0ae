// SPDX-License-Identifier: MIT
#include "player/light.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <string>

#include "tests/player/light_pictures.hpp"
#include "tests/test.hpp"

namespace relit::player {
namespace {

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
  CHECK(load("{\"sh\": [[1,1,1]]" + std::string(5 << 20, ' ') + "}").error().code ==
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

TEST_CASE("the assets' lights are the standard lights", "[long]") {
  const auto found = relit::test::shared_asset("../tools/standard_lights.json");
  if (!found) return;
  const auto standard = nlohmann::json::parse(read_bytes(found->string()));
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
    const auto file = relit::test::shared_asset(stem + suffix);
    REQUIRE(file);
    const auto loaded = load_light(file->string(), options);
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

}  // namespace relit::player
