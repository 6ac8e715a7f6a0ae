// SPDX-License-Identifier: MIT
#include "player/light_field.hpp"

#include <cmath>
#include <random>
#include <string>

#include "decoders/npy.hpp"
#include "player/light_file.hpp"
#include "tests/player/files.hpp"
#include "tests/player/light_pictures.hpp"
#include "tests/test.hpp"

namespace relit::player {
namespace {

Light flat(double value) { return {{{value, 2 * value, -value}}}; }

Light random_light(std::mt19937& random, std::size_t rows) {
  std::uniform_real_distribution<double> any(-3, 3);
  Light light;
  light.sh.resize(rows);
  for (auto& row : light.sh)
    for (double& value : row) value = any(random);
  return light;
}

LightField make(LightFieldParts parts) {
  auto field = LightField::create(std::move(parts));
  INFO((field ? "made" : field.error().message));
  REQUIRE(field);
  return std::move(*field);
}

/// Keys at 1, 2 and 4 s with the values 10, 20 and 0.
LightFieldParts keyed() {
  LightFieldParts parts;
  parts.times_s = {1, 2, 4};
  parts.lights = {flat(10), flat(20), flat(0)};
  return parts;
}

double value_at(const LightField& field, double time_s, glm::vec3 place = {}) {
  const Light light = field.at(time_s, place);
  CHECK(light.sh[0][1] == 2 * light.sh[0][0]);
  CHECK(light.sh[0][2] == -light.sh[0][0]);
  return light.sh[0][0];
}

Result<LightField> read(const std::string& text) {
  return read_light_field({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

bool refuses(const Result<LightField>& field, const std::string& text,
             ErrorCode code = ErrorCode::kInvalid) {
  INFO((field ? "accepted" : field.error().message));
  CHECK_FALSE(field);
  if (field) return false;
  CHECK(field.error().code == code);
  return field.error().message.find(text) != std::string::npos;
}

constexpr const char* kGrid = R"("origin": [0,0,0], "spacing": [1,1,1], "size": [2,1,1])";

}  // namespace

TEST_CASE("keys blend evenly from one to the next, and hold outside") {
  const LightField field = make(keyed());
  CHECK(field.varies_in_time());
  CHECK_FALSE(field.varies_in_space());
  CHECK(value_at(field, -5) == 10);
  CHECK(value_at(field, 1) == 10);
  CHECK(value_at(field, 1.25) == 12.5);
  CHECK(value_at(field, 2) == 20);
  CHECK(value_at(field, 3) == 10);
  CHECK(value_at(field, 4) == 0);
  CHECK(value_at(field, 1e300) == 0);
  CHECK(value_at(field, HUGE_VAL) == 0);
  CHECK(value_at(field, -HUGE_VAL) == 10);
  CHECK(value_at(field, std::nan("")) == 10);
}

TEST_CASE("steps hold each key until the next") {
  LightFieldParts parts = keyed();
  parts.step = true;
  const LightField field = make(parts);
  CHECK(value_at(field, 0) == 10);
  CHECK(value_at(field, 1.999) == 10);
  CHECK(value_at(field, 2) == 20);
  CHECK(value_at(field, 3.999) == 20);
  CHECK(value_at(field, 4) == 0);
}

TEST_CASE("a loop comes round after its period, in both directions") {
  LightFieldParts parts = keyed();
  parts.loop = true;
  LightField field = make(parts);  // 3 s, from the last key to the first at once
  CHECK(value_at(field, 1.25 + 3) == 12.5);
  CHECK(value_at(field, 1.25 - 300) == 12.5);
  CHECK(value_at(field, 4) == 10);
  CHECK(value_at(field, 3.5) == 5);
  parts.period_s = 5;  // two seconds to blend back
  field = make(parts);
  CHECK(value_at(field, 4) == 0);
  CHECK(value_at(field, 5) == 5);
  CHECK(value_at(field, 6) == 10);
  CHECK(value_at(field, 0.5) == 7.5);
  CHECK(std::isfinite(value_at(field, 1e300)));
  CHECK(std::isfinite(value_at(field, HUGE_VAL)));
  parts.step = true;
  CHECK(value_at(make(parts), 5.9) == 0);
  LightFieldParts one;
  one.times_s = {7}, one.lights = {flat(3)}, one.loop = true;
  CHECK(value_at(make(one), 100) == 3);
}

TEST_CASE("probes blend trilinearly, and the border holds outside") {
  LightFieldParts parts;
  parts.grid = {{-1, 0, 10}, {2, 0.5, 1}, {3, 2, 2}};
  // What is linear in x, y and z is met everywhere between the probes.
  const auto linear = [](double x, double y, double z) { return 1 + 2 * x - 3 * y + 0.5 * z; };
  for (int z = 0; z < 2; ++z)
    for (int y = 0; y < 2; ++y)
      for (int x = 0; x < 3; ++x) parts.lights.push_back(flat(linear(-1 + 2 * x, 0.5 * y, 10 + z)));
  const LightField field = make(parts);
  CHECK(field.varies_in_space());
  std::mt19937 random(4);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int i = 0; i < 200; ++i) {
    const glm::vec3 place(-1 + 4 * unit(random), 0.5f * unit(random), 10 + unit(random));
    const double expected = linear(static_cast<double>(place.x), static_cast<double>(place.y),
                                   static_cast<double>(place.z));
    // Some tens of roundings of numbers below 16: 16 · 32 · 2^-53.
    CHECK(std::abs(field.at(0, place).sh[0][0] - expected) < 6e-14);
  }
  CHECK(value_at(field, 0, {-50, -50, -50}) == linear(-1, 0, 10));
  CHECK(value_at(field, 0, {50, 50, 50}) == linear(3, 0.5, 11));
  CHECK(value_at(field, 0, {50, -50, HUGE_VALF}) == linear(3, 0, 11));
  CHECK(value_at(field, 0, {NAN, 0, 10}) == linear(0, 0, 10));
}

TEST_CASE("keys of probes blend in both, coefficient by coefficient") {
  std::mt19937 random(11);
  LightFieldParts parts;
  parts.grid.size = {2, 1, 1};
  parts.times_s = {0, 1};
  for (int i = 0; i < 4; ++i) parts.lights.push_back(random_light(random, 9));
  const LightField field = make(parts);
  CHECK(field.order() == 2);
  const Light light = field.at(0.25, {0.75f, 0, 0});
  const Light mean = field.mean();
  for (std::size_t n = 0; n < 9; ++n) {
    for (std::size_t c = 0; c < 3; ++c) {
      const auto of = [&](std::size_t i) { return parts.lights[i].sh[n][c]; };
      CHECK(light.sh[n][c] ==
            Approx(0.75 * (0.25 * of(0) + 0.75 * of(1)) + 0.25 * (0.25 * of(2) + 0.75 * of(3)))
                .margin(1e-14));
      CHECK(mean.sh[n][c] == Approx((of(0) + of(1) + of(2) + of(3)) / 4).margin(1e-14));
    }
  }
}

TEST_CASE("sampling into a light again takes no new memory") {
  std::mt19937 random(12);
  LightFieldParts parts;
  parts.times_s = {0, 1};
  for (int i = 0; i < 2; ++i) parts.lights.push_back(random_light(random, 16));
  const LightField field = make(parts);
  Light light;
  field.sample(0, {}, light);
  const auto* memory = light.sh.data();
  for (int i = 0; i < 100; ++i) field.sample(i * 0.01, {}, light);
  CHECK(light.sh.data() == memory);
}

TEST_CASE("a field that makes no sense is refused by part") {
  const auto with = [](auto change) {
    LightFieldParts parts = keyed();
    change(parts);
    return LightField::create(std::move(parts));
  };
  CHECK(refuses(with([](auto& p) { p.times_s = {1, 1, 4}; }), "keys[1].time_s"));
  CHECK(refuses(with([](auto& p) { p.times_s = {1, 4, 2}; }), "keys[2].time_s"));
  CHECK(refuses(with([](auto& p) { p.times_s[1] = NAN; }), "keys[1].time_s is not finite"));
  CHECK(refuses(with([](auto& p) { p.times_s = {-1e308, 0, 1e308}; }), "too far apart"));
  CHECK(refuses(with([](auto& p) { p.times_s.pop_back(); }), "3 lights"));
  CHECK(refuses(with([](auto& p) { p.lights.clear(); }), "0 lights"));
  CHECK(refuses(with([](auto& p) { p.lights[2].sh.resize(4); }), "key 2, probe 0 has 4 rows"));
  CHECK(refuses(with([](auto& p) { p.lights[0].sh.clear(); }), "key 0, probe 0 has 0 rows"));
  CHECK(refuses(with([](auto& p) { p.lights[1].sh[0][2] = HUGE_VAL; }), "key 1, probe 0"));
  CHECK(refuses(with([](auto& p) { p.period_s = 2.9; }), "period_s"));
  CHECK(refuses(with([](auto& p) { p.period_s = NAN; }), "period_s"));
  CHECK(refuses(with([](auto& p) { p.grid.spacing[1] = 0; }), "probes.spacing[1]"));
  CHECK(refuses(with([](auto& p) { p.grid.spacing[2] = NAN; }), "probes.spacing[2]"));
  CHECK(refuses(with([](auto& p) { p.grid.origin[0] = NAN; }), "probes.origin[0]"));
  CHECK(refuses(with([](auto& p) { p.grid.size[0] = 0; }), "probes.size[0]"));
  CHECK(refuses(with([](auto& p) {
                  p.grid.size = {1 << 30, 1 << 30, 1 << 30};
                }),
                "probes.size", ErrorCode::kLimit));
  CHECK(refuses(with([](auto& p) {
                  p.grid.size = {16, 16, 16}, p.times_s = {1, 2, 3, 4, 5};
                }),
                "16384", ErrorCode::kLimit));
}

TEST_CASE("the forms of a light file are read") {
  auto field = read(R"({"sh": [[1,2,3]]})");
  REQUIRE(field);
  CHECK_FALSE(field->varies_in_time());
  field = read(R"({"keys": [{"time_s": 0, "sh": [[1,1,1]]}, {"time_s": 2.5, "sh": [[3,3,3]]}],
                   "loop": true, "interpolation": "step", "period_s": 4, "about": [[[[[[[[1]]]]]]]]})");
  REQUIRE(field);
  CHECK(field->parts().times_s == std::vector<double>{0, 2.5});
  CHECK(field->parts().loop);
  CHECK(field->parts().step);
  CHECK(field->parts().period_s == 4);
  field = read(std::string(R"({"probes": {)") + kGrid + R"(, "sh": [[[1,1,1]], [[3,3,3]]]}})");
  REQUIRE(field);
  CHECK(field->at(0, {0.5f, 0, 0}).sh[0][0] == 2);
  field = read(std::string(R"({"probes": {)") + kGrid + R"(}, "keys": [
                   {"time_s": 0, "sh": [[[1,1,1]], [[3,3,3]]]},
                   {"time_s": 1, "sh": [[[5,5,5]], [[7,7,7]]]}]})");
  REQUIRE(field);
  CHECK(field->at(0.5, {0.5f, 0, 0}).sh[0][0] == 4);
}

TEST_CASE("a light file that is wrong is refused by place") {
  const std::string key = R"({"time_s": 0, "sh": [[1,1,1]]})";
  const auto keys = [&](const std::string& second) {
    return read("{\"keys\": [" + key + ", " + second + "]}");
  };
  CHECK(refuses(keys("7"), "keys[1] has no \"time_s\""));
  CHECK(refuses(keys(R"({"sh": [[1,1,1]]})"), "keys[1] has no \"time_s\""));
  CHECK(refuses(keys(R"({"time_s": "1", "sh": [[1,1,1]]})"), "keys[1].time_s is not a number"));
  CHECK(refuses(keys(R"({"time_s": 1})"), "keys[1] has no array \"sh\""));
  CHECK(refuses(keys(R"({"time_s": 1, "sh": [[1,1]]})"), "keys[1].sh[0] is not three"));
  CHECK(refuses(keys(R"({"time_s": 1, "sh": [[1,1,1e39]]})"), "keys[1].sh[0][2] is beyond"));
  CHECK(refuses(keys(R"({"time_s": 1, "sh": [[1,1,1],[1,1,1]]})"), "keys[1].sh\" has 2 rows"));
  CHECK(refuses(keys(R"({"time_s": 1, "sh": [[1,1,1],[1,1,1],[1,1,1],[1,1,1]]})"),
                "has 4 rows, and the first light 1"));
  CHECK(refuses(keys(R"({"time_s": 0, "sh": [[1,1,1]]})"), "keys[1].time_s is 0"));
  CHECK(refuses(read(R"({"keys": []})"), "\"keys\" is not"));
  CHECK(refuses(read(R"({"keys": 3})"), "\"keys\" is not"));
  CHECK(refuses(read("{\"sh\": [[1,1,1]], \"keys\": [" + key + "]}"), "beside \"keys\""));
  CHECK(refuses(read("{\"loop\": 1, \"keys\": [" + key + "]}"), "\"loop\""));
  CHECK(refuses(read("{\"interpolation\": \"cubic\", \"keys\": [" + key + "]}"), "\"interpol"));
  CHECK(refuses(read("{\"period_s\": null, \"keys\": [" + key + "]}"), "period_s is not"));
  CHECK(refuses(read("{\"period_s\": -1, \"keys\": [" + key + "]}"), "period_s is -1"));

  const auto probes = [&](const std::string& grid, const std::string& sh) {
    return read("{\"probes\": {" + grid + ", \"sh\": " + sh + "}}");
  };
  CHECK(refuses(read(R"({"probes": 1})"), "\"probes\" is not an object"));
  CHECK(refuses(probes(kGrid, "[[[1,1,1]]]"), "probes.sh has 1 lights; the grid has 2"));
  CHECK(refuses(probes(kGrid, "[[[1,1,1]], [[1,1,\"1\"]]]"), "probes.sh[1][0][2] is not"));
  CHECK(refuses(probes(kGrid, "[[[1,1,1]], 4]"), "probes.sh[1] is not a light"));
  CHECK(refuses(probes(R"("origin": [0,0], "spacing": [1,1,1], "size": [2,1,1])", "[]"),
                "probes.origin is not three"));
  CHECK(refuses(probes(R"("origin": [0,0,0], "spacing": [1,0,1], "size": [1,1,1])", "[[[1,1,1]]]"),
                "probes.spacing[1]"));
  CHECK(refuses(probes(R"("origin": [0,0,0], "spacing": [1,1,1], "size": [0,1,1])", "[]"),
                "probes.size[0]"));
  CHECK(refuses(probes(R"("origin": [0,0,0], "spacing": [1,1,1], "size": [1.5,1,1])", "[]"),
                "probes.size[0]"));
  CHECK(refuses(probes(R"("origin": [0,0,0], "spacing": [1,1,1], "size": [1e9,1e9,1e9])", "[]"),
                "more than 4096 probes", ErrorCode::kLimit));
  CHECK(refuses(probes(R"("origin": [0,0,0], "spacing": [1,1,1], "size": [64,64,2])", "[]"),
                "more than 4096 probes", ErrorCode::kLimit));
  CHECK(refuses(read("{\"probes\": {" + std::string(kGrid) + "}, \"sh\": [[1,1,1]]}"),
                "beside \"probes\""));
  std::string many = key;
  for (int i = 1; i <= 4096; ++i) many += ",{}";
  CHECK(refuses(read("{\"keys\": [" + many + "]}"), "4097 keys", ErrorCode::kLimit));
  CHECK(refuses(read("{\"keys\": " + std::string(100000, '[')), "not JSON", ErrorCode::kCorrupt));
}

TEST_CASE("every truncation of a light field is refused") {
  const std::string text =
      std::string(R"({"probes": {)") + kGrid +
      R"(}, "loop": true, "keys": [{"time_s": 0, "sh": [[[1,2,3]],[[1,1,1]]]}]})";
  REQUIRE(read(text));
  for (std::size_t length = 0; length < text.size(); ++length)
    CHECK_FALSE(read(text.substr(0, length)));
}

TEST_CASE("a field is written as it is read") {
  std::mt19937 random(20);
  for (const bool grid : {false, true}) {
    for (const std::size_t keys : {0u, 1u, 3u}) {
      LightFieldParts parts;
      if (grid) parts.grid = {{0.1, -0.0, 1e-30}, {0.1, 3, 1e9}, {2, 3, 1}};
      for (std::size_t i = 0; i < keys; ++i)
        parts.times_s.push_back(-0.1 + static_cast<double>(i) / 3);
      parts.loop = keys == 3, parts.step = keys == 1, parts.period_s = keys == 3 ? 1.0 / 0.7 : 0;
      const std::size_t count = parts.grid.count() * std::max<std::size_t>(keys, 1);
      for (std::size_t i = 0; i < count; ++i) parts.lights.push_back(random_light(random, 4));
      const std::string text = light_field_json(make(parts));
      const auto again = read(text);
      INFO(text);
      REQUIRE(again);
      CHECK(light_field_json(*again) == text);
      CHECK(again->parts().times_s == parts.times_s);
      CHECK(again->parts().grid == parts.grid);
      CHECK(again->parts().loop == parts.loop);
      CHECK(again->parts().step == parts.step);
      CHECK(again->parts().period_s == parts.period_s);
      for (std::size_t i = 0; i < count; ++i)
        check_same(again->parts().lights[i], parts.lights[i], 0);
    }
  }
  CHECK(light_field_json(make({{}, {}, {flat(1)}, false, false, 0})) == *light_json(flat(1)));
}

TEST_CASE("load_light gives a field where the light varies, turned, windowed and cut") {
  const Folder folder;
  std::mt19937 random(30);
  LightFieldParts parts;
  parts.times_s = {-1, 1};
  parts.lights = {random_light(random, 16), random_light(random, 16)};
  const LightField field = make(parts);
  const std::string path = (folder.path / "field.json").string();
  REQUIRE(write_light_json(path, field));
  LightOptions options;
  options.order = 2, options.rotate_rad = 0.4, options.window = true;
  const auto loaded = load_light(path, options);
  REQUIRE(loaded);
  REQUIRE(loaded->field);
  for (const double time_s : {-1.0, 0.0, 0.7}) {
    Light expected = field.at(time_s, {});
    expected.sh.resize(9);
    decoders::rotate_light_y(expected, 0.4);
    decoders::window_light(expected);
    // Turning is linear: before or after blending differ by roundings of numbers below 8.
    check_same(loaded->field->at(time_s, {}), expected, 1e-14);
  }
  check_same(loaded->light, loaded->field->mean(), 0);
  const auto single = load_light(folder.write("one.json", *light_json(parts.lights[0])));
  REQUIRE(single);
  CHECK_FALSE(single->field);
}

namespace {

/// The light map of frame 25 of the shipped clip, 0.5 s from its beginning.
std::vector<float> light_map(const Folder& folder, const std::string& light,
                             const std::string& more = "") {
  const std::string out = (folder.path / "map.npy").string();
  std::string says;
  const int status =
      test::run_relit("render " + test::shipped_clip().string() + " --light " + light +
                          " --frame 25 --lightmap --backend cpu -o " + out + more,
                      &says);
  INFO(says);
  REQUIRE(status == 0);
  const auto array = decoders::read_npy(out);
  REQUIRE(array);
  return array->values;
}

}  // namespace

TEST_CASE(
    "relit light makes keys of several lights, and relit render follows clip time and place") {
  const Folder folder;
  std::mt19937 random(40);
  const Light a = random_light(random, 9), b = random_light(random, 9);
  const std::string first = folder.write("a.json", *light_json(a));
  const std::string second = folder.write("b.json", *light_json(b));
  const std::string keys = (folder.path / "keys.json").string();
  REQUIRE(test::run_relit("light " + first + " " + second + " --times -0.5,1.5 --loop -o " +
                          keys) == 0);
  LightFieldParts parts;
  parts.times_s = {-0.5, 1.5};
  parts.loop = true;
  parts.lights = {a, b};
  const std::string half = folder.write("half.json", *light_json(make(parts).at(0.5, {})));
  CHECK(light_map(folder, keys) == light_map(folder, half));
  CHECK(light_map(folder, keys) != light_map(folder, first));

  parts = {};
  parts.grid = {{10, 0, 0}, {4, 1, 1}, {2, 1, 1}};
  parts.lights = {a, b};
  const std::string probes = folder.write("probes.json", light_field_json(make(parts)));
  const std::string three = folder.write("three.json", *light_json(make(parts).at(0, {13, 0, 0})));
  CHECK(light_map(folder, probes) == light_map(folder, first));  // at the origin: on the border
  CHECK(light_map(folder, probes, " --at 13,-5,2") == light_map(folder, three));

  CHECK(test::run_relit("light " + first + " " + second + " -o " + keys) == 2);
  CHECK(test::run_relit("light " + first + " " + second + " --times 1,0 -o " + keys) == 2);
  CHECK(test::run_relit("light " + keys + " " + second + " --times 0,1 -o " + keys) == 1);
}

}  // namespace relit::player
