// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include "container/base/result.hpp"
#include "gles/view.hpp"
#include "player/camera.hpp"
#include "player/player.hpp"

/// How the commands and the window show a clip.
namespace relit::player {

/// As the user said it.
struct LookOptions {
  std::string exposure = "auto";     ///< auto, or stops: radiance × 2^stops
  std::string tone_map = "neutral";  ///< neutral, filmic or linear
  std::string background = "light";  ///< light, sh, none or #rrggbb
  double background_blur_deg = 0;
};

struct Look {
  std::optional<double> exposure_stops;  ///< radiance × 2^stops; none: chosen by the light
  gles::ToneMap tone_map = gles::ToneMap::kNeutral;
  Backdrop backdrop;
};

/// Errors: kInvalid, naming the option and what it may be.
[[nodiscard]] Result<Look> parse_look(const LookOptions& options);

struct ViewSize {
  int width = 1, height = 1;  ///< pixels, at least 1
  [[nodiscard]] double aspect() const { return static_cast<double>(width) / height; }
};

/// The clip that a player shows, from a camera that circles its box.
[[nodiscard]] gles::View look_at(const Player& player, const Look& look, const OrbitCamera& camera,
                                 const ViewSize& size);

}  // namespace relit::player
