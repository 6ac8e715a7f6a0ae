// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "player/camera.hpp"
#include "player/light.hpp"
#include "player/look.hpp"
#include "player/player.hpp"
#include "player/source.hpp"

namespace relit::player {

struct WindowOptions {
  std::string source;               ///< as open_source() takes it
  SourceOptions reading;            ///< how
  std::vector<LoadedLight> lights;  ///< taken in turn; none: white light
  LightOptions light;               ///< for those that are dropped into the window
  glm::vec3 position{0.0f};         ///< of the character in lights that vary with the place

  std::vector<std::string> clips;  ///< one, or a sequence, by name or number; empty: the first
  double cross_fade_s = 0;         ///< between the clips of a sequence, and when the user takes one
  LoopMode loop = LoopMode::kAsGiven;
  double start_s = 0;
  double speed = 1;

  LookOptions look;
  OrbitCamera camera;
  PlayerOptions player;  ///< its name, clip, interrupt and log are set by the window

  int width = 960;
  int height = 720;
  bool fullscreen = false;
  int ui_scale = 0;             ///< pixels a point of the overlay; 0: by the display
  bool es2 = false;             ///< an OpenGL ES 2 context, even where there is a later one
  std::uint64_t max_shown = 0;  ///< leave after so many pictures; 0: when the user does
};

/// What the keys and the mouse do, for --help.
[[nodiscard]] std::string window_help();

/// Plays a source in a window until the user leaves. Returns what was lost to damage in the file
/// that was shown last. Errors: kEnvironment where there is no display or no GL, those of opening
/// the source, and those that playback ended with. Errors of what the user drops into the window
/// are shown there.
Result<PlaybackLoss> play_in_window(const WindowOptions& options);

}  // namespace relit::player
