// SPDX-License-Identifier: MIT
#include "player/window_session.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>

namespace relit::player {
namespace {

constexpr double kMessage_s = 1.8, kErrorMessage_s = 6, kMessageFade_s = 0.3;
// Shorter waits are not worth a word.
constexpr double kWaiting_s = 0.5;

std::string name_of(const std::string& source) {
  if (source == "-") return "standard input";
  std::string name = source.substr(0, source.find_first_of("?#"));
  name = std::filesystem::path(name).filename().string();
  return name.empty() ? source : name;
}

// By name, or by number.
Result<std::size_t> find_clip(const container::FileContents& contents, const std::string& wanted) {
  std::size_t number = contents.clips.size();
  const char* end = wanted.data() + wanted.size();
  const auto [rest, error] = std::from_chars(wanted.data(), end, number);
  std::string names;
  for (std::size_t i = 0; i < contents.clips.size(); ++i) {
    if (contents.clips[i].name == wanted) return i;
    names += (i == 0 ? "" : ", ") + contents.clips[i].name;
  }
  if (error == std::errc() && rest == end && number < contents.clips.size()) return number;
  return fail(ErrorCode::kNotFound, "no clip \"" + wanted + "\"; there are: " + names);
}

}  // namespace

Result<std::unique_ptr<WindowSession>> WindowSession::create(const WindowOptions& options,
                                                             MakeDevice make_device) {
  std::unique_ptr<WindowSession> session(new WindowSession(options, std::move(make_device)));
  RELIT_ASSIGN(session->look_, parse_look(options.look));
  session->camera_ = options.camera;
  session->lights_ = options.lights;
  session->path_ = options.player.path;
  session->quality_ = options.player.governor.quality;
  RELIT_ASSIGN(Opened opened, session->open(options.source, true));
  session->use(std::move(opened));
  return session;
}

// `as_asked`: with the clips, the start and the loop of the options, which are of their source.
Result<WindowSession::Opened> WindowSession::open(const std::string& source, bool as_asked) const {
  Opened opened;
  opened.title = name_of(source);
  opened.why = std::make_shared<std::string>();
  PlayerOptions player = options_.player;
  player.name = source == "-" ? "standard input" : source;
  player.clip = as_asked && options_.clips.size() == 1 ? options_.clips.front() : "";
  player.path = path_;
  player.governor.quality = quality_;
  player.interrupt = std::make_shared<Interrupt>();
  player.log = [why = opened.why](LogLevel level, const std::string& sentence) {
    constexpr std::string_view kPath = "composite: ";
    if (sentence.compare(0, kPath.size(), kPath) == 0) {
      *why = sentence.substr(kPath.size());
    } else if (level != LogLevel::kInfo) {
      std::fprintf(stderr, "relit: %s%s\n", level == LogLevel::kWarning ? "warning: " : "",
                   sentence.c_str());
    } else {
      std::fprintf(stderr, "relit: %s\n", sentence.c_str());
    }
  };
  SourceOptions reading = options_.reading;
  reading.sparing = player.layers >= 0;
  reading.interrupt = Interrupt::poll(player.interrupt);
  RELIT_ASSIGN(auto bytes, open_source(source, reading));
  RELIT_ASSIGN(opened.player, Player::open(std::move(bytes), player));
  RELIT_ASSIGN(auto device, make_device_());
  RELIT_TRY(opened.player->attach(std::move(device)));
  RELIT_TRY(start(*opened.player, as_asked));
  return opened;
}

Status WindowSession::start(Player& player, bool as_asked) const {
  if (!lights_.empty()) RELIT_TRY(player.set_light(lights_[light_]));
  RELIT_TRY(player.turn_light(light_turn_rad_));
  player.set_position(options_.position);
  if (!as_asked) return {};
  if (options_.clips.size() > 1) {
    std::vector<SequenceItem> items;
    for (const std::string& wanted : options_.clips) {
      SequenceItem item;
      RELIT_ASSIGN(item.clip, find_clip(player.contents(), wanted));
      item.cross_fade_s = options_.cross_fade_s;
      items.push_back(item);
    }
    RELIT_TRY(player.play_sequence(items, true));
  }
  if (options_.loop != LoopMode::kAsGiven) player.set_loop(options_.loop);
  if (options_.speed != 1) RELIT_TRY(player.set_speed(options_.speed));
  if (options_.start_s != 0) RELIT_TRY(player.seek(options_.start_s));
  return {};
}

void WindowSession::use(Opened opened) {
  player_ = std::move(opened.player);
  title_ = std::move(opened.title);
  why_ = std::move(opened.why);
  layers_ = options_.player.layers;
  changed_ = true;
}

void WindowSession::drop(const std::string& path) {
  const std::string end = std::filesystem::path(path).extension().string();
  const bool is_light = end == ".hdr" || end == ".exr" || end == ".json";
  if (!is_light) {
    auto opened = open(path, false);
    if (!opened) return say(opened.error().message, true);
    use(std::move(*opened));
    return say(title_);
  }
  auto light = load_light(path, options_.light);
  if (!light) return say(light.error().message, true);
  if (const Status set = player_->set_light(*light); !set) return say(set.error().message, true);
  lights_.push_back(std::move(*light));
  light_ = lights_.size() - 1;
  say("light: " + light_text());
}

void WindowSession::say(std::string text, bool is_error) {
  message_ = std::move(text);
  message_is_error_ = is_error;
  message_until_s_ = now_s_ + (is_error ? kErrorMessage_s : kMessage_s);
  if (is_error) std::fprintf(stderr, "relit: %s\n", message_.c_str());
}

Status WindowSession::update(double now_s) {
  now_s_ = now_s;
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
  return statistics_ || std::max(message_until_s_, controls_until_s_) > now_s_ ||
         (waiting_since_s_ && now_s_ - *waiting_since_s_ > kWaiting_s);
}

double WindowSession::idle_s() const {
  double idle = player_->moment().next_s.value_or(std::numeric_limits<double>::infinity());
  if (player_->moment().late || !player_->moment().ready) idle = std::min(idle, 0.01);
  if (std::max(message_until_s_, controls_until_s_) > now_s_) idle = std::min(idle, 0.03);
  return idle;
}

std::string WindowSession::light_text() const {
  if (lights_.empty()) return "white";
  std::string text = lights_[light_].name;
  if (lights_.size() > 1)
    text += " (" + std::to_string(light_ + 1) + " of " + std::to_string(lights_.size()) + ")";
  return text;
}

std::string WindowSession::planes_text() const {
  const container::ModelRecord* model = player_->model_of(player_->moment().clip);
  std::size_t layers = 0, planes = 0, planes_used = 0;
  for (const container::LayerRecord& layer : player_->contents().layers) {
    if (model == nullptr || layer.model_id != model->id) continue;
    if (layers_ < 0 || layers < static_cast<std::size_t>(layers_))
      planes_used += layer.planes.size();
    planes += layer.planes.size();
    ++layers;
  }
  const std::size_t used =
      layers_ < 0 ? layers : std::min(layers, static_cast<std::size_t>(layers_));
  return std::to_string(planes_used) + " of " + std::to_string(planes) + " planes, " +
         std::to_string(used) + " of " + std::to_string(layers) + " layers";
}

void WindowSession::fill(OverlayModel& model, WindowStatistics& statistics) const {
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
  model.keys = keys_;
  if (controls_until_s_ > now_s_)
    model.controls =
        std::max(model.controls, static_cast<float>((controls_until_s_ - now_s_) / kMessageFade_s));
  if (message_until_s_ > now_s_) {
    model.message = message_, model.message_is_error = message_is_error_;
    model.message_visibility = static_cast<float>((message_until_s_ - now_s_) / kMessageFade_s);
  } else if (waiting_since_s_ && now_s_ - *waiting_since_s_ > kWaiting_s) {
    model.message = "waiting for data…", model.message_is_error = false;
    model.message_visibility = 1;
  } else {
    model.message_visibility = 0;
  }
  model.statistics = statistics_ ? &statistics : nullptr;
  if (!statistics_) return;

  statistics.light = light_text();
  statistics.clip_per_s = clip_per_s;
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
  std::snprintf(text, sizeof text, "%s%.2f, %d of %d planes%s", quality_ ? "" : "auto, ",
                stats.quality, stats.planes, stats.planes_of,
                stats.chosen.half_size ? ", half size" : "");
  statistics.quality = text;
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
  statistics.memory[4] = {"planned", plan.total_bytes(),
                          bounded ? *options_.player.memory_budget_bytes : 0};
  statistics.shown = stats.shown, statistics.repeated = stats.repeated;
  statistics.late = stats.late, statistics.skipped = stats.skipped_frames;
  statistics.lost = stats.loss.frames;
  statistics.ring_frames = static_cast<std::uint32_t>(stats.prefetch.ring_frames);
}

}  // namespace relit::player
