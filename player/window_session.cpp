// SPDX-License-Identifier: MIT
#include "player/window_session.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace relit::player {
namespace {

constexpr double kMessage_s = 1.8, kErrorMessage_s = 6, kMessageFade_s = 0.3;
// Shorter waits are not worth a word.
constexpr double kWaiting_s = 0.5, kOpening_s = 0.2;

}  // namespace

Result<std::unique_ptr<WindowSession>> WindowSession::create(const WindowOptions& options,
                                                             MakeDevice make_device) {
  std::unique_ptr<WindowSession> session(new WindowSession(options, std::move(make_device)));
  RELIT_ASSIGN(session->look_, parse_look(options.look));
  session->camera_ = options.camera;
  session->lights_ = options.lights;
  session->path_ = options.player.path;
  session->quality_ = options.player.governor.quality;
  RELIT_TRY(session->begin_opening(options.source, true));
  return session;
}

void WindowSession::say(std::string text, bool is_error) {
  message_ = std::move(text);
  message_is_error_ = is_error;
  message_until_s_ = now_s_ + (is_error ? kErrorMessage_s : kMessage_s);
  if (is_error) std::fprintf(stderr, "relit: %s\n", message_.c_str());
}

Status WindowSession::update(double now_s) {
  now_s_ = now_s;
  RELIT_TRY(take_opened());
  if (!ready()) return {};
  RELIT_TRY(player_->update(static_cast<std::int64_t>(now_s * 1e9)));
  const PlayerMoment& moment = player_->moment();
  changed_ = changed_ || moment.changed;
  if (moment.ready && !moment.late) {
    waiting_since_s_.reset();
  } else if (!waiting_since_s_) {
    waiting_since_s_ = now_s;
  }
  return {};
}

Status WindowSession::draw(int width, int height) {
  size_ = {width, height};
  gles::View view = look_at(*player_, look_, camera_, size_);
  view.exposure *= static_cast<float>(std::exp2(exposure_stops_));
  changed_ = false;
  return player_->draw(view, look_.backdrop);
}

const container::ClipRecord& WindowSession::clip() const {
  return player_->contents().clips[player_->moment().clip];
}

bool WindowSession::has_overlay() const {
  return statistics_ || opening() || std::max(message_until_s_, controls_until_s_) > now_s_ ||
         (waiting_since_s_ && now_s_ - *waiting_since_s_ > kWaiting_s);
}

double WindowSession::idle_s() const {
  if (!ready()) return 0.03;
  double idle = player_->moment().next_s.value_or(std::numeric_limits<double>::infinity());
  if (player_->moment().late || !player_->moment().ready) idle = std::min(idle, 0.01);
  if (opening() || std::max(message_until_s_, controls_until_s_) > now_s_)
    idle = std::min(idle, 0.03);
  return idle;
}

double WindowSession::overlay_period_s() const {
  // A message fades; numbers and what is waited for are read.
  if (message_until_s_ > now_s_) return 1.0 / 60;
  // A source that stalls says nothing new.
  const bool by_itself = opening() && !statistics_ && controls_until_s_ <= now_s_;
  if (by_itself && opening_text_ == opening_text()) return std::numeric_limits<double>::infinity();
  return 0.25;
}

std::string WindowSession::light_text() const {
  if (lights_.empty()) return "white";
  std::string text = lights_[light_].name;
  if (lights_.size() > 1)
    text += " (" + std::to_string(light_ + 1) + " of " + std::to_string(lights_.size()) + ")";
  return text;
}

int WindowSession::planes_of_clip() const {
  const container::ModelRecord* model = player_->model_of(player_->moment().clip);
  std::size_t planes = 0;
  for (const container::LayerRecord& layer : player_->contents().layers)
    if (model != nullptr && layer.model_id == model->id) planes += layer.planes.size();
  return static_cast<int>(planes);
}

std::string WindowSession::planes_text() const {
  const int of = planes_of_clip();
  return std::to_string(planes_ < 0 ? of : std::min(planes_, of)) + " of " + std::to_string(of) +
         " planes";
}

void WindowSession::fill(OverlayModel& model, WindowStatistics& statistics) const {
  model.keys = keys_;
  model.message_visibility = 0, model.message_is_error = false;
  opening_text_.clear();
  if (message_until_s_ > now_s_) {
    model.message = message_, model.message_is_error = message_is_error_;
    model.message_visibility = static_cast<float>((message_until_s_ - now_s_) / kMessageFade_s);
  } else if (opening() && (!opening_ || now_s_ - opening_->since_s > kOpening_s)) {
    opening_text_ = opening_text();
    model.message = opening_text_, model.message_visibility = 1;
  } else if (waiting_since_s_ && now_s_ - *waiting_since_s_ > kWaiting_s) {
    model.message = "waiting for data…", model.message_visibility = 1;
  }
  if (!ready()) return;
  const PlayerMoment& moment = player_->moment();
  const PlayerStats stats = player_->stats();
  const container::ClipRecord& shown = clip();
  const double clip_per_s =
      static_cast<double>(shown.frame_count) / std::max(container::duration_s(shown), 1e-9);
  model.time_s = moment.time_s;
  model.duration_s = player_->playback().duration_s();
  model.frame = moment.frame, model.frame_count = shown.frame_count;
  const auto ahead = static_cast<double>(std::max<std::size_t>(stats.prefetch.ring_frames, 1) - 1);
  model.buffered_s = ahead / std::max(clip_per_s, 1e-9);
  model.speed = player_->playback().speed();
  model.paused = player_->playback().paused();
  model.title = title_, model.clip = shown.name;
  if (controls_until_s_ > now_s_)
    model.controls =
        std::max(model.controls, static_cast<float>((controls_until_s_ - now_s_) / kMessageFade_s));
  model.statistics = statistics_ ? &statistics : nullptr;
  if (!statistics_) return;
  statistics.clip_per_s = clip_per_s;
  fill_statistics(stats, statistics);
}

void WindowSession::fill_statistics(const PlayerStats& stats, WindowStatistics& statistics) const {
  statistics.light = light_text();
  statistics.target_per_s = options_.player.governor.target_fps;
  statistics.path = composite_path_name(stats.path);
  if (path_ == CompositePath::kAuto) {
    statistics.path += ", chosen by measuring";
    statistics.why = *why_;
  } else {
    statistics.path += ", asked for";
    statistics.why.clear();
  }
  char text[96];
  std::snprintf(text, sizeof text, "%s%.2f%s", quality_ ? "" : "auto, ", stats.quality,
                stats.chosen.half_size ? ", half size" : "");
  statistics.quality = text;
  // As chosen by the keys, and what the light and the quality need of them.
  std::snprintf(text, sizeof text, "%d of %d", stats.planes, stats.planes_of);
  statistics.planes = text;
  if (planes_ >= 0) statistics.planes += ", " + std::to_string(planes_) + " asked for";
  statistics.stages[0] = {"decode", stats.decode_ms};
  statistics.stages[1] = {"composite", stats.composite_ms};
  statistics.stages[2] = {"pose", stats.pose_ms};
  statistics.stages[3] = {"draw", stats.draw_ms};
  const MemoryPlan& plan = player_->plan();
  statistics.memory[0] = {"ring", stats.prefetch.ring_bytes, plan.ring_bytes};
  statistics.memory[1] = {"pictures", stats.prefetch.picture_bytes, 0};
  statistics.memory[2] = {"packets", stats.prefetch.packet_bytes, 0};
  statistics.memory[3] = {"GPU", stats.gpu_bytes, 0};
  const bool bounded = options_.player.memory_budget_bytes.has_value();
  statistics.memory[4] = {"poses", stats.prefetch.pose_bytes, 0};
  statistics.memory[5] = {"planned", plan.total_bytes(),
                          bounded ? *options_.player.memory_budget_bytes : 0};
  statistics.shown = stats.shown, statistics.repeated = stats.repeated;
  statistics.late = stats.late, statistics.skipped = stats.skipped_frames;
  statistics.lost = stats.loss.frames;
  statistics.ring_frames = static_cast<std::uint32_t>(stats.prefetch.ring_frames);
}

}  // namespace relit::player
