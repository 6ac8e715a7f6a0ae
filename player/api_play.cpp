// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "container/base/limits.hpp"
#include "player/api_player.hpp"
#include "player/light.hpp"

using namespace relit;               // NOLINT: definitions of C functions
using namespace relit::player;       // NOLINT
using namespace relit::player::api;  // NOLINT

namespace {

Status need_finite(double value, const char* name) {
  if (std::isfinite(value)) return {};
  return invalid(std::string(name) + " is not finite");
}

relit_moment moment_of(const Player& player) {
  const PlayerMoment& shown = player.moment();
  relit_moment out{};
  out.ready = shown.ready ? 1 : 0;
  out.changed = shown.changed ? 1 : 0;
  out.late = shown.late ? 1 : 0;
  out.ended = shown.ended ? 1 : 0;
  out.clip = static_cast<std::uint32_t>(shown.clip);
  out.frame = shown.frame;
  out.time_s = shown.time_s;
  out.next_s = shown.next_s.value_or(std::numeric_limits<double>::infinity());
  return out;
}

Status give_moment(const Player& player, relit_moment* out) {
  return out == nullptr ? Status() : write_struct("relit_moment", moment_of(player), out);
}

// Before anything happens: a struct that cannot be filled is a mistake of the host's.
Status check_moment(const relit_moment* out) {
  return out == nullptr ? Status()
                        : check_struct("relit_moment", out->struct_size, kFirstSize<relit_moment>);
}

}  // namespace

relit_result relit_set_light_sh(relit_player* player, const float* rgb, uint32_t count) noexcept {
  return call(player, [&](Player& p) -> Status {
    RELIT_TRY(need(rgb, "rgb"));
    if (count != 1 && count != 4 && count != 9 && count != 16)
      return invalid("a light has 1, 4, 9 or 16 coefficients, not " + std::to_string(count));
    decoders::Light light;
    for (std::uint32_t n = 0; n < count; ++n)
      light.sh.push_back({double{rgb[3 * n]}, double{rgb[3 * n + 1]}, double{rgb[3 * n + 2]}});
    RELIT_ASSIGN(LightField field, LightField::steady(std::move(light)));
    return p.set_light(std::move(field), nullptr, 0);
  });
}

relit_result relit_set_environment(relit_player* player, const float* rgb, int32_t width,
                                   int32_t height) noexcept {
  return call(player, [&](Player& p) -> Status {
    RELIT_TRY(need(rgb, "rgb"));
    constexpr auto kSide = static_cast<std::int32_t>(limits::kImageSide);
    if (width < 1 || height < 1) return invalid("an environment without pixels");
    if (width > kSide || height > kSide)
      return fail(ErrorCode::kLimit,
                  "a side of an environment may have " + std::to_string(kSide) + " pixels at most");
    auto environment = std::make_shared<decoders::Environment>();
    environment->width = width;
    environment->height = height;
    const std::size_t count =
        std::size_t{3} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    environment->rgb.assign(rgb, rgb + count);
    RELIT_ASSIGN(decoders::Light light,
                 decoders::project_environment(*environment, static_cast<int>(limits::kShOrder)));
    RELIT_ASSIGN(LightField field, LightField::steady(std::move(light)));
    return p.set_light(std::move(field), std::move(environment), 0);
  });
}

relit_result relit_set_light_file(relit_player* player, const char* path) noexcept {
  return call(player, [&](Player& p) -> Status {
    RELIT_TRY(need(path, "path"));
    RELIT_ASSIGN(const LoadedLight loaded, load_light(path));
    for (const std::string& warning : loaded.warnings) player->log.say(RELIT_LOG_WARNING, warning);
    return p.set_light(loaded);
  });
}

relit_result relit_turn_light(relit_player* player, double angle_rad) noexcept {
  return call(player, [&](Player& p) { return p.turn_light(angle_rad); });
}

relit_result relit_set_position(relit_player* player, const float position[3]) noexcept {
  return call(player, [&](Player& p) -> Status {
    RELIT_TRY(need(position, "position"));
    for (int i = 0; i < 3; ++i) RELIT_TRY(need_finite(double{position[i]}, "position"));
    p.set_position({position[0], position[1], position[2]});
    return {};
  });
}

relit_result relit_auto_exposure(relit_player* player, float* exposure) noexcept {
  return call(player, [&](Player& p) -> Status {
    RELIT_TRY(need(exposure, "exposure"));
    *exposure = p.auto_exposure();
    return {};
  });
}

relit_result relit_play_clip(relit_player* player, uint32_t clip, double cross_fade_s) noexcept {
  return call(player, [&](Player& p) { return p.play_clip(clip, cross_fade_s); });
}

relit_result relit_play_sequence(relit_player* player, const relit_sequence_entry* entries,
                                 size_t count, int32_t loop) noexcept {
  return call(player, [&](Player& p) -> Status {
    RELIT_TRY(need(entries, "entries"));
    if (count < 1 || count > 65536) return invalid("a sequence has 1 to 65536 entries");
    std::vector<SequenceItem> items;
    for (const relit_sequence_entry& entry : std::span(entries, count))
      items.push_back({entry.clip, entry.repeats, entry.cross_fade_s});
    return p.play_sequence(items, loop != 0);
  });
}

relit_result relit_set_paused(relit_player* player, int32_t paused) noexcept {
  return call(player, [&](Player& p) -> Status {
    p.set_paused(paused != 0);
    return {};
  });
}

relit_result relit_set_speed(relit_player* player, double speed) noexcept {
  return call(player, [&](Player& p) -> Status {
    if (speed < 0 && !p.seekable())
      return fail(ErrorCode::kUnsupported, "this source cannot seek, so it cannot go backwards");
    return p.set_speed(speed);
  });
}

relit_result relit_set_loop(relit_player* player, relit_loop loop) noexcept {
  return call(player, [&](Player& p) -> Status {
    if (loop < RELIT_LOOP_AS_FILE || loop > RELIT_LOOP_ON) return invalid("none of relit_loop");
    p.set_loop(static_cast<LoopMode>(loop));
    return {};
  });
}

relit_result relit_seek(relit_player* player, double time_s) noexcept {
  return call(player, [&](Player& p) { return p.seek(time_s); });
}

relit_result relit_seek_frame(relit_player* player, uint64_t frame) noexcept {
  return call(player, [&](Player& p) { return p.seek_frame(frame); });
}

relit_result relit_step(relit_player* player, int32_t frames) noexcept {
  return call(player, [&](Player& p) { return p.step(frames); });
}

relit_result relit_update(relit_player* player, int64_t now_ns, relit_moment* moment) noexcept {
  return call(player, [&](Player& p) -> Status {
    RELIT_TRY(check_moment(moment));
    const Status updated = p.update(now_ns);
    RELIT_TRY(give_moment(p, moment));
    return updated;
  });
}

relit_result relit_wait(relit_player* player, double timeout_s, relit_moment* moment) noexcept {
  return call(player, [&](Player& p) -> Status {
    RELIT_TRY(check_moment(moment));
    if (!(timeout_s >= 0) || !std::isfinite(timeout_s))
      return invalid("timeout_s must be 0 or more, and finite");
    RELIT_ASSIGN(const bool here, p.wait(timeout_s));
    RELIT_TRY(give_moment(p, moment));
    if (here) return {};
    return fail(ErrorCode::kCancelled,
                "the frame did not come within " + std::to_string(timeout_s) + " s");
  });
}

relit_result relit_set_layers(relit_player* player, int32_t layers) noexcept {
  return call(player, [&](Player& p) -> Status {
    if (layers < -1) return invalid("layers must be -1 or more");
    return p.set_layers(layers);
  });
}

relit_result relit_set_interpolation(relit_player* player, int32_t on) noexcept {
  return call(player, [&](Player& p) -> Status {
    p.set_interpolation(on != 0);
    return {};
  });
}

relit_result relit_set_path(relit_player* player, relit_path path) noexcept {
  return call(player, [&](Player& p) -> Status {
    if (path < RELIT_PATH_AUTO || path > RELIT_PATH_FUSED) return invalid("none of relit_path");
    return p.set_path(static_cast<CompositePath>(path));
  });
}

relit_result relit_set_quality(relit_player* player, double quality) noexcept {
  return call(player, [&](Player& p) -> Status {
    if (!(quality <= 1)) return invalid("quality must be at most 1");
    return p.set_quality(quality < 0 ? std::nullopt : std::optional(quality));
  });
}

relit_result relit_set_target_fps(relit_player* player, double fps) noexcept {
  return call(player, [&](Player& p) { return p.set_target_fps(fps == 0 ? 60 : fps); });
}
