// SPDX-License-Identifier: MIT
// What the user's actions do to a session.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "player/window_session.hpp"

namespace relit::player {
namespace {

constexpr double kSlowest = 0.01;
// Qualities that the key goes through; before the first one the governor chooses.
constexpr std::array kQualities{1.0, 0.75, 0.5, 0.25, 0.0};

template <class... Values>
std::string text_of(const char* format, Values... values) {
  char text[96];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

std::size_t around(std::size_t from, int way, std::size_t count) {
  const auto n = static_cast<long long>(count);
  return static_cast<std::size_t>((static_cast<long long>(from) + way + n) % n);
}

}  // namespace

void WindowSession::act(const Action& action) {
  if (const Status done = change(action); !done) say(done.error().message, true);
}

// What needs nothing to play.
Status WindowSession::change(const Action& action) {
  switch (action.kind) {
    case ActionKind::kQuit:
      requests_.quit = true;
      return {};
    case ActionKind::kEscape:
      if (opening() && ready()) {
        cancel_opening();
        say("opening cancelled");
      } else if (keys_ || statistics_) {
        keys_ = statistics_ = false;
      } else {
        requests_.escape = true;
      }
      return {};
    case ActionKind::kFullscreen:
      requests_.fullscreen = true;
      return {};
    case ActionKind::kKeysPanel:
      keys_ = !keys_;
      return {};
    default:
      return ready() ? change_player(action) : Status();
  }
}

Status WindowSession::change_player(const Action& action) {
  const int way = action.amount < 0 ? -1 : 1;
  const double duration_s = player_->playback().duration_s();
  switch (action.kind) {
    case ActionKind::kScreenshot:
      requests_.screenshot = true;
      return {};
    case ActionKind::kStatisticsPanel:
      statistics_ = !statistics_;
      return {};
    case ActionKind::kPause:
      // At the end there is nothing to go on with but the beginning.
      if (player_->moment().ended) {
        RELIT_TRY(player_->seek(0));
        player_->set_paused(false);
      } else {
        player_->set_paused(!player_->playback().paused());
      }
      say(player_->playback().paused() ? "⏸ paused" : "▶ playing");
      return {};
    case ActionKind::kStep:
      RELIT_TRY(player_->step(way));
      show_controls();
      return {};
    case ActionKind::kSeekBy:
      show_controls();
      return player_->seek(player_->moment().time_s + action.amount * seek_step_s(duration_s));
    case ActionKind::kSeekTo:
      show_controls();
      // The end is the last frame, also of what loops.
      return player_->seek(std::min(action.amount, 1 - 1e-6) * duration_s);
    case ActionKind::kSpeedBy:
      return change_speed(player_->playback().speed() * action.amount);
    case ActionKind::kSpeedReset:
      return change_speed(1);
    case ActionKind::kExposureBy:
      change_exposure(action.amount);
      return {};
    case ActionKind::kLight:
      return change_light(way);
    case ActionKind::kClip:
      return change_clip(way);
    case ActionKind::kPlanesBy:
    case ActionKind::kPlanesTo:
      return change_planes(action);
    case ActionKind::kPath:
      return change_path(way);
    case ActionKind::kQualityBy:
      return change_quality(way);
    case ActionKind::kTurnLight:
      light_turn_rad_ = std::remainder(light_turn_rad_ + action.amount, 6.283185307179586);
      return player_->turn_light(light_turn_rad_);
    case ActionKind::kResetCamera:
    case ActionKind::kOrbit:
    case ActionKind::kPan:
    case ActionKind::kZoom:
      move_camera(action);
      return {};
    default:
      return {};
  }
}

void WindowSession::move_camera(const Action& action) {
  const auto& low = clip().bounds_min;
  const auto& high = clip().bounds_max;
  const glm::vec3 from(low[0], low[1], low[2]), to(high[0], high[1], high[2]);
  const double fitting = fitting_distance(camera_, from, to, size_.aspect());
  if (camera_.distance <= 0) camera_.distance = fitting;
  switch (action.kind) {
    case ActionKind::kOrbit:
      orbit(camera_, action.amount, action.second);
      break;
    case ActionKind::kPan:
      pan(camera_, action.amount, action.second);
      break;
    case ActionKind::kZoom:
      camera_.distance = std::clamp(camera_.distance * action.amount, 0.02 * fitting, 50 * fitting);
      break;
    default:
      camera_ = options_.camera;
      say("camera reset");
      break;
  }
  changed_ = true;
}

void WindowSession::change_exposure(double stops) {
  exposure_stops_ = std::clamp(exposure_stops_ + stops, -20.0, 20.0);
  changed_ = true;
  say(text_of("exposure %+.2f", exposure_stops_ + look_.exposure_stops.value_or(0)));
}

Status WindowSession::change_speed(double speed) {
  // Back to exactly 1 by the factors of the keys.
  if (std::abs(speed - 1) < 0.01) speed = 1;
  RELIT_TRY(player_->set_speed(std::clamp(speed, kSlowest, Playback::kLargestSpeed)));
  say(text_of("speed %.2f×", player_->playback().speed()));
  return {};
}

Status WindowSession::change_light(int way) {
  if (lights_.size() < 2) {
    say("light: " + light_text() + ", the only one");
    return {};
  }
  const std::size_t next = around(light_, way, lights_.size());
  RELIT_TRY(player_->set_light(lights_[next]));
  light_ = next;
  light_turn_rad_ = 0;
  RELIT_TRY(player_->turn_light(0));
  say("light: " + light_text());
  return {};
}

Status WindowSession::change_clip(int way) {
  const auto& clips = player_->contents().clips;
  if (clips.size() < 2) {
    say("clip: " + clip().name + ", the only one");
    return {};
  }
  const std::size_t next = around(player_->moment().clip, way, clips.size());
  RELIT_TRY(player_->play_clip(next, options_.cross_fade_s));
  say("clip: " + clips[next].name);
  return {};
}

Status WindowSession::change_path(int way) {
  const auto next = static_cast<CompositePath>(
      around(static_cast<std::size_t>(path_), way, static_cast<std::size_t>(kCompositePaths)));
  RELIT_TRY(player_->set_path(next));
  path_ = next;
  changed_ = true;
  say(std::string("path: ") + composite_path_name(path_));
  return {};
}

Status WindowSession::change_quality(int way) {
  // 0: the governor.
  std::size_t now = 0;
  for (std::size_t i = 0; i < kQualities.size(); ++i)
    if (quality_ && *quality_ <= kQualities[i]) now = i + 1;
  const std::size_t next = around(now, way, kQualities.size() + 1);
  const std::optional<double> wanted =
      next == 0 ? std::nullopt : std::optional<double>(kQualities[next - 1]);
  RELIT_TRY(player_->set_quality(wanted));
  quality_ = wanted;
  changed_ = true;
  say(quality_ ? text_of("quality: %.2f", *quality_) : "quality: auto");
  return {};
}

Status WindowSession::change_planes(const Action& action) {
  const int count = planes_of_clip();
  int wanted = planes_ < 0 ? count : std::min(planes_, count);
  if (action.kind == ActionKind::kPlanesTo) {
    wanted = action.amount == 0 ? count : static_cast<int>(action.amount);
  } else {
    wanted += action.amount < 0 ? -1 : 1;
  }
  wanted = std::clamp(wanted, 1, std::max(count, 1));
  planes_ = wanted == count ? -1 : wanted;
  player_->set_planes(planes_);
  changed_ = true;
  say(planes_text());
  return {};
}

}  // namespace relit::player
