// SPDX-License-Identifier: MIT
#pragma once

#include <SDL2/SDL_events.h>

#include <vector>

#include "player/window_input.hpp"

namespace relit::player {

/// SDL's events as InputMap's.
class SdlEvents {
 public:
  /// Appends what the event means. Returns whether the pointer moved. `points_per_unit` goes from
  /// the window's coordinates to the overlay's points.
  bool translate(const SDL_Event& event, float points_per_unit, std::vector<Action>& out);

  [[nodiscard]] InputMap& input() { return input_; }

 private:
  void key(const SDL_KeyboardEvent& event, std::vector<Action>& out);

  InputMap input_;
};

}  // namespace relit::player
