// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstring>
#include <limits>
#include <thread>

#include "tests/player/api_fixture.hpp"

using namespace relit;
using namespace relit::player::test;

namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Calls `use` with a T whose struct_size is wrong in each way, in room that is larger.
template <class T, class Use>
void check_sizes(T good, Use&& use) {
  struct Room {
    T value;
    unsigned char behind[64];
  } room{good, {}};
  for (const std::size_t size : {std::size_t{0}, sizeof(T) - 1, std::size_t{1} << 40,
                                 std::numeric_limits<std::size_t>::max()}) {
    room.value.struct_size = size;
    INFO(size);
    CHECK(use(&room.value) == RELIT_INVALID);
  }
  room.value.struct_size = sizeof(Room);
  CHECK(use(&room.value) == RELIT_OK);
}

}  // namespace

TEST_CASE("api: the version and the results have names") {
  CHECK(relit_version() ==
        (RELIT_VERSION_MAJOR << 16 | RELIT_VERSION_MINOR << 8 | RELIT_VERSION_PATCH));
  const std::string text = std::to_string(RELIT_VERSION_MAJOR) + "." +
                           std::to_string(RELIT_VERSION_MINOR) + "." +
                           std::to_string(RELIT_VERSION_PATCH);
  CHECK(relit_version_text() == text);
  CHECK(std::string(relit_result_name(RELIT_OUT_OF_MEMORY)) == "RELIT_OUT_OF_MEMORY");
  CHECK(std::string(relit_result_name(static_cast<relit_result>(15))) == "?");
}

TEST_CASE("api: structs of other sizes are refused, or grow with zeros") {
  const ApiPlayer player(mannequin());
  REQUIRE(player.result == RELIT_OK);
  waited(player);
  check_sizes(relit_clip_info{}, [&](auto* s) { return relit_clip(player, 0, s); });
  check_sizes(relit_mesh_info{}, [&](auto* s) { return relit_mesh(player, 0, s); });
  check_sizes(relit_material_info{}, [&](auto* s) { return relit_material(player, 0, s); });
  check_sizes(relit_moment{}, [&](auto* s) { return relit_update(player, 0, s); });
  check_sizes(relit_moment{}, [&](auto* s) { return relit_wait(player, 10, s); });
  check_sizes(relit_statistics{}, [&](auto* s) { return relit_get_statistics(player, s); });
  check_sizes(default_options(), [&](const auto* s) {
    ApiPlayer other(mannequin(), *s);
    return other.result;
  });
  check_sizes(relit_pool_options{}, [&](const auto* s) {
    relit_pool* pool = nullptr;
    const relit_result result = relit_pool_create(s, &pool);
    CHECK((pool != nullptr) == (result == RELIT_OK));
    relit_pool_release(pool);
    return result;
  });
  struct {
    relit_statistics known;
    unsigned char later[16];
  } grown;
  std::memset(&grown, 0xAA, sizeof grown);
  grown.known.struct_size = sizeof grown;
  REQUIRE(relit_get_statistics(player, &grown.known) == RELIT_OK);
  CHECK(grown.known.struct_size == sizeof grown);
  for (const unsigned char byte : grown.later) CHECK(byte == 0);
}

TEST_CASE("api: options of a later version are refused unless they are zero") {
  struct {
    relit_open_options known;
    unsigned char later[8];
  } options{default_options(), {}};
  options.known.struct_size = sizeof options;
  {
    const ApiPlayer player(mannequin(), options.known);
    CHECK(player.result == RELIT_OK);
  }
  options.later[3] = 1;
  const ApiPlayer player(mannequin(), options.known);
  CHECK(player.result == RELIT_UNSUPPORTED);
  CHECK(player.error().find("later version") != std::string::npos);
  relit_open_options small;
  CHECK(relit_open_options_default(&small, sizeof small - 1) == RELIT_INVALID);
  CHECK(relit_open_options_default(nullptr, sizeof small) == RELIT_INVALID);
  CHECK(relit_view_default(nullptr, sizeof(relit_view)) == RELIT_INVALID);
  CHECK(relit_gl_options_default(nullptr, sizeof(relit_gl_options)) == RELIT_INVALID);
  CHECK(relit_pool_options_default(nullptr, sizeof(relit_pool_options)) == RELIT_INVALID);
}

TEST_CASE("api: no function takes a player that is not there") {
  relit_view view;
  REQUIRE(relit_view_default(&view, sizeof view) == RELIT_OK);
  relit_gl_options gl;
  REQUIRE(relit_gl_options_default(&gl, sizeof gl) == RELIT_OK);
  float number = 0;
  std::int32_t width = 0, height = 0;
  const relit_sequence_entry entry{0, 1, 0};
  const relit_result results[] = {relit_cancel(nullptr),
                                  relit_adopt(nullptr),
                                  relit_clip(nullptr, 0, nullptr),
                                  relit_mesh(nullptr, 0, nullptr),
                                  relit_material(nullptr, 0, nullptr),
                                  relit_image(nullptr, 0, &width, &height, nullptr, 0),
                                  relit_set_light_sh(nullptr, kLight, 4),
                                  relit_set_environment(nullptr, kLight, 2, 2),
                                  relit_set_light_file(nullptr, "x"),
                                  relit_turn_light(nullptr, 0),
                                  relit_set_position(nullptr, kLight),
                                  relit_auto_exposure(nullptr, &number),
                                  relit_play_clip(nullptr, 0, 0),
                                  relit_play_sequence(nullptr, &entry, 1, 0),
                                  relit_set_paused(nullptr, 1),
                                  relit_set_speed(nullptr, 1),
                                  relit_set_loop(nullptr, RELIT_LOOP_ON),
                                  relit_seek(nullptr, 0),
                                  relit_seek_frame(nullptr, 0),
                                  relit_step(nullptr, 1),
                                  relit_update(nullptr, 0, nullptr),
                                  relit_wait(nullptr, 0, nullptr),
                                  relit_set_layers(nullptr, 1),
                                  relit_set_interpolation(nullptr, 1),
                                  relit_set_path(nullptr, RELIT_PATH_CPU),
                                  relit_set_quality(nullptr, 1),
                                  relit_set_target_fps(nullptr, 60),
                                  relit_gl_attach(nullptr, &gl),
                                  relit_gl_detach(nullptr),
                                  relit_gl_abandon(nullptr),
                                  relit_draw(nullptr, &view),
                                  relit_light_map_texture(nullptr, nullptr),
                                  relit_light_map_size(nullptr, &width, &height),
                                  relit_light_map_pixels(nullptr, &number, 1),
                                  relit_posed_vertices(nullptr, 0, &number, nullptr, 1),
                                  relit_get_statistics(nullptr, nullptr)};
  for (const relit_result result : results) CHECK(result == RELIT_INVALID);
  CHECK(relit_clip_count(nullptr) == 0);
  CHECK(relit_mesh_count(nullptr) == 0);
  CHECK(relit_material_count(nullptr) == 0);
  CHECK(relit_image_count(nullptr) == 0);
  CHECK(std::string(relit_last_error(nullptr)).empty());
  CHECK(std::string(relit_memory_plan(nullptr)).empty());
  relit_close(nullptr);
  relit_pool_release(nullptr);
  CHECK(relit_pool_create(nullptr, nullptr) == RELIT_INVALID);
  CHECK(relit_open("x", nullptr, nullptr) == RELIT_INVALID);
}

TEST_CASE("api: arguments that make no sense change nothing and are named") {
  const ApiPlayer player(mannequin());
  REQUIRE(player.result == RELIT_OK);
  waited(player);
  const std::vector<float> before = light_map(player);
  const auto refused = [&](relit_result result, relit_result expected = RELIT_INVALID) {
    CHECK(result == expected);
    CHECK_FALSE(player.error().empty());
  };
  float light[48] = {};
  for (const std::uint32_t count : {0u, 2u, 5u, 17u})
    refused(relit_set_light_sh(player, light, count));
  for (const float wrong : {kNaN, kInfinity, -kInfinity}) {
    light[5] = wrong;
    refused(relit_set_light_sh(player, light, 4));
    refused(relit_set_environment(player, light, 2, 2));
    refused(relit_turn_light(player, double{wrong}));
    const float position[3] = {0, wrong, 0};
    refused(relit_set_position(player, position));
    refused(relit_seek(player, double{wrong}));
    refused(relit_set_speed(player, double{wrong}));
    refused(relit_play_clip(player, 0, double{wrong}));
    refused(relit_wait(player, double{wrong}, nullptr));
  }
  refused(relit_set_quality(player, double{kNaN}));
  refused(relit_set_target_fps(player, double{kNaN}));
  light[5] = -1;
  refused(relit_set_environment(player, light, 2, 2));
  refused(relit_set_environment(player, light, 0, 2));
  refused(relit_set_environment(player, light, 20000, 2), RELIT_LIMIT);
  refused(relit_set_light_sh(player, nullptr, 4));
  refused(relit_set_environment(player, nullptr, 2, 2));
  refused(relit_set_position(player, nullptr));
  refused(relit_auto_exposure(player, nullptr));
  refused(relit_set_light_file(player, nullptr));
  refused(relit_set_light_file(player, "/no/such/light.hdr"), RELIT_IO);
  refused(relit_play_clip(player, 7, 0), RELIT_NOT_FOUND);
  refused(relit_play_clip(player, 0, -1));
  refused(relit_play_sequence(player, nullptr, 1, 0));
  const relit_sequence_entry no_clip{9, 1, 0}, no_repeats{0, 0, 0}, some{0, 1, 0};
  refused(relit_play_sequence(player, &no_clip, 1, 0), RELIT_NOT_FOUND);
  refused(relit_play_sequence(player, &no_repeats, 1, 0));
  refused(relit_play_sequence(player, &some, 0, 0));
  refused(relit_set_loop(player, static_cast<relit_loop>(3)));
  refused(relit_set_speed(player, 101));
  refused(relit_set_layers(player, -2));
  refused(relit_set_quality(player, 1.5));
  refused(relit_set_target_fps(player, 0.5));
  refused(relit_wait(player, -1, nullptr));
  refused(relit_clip(player, 9, nullptr), RELIT_NOT_FOUND);
  refused(relit_clip(player, 0, nullptr));
  refused(relit_mesh(player, 0, nullptr));
  refused(relit_mesh(player, 999, nullptr), RELIT_NOT_FOUND);
  refused(relit_material(player, 999, nullptr), RELIT_NOT_FOUND);
  refused(relit_get_statistics(player, nullptr));
  std::int32_t width = 0, height = 0;
  refused(relit_image(player, 0, nullptr, &height, nullptr, 0));
  refused(relit_image(player, 99, &width, &height, nullptr, 0), RELIT_NOT_FOUND);
  refused(relit_light_map_size(player, nullptr, &height));
  refused(relit_light_map_pixels(player, light, 48));
  refused(relit_light_map_pixels(player, nullptr, 48));
  refused(relit_posed_vertices(player, 0, light, nullptr, 3));
  refused(relit_posed_vertices(player, 0, nullptr, nullptr, 3));
  refused(relit_posed_vertices(player, 99, light, nullptr, 3), RELIT_NOT_FOUND);
  // Without a context.
  relit_view view;
  REQUIRE(relit_view_default(&view, sizeof view) == RELIT_OK);
  view.width = view.height = 16;
  refused(relit_draw(player, &view));
  relit_light_map map{};
  map.struct_size = sizeof map;
  refused(relit_light_map_texture(player, &map));
  CHECK(relit_gl_detach(player) == RELIT_OK);
  CHECK(relit_gl_abandon(player) == RELIT_OK);
  waited(player);
  CHECK(light_map(player) == before);
}

TEST_CASE("api: a file that does not open leaves a player that says why") {
  relit_player* player = nullptr;
  CHECK(relit_open("/no/such/file.relit", nullptr, &player) == RELIT_IO);
  REQUIRE(player != nullptr);
  CHECK(std::string(relit_last_error(player)).find("/no/such/file.relit") != std::string::npos);
  CHECK(relit_update(player, 0, nullptr) == RELIT_IO);
  CHECK(relit_clip_count(player) == 0);
  CHECK(relit_cancel(player) == RELIT_INVALID);
  relit_close(player);
  CHECK(relit_open(nullptr, nullptr, &player) == RELIT_INVALID);
  relit_close(player);
  CHECK(relit_open_memory(nullptr, 10, nullptr, &player) == RELIT_INVALID);
  relit_close(player);
  const std::string text = "hello, world: this is no such file at all, whatever it is called";
  CHECK(relit_open_memory(text.data(), text.size(), nullptr, &player) == RELIT_CORRUPT);
  relit_close(player);
  CHECK(relit_open_memory(mannequin().data(), 100, nullptr, &player) == RELIT_TRUNCATED);
  relit_close(player);
  relit_open_options options = default_options();
  options.clip = "swim";
  const ApiPlayer other(mannequin(), options);
  CHECK(other.result == RELIT_NOT_FOUND);
  CHECK(other.error().find("swim") != std::string::npos);
}

TEST_CASE("api: options out of range are refused") {
  const auto refused = [](auto&& change) {
    relit_open_options options = default_options();
    change(options);
    const ApiPlayer player(mannequin(), options);
    CHECK(player.result == RELIT_INVALID);
    CHECK(player.error().find("relit_open_options") == 0);
  };
  refused([](auto& o) { o.layers = -2; });
  refused([](auto& o) { o.threads = 65; });
  refused([](auto& o) { o.threads = -1; });
  refused([](auto& o) { o.path = 4; });
  refused([](auto& o) { o.model = 1; });
  refused([](auto& o) { o.quality = 2; });
  refused([](auto& o) { o.quality = double{kNaN}; });
  refused([](auto& o) { o.target_fps = 0.5; });
  refused([](auto& o) { o.target_fps = double{kNaN}; });
  refused([](auto& o) { o.timeout_s = 0; });
  refused([](auto& o) { o.timeout_s = double{kInfinity}; });
  static const relit_allocator kNothing{};
  refused([](auto& o) { o.allocator = &kNothing; });
}

TEST_CASE("api: a thousand players come and go") {
  const auto bytes = coded_file();
  for (int i = 0; i < 1000; ++i) {
    const ApiPlayer player(bytes);
    REQUIRE(player.result == RELIT_OK);
    if (i % 3 == 1) REQUIRE(relit_update(player, i, nullptr) == RELIT_OK);
    if (i % 3 == 2) waited(player);
  }
}

TEST_CASE("api: calls from another thread do nothing, until it adopts the player") {
  const ApiPlayer player(mannequin());
  REQUIRE(player.result == RELIT_OK);
  relit_result update = RELIT_OK, adopted = RELIT_OK, updated = RELIT_OK;
  std::string says;
  std::uint32_t clips = 7;
  std::thread([&] {
    update = relit_update(player, 0, nullptr);
    clips = relit_clip_count(player);
    says = relit_last_error(player);
    adopted = relit_adopt(player);
    updated = relit_update(player, 0, nullptr);
  }).join();
  CHECK(update == RELIT_INVALID);
  CHECK(clips == 0);
  CHECK(says.find("thread") != std::string::npos);
  CHECK(adopted == RELIT_OK);
  CHECK(updated == RELIT_OK);
  CHECK(relit_update(player, 0, nullptr) == RELIT_INVALID);
  REQUIRE(relit_adopt(player) == RELIT_OK);
  CHECK(relit_update(player, 0, nullptr) == RELIT_OK);
}

TEST_CASE("api: a budget is kept, or refused with the one that would do") {
  relit_open_options options = default_options();
  options.memory_budget_bytes = 1024;
  {
    const ApiPlayer player(mannequin(), options);
    CHECK(player.result == RELIT_OUT_OF_MEMORY);
    CHECK(player.error().find_first_of("0123456789") != std::string::npos);
  }
  options.memory_budget_bytes = std::numeric_limits<std::uint64_t>::max();
  {
    const ApiPlayer player(mannequin(), options);
    REQUIRE(player.result == RELIT_OK);
    waited(player);
    CHECK(std::string(relit_memory_plan(player)).find("bytes") != std::string::npos);
  }
  options.memory_budget_bytes = 32u << 20;
  const ApiPlayer player(mannequin(), options);
  REQUIRE(player.result == RELIT_OK);
  waited(player);
  const relit_statistics statistics = statistics_of(player);
  CHECK(statistics.planned_bytes <= options.memory_budget_bytes);
  CHECK(statistics.planned_bytes > 0);
}

TEST_CASE("api: a decoder that is not there gives way to software, and the log says so") {
  relit_open_options options = default_options();
  options.decoder = "h264_no_such_decoder";
  std::string said;
  options.log = [](void* user, relit_log_level level, const char* text) {
    if (level == RELIT_LOG_WARNING) *static_cast<std::string*>(user) += text;
  };
  options.log_user = &said;
  const ApiPlayer player(mannequin(), options);
  REQUIRE(player.result == RELIT_OK);
  waited(player);
  CHECK(said.find("h264_no_such_decoder") != std::string::npos);
}

TEST_CASE("api: what a file holds is told") {
  const ApiPlayer player(mannequin());
  REQUIRE(player.result == RELIT_OK);
  REQUIRE(relit_clip_count(player) == 1);
  const relit_clip_info clip = clip_of(player);
  CHECK(std::string(clip.name).size() > 0);
  CHECK(clip.frame_count > 0);
  CHECK(clip.duration_s > 2);
  CHECK(clip.loops == 1);
  CHECK(clip.width > 0);
  CHECK(clip.layer_count > 0);
  CHECK(clip.bounds_max[1] > clip.bounds_min[1]);
  REQUIRE(relit_mesh_count(player) > 0);
  for (std::uint32_t m = 0; m < relit_mesh_count(player); ++m) {
    relit_mesh_info mesh{};
    mesh.struct_size = sizeof mesh;
    REQUIRE(relit_mesh(player, m, &mesh) == RELIT_OK);
    REQUIRE(mesh.vertex_count > 0);
    CHECK(mesh.index_count % 3 == 0);
    for (std::uint32_t i = 0; i < mesh.index_count; ++i)
      REQUIRE(mesh.indices[i] < mesh.vertex_count);
    for (std::uint32_t i = 0; i < 2 * mesh.vertex_count; ++i)
      REQUIRE((mesh.lightmap_uv[i] >= 0 && mesh.lightmap_uv[i] <= 1));
    CHECK(mesh.material < relit_material_count(player));
  }
  for (std::uint32_t m = 0; m < relit_material_count(player); ++m) {
    relit_material_info material{};
    material.struct_size = sizeof material;
    REQUIRE(relit_material(player, m, &material) == RELIT_OK);
    CHECK(material.image < static_cast<std::int32_t>(relit_image_count(player)));
  }
  for (std::uint32_t i = 0; i < relit_image_count(player); ++i) {
    std::int32_t width = 0, height = 0;
    REQUIRE(relit_image(player, i, &width, &height, nullptr, 0) == RELIT_OK);
    std::vector<std::uint8_t> rgba(std::size_t{4} * static_cast<std::size_t>(width * height));
    CHECK(relit_image(player, i, &width, &height, rgba.data(), rgba.size() - 1) == RELIT_INVALID);
    REQUIRE(relit_image(player, i, &width, &height, rgba.data(), rgba.size()) == RELIT_OK);
    CHECK(rgba[3] == 255);
  }
}

TEST_CASE("api: the host's allocator gets back all that it gave") {
  struct Counter {
    std::atomic<std::size_t> bytes{0}, calls{0};
  } counter;
  relit_allocator allocator{};
  allocator.user = &counter;
  allocator.allocate = [](void* user, std::size_t bytes, std::size_t alignment) {
    static_cast<Counter*>(user)->bytes += bytes;
    ++static_cast<Counter*>(user)->calls;
    return std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
  };
  allocator.release = [](void* user, void* memory, std::size_t bytes) {
    static_cast<Counter*>(user)->bytes -= bytes;
    std::free(memory);
  };
  relit_open_options options = default_options();
  options.allocator = &allocator;
  {
    const ApiPlayer player(mannequin(), options);
    REQUIRE(player.result == RELIT_OK);
    waited(player);
    CHECK(counter.calls > 0);
  }
  CHECK(counter.bytes == 0);
  allocator.allocate = [](void*, std::size_t, std::size_t) -> void* { return nullptr; };
  relit_player* player = nullptr;
  CHECK(relit_open_memory(mannequin().data(), mannequin().size(), &options, &player) ==
        RELIT_OUT_OF_MEMORY);
  relit_close(player);
}
