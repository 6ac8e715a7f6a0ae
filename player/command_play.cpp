// SPDX-License-Identifier: MIT
#include <filesystem>

#include "player/command.hpp"
#include "player/http_source.hpp"
#include "player/window.hpp"

namespace relit::player {
namespace {

struct Arguments {
  SourceArguments source;
  std::string clip, camera;
  std::vector<std::string> lights;
  LightArguments light;
  WindowOptions window;
  int threads = 1;
};

Status play(const Arguments& arguments, ClipReader& clip) {
  WindowOptions window = arguments.window;
  if (!arguments.camera.empty()) {
    RELIT_ASSIGN(window.view.camera, parse_camera(arguments.camera));
  }
  window.title = std::filesystem::path(arguments.source.name).filename().string();
  std::vector<LoadedLight> lights;
  for (const std::string& path : arguments.lights) {
    LightArguments one = arguments.light;
    one.path = path;
    RELIT_ASSIGN(LoadedLight light, load_light(one, 3));
    lights.push_back(std::move(light));
  }
  return play_in_window(clip, lights, window);
}

int run(const Arguments& arguments) {
  ClipOptions options;
  options.clip = arguments.clip, options.layers = arguments.window.view.layers,
  options.threads = arguments.threads;
  // What comes over a network is shown as soon as it can be, a disk is waited for.
  options.impatient = is_http_address(arguments.source.name);
  auto clip = open_clip(arguments.source, options);
  if (!clip) return report(clip.error());
  if (const Status status = play(arguments, *clip); !status) return report(status.error());
  return report_loss(clip->loss());
}

}  // namespace

Command add_play(CLI::App& app) {
  CLI::App* command = app.add_subcommand("play", "play a clip in a window");
  const auto a = std::make_shared<Arguments>();
  add_source_options(*command, a->source, "path, - or http(s)://; a pipe cannot loop");
  command
      ->add_option("--light", a->lights,
                   ".hdr, .exr (equirectangular) or .json; several are taken in turn")
      ->required();
  add_light_options(*command, a->light);
  add_view_options(*command, a->window.view, a->camera);
  command->add_option("--clip", a->clip, "by name or number");
  command->add_option("--layers", a->window.view.layers,
                      "only the first so many layers: faster and less accurate");
  command->add_option("--threads", a->threads, "of each decoder")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  command->add_option("--width", a->window.width, "of the window")
      ->check(CLI::Range(16, 16384))
      ->capture_default_str();
  command->add_option("--height", a->window.height, "of the window")
      ->check(CLI::Range(16, 16384))
      ->capture_default_str();
  command->add_flag("--es2", a->window.es2, "take OpenGL ES 2");
  command->add_option("--pictures", a->window.max_shown, "leave after so many pictures");
  command->footer(kWindowHelp);
  return [a] { return run(*a); };
}

}  // namespace relit::player
