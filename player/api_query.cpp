// SPDX-License-Identifier: MIT
#include <algorithm>

#include "decoders/image.hpp"
#include "player/api_player.hpp"

using namespace relit;               // NOLINT: definitions of C functions
using namespace relit::player;       // NOLINT
using namespace relit::player::api;  // NOLINT

namespace {

Unexpected no_such(const char* what, std::uint32_t index, std::size_t count) {
  return fail(ErrorCode::kNotFound, std::string("no ") + what + " " + std::to_string(index) +
                                        "; the file has " + std::to_string(count));
}

// Of a player on its thread; 0 where there is none.
template <class Count>
std::uint32_t count_of(const relit_player* player, Count&& count) {
  if (player == nullptr || !on_thread(*player) || !player->player) return 0;
  return static_cast<std::uint32_t>(count(*player->player));
}

relit_clip_info clip_info(const Player& player, std::size_t index) {
  const container::ClipRecord& clip = player.contents().clips[index];
  relit_clip_info info{};
  info.name = clip.name.c_str();
  info.frame_count = clip.frame_count;
  info.duration_s = static_cast<double>(clip.duration_ticks) *
                    static_cast<double>(clip.tick_rate.den) /
                    static_cast<double>(clip.tick_rate.num);
  info.loops = clip.loop ? 1 : 0;
  std::copy(clip.bounds_min.begin(), clip.bounds_min.end(), info.bounds_min);
  std::copy(clip.bounds_max.begin(), clip.bounds_max.end(), info.bounds_max);
  if (const container::ModelRecord* model = player.model_of(index)) {
    info.light_order = model->order;
    info.width = model->width;
    info.height = model->height;
    for (const container::LayerRecord& layer : player.contents().layers)
      info.layer_count += layer.model_id == model->id ? 1 : 0;
  }
  return info;
}

const float* floats(const std::vector<glm::vec2>& values) {
  return values.empty() ? nullptr : &values.front().x;
}

relit_mesh_info mesh_info(const Player& player, const decoders::Mesh& mesh) {
  relit_mesh_info info{};
  info.name = mesh.name.c_str();
  info.vertex_count = static_cast<std::uint32_t>(mesh.positions.size());
  info.index_count = static_cast<std::uint32_t>(mesh.indices.size());
  info.indices = mesh.indices.data();
  info.lightmap_uv = floats(mesh.lightmap_uv);
  info.albedo_uv = floats(mesh.albedo_uv);
  info.colors = mesh.colors.empty() ? nullptr : &mesh.colors.front().x;
  const auto& materials = player.contents().materials;
  const auto material =
      std::find_if(materials.begin(), materials.end(),
                   [&](const container::MaterialRecord& m) { return m.id == mesh.material_id; });
  info.material = static_cast<std::uint32_t>(material - materials.begin());
  return info;
}

relit_material_info material_info(const Player& player, const container::MaterialRecord& material) {
  relit_material_info info{};
  info.name = material.name.c_str();
  std::copy(material.base_color.begin(), material.base_color.end(), info.base_color);
  info.image = -1;
  const auto& images = player.contents().images;
  for (std::size_t i = 0; i < images.size(); ++i)
    if (static_cast<std::int64_t>(images[i].id) == material.image_id)
      info.image = static_cast<std::int32_t>(i);
  info.wrap_u = static_cast<std::int32_t>(material.wrap_u);
  info.wrap_v = static_cast<std::int32_t>(material.wrap_v);
  info.linear_filter = material.linear_filter ? 1 : 0;
  info.alpha_mode = static_cast<std::int32_t>(material.alpha_mode);
  info.alpha_cutoff = material.alpha_cutoff;
  return info;
}

Status decode(relit_player& handle, const Player& player, std::uint32_t index) {
  if (handle.image && handle.image_index == index) return {};
  const auto& images = player.contents().images;
  handle.image.reset();
  RELIT_ASSIGN(handle.image, decoders::decode_image(images[index].bytes, images[index].media_type));
  handle.image_index = index;
  return {};
}

relit_statistics statistics_of(const Player& player) {
  const PlayerStats stats = player.stats();
  relit_statistics out{};
  out.updates = stats.updates;
  out.shown = stats.shown;
  out.repeated = stats.repeated;
  out.late = stats.late;
  out.waiting = stats.waiting;
  out.skipped_frames = stats.skipped_frames;
  out.composites = stats.composites;
  out.lost_frames = stats.loss.frames;
  out.lost_records = stats.loss.records;
  out.lost_segments = stats.loss.segments;
  out.decode_ms = stats.decode_ms;
  out.composite_ms = stats.composite_ms;
  out.draw_ms = stats.draw_ms;
  for (const PrefetchStats::Track& track : stats.prefetch.tracks) out.read_bytes += track.bytes;
  out.ring_bytes = stats.prefetch.ring_bytes;
  out.ring_peak_bytes = stats.prefetch.ring_bytes_peak;
  out.ring_limit_bytes = player.plan().ring_bytes;
  out.ring_frames = static_cast<std::uint32_t>(stats.prefetch.ring_frames);
  out.planned_bytes = player.plan().total_bytes();
  out.gpu_bytes = stats.gpu_bytes;
  out.quality = stats.quality;
  out.path = static_cast<std::int32_t>(stats.path);
  out.planes = stats.planes;
  out.planes_of = stats.planes_of;
  out.half_size = stats.chosen.half_size ? 1 : 0;
  out.light_map_every = stats.chosen.light_map_every;
  out.threads = player.plan().threads;
  out.pose_bytes = stats.prefetch.pose_bytes;
  return out;
}

}  // namespace

uint32_t relit_clip_count(const relit_player* player) noexcept {
  return count_of(player, [](const Player& p) { return p.contents().clips.size(); });
}

relit_result relit_clip(relit_player* player, uint32_t clip, relit_clip_info* info) noexcept {
  return call(player, [&](Player& p) -> Status {
    const std::size_t count = p.contents().clips.size();
    if (clip >= count) return no_such("clip", clip, count);
    return write_struct("relit_clip_info", clip_info(p, clip), info);
  });
}

uint32_t relit_mesh_count(const relit_player* player) noexcept {
  return count_of(player, [](const Player& p) { return p.meshes().size(); });
}

relit_result relit_mesh(relit_player* player, uint32_t mesh, relit_mesh_info* info) noexcept {
  return call(player, [&](Player& p) -> Status {
    if (mesh >= p.meshes().size()) return no_such("mesh", mesh, p.meshes().size());
    return write_struct("relit_mesh_info", mesh_info(p, p.meshes()[mesh]), info);
  });
}

uint32_t relit_material_count(const relit_player* player) noexcept {
  return count_of(player, [](const Player& p) { return p.contents().materials.size(); });
}

relit_result relit_material(relit_player* player, uint32_t material,
                            relit_material_info* info) noexcept {
  return call(player, [&](Player& p) -> Status {
    const auto& materials = p.contents().materials;
    if (material >= materials.size()) return no_such("material", material, materials.size());
    return write_struct("relit_material_info", material_info(p, materials[material]), info);
  });
}

uint32_t relit_image_count(const relit_player* player) noexcept {
  return count_of(player, [](const Player& p) { return p.contents().images.size(); });
}

relit_result relit_image(relit_player* player, uint32_t image, int32_t* width, int32_t* height,
                         uint8_t* rgba, size_t bytes) noexcept {
  return call(player, [&](Player& p) -> Status {
    RELIT_TRY(need(width, "width"));
    RELIT_TRY(need(height, "height"));
    if (image >= p.contents().images.size())
      return no_such("image", image, p.contents().images.size());
    RELIT_TRY(decode(*player, p, image));
    const decoders::DecodedImage& decoded = *player->image;
    if (rgba != nullptr && bytes != decoded.rgba.size())
      return fail(ErrorCode::kInvalid, "image " + std::to_string(image) + " takes " +
                                           std::to_string(decoded.rgba.size()) + " bytes, not " +
                                           std::to_string(bytes));
    *width = decoded.width, *height = decoded.height;
    if (rgba == nullptr) return {};
    std::copy(decoded.rgba.begin(), decoded.rgba.end(), rgba);
    player->image.reset();
    return {};
  });
}

relit_result relit_get_statistics(relit_player* player, relit_statistics* statistics) noexcept {
  return call(player, [&](Player& p) -> Status {
    return write_struct("relit_statistics", statistics_of(p), statistics);
  });
}

const char* relit_memory_plan(relit_player* player) noexcept {
  const relit_result result = call(player, [&](Player& p) -> Status {
    player->plan_text.clear();
    for (const MemoryTerm& term : p.plan().terms)
      player->plan_text += term.name + ": " + std::to_string(term.heap_bytes) + " + " +
                           std::to_string(term.gpu_bytes) + " bytes, " + term.what + "\n";
    for (const std::string& sentence : p.plan().given_up) player->plan_text += sentence + "\n";
    return {};
  });
  return result == RELIT_OK ? player->plan_text.c_str() : "";
}
