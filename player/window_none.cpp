// SPDX-License-Identifier: MIT
// Stands in for window_sdl.cpp in a build without SDL2.
#include "player/window.hpp"

namespace relit::player {

const char* const kWindowHelp = "This relit was built without a window.";

Status play_in_window(ClipReader&, std::span<const LoadedLight>, const WindowOptions&) {
  return fail(ErrorCode::kEnvironment,
              "play: this relit was built without a window (RELIT_WINDOW=OFF); `relit render` "
              "writes pictures and films");
}

}  // namespace relit::player
