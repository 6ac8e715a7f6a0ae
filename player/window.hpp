// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "player/clip_reader.hpp"
#include "player/light.hpp"
#include "player/scene_view.hpp"

namespace relit::player {

struct WindowOptions {
  ViewOptions view;
  int width = 960;
  int height = 720;
  bool es2 = false;             ///< an OpenGL ES 2 context, even where there is a later one
  std::uint64_t max_shown = 0;  ///< leave after so many pictures; 0: when the user does
  std::string title;
};

/// What the keys and the mouse do, for --help.
extern const char* const kWindowHelp;

/// Plays a clip in a window until the user leaves: real time, frames skipped when late, nothing
/// composited again while neither frame nor light changes. `lights` are taken in turn; at least
/// one. Errors: kEnvironment where there is no display or no GL, and what playback itself reports.
Status play_in_window(ClipReader& clip, std::span<const LoadedLight> lights,
                      const WindowOptions& options);

}  // namespace relit::player
