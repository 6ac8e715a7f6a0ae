// SPDX-License-Identifier: MIT
#pragma once

#include "gles/overlay_canvas.hpp"

/// The colours of the window's overlay.
namespace relit::player {

constexpr gles::OverlayColor kPanel{14, 16, 20, 214};
constexpr gles::OverlayColor kText{236, 238, 241, 255};
constexpr gles::OverlayColor kDim{158, 166, 176, 255};
constexpr gles::OverlayColor kAccent{255, 186, 84, 255};
constexpr gles::OverlayColor kGood{112, 196, 168, 255};
constexpr gles::OverlayColor kBad{255, 118, 104, 255};
constexpr gles::OverlayColor kTrack{255, 255, 255, 46};
constexpr gles::OverlayColor kAhead{255, 255, 255, 92};

[[nodiscard]] inline gles::OverlayColor faded(gles::OverlayColor color, float visibility) {
  color.a = static_cast<std::uint8_t>(static_cast<float>(color.a) * visibility + 0.5f);
  return color;
}

}  // namespace relit::player
