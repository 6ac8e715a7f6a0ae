// SPDX-License-Identifier: MIT
#include <cmath>
#include <glm/gtc/type_ptr.hpp>

#include "player/api_player.hpp"

using namespace relit;               // NOLINT: definitions of C functions
using namespace relit::player;       // NOLINT
using namespace relit::player::api;  // NOLINT

namespace {

relit_view default_view() {
  relit_view view{};
  view.struct_size = sizeof view;
  for (int i = 0; i < 4; ++i) view.view[5 * i] = view.projection[5 * i] = 1;
  view.exposure = 1;
  view.tone_map = RELIT_TONE_MAP_NEUTRAL;
  return view;
}

Result<gles::DeviceOptions> device_options(const relit_gl_options& options) {
  if (options.get_proc_address == nullptr) return invalid("get_proc_address is NULL");
  gles::DeviceOptions out;
  out.get_proc_address = [find = options.get_proc_address, user = options.user](const char* name) {
    return find(user, name);
  };
  switch (options.es_version) {
    case 0:
      break;
    case 2:
      out.profile = gles::Profile::kEs2;
      break;
    case 3:
      out.profile = gles::Profile::kEs3;
      break;
    default:
      return invalid("es_version must be 0, 2 or 3");
  }
  if (options.ignored_extensions != nullptr) out.ignored_extensions = options.ignored_extensions;
  return out;
}

Result<gles::View> view_of(const relit_view& view) {
  if (view.tone_map < RELIT_TONE_MAP_LINEAR || view.tone_map > RELIT_TONE_MAP_NEUTRAL)
    return invalid("tone_map is none of relit_tone_map");
  gles::View out;
  out.view = glm::make_mat4(view.view);
  out.projection = glm::make_mat4(view.projection);
  out.exposure = view.exposure;
  out.tone_map = static_cast<gles::ToneMap>(view.tone_map);
  out.x = view.x, out.y = view.y;
  out.width = view.width, out.height = view.height;
  return out;
}

Result<Backdrop> backdrop_of(const relit_view& view) {
  if (view.background < RELIT_BACKGROUND_KEEP || view.background > RELIT_BACKGROUND_LIGHT)
    return invalid("background is none of relit_background");
  Backdrop out;
  out.kind = static_cast<Backdrop::Kind>(view.background);
  for (std::size_t c = 0; c < 3; ++c) {
    if (!std::isfinite(view.background_color[c])) return invalid("background_color is not finite");
    out.color[c] = view.background_color[c];
  }
  if (!std::isfinite(view.background_blur_rad) || view.background_blur_rad < 0)
    return invalid("background_blur_rad must be 0 or more, and finite");
  out.blur_rad = view.background_blur_rad;
  return out;
}

std::span<glm::vec3> vectors(float* values, std::size_t count) {
  static_assert(sizeof(glm::vec3) == 3 * sizeof(float));
  return {reinterpret_cast<glm::vec3*>(values), values != nullptr ? count : 0};
}

}  // namespace

relit_result relit_gl_options_default(relit_gl_options* options, size_t struct_size) noexcept {
  return write_default(relit_gl_options{}, options, struct_size);
}

relit_result relit_view_default(relit_view* view, size_t struct_size) noexcept {
  return write_default(default_view(), view, struct_size);
}

relit_result relit_gl_attach(relit_player* player, const relit_gl_options* options) noexcept {
  if (player == nullptr) return RELIT_INVALID;
  if (player->player && player->player->device() == nullptr)
    player->owner.store(std::this_thread::get_id(), std::memory_order_relaxed);
  return call(player, [&](Player& p) -> Status {
    if (p.device() != nullptr) return invalid("a GL context is attached already; detach it first");
    relit_gl_options chosen{};
    RELIT_TRY(read_struct("relit_gl_options", options, chosen));
    RELIT_ASSIGN(const gles::DeviceOptions device_opts, device_options(chosen));
    RELIT_ASSIGN(auto device, gles::Device::create(device_opts));
    return p.attach(std::move(device));
  });
}

relit_result relit_gl_detach(relit_player* player) noexcept {
  return call(player, [&](Player& p) -> Status {
    if (p.device() == nullptr) return {};
    RELIT_TRY(p.device()->ready("detaching"));
    p.detach();
    return {};
  });
}

relit_result relit_gl_abandon(relit_player* player) noexcept {
  return call(player, [&](Player& p) -> Status {
    p.abandon();
    return {};
  });
}

relit_result relit_draw(relit_player* player, const relit_view* view) noexcept {
  return call(player, [&](Player& p) -> Status {
    relit_view chosen = default_view();
    RELIT_TRY(read_struct("relit_view", view, chosen));
    RELIT_ASSIGN(const gles::View seen, view_of(chosen));
    RELIT_ASSIGN(const Backdrop backdrop, backdrop_of(chosen));
    return p.draw(seen, backdrop);
  });
}

relit_result relit_light_map_texture(relit_player* player, relit_light_map* map) noexcept {
  return call(player, [&](Player& p) -> Status {
    RELIT_TRY(need(map, "relit_light_map"));
    RELIT_TRY(check_struct("relit_light_map", map->struct_size, kFirstSize<relit_light_map>));
    RELIT_ASSIGN(const gles::LightMap made, p.light_map());
    relit_light_map out{};
    out.texture = made.texture;
    out.width = made.width, out.height = made.height;
    out.square_root = made.square_root ? 1 : 0;
    out.linear_filter = made.linear_filter ? 1 : 0;
    out.radiance_scale = made.scale * made.magnitude;
    return write_struct("relit_light_map", out, map);
  });
}

relit_result relit_light_map_size(relit_player* player, int32_t* width, int32_t* height) noexcept {
  return call(player, [&](Player& p) -> Status {
    RELIT_TRY(need(width, "width"));
    RELIT_TRY(need(height, "height"));
    const Player::Size size = p.light_map_size();
    *width = size.width, *height = size.height;
    return {};
  });
}

relit_result relit_light_map_pixels(relit_player* player, float* out, size_t count) noexcept {
  return call(player, [&](Player& p) -> Status {
    RELIT_TRY(need(out, "out"));
    const Player::Size size = p.light_map_size();
    const std::size_t due = std::size_t{3} * static_cast<std::size_t>(size.width) *
                            static_cast<std::size_t>(size.height);
    if (count != due)
      return invalid("the light map has " + std::to_string(due) + " numbers, not " +
                     std::to_string(count));
    return p.read_light_map({out, count});
  });
}

relit_result relit_posed_vertices(relit_player* player, uint32_t mesh, float* positions,
                                  float* normals, size_t count) noexcept {
  return call(player, [&](Player& p) -> Status {
    RELIT_TRY(need(positions, "positions"));
    return p.posed_vertices(mesh, vectors(positions, count), vectors(normals, count));
  });
}
