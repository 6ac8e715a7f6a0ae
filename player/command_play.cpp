// SPDX-License-Identifier: MIT
#include <charconv>
#include <cstdio>

#include "player/command.hpp"
#include "player/window.hpp"

namespace relit::player {
namespace {

struct PlayArguments {
  SourceArguments source;
  std::string clips, camera, quality = "auto", composite = "auto", memory_budget;
  std::vector<std::string> lights;
  std::vector<float> at;
  LightArguments light;
  WindowOptions window;
  bool loop = false, no_loop = false, no_interpolation = false;
};

Result<std::optional<double>> parse_quality(const std::string& text) {
  if (text == "auto") return std::optional<double>();
  double quality = 0;
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, quality);
  if (error == std::errc() && rest == end && quality >= 0 && quality <= 1)
    return std::optional<double>(quality);
  return fail(ErrorCode::kInvalid, "--quality " + text + ": it must be auto, or from 0 to 1");
}

Status read_player_options(const PlayArguments& arguments, WindowOptions& window) {
  PlayerOptions& player = window.player;
  RELIT_ASSIGN(player.path, parse_composite_path(arguments.composite));
  RELIT_ASSIGN(player.governor.quality, parse_quality(arguments.quality));
  if (!arguments.memory_budget.empty()) {
    RELIT_ASSIGN(player.memory_budget_bytes, parse_bytes(arguments.memory_budget));
  }
  player.interpolate = !arguments.no_interpolation;
  player.drawing = DrawingScale{};
  player.drawing->background_side = window.look.background == "light" ? 512 : 0;
  if (arguments.loop) window.loop = LoopMode::kOn;
  if (arguments.no_loop) window.loop = LoopMode::kOff;
  return {};
}

Result<WindowOptions> window_options(const PlayArguments& arguments) {
  WindowOptions window = arguments.window;
  window.source = arguments.source.name;
  window.reading.http_headers = arguments.source.http_headers;
  window.reading.warn = &warn;
  for (std::size_t from = 0; from < arguments.clips.size();) {
    const std::size_t comma = std::min(arguments.clips.find(',', from), arguments.clips.size());
    window.clips.push_back(arguments.clips.substr(from, comma - from));
    from = comma + 1;
  }
  if (!arguments.camera.empty()) {
    RELIT_ASSIGN(window.camera, parse_camera(arguments.camera));
  }
  if (!arguments.at.empty()) window.position = {arguments.at[0], arguments.at[1], arguments.at[2]};
  RELIT_TRY(read_player_options(arguments, window));
  for (const std::string& path : arguments.lights) {
    LightArguments one = arguments.light;
    one.path = path;
    RELIT_ASSIGN(LoadedLight light, load_light(one, 3));
    window.lights.push_back(std::move(light));
  }
  window.light.window = arguments.light.window;
  return window;
}

int run_play(const PlayArguments& arguments) {
  const auto window = window_options(arguments);
  if (!window) return report(window.error());
  const auto loss = play_in_window(*window);
  if (!loss) return report(loss.error());
  return report_loss(*loss);
}

void add_playback_options(Options command, PlayArguments& a) {
  command.add("--clip", a.clips, "by name or number; several, with commas between, are a sequence");
  command
      .add("--cross-fade", a.window.cross_fade_s,
           "over which the clips of a sequence blend, and those that C takes, seconds")
      .range(0.0, 3600.0);
  command.add("--start", a.window.start_s, "begin at this time, seconds").range(0.0, 1e9);
  command.add("--speed", a.window.speed, "1 is real time")
      .range(0.01, Playback::kLargestSpeed)
      .shows_default();
  Option loop = command.flag("--loop", a.loop,
                             "begin again at the end; by default the "
                             "clip says whether");
  command.flag("--no-loop", a.no_loop, "stand at the end").excludes(loop);
  command.flag("--no-interpolation", a.no_interpolation,
               "show frames as they are, and nothing in between");
}

void add_cost_options(Options command, PlayArguments& a) {
  command
      .add("--target-fps", a.window.player.governor.target_fps,
           "pictures a second that the quality is chosen for")
      .range(1.0, 1000.0)
      .shows_default();
  command.add("--quality", a.quality, "auto, or from 0 to 1").shows_default();
  command.add("--composite", a.composite, "who adds the planes up: auto, cpu, texture or fused")
      .shows_default();
  command.add("--layers", a.window.player.layers,
              "only the first so many layers: faster and less accurate");
  command.add("--threads", a.window.player.threads, "that decode; 0: one a processor")
      .range(0, 64)
      .shows_default();
  command.add("--memory-budget", a.memory_budget,
              "bytes, or such as 32MiB: plans to fit, or refuses");
}

}  // namespace

void add_play(CommandLine& line) {
  Options command = line.add("play", "play a clip in a window");
  const auto a = std::make_shared<PlayArguments>();
  add_source_options(command, a->source, "path, - or http(s)://; a pipe cannot loop");
  command
      .add("--light", a->lights, ".hdr, .exr (equirectangular) or .json; several are taken in turn")
      .required();
  add_light_options(command, a->light);
  command
      .add("--at", a->at,
           "X,Y,Z: where the character stands in a light that varies with the place, metres")
      .delimiter(',')
      .expected(3, 3);
  add_look_options(command, a->window.look, a->camera);
  add_playback_options(command, *a);
  add_cost_options(command, *a);
  command.add("--width", a->window.width, "of the window").range(16, 16384).shows_default();
  command.add("--height", a->window.height, "of the window").range(16, 16384).shows_default();
  command.flag("--fullscreen", a->window.fullscreen, "begin in full screen");
  command
      .add("--ui-scale", a->window.ui_scale,
           "pixels a point of what is written over the picture; 0: by the display")
      .range(0, 4);
  command.flag("--es2", a->window.es2, "take OpenGL ES 2");
  command.add("--pictures", a->window.max_shown, "leave after so many pictures");
  command.footer(window_help());
  command.runs([a] { return run_play(*a); });
}

}  // namespace relit::player
