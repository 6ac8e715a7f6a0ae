// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "container/base/result.hpp"
#include "gles/view.hpp"
#include "player/player.hpp"
#include "player/scene_view.hpp"

namespace relit::player {

/// ViewOptions as what Player takes.
struct WindowLook {
  std::optional<double> exposure_stops;  ///< radiance × 2^stops; none: chosen by the light
  gles::ToneMap tone_map = gles::ToneMap::kNeutral;
  Backdrop backdrop;
};

/// Errors: kInvalid, naming the option and what it may be.
[[nodiscard]] Result<WindowLook> parse_look(const ViewOptions& options);

}  // namespace relit::player
