// SPDX-License-Identifier: MIT
#include "player/window_input.hpp"

#include <cmath>
#include <string>

#include "tests/test.hpp"

using namespace relit;
using namespace relit::player;

namespace {

// An input map over a window of 400 points' height, with a bar from 100 to 300 and a pause button.
struct Input {
  Input() { map.set_layout(400, {100, 350, 200, 40}, {0, 350, 40, 40}); }
  std::vector<Action> take() { return std::exchange(actions, {}); }
  Action only() {
    REQUIRE(actions.size() == 1);
    return take().front();
  }
  InputMap map;
  std::vector<Action> actions;
};

constexpr Modifiers kNone{}, kShift{true, false, false}, kCtrl{false, true, false},
    kAlt{false, false, true};

}  // namespace

TEST_CASE("letters act by themselves and shift turns them round") {
  Input in;
  struct Case {
    char32_t letter;
    ActionKind kind;
    double plain, shifted;
  };
  for (const Case& c :
       {Case{U'q', ActionKind::kQuit, 0, 0}, Case{U' ', ActionKind::kPause, 0, 0},
        Case{U'f', ActionKind::kFullscreen, 0, 0}, Case{U's', ActionKind::kScreenshot, 0, 0},
        Case{U'r', ActionKind::kResetCamera, 0, 0}, Case{U'l', ActionKind::kLight, 1, -1},
        Case{U'c', ActionKind::kClip, 1, -1}, Case{U'p', ActionKind::kPath, 1, -1},
        Case{U'v', ActionKind::kQualityBy, 1, -1},
        Case{U'i', ActionKind::kStatisticsPanel, 0, 0}}) {
    INFO(static_cast<char>(c.letter));
    in.map.letter(c.letter, kNone, false, in.actions);
    Action action = in.only();
    CHECK(action.kind == c.kind);
    CHECK(action.amount == c.plain);
    in.map.letter(c.letter, kShift, false, in.actions);
    action = in.only();
    CHECK(action.kind == c.kind);
    CHECK(action.amount == c.shifted);
    // A key that is held down does not flicker.
    in.map.letter(c.letter, kNone, true, in.actions);
    in.map.letter(c.letter, kAlt, false, in.actions);
    CHECK(in.take().empty());
  }
  in.map.letter(U'x', kNone, false, in.actions);
  CHECK(in.take().empty());
}

TEST_CASE("ctrl with C, Q and W quits, and other letters do nothing with it") {
  Input in;
  for (const char32_t letter : {U'c', U'q', U'w'}) {
    in.map.letter(letter, kCtrl, false, in.actions);
    CHECK(in.only().kind == ActionKind::kQuit);
  }
  in.map.letter(U's', kCtrl, false, in.actions);
  CHECK(in.take().empty());
}

TEST_CASE("typed characters step, set speed, exposure and planes on any keyboard") {
  Input in;
  in.map.typed(".,+-=[]{}<>?", in.actions);
  const std::vector<Action> actions = in.take();
  REQUIRE(actions.size() == 12);
  CHECK((actions[0].kind == ActionKind::kStep && actions[0].amount == 1));
  CHECK((actions[1].kind == ActionKind::kStep && actions[1].amount == -1));
  CHECK((actions[2].kind == ActionKind::kExposureBy && actions[2].amount == 0.25));
  CHECK((actions[3].kind == ActionKind::kExposureBy && actions[3].amount == -0.25));
  CHECK((actions[4].kind == ActionKind::kExposureBy && actions[4].amount == 0.25));
  // Down and up again is where it was.
  CHECK(actions[5].amount * actions[6].amount == Approx(1));
  CHECK((actions[6].kind == ActionKind::kSpeedBy && actions[6].amount == 1.1));
  CHECK((actions[7].kind == ActionKind::kSpeedBy && actions[7].amount == 0.5));
  CHECK((actions[8].kind == ActionKind::kSpeedBy && actions[8].amount == 2));
  CHECK((actions[9].kind == ActionKind::kClip && actions[9].amount == -1));
  CHECK((actions[10].kind == ActionKind::kClip && actions[10].amount == 1));
  CHECK(actions[11].kind == ActionKind::kKeysPanel);
  in.map.typed("9", in.actions);
  Action action = in.only();
  CHECK((action.kind == ActionKind::kPlanesTo && action.amount == 9));
  in.map.typed("0é", in.actions);
  action = in.only();
  CHECK((action.kind == ActionKind::kPlanesTo && action.amount == 0));
}

TEST_CASE("keys that are no characters") {
  Input in;
  struct Case {
    Key key;
    ActionKind kind;
    double amount;
  };
  for (const Case& c :
       {Case{Key::kEscape, ActionKind::kEscape, 0},
        Case{Key::kBackspace, ActionKind::kSpeedReset, 0},
        Case{Key::kLeft, ActionKind::kSeekBy, -1}, Case{Key::kRight, ActionKind::kSeekBy, 1},
        Case{Key::kHome, ActionKind::kSeekTo, 0}, Case{Key::kEnd, ActionKind::kSeekTo, 1},
        Case{Key::kPageUp, ActionKind::kPlanesBy, 1},
        Case{Key::kPageDown, ActionKind::kPlanesBy, -1}, Case{Key::kF1, ActionKind::kKeysPanel, 0},
        Case{Key::kF2, ActionKind::kStatisticsPanel, 0}}) {
    in.map.key(c.key, kNone, in.actions);
    const Action action = in.only();
    CHECK(action.kind == c.kind);
    CHECK(action.amount == c.amount);
  }
  in.map.key(Key::kRight, kShift, in.actions);
  CHECK(in.only().kind == ActionKind::kStep);
  in.map.key(Key::kOther, kNone, in.actions);
  in.map.key(Key::kF1, kAlt, in.actions);
  CHECK(in.take().empty());
}

TEST_CASE("drags orbit, pan and turn the light by button and modifier") {
  Input in;
  const auto drag = [&](MouseButton button, Modifiers modifiers) {
    in.map.press(button, 50, 50, 1, modifiers, in.actions);
    CHECK(in.take().empty());
    CHECK(in.map.dragging());
    in.map.move(90, 30, in.actions);
    const Action action = in.only();
    in.map.release(button);
    CHECK_FALSE(in.map.dragging());
    in.map.move(0, 0, in.actions);
    CHECK(in.take().empty());
    return action;
  };
  Action action = drag(MouseButton::kLeft, kNone);
  CHECK(action.kind == ActionKind::kOrbit);
  // The scene follows the hand: to the right the camera goes to the left.
  CHECK(action.amount == Approx(-16));
  CHECK(action.second == Approx(-8));
  for (const auto& [button, modifiers] :
       {std::pair(MouseButton::kMiddle, kNone), std::pair(MouseButton::kLeft, kCtrl)}) {
    action = drag(button, modifiers);
    CHECK(action.kind == ActionKind::kPan);
    CHECK(action.amount == Approx(0.1));
    CHECK(action.second == Approx(0.05));
  }
  for (const auto& [button, modifiers] :
       {std::pair(MouseButton::kRight, kNone), std::pair(MouseButton::kLeft, kShift)}) {
    action = drag(button, modifiers);
    CHECK(action.kind == ActionKind::kTurnLight);
    CHECK(action.amount == Approx(16 * 3.14159265 / 180));
  }
}

TEST_CASE("a drag belongs to the button that began it") {
  Input in;
  in.map.press(MouseButton::kLeft, 50, 50, 1, kNone, in.actions);
  in.map.press(MouseButton::kRight, 50, 50, 1, kNone, in.actions);
  in.map.release(MouseButton::kRight);
  in.map.move(60, 50, in.actions);
  CHECK(in.only().kind == ActionKind::kOrbit);
}

TEST_CASE("the scrub bar seeks when it is pressed and dragged, and not while it is hidden") {
  Input in;
  in.map.press(MouseButton::kLeft, 150, 360, 1, kNone, in.actions);
  Action action = in.only();
  CHECK((action.kind == ActionKind::kSeekTo && action.amount == 0.25));
  CHECK(in.map.scrubbing());
  // Beyond its ends it stays at them, wherever the hand goes.
  in.map.move(500, 10, in.actions);
  action = in.only();
  CHECK((action.kind == ActionKind::kSeekTo && action.amount == 1));
  in.map.move(0, 10, in.actions);
  CHECK(in.only().amount == 0);
  in.map.release(MouseButton::kLeft);
  CHECK_FALSE(in.map.scrubbing());
  in.map.press(MouseButton::kLeft, 20, 360, 2, kNone, in.actions);
  CHECK(in.only().kind == ActionKind::kPause);
  CHECK_FALSE(in.map.dragging());
  in.map.set_layout(400, {}, {});
  in.map.press(MouseButton::kLeft, 150, 360, 1, kNone, in.actions);
  CHECK(in.take().empty());
  CHECK_FALSE(in.map.scrubbing());
}

TEST_CASE("double clicks, wheels and pinches") {
  Input in;
  in.map.press(MouseButton::kLeft, 50, 50, 2, kNone, in.actions);
  CHECK(in.only().kind == ActionKind::kFullscreen);
  in.map.wheel(1, in.actions);
  const double nearer = in.only().amount;
  CHECK(nearer < 1);
  in.map.wheel(-1, in.actions);
  CHECK(in.only().amount * nearer == Approx(1));
  in.map.pinch(0.25, in.actions);
  CHECK(in.only().amount == Approx(0.5));
  in.map.wheel(0, in.actions);
  in.map.pinch(0, in.actions);
  CHECK(in.take().empty());
}

TEST_CASE("seeks are of five seconds, of a tenth in short clips") {
  CHECK(seek_step_s(3600) == 5);
  CHECK(seek_step_s(2.4) == Approx(0.24));
}

TEST_CASE("the controls fade after two seconds without a pointer that moves") {
  PointerRest pointer;
  CHECK(pointer.resting(0));
  CHECK(pointer.visibility(0) == 0);
  pointer.moved(10);
  CHECK_FALSE(pointer.resting(11.9));
  CHECK(pointer.visibility(10) == 1);
  CHECK(pointer.visibility(11.7) == 1);
  CHECK(pointer.visibility(11.875) == Approx(0.5));
  CHECK(pointer.resting(12));
  pointer.moved(20);
  pointer.left();
  CHECK(pointer.visibility(20) == 0);
}

TEST_CASE("every key has its line of help") {
  std::string text;
  for (const KeyHelp& entry : key_help()) {
    REQUIRE(entry.what != nullptr);
    if (entry.keys != nullptr) text += std::string(" ") + entry.keys;
  }
  for (const char* key :
       {"drag", "wheel",   "L",      "+", "R", "space", ".",  "home", "[",  "{", "backspace",
        "C",    "page up", "1 to 9", "P", "V", "F1",    "F2", "S",    "F,", "Q", "escape"}) {
    INFO(key);
    CHECK(text.find(std::string(" ") + key) != std::string::npos);
  }
}
