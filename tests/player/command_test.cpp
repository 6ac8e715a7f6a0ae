// SPDX-License-Identifier: MIT
// The commands as a user runs them: exit statuses, what they write, and that the backends agree.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "decoders/image.hpp"
#include "decoders/npy.hpp"
#include "player/clip_reader.hpp"
#include "player/light.hpp"
#include "tests/player/files.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;

namespace {

std::string clip_and_light() {
  return shipped_clip().string() + " --light " + shipped_light().string() + " ";
}

// Σ_n L_n T_n in double precision, from the decoded transfer.
std::vector<double> reference_light_map(std::uint64_t frame_index) {
  auto source = container::FileSource::open(shipped_clip().string());
  REQUIRE(source);
  auto clip = ClipReader::open(std::move(*source), "clip", {});
  REQUIRE(clip);
  ClipFrame frame;
  REQUIRE(clip->frame(frame_index, frame));
  const auto light = load_light(shipped_light().string());
  REQUIRE(light);
  const int width = clip->model().width, height = clip->model().height;
  std::vector<double> map(static_cast<std::size_t>(3 * width * height));
  std::size_t k = 0;
  for (std::size_t n = 0; n < clip->model().mean.size(); ++n) {
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t t = 0; t < map.size() / 3; ++t) {
        map[c * map.size() / 3 + t] +=
            light->light.sh[n][c] * static_cast<double>(clip->model().mean[n][c]);
      }
    }
  }
  for (const container::LayerRecord& layer : clip->layers()) {
    for (const container::PlaneRecord& plane : layer.planes) {
      const PlaneView& view = frame.planes.planes()[k++];
      for (const container::MatrixEntry& entry : plane.matrix) {
        const double weight =
            light->light.sh[entry.coefficient][entry.channel] * static_cast<double>(entry.value);
        for (int y = 0; y < height; ++y) {
          for (int x = 0; x < width; ++x) {
            map[(entry.channel * static_cast<std::size_t>(height) + static_cast<std::size_t>(y)) *
                    static_cast<std::size_t>(width) +
                static_cast<std::size_t>(x)] += weight * decoders::plane_value(view, x, y);
          }
        }
      }
    }
  }
  return map;
}

}  // namespace

TEST_CASE("every backend's light map agrees with double precision") {
  const Folder folder;
  const std::vector<double> reference = reference_light_map(7);
  const double peak =
      std::abs(*std::max_element(reference.begin(), reference.end(),
                                 [](double a, double b) { return std::abs(a) < std::abs(b); }));
  struct Case {
    const char* backend;
    // CPU: 27 products and sums in float, 27 · 2^-23 · Σ|w v| / peak < 1e-5. ES 3: RGBA16F
    // truncates to 10 bits, 2^-10, and the sum before it adds little. ES 2: the same target, with
    // planes rounded on the way. mediump: 27 products of 11 significant bits each.
    double bound;
  };
  for (const Case& c : {Case{"cpu", 1e-5}, Case{"egl", 1.5e-3}, Case{"egl-es2", 4e-3},
                        Case{"egl-es2-mediump", 2e-2}, Case{"osmesa", 1.5e-3}}) {
    INFO(c.backend);
    std::string says;
    const std::string out = folder.file("map.npy");
    REQUIRE(run_relit("render " + clip_and_light() + "--frame 7 --lightmap --backend " + c.backend +
                          " -o " + out,
                      &says) == 0);
    const auto map = decoders::read_npy(out);
    REQUIRE(map);
    REQUIRE(map->values.size() == reference.size());
    double worst = 0;
    for (std::size_t i = 0; i < reference.size(); ++i)
      worst = std::max(worst, std::abs(static_cast<double>(map->values[i]) - reference[i]));
    std::printf("light map of the mannequin, %-16s error/peak %.2e (bound %.1e)\n", c.backend,
                worst / peak, c.bound);
    CHECK(worst / peak <= c.bound);
  }
}

TEST_CASE("every backend draws the same picture") {
  const Folder folder;
  std::vector<std::uint8_t> first;
  for (const char* backend : {"egl", "cpu", "egl-es2", "osmesa"}) {
    INFO(backend);
    const std::string out = folder.file("p.png");
    REQUIRE(run_relit("render " + clip_and_light() +
                      "--frame 7 --size 96x96 --samples 1 --backend " + backend + " -o " + out) ==
            0);
    const auto picture = decoders::decode_image(read_bytes(out), "image/png");
    REQUIRE(picture);
    if (first.empty()) first = picture->rgba;
    // Light maps differ by 1.5e-3 of the peak and the dither by one step; a rasteriser may own an
    // edge pixel that another does not.
    std::size_t different = 0;
    for (std::size_t i = 0; i < first.size(); ++i)
      different += std::abs(int{first[i]} - int{picture->rgba[i]}) > 4;
    CHECK(different < first.size() / 200);
  }
}

TEST_CASE("films, sheets and numbered pictures are written by extension") {
  const Folder folder;
  const std::string render = "render " + clip_and_light() + "--size 64x64 --frames 0-5 -o ";
  for (const char* name : {"f.mp4", "f.webp", "f.gif"}) {
    INFO(name);
    CHECK(run_relit(render + folder.file(name)) == 0);
    CHECK(std::filesystem::file_size(folder.file(name)) > 500);
  }
  CHECK(run_relit(render + folder.file("s.png") + " --sheet 3x2") == 0);
  CHECK(run_relit(render + folder.file("n%03d.png")) == 0);
  CHECK(std::filesystem::exists(folder.file("n005.png")));
  std::string says;
  CHECK(run_relit(render + folder.file("one.png"), &says) == 2);
  CHECK(says.find("--sheet") != std::string::npos);
  CHECK(run_relit(render + folder.file("x.bmp"), &says) == 2);
  CHECK(says.find(".webp") != std::string::npos);
  for (const auto& entry : std::filesystem::directory_iterator(folder.path)) {
    CHECK(entry.path().string().find(".part") == std::string::npos);
  }
}

TEST_CASE("info says the same to people and to programs") {
  std::string says;
  REQUIRE(run_relit("info " + shipped_clip().string() + " --json", &says) == 0);
  const auto json = nlohmann::json::parse(says);
  CHECK(json.at("bytes") == std::filesystem::file_size(shipped_clip()));
  CHECK(json.at("complete") == true);
  CHECK(json.at("models").at(0).at("order") == 2);
  CHECK(json.at("models").at(0).at("layers").size() == 3);
  CHECK(json.at("segments").at(0).at("chunks").at(0).at("packets").size() == 1);
  REQUIRE(run_relit("info " + shipped_clip().string(), &says) == 0);
  CHECK(says.find("order 2 (9 coefficients)") != std::string::npos);
}

TEST_CASE("dump writes arrays of the promised shapes") {
  const Folder folder;
  REQUIRE(run_relit("dump " + shipped_clip().string() + " --frames 2-3 -o " + folder.file("t.npy") +
                    " --mask " + folder.file("m.npy")) == 0);
  const auto transfer = decoders::read_npy(folder.file("t.npy"));
  const auto mask = decoders::read_npy(folder.file("m.npy"));
  REQUIRE(transfer);
  REQUIRE(mask);
  const std::uint64_t side = mask->shape.at(0);
  CHECK(transfer->shape == std::vector<std::uint64_t>{2, 9, 3, side, side});
  const double covered =
      static_cast<double>(std::count(mask->values.begin(), mask->values.end(), 1.0f)) /
      static_cast<double>(side * side);
  CHECK(covered > 0.5);
  CHECK(covered < 0.9);
}

TEST_CASE("a light goes through its JSON unchanged") {
  const Folder folder;
  REQUIRE(run_relit("light " + shipped_light().string() + " -o " + folder.file("l.json") +
                    " --rotate-light 30 --light-window") == 0);
  LightOptions options;
  options.rotate_rad = 30 * 3.14159265358979323846 / 180;
  options.window = true;
  const auto direct = load_light(shipped_light().string(), options);
  const auto read = load_light(folder.file("l.json"));
  REQUIRE(direct);
  REQUIRE(read);
  CHECK(direct->light.sh == read->light.sh);
}

TEST_CASE("exit statuses tell bad input from bad usage and from losses") {
  const Folder folder;
  CHECK(run_relit("--help") == 0);
  CHECK(run_relit("") == 2);
  CHECK(run_relit("render --no-such-option") == 2);
  CHECK(run_relit("info " + folder.file("absent.relit")) == 1);
  CHECK(run_relit("render " + shipped_clip().string() + " --light " + folder.file("absent.hdr") +
                  " --frame 0 -o " + folder.file("x.png")) == 1);
  CHECK(run_relit("render " + clip_and_light() + "--frame 99999 -o " + folder.file("x.png")) == 2);
  CHECK(run_relit("render " + clip_and_light() + "--frame 0 --camera nowhere -o " +
                  folder.file("x.png")) == 2);
  CHECK(run_relit("render " + clip_and_light() + "--frame 0 --backend vulkan -o " +
                  folder.file("x.png")) == 2);
  CHECK(run_relit("render " + clip_and_light() + "--frame 0 -o /no/such/folder/x.png") == 1);
  auto bytes = read_bytes(shipped_clip());
  bytes.resize(bytes.size() / 2);
  std::ofstream(folder.file("cut.relit"), std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  std::string says;
  CHECK(run_relit("dump " + folder.file("cut.relit") + " --frames 0-119 -o " + folder.file("t.npy"),
                  &says) == 3);
  CHECK(says.find("damaged") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(folder.file("x.png")));
}

TEST_CASE("standard input plays forward") {
  const Folder folder;
  CHECK(run_relit("render - --light " + shipped_light().string() + " --frame 40 --size 64x64 -o " +
                  folder.file("x.png") + " <" + shipped_clip().string()) == 0);
  CHECK(std::filesystem::exists(folder.file("x.png")));
}

TEST_CASE("stream keeps to a memory budget, or is refused with the one that would do") {
  const Folder folder;
  const std::string clip = shipped_clip().string();
  const std::string composite = " --sink composite --light " + shipped_light().string();
  std::string says;
  REQUIRE(run_relit("stream " + clip + composite + " --memory-budget 12MiB --fill --json", &says) ==
          0);
  const auto played = nlohmann::json::parse(says);
  CHECK(played["frames"] == 120);
  const auto& plan = played["plan"];
  CHECK(plan["heap_bytes"].get<std::uint64_t>() <= (12u << 20));
  CHECK(plan["given_up"].size() > 0);
  CHECK(played["peak_bytes"]["ring"].get<std::uint64_t>() <= plan["heap_bytes"]);
  // What `relit plan` says of the same.
  REQUIRE(run_relit("plan " + clip + " --headless --memory-budget 12MiB --json", &says) == 0);
  const auto planned = nlohmann::json::parse(says);
  CHECK(planned["heap_bytes"] == plan["heap_bytes"]);
  CHECK(planned["ring"]["frames"] == plan["ring_frames"]);

  CHECK(run_relit("stream " + clip + composite + " --memory-budget 1MiB", &says) == 1);
  CHECK(says.find("needs at least") != std::string::npos);
  CHECK(run_relit("stream " + clip + " --memory-budget 12MiB --ring 8MiB") == 2);
  CHECK(run_relit("stream " + clip + " --memory-budget much") == 2);
  CHECK(run_relit("stream " + clip + " --fill") == 2);
  // A pipe's segments are not known beforehand, and are taken to be large.
  CHECK(run_relit("stream - --memory-budget 32MiB <" + clip) == 0);
}

TEST_CASE("without a display play points to render") {
  std::string says;
  const int status = run_relit("play " + clip_and_light(), &says);
  if (std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr) {
    WARN("skipped: there is a display");
    return;
  }
  CHECK(status == 2);
  CHECK(says.find("relit render") != std::string::npos);
}
