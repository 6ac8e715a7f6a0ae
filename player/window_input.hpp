// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>
#include <vector>

/// What keys, mouse and touch mean in the window, apart from any window system.
namespace relit::player {

/// Keys that are no characters; the others are named by what they type.
enum class Key {
  kOther,
  kEscape,
  kBackspace,
  kLeft,
  kRight,
  kHome,
  kEnd,
  kPageUp,
  kPageDown,
  kF1,
  kF2,
};

enum class MouseButton { kLeft, kMiddle, kRight };

struct Modifiers {
  bool shift = false, ctrl = false, alt = false;
};

enum class ActionKind {
  kQuit,
  kEscape,  ///< leaves panels and full screen
  kFullscreen,
  kPause,    ///< or go on
  kStep,     ///< amount: frames
  kSeekBy,   ///< amount: -1 or 1, of what seek_step_s() says
  kSeekTo,   ///< amount: 0..1 of the clip
  kSpeedBy,  ///< amount: a factor
  kSpeedReset,
  kExposureBy,  ///< amount: stops
  kLight,       ///< amount: -1 or 1, to the one before or the next
  kClip,        ///< likewise
  kPlanesBy,    ///< amount: -1 or 1
  kPlanesTo,    ///< amount: the first 1..9 planes; 0: all
  kPath,        ///< the next composite path
  kQualityBy,   ///< amount: -1 or 1, to the one before or the next
  kKeysPanel,
  kStatisticsPanel,
  kScreenshot,
  kResetCamera,
  kOrbit,      ///< amount, second: azimuth and elevation, degrees
  kPan,        ///< amount, second: of the window's height, right and up
  kZoom,       ///< amount: a factor of the distance
  kTurnLight,  ///< amount: radians
};

struct Action {
  ActionKind kind{};
  double amount = 0;
  double second = 0;
};

/// How far the arrow keys seek: 5 s as in mpv, less in clips that are short.
[[nodiscard]] double seek_step_s(double duration_s);

/// A key of the help panel, and its line of --help.
struct KeyHelp {
  const char* keys;
  const char* what;
};
/// All of them, in the order of the panel; an entry without keys begins a new group, `what` being
/// its title.
[[nodiscard]] const std::vector<KeyHelp>& key_help();

/// Where the controls lie, in the coordinates of the pointer; of width 0 while they are hidden.
struct ControlArea {
  float x = 0, y = 0, width = 0, height = 0;
  [[nodiscard]] bool contains(float at_x, float at_y) const {
    return at_x >= x && at_y >= y && at_x < x + width && at_y < y + height;
  }
};

/// Turns events into actions. Positions are in points of the window, y down. Actions are appended
/// to `out`.
class InputMap {
 public:
  /// The window's height in points, the scrub bar and the pause button.
  void set_layout(float height, const ControlArea& bar, const ControlArea& pause) {
    height_ = height, bar_ = bar, pause_ = pause;
  }

  /// A key that is no character, or a letter or the space bar with its modifiers (lower case,
  /// whatever the keyboard's shift or lock say).
  void key(Key key, Modifiers modifiers, std::vector<Action>& out);
  void letter(char32_t letter, Modifiers modifiers, bool repeat, std::vector<Action>& out);
  /// Typed text, as the layout makes it: figures and punctuation.
  void typed(std::string_view utf8, std::vector<Action>& out);

  /// `clicks`: 2 for the second press of a double click.
  void press(MouseButton button, float x, float y, int clicks, Modifiers modifiers,
             std::vector<Action>& out);
  void release(MouseButton button);
  void move(float x, float y, std::vector<Action>& out);
  /// Notches, positive away from the user.
  void wheel(double notches, std::vector<Action>& out);
  /// Two fingers: by how much their distance changed, of the window's size.
  void pinch(double change, std::vector<Action>& out);

  [[nodiscard]] bool dragging() const { return drag_ != Drag::kNone; }
  [[nodiscard]] bool scrubbing() const { return drag_ == Drag::kScrub; }

 private:
  enum class Drag { kNone, kOrbit, kPan, kLight, kScrub };
  [[nodiscard]] Action seek_to(float x) const;

  float height_ = 1;
  ControlArea bar_, pause_;
  Drag drag_ = Drag::kNone;
  MouseButton drag_button_{};
  float x_ = 0, y_ = 0;
};

/// When the pointer was last moved: the controls show for a while, and in full screen the pointer
/// hides after it. Times are seconds of one monotonic clock.
class PointerRest {
 public:
  static constexpr double kRest = 2.0, kFade = 0.25;

  void moved(double now_s) { last_s_ = now_s; }
  void left() { last_s_ = -1e9; }
  [[nodiscard]] bool resting(double now_s) const { return now_s - last_s_ >= kRest; }
  /// 1 while it moves, fading to 0 before it counts as resting.
  [[nodiscard]] float visibility(double now_s) const;

 private:
  double last_s_ = -1e9;
};

}  // namespace relit::player
