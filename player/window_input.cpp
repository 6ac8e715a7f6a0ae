// SPDX-License-Identifier: MIT
#include "player/window_input.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace relit::player {
namespace {

constexpr double kDegreesPerPoint = 0.4;
constexpr double kStopsPerKey = 0.25;
// mpv's factor of [ and ].
constexpr double kSpeedPerKey = 1.1;
constexpr double kZoomPerNotch = 0.9;

struct LetterBinding {
  char32_t letter;
  Action plain, shifted;
};

constexpr LetterBinding kLetters[] = {
    {U'q', {ActionKind::kQuit}, {ActionKind::kQuit}},
    {U' ', {ActionKind::kPause}, {ActionKind::kPause}},
    {U'f', {ActionKind::kFullscreen}, {ActionKind::kFullscreen}},
    {U's', {ActionKind::kScreenshot}, {ActionKind::kScreenshot}},
    {U'r', {ActionKind::kResetCamera}, {ActionKind::kResetCamera}},
    {U'p', {ActionKind::kPath, 1}, {ActionKind::kPath, -1}},
    {U'l', {ActionKind::kLight, 1}, {ActionKind::kLight, -1}},
    {U'c', {ActionKind::kClip, 1}, {ActionKind::kClip, -1}},
    {U'v', {ActionKind::kQualityBy, 1}, {ActionKind::kQualityBy, -1}},
    {U'i', {ActionKind::kStatisticsPanel}, {ActionKind::kStatisticsPanel}},
};

struct TypedBinding {
  char character;
  Action action;
};

constexpr TypedBinding kTyped[] = {
    {'.', {ActionKind::kStep, 1}},
    {',', {ActionKind::kStep, -1}},
    {'+', {ActionKind::kExposureBy, kStopsPerKey}},
    {'=', {ActionKind::kExposureBy, kStopsPerKey}},
    {'-', {ActionKind::kExposureBy, -kStopsPerKey}},
    {'_', {ActionKind::kExposureBy, -kStopsPerKey}},
    {'[', {ActionKind::kSpeedBy, 1 / kSpeedPerKey}},
    {']', {ActionKind::kSpeedBy, kSpeedPerKey}},
    {'{', {ActionKind::kSpeedBy, 0.5}},
    {'}', {ActionKind::kSpeedBy, 2}},
    {'<', {ActionKind::kClip, -1}},
    {'>', {ActionKind::kClip, 1}},
    {'?', {ActionKind::kKeysPanel}},
};

}  // namespace

double seek_step_s(double duration_s) { return std::min(5.0, duration_s / 10); }

const std::vector<KeyHelp>& key_help() {
  static const std::vector<KeyHelp> kHelp{
      {nullptr, "Camera and light"},
      {"drag", "orbit"},
      {"middle, ctrl+drag", "pan"},
      {"wheel, pinch", "nearer, farther"},
      {"right, shift+drag", "turn the light"},
      {"L   shift+L", "next, previous light"},
      {"+  -", "exposure, a quarter of a stop"},
      {"R", "reset the camera"},
      {nullptr, "Playback"},
      {"space", "pause"},
      {".  ,", "a frame on, back"},
      {"← →", "seek 5 s, or a tenth of the clip"},
      {"home  end", "to the start, the end"},
      {"[  ]   {  }", "speed ×1.1, ×2"},
      {"backspace", "normal speed"},
      {"C   shift+C", "next, previous clip"},
      {nullptr, "Speed and accuracy"},
      {"page up, down", "planes: one more, one less"},
      {"1 to 9, 0", "so many planes, all"},
      {"P   shift+P", "composite path"},
      {"V   shift+V", "quality"},
      {nullptr, "Window"},
      {"F1   F2 or I", "keys, statistics"},
      {"S", "screenshot"},
      {"F, double click", "full screen"},
      {"Q   escape", "quit, leave full screen"},
  };
  return kHelp;
}

void InputMap::key(Key key, Modifiers modifiers, std::vector<Action>& out) {
  if (modifiers.alt) return;
  switch (key) {
    case Key::kEscape:
      return out.push_back({ActionKind::kEscape});
    case Key::kBackspace:
      return out.push_back({ActionKind::kSpeedReset});
    case Key::kLeft:
    case Key::kRight: {
      const double way = key == Key::kLeft ? -1 : 1;
      return out.push_back({modifiers.shift ? ActionKind::kStep : ActionKind::kSeekBy, way});
    }
    case Key::kHome:
      return out.push_back({ActionKind::kSeekTo, 0});
    case Key::kEnd:
      return out.push_back({ActionKind::kSeekTo, 1});
    case Key::kPageUp:
      return out.push_back({ActionKind::kPlanesBy, 1});
    case Key::kPageDown:
      return out.push_back({ActionKind::kPlanesBy, -1});
    case Key::kF1:
      return out.push_back({ActionKind::kKeysPanel});
    case Key::kF2:
      return out.push_back({ActionKind::kStatisticsPanel});
    case Key::kOther:
      return;
  }
}

void InputMap::letter(char32_t letter, Modifiers modifiers, bool repeat, std::vector<Action>& out) {
  if (modifiers.alt || repeat) return;
  if (modifiers.ctrl) {
    if (letter == U'c' || letter == U'q' || letter == U'w') out.push_back({ActionKind::kQuit});
    return;
  }
  for (const LetterBinding& binding : kLetters) {
    if (binding.letter != letter) continue;
    out.push_back(modifiers.shift ? binding.shifted : binding.plain);
  }
}

void InputMap::typed(std::string_view utf8, std::vector<Action>& out) {
  for (const char character : utf8) {
    if (character >= '0' && character <= '9')
      out.push_back({ActionKind::kPlanesTo, static_cast<double>(character - '0')});
    for (const TypedBinding& binding : kTyped)
      if (binding.character == character) out.push_back(binding.action);
  }
}

Action InputMap::seek_to(float x) const {
  return {ActionKind::kSeekTo,
          std::clamp(static_cast<double>((x - bar_.x) / std::max(bar_.width, 1.0f)), 0.0, 1.0)};
}

void InputMap::press(MouseButton button, float x, float y, int clicks, Modifiers modifiers,
                     std::vector<Action>& out) {
  x_ = x, y_ = y;
  if (dragging()) return;
  if (button == MouseButton::kLeft) {
    if (pause_.contains(x, y)) return out.push_back({ActionKind::kPause});
    if (bar_.contains(x, y)) {
      drag_ = Drag::kScrub;
      out.push_back(seek_to(x));
    } else if (clicks == 2) {
      return out.push_back({ActionKind::kFullscreen});
    } else {
      drag_ = modifiers.shift ? Drag::kLight : modifiers.ctrl ? Drag::kPan : Drag::kOrbit;
    }
  } else {
    drag_ = button == MouseButton::kMiddle ? Drag::kPan : Drag::kLight;
  }
  drag_button_ = button;
}

void InputMap::release(MouseButton button) {
  if (dragging() && button == drag_button_) drag_ = Drag::kNone;
}

void InputMap::move(float x, float y, std::vector<Action>& out) {
  const double dx = static_cast<double>(x - x_), dy = static_cast<double>(y - y_);
  x_ = x, y_ = y;
  if (dx == 0 && dy == 0) return;
  const double height = static_cast<double>(std::max(height_, 1.0f));
  switch (drag_) {
    case Drag::kOrbit:
      return out.push_back({ActionKind::kOrbit, -kDegreesPerPoint * dx, kDegreesPerPoint * dy});
    case Drag::kPan:
      return out.push_back({ActionKind::kPan, dx / height, -dy / height});
    case Drag::kLight:
      return out.push_back(
          {ActionKind::kTurnLight, kDegreesPerPoint * dx * std::numbers::pi / 180});
    case Drag::kScrub:
      return out.push_back(seek_to(x));
    case Drag::kNone:
      return;
  }
}

void InputMap::wheel(double notches, std::vector<Action>& out) {
  if (notches != 0) out.push_back({ActionKind::kZoom, std::pow(kZoomPerNotch, notches)});
}

void InputMap::pinch(double change, std::vector<Action>& out) {
  // Fingers that go apart over a quarter of the window bring the character twice as near.
  if (change != 0) out.push_back({ActionKind::kZoom, std::exp2(-4 * change)});
}

float PointerRest::visibility(double now_s) const {
  const double left_s = kRest - (now_s - last_s_);
  return static_cast<float>(std::clamp(left_s / kFade, 0.0, 1.0));
}

}  // namespace relit::player
