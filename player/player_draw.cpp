// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "container/base/out_of_memory.hpp"
#include "player/player_state.hpp"

namespace relit::player {
namespace {

// Pictures before the composite paths are measured, so that the first ones come soon.
constexpr std::uint64_t kFirstMeasuring = 8;
constexpr int kBackgroundSide = 512;

Unexpected no_context() {
  return fail(ErrorCode::kInvalid, "no GL context is attached to this player");
}

Unexpected no_picture() {
  return fail(ErrorCode::kNotFound, "no frame has arrived yet; wait for one");
}

}  // namespace

Status Player::attach(std::unique_ptr<gles::Device> device) {
  if (state_->device)
    return fail(ErrorCode::kInvalid, "a GL context is attached already; detach it first");
  return catch_out_of_memory("attaching a GL context",
                             [&] { return state_->attach(std::move(device)); });
}

Status Player::State::attach(std::unique_ptr<gles::Device> context) {
  const Clock::time_point begin = Clock::now();
  device = std::move(context);
  const auto build = [&]() -> Status {
    RELIT_ASSIGN(character, Character::create(statics->contents, statics->meshes, *device));
    for (const std::string& warning : character->warnings()) say(LogLevel::kWarning, warning);
    for (ClipVoice* voice : voices())
      if (voice != nullptr) RELIT_TRY(attach_voice(*voice));
    lit = nullptr;
    return {};
  };
  const Status built = build();
  if (!built) forget_gl();
  counted.attach_ms = 1e3 * seconds_since(begin);
  return built;
}

// Playback goes on without a context.
void Player::State::forget_gl() {
  character.reset();
  for (ClipVoice* voice : voices())
    if (voice != nullptr) voice->detach();
  device.reset();
  backdrop.reset();
  positions_uploaded = false;
  exposure = 0;
  draws = 0;
  lit = nullptr;
  composited_at = 0;
  for (ClipVoice* voice : voices()) {
    if (voice == nullptr) continue;
    if (const Status status = attach_voice(*voice); !status)
      say(LogLevel::kError, status.error().message);
  }
}

void Player::detach() {
  if (state_->device) state_->forget_gl();
}

void Player::abandon() {
  if (!state_->device) return;
  state_->device->abandon();
  state_->forget_gl();
}

gles::Device* Player::device() const { return state_->device.get(); }

Status Player::State::set_backdrop(const Backdrop& wanted) {
  gles::BackgroundRenderer& renderer = character->renderer().background();
  const decoders::Environment* environment = light->environment();
  const bool picture = wanted.kind == Backdrop::Kind::kLight && environment != nullptr;
  const bool harmonics = !picture && (wanted.kind == Backdrop::Kind::kLight ||
                                      wanted.kind == Backdrop::Kind::kHarmonics);
  renderer.set_rotation(picture     ? static_cast<float>(light->environment_rotation_rad())
                        : harmonics ? static_cast<float>(light->turn_rad())
                                    : 0.0f);
  const bool same = backdrop == wanted && backdrop_light == light->generation() &&
                    !(harmonics && backdrop_harmonics != light->unturned_generation());
  if (same) return {};
  gles::Background background;
  std::vector<std::array<float, 3>> rows;
  if (picture) {
    background.kind = gles::Background::Kind::kEnvironment;
    background.environment = {environment->width, environment->height, environment->rgb};
    background.blur_rad = wanted.blur_rad;
    background.max_side = kBackgroundSide;
  } else if (harmonics) {
    background.kind = gles::Background::Kind::kHarmonics;
    for (const auto& row : light->unturned().sh)
      rows.push_back(
          {static_cast<float>(row[0]), static_cast<float>(row[1]), static_cast<float>(row[2])});
    background.harmonics = rows;
  } else if (wanted.kind == Backdrop::Kind::kColor) {
    background.kind = gles::Background::Kind::kColor;
    background.top = wanted.color;
  } else if (wanted.kind == Backdrop::Kind::kKeep) {
    background.kind = gles::Background::Kind::kKeep;
  }
  RELIT_TRY(renderer.set(background));
  backdrop = wanted;
  backdrop_light = light->generation();
  backdrop_harmonics = light->unturned_generation();
  return {};
}

// Planes that this exposure cannot show are left out, and those that it does are brought back.
void Player::State::use_exposure(float wanted) {
  if (wanted == exposure) return;
  exposure = wanted;
  recomposite = true;
  for (ClipVoice* voice : voices())
    if (voice != nullptr) voice->relighter()->set_exposure(exposure);
}

// What has changed since the last update, other than time, shows now.
Status Player::State::freshen() {
  return light_stale || recomposite ? show(playback->now(), true) : Status();
}

Status Player::draw(const gles::View& view, const Backdrop& backdrop) {
  if (!state_->device) return no_context();
  RELIT_TRY(state_->device->ready("drawing"));
  return catch_out_of_memory("drawing", [&] { return state_->draw(view, backdrop); });
}

Status Player::State::draw(const gles::View& view, const Backdrop& wanted) {
  const Clock::time_point begin = Clock::now();
  if (light->now().sh.empty()) light->sample(light_time_s);
  RELIT_TRY(set_backdrop(wanted));
  gles::CharacterRenderer& renderer = character->renderer();
  if (!moment.ready) return renderer.draw_background(view);
  use_exposure(std::isfinite(view.exposure) && view.exposure > 0 ? view.exposure : 0);
  RELIT_TRY(freshen());
  if (lit == nullptr) return renderer.draw_background(view);
  if (!positions_uploaded) {
    for (std::size_t m = 0; m < posed->count(); ++m)
      RELIT_TRY(renderer.update_positions(m, posed->positions(m)));
    positions_uploaded = true;
  }
  ++draws;
  if (wants_measuring(view)) return measure_path(view);
  RELIT_TRY(lit->relighter()->draw(renderer, view));
  const double took_s = seconds_since(begin);
  if (draws == 1) counted.first_draw_ms = 1e3 * took_s;
  draw_s.add(took_s);
  drawn_s += took_s;
  return {};
}

// Which path is cheapest for what is seen. Not during a fade, which comes and goes.
bool Player::State::wants_measuring(const gles::View& view) {
  if (draws <= kFirstMeasuring || secondary || lit != primary.get() ||
      primary_frames.from == nullptr || moment.late)
    return false;
  return primary->relighter()->wants_measuring(covered_pixels(view));
}

// This picture is drawn by the path whose turn it is. The governor is not told how long that took:
// it says nothing about the pictures to come.
Status Player::State::measure_path(const gles::View& view) {
  Relighter& relighter = *primary->relighter();
  RELIT_ASSIGN(const bool chosen,
               relighter.measure(primary_frames.mix(), character->renderer(), view));
  if (chosen) say(LogLevel::kInfo, "composite: " + relighter.why());
  return {};
}

// The area of the projected bounding box, within the view.
double Player::State::covered_pixels(const gles::View& view) const {
  const container::ClipRecord& clip = primary->prefetcher().clip();
  const glm::mat4 matrix = view.projection * view.view;
  glm::vec2 low(1.0f), high(-1.0f);
  for (unsigned corner = 0; corner < 8; ++corner) {
    glm::vec4 p(0, 0, 0, 1);
    for (unsigned axis = 0; axis < 3; ++axis)
      p[static_cast<int>(axis)] =
          (corner >> axis & 1u) != 0 ? clip.bounds_max[axis] : clip.bounds_min[axis];
    p = matrix * p;
    if (!(p.w > 0)) return static_cast<double>(view.width) * view.height;
    const glm::vec2 at = glm::clamp(glm::vec2(p) / p.w, -1.0f, 1.0f);
    low = glm::min(low, at), high = glm::max(high, at);
  }
  const glm::vec2 size = glm::max(high - low, 0.0f) * 0.5f;
  return static_cast<double>(size.x * size.y) * view.width * view.height;
}

Result<gles::LightMap> Player::light_map() {
  if (!state_->device) return no_context();
  if (!state_->moment.ready) return no_picture();
  RELIT_TRY(state_->device->ready("light map"));
  state_->use_exposure(0);
  RELIT_TRY(state_->freshen());
  if (state_->lit == nullptr) return no_picture();
  return state_->lit->relighter()->texture();
}

Status Player::read_light_map(std::span<float> out) {
  if (!state_->moment.ready) return no_picture();
  if (state_->device) RELIT_TRY(state_->device->ready("light map"));
  state_->use_exposure(0);
  RELIT_TRY(state_->freshen());
  if (state_->lit == nullptr) return no_picture();
  return state_->lit->relighter()->read(out);
}

Player::Size Player::light_map_size() const {
  const ClipVoice& voice = state_->lit != nullptr ? *state_->lit : *state_->primary;
  const Relighter& relighter = *voice.relighter();
  return {relighter.width(), relighter.height()};
}

Status Player::posed_vertices(std::size_t mesh, std::span<glm::vec3> positions,
                              std::span<glm::vec3> normals) {
  if (mesh >= meshes().size())
    return fail(ErrorCode::kNotFound, "mesh " + std::to_string(mesh) + ": the file has " +
                                          std::to_string(meshes().size()));
  const std::size_t count = meshes()[mesh].positions.size();
  if (positions.size() != count || (!normals.empty() && normals.size() != count))
    return fail(ErrorCode::kInvalid, "mesh " + std::to_string(mesh) + " has " +
                                         std::to_string(count) + " vertices, not " +
                                         std::to_string(positions.size()));
  if (state_->posed->empty()) return no_picture();
  const std::span<const glm::vec3> posed = state_->posed->positions(mesh);
  std::copy(posed.begin(), posed.end(), positions.begin());
  if (!normals.empty()) state_->posed->normals(mesh, normals);
  return {};
}

PlayerStats Player::stats() const { return state_->stats(); }

PlayerStats Player::State::stats() const {
  PlayerStats stats = counted;
  const Relighter& relighter = *primary->relighter();
  stats.loss = primary->prefetcher().loss();
  stats.prefetch = primary->prefetcher().stats();
  if (stats.prefetch.decoded_frames > 0)
    stats.decode_ms =
        1e3 * stats.prefetch.decode_s / static_cast<double>(stats.prefetch.decoded_frames);
  stats.composite_ms = 1e3 * composite_s.value();
  stats.pose_ms = 1e3 * pose_s.value();
  stats.draw_ms = 1e3 * draw_s.value();
  stats.composites = relighter.stats().composites;
  stats.planes_uploaded = relighter.stats().planes_uploaded;
  stats.gpu_bytes = relighter.gpu_bytes() + (character ? character->renderer().gpu_bytes() : 0);
  stats.quality = governor->value();
  stats.chosen = governor->quality();
  stats.path = relighter.path();
  const auto needed = relighter.needed_planes();
  stats.planes = static_cast<int>(std::count(needed.begin(), needed.end(), 1));
  stats.planes_of = static_cast<int>(needed.size());
  return stats;
}

}  // namespace relit::player
