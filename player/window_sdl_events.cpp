// SPDX-License-Identifier: MIT
#include "player/window_sdl_events.hpp"

#include <SDL2/SDL.h>

namespace relit::player {
namespace {

Modifiers modifiers_of(unsigned state) {
  return {(state & KMOD_SHIFT) != 0, (state & KMOD_CTRL) != 0,
          (state & (KMOD_ALT | KMOD_MODE | KMOD_GUI)) != 0};
}

MouseButton button_of(Uint8 button) {
  if (button == SDL_BUTTON_MIDDLE) return MouseButton::kMiddle;
  return button == SDL_BUTTON_RIGHT ? MouseButton::kRight : MouseButton::kLeft;
}

Key key_of(SDL_Keycode code) {
  switch (code) {
    case SDLK_ESCAPE:
      return Key::kEscape;
    case SDLK_BACKSPACE:
      return Key::kBackspace;
    case SDLK_LEFT:
      return Key::kLeft;
    case SDLK_RIGHT:
      return Key::kRight;
    case SDLK_HOME:
      return Key::kHome;
    case SDLK_END:
      return Key::kEnd;
    case SDLK_PAGEUP:
      return Key::kPageUp;
    case SDLK_PAGEDOWN:
      return Key::kPageDown;
    case SDLK_F1:
      return Key::kF1;
    case SDLK_F2:
      return Key::kF2;
    default:
      return Key::kOther;
  }
}

bool is_button(Uint8 button) { return button >= SDL_BUTTON_LEFT && button <= SDL_BUTTON_RIGHT; }

}  // namespace

void SdlEvents::key(const SDL_KeyboardEvent& event, std::vector<Action>& out) {
  const SDL_Keycode code = event.keysym.sym;
  const Modifiers modifiers = modifiers_of(event.keysym.mod);
  if ((code >= SDLK_a && code <= SDLK_z) || code == SDLK_SPACE) {
    input_.letter(static_cast<char32_t>(code), modifiers, event.repeat != 0, out);
  } else {
    input_.key(key_of(code), modifiers, out);
  }
}

bool SdlEvents::translate(const SDL_Event& event, float points_per_unit, std::vector<Action>& out) {
  const auto points = [&](Sint32 units) { return static_cast<float>(units) * points_per_unit; };
  switch (event.type) {
    case SDL_KEYDOWN:
      key(event.key, out);
      return false;
    case SDL_TEXTINPUT:
      input_.typed(event.text.text, out);
      return false;
    case SDL_MOUSEBUTTONDOWN:
      if (is_button(event.button.button))
        input_.press(button_of(event.button.button), points(event.button.x), points(event.button.y),
                     event.button.clicks, modifiers_of(SDL_GetModState()), out);
      return true;
    case SDL_MOUSEBUTTONUP:
      if (is_button(event.button.button)) input_.release(button_of(event.button.button));
      return true;
    case SDL_MOUSEMOTION:
      input_.move(points(event.motion.x), points(event.motion.y), out);
      return true;
    case SDL_MOUSEWHEEL: {
      const float notches = event.wheel.preciseY;
      input_.wheel(
          static_cast<double>(event.wheel.direction == SDL_MOUSEWHEEL_FLIPPED ? -notches : notches),
          out);
      return false;
    }
    case SDL_MULTIGESTURE:
      if (event.mgesture.numFingers == 2)
        input_.pinch(static_cast<double>(event.mgesture.dDist), out);
      return false;
    default:
      return false;
  }
}

}  // namespace relit::player
