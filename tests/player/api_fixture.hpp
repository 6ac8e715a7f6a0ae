// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "container/byte_sink.hpp"
#include "gles/offscreen.hpp"
#include "player/concat.hpp"
#include "player/relit.h"
#include "tests/player/coded_file.hpp"
#include "tests/player/files.hpp"
#include "tests/test.hpp"

/// relit.h as a host uses it.
namespace relit::player::test {

inline relit_open_options default_options() {
  relit_open_options options;
  REQUIRE(relit_open_options_default(&options, sizeof options) == RELIT_OK);
  options.quality = 1;  // pictures are compared, and this machine may be slow
  return options;
}

/// An open player that closes itself.
struct ApiPlayer {
  relit_player* handle = nullptr;
  relit_result result = RELIT_OK;

  ApiPlayer() = default;
  ApiPlayer(const std::vector<std::uint8_t>& bytes, const relit_open_options& options) {
    result = relit_open_memory(bytes.data(), bytes.size(), &options, &handle);
  }
  explicit ApiPlayer(const std::vector<std::uint8_t>& bytes)
      : ApiPlayer(bytes, default_options()) {}
  ~ApiPlayer() { relit_close(handle); }
  ApiPlayer(const ApiPlayer&) = delete;
  ApiPlayer& operator=(const ApiPlayer&) = delete;
  operator relit_player*() const { return handle; }  // NOLINT: as in C
  [[nodiscard]] std::string error() const { return relit_last_error(handle); }
};

/// The shipped clip, read once.
inline const std::vector<std::uint8_t>& mannequin() {
  static const std::vector<std::uint8_t> kBytes = read_bytes(shipped_clip());
  return kBytes;
}

inline relit_moment moment_of(relit_player* player, std::int64_t now_ns) {
  relit_moment moment{};
  moment.struct_size = sizeof moment;
  INFO(relit_last_error(player));
  REQUIRE(relit_update(player, now_ns, &moment) == RELIT_OK);
  return moment;
}

inline relit_moment waited(relit_player* player) {
  relit_moment moment{};
  moment.struct_size = sizeof moment;
  const relit_result result = relit_wait(player, 20, &moment);
  INFO(relit_last_error(player));
  REQUIRE(result == RELIT_OK);
  return moment;
}

inline relit_clip_info clip_of(relit_player* player, std::uint32_t clip = 0) {
  relit_clip_info info{};
  info.struct_size = sizeof info;
  REQUIRE(relit_clip(player, clip, &info) == RELIT_OK);
  return info;
}

inline relit_statistics statistics_of(relit_player* player) {
  relit_statistics statistics{};
  statistics.struct_size = sizeof statistics;
  REQUIRE(relit_get_statistics(player, &statistics) == RELIT_OK);
  return statistics;
}

/// The light map of the moment.
inline std::vector<float> light_map(relit_player* player) {
  std::int32_t width = 0, height = 0;
  REQUIRE(relit_light_map_size(player, &width, &height) == RELIT_OK);
  std::vector<float> out(std::size_t{3} * static_cast<std::size_t>(width) *
                         static_cast<std::size_t>(height));
  REQUIRE(relit_light_map_pixels(player, out.data(), out.size()) == RELIT_OK);
  return out;
}

/// An order-1 light that comes from above, mostly.
inline constexpr float kLight[12] = {2.6f, 2.4f, 2.2f, 0.9f, 0.8f, 0.7f,
                                     0.2f, 0.2f, 0.3f, 0.4f, 0.1f, -0.2f};

/// A context that is current on this thread while the object lives.
struct ApiContext {
  gles::OffscreenKind kind;
  std::unique_ptr<gles::OffscreenContext> context;
  gles::GetProcAddress find;

  explicit ApiContext(gles::OffscreenKind wanted) : kind(wanted) {
    auto made = gles::OffscreenContext::create(kind);
    if (!made) return;
    context = std::move(*made);
    find = context->get_proc_address();
  }
  [[nodiscard]] relit_gl_options options() {
    relit_gl_options options;
    REQUIRE(relit_gl_options_default(&options, sizeof options) == RELIT_OK);
    // Drivers give more than is asked for.
    if (kind == gles::OffscreenKind::kEglEs2) options.es_version = 2;
    options.user = this;
    options.get_proc_address = [](void* user, const char* name) {
      return static_cast<ApiContext*>(user)->find(name);
    };
    return options;
  }
};

}  // namespace relit::player::test
