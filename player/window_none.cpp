// SPDX-License-Identifier: MIT
// Stands in for window_sdl.cpp in a build without SDL2.
#include "player/window.hpp"

namespace relit::player {

std::string window_help() { return "This relit was built without a window."; }

Result<PlaybackLoss> play_in_window(const WindowOptions&) {
  return fail(ErrorCode::kEnvironment,
              "play: this relit was built without a window (RELIT_WINDOW=OFF); `relit render` "
              "writes pictures and films");
}

}  // namespace relit::player
