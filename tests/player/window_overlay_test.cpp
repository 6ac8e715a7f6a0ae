// SPDX-License-Identifier: MIT
#include "player/window_overlay.hpp"

#include <algorithm>
#include <string>

#include "tests/test.hpp"

using namespace relit;
using namespace relit::gles;
using namespace relit::player;

namespace {

// What the shapes from `first` on cover, points.
OverlayRect extent(const OverlayCanvas& canvas, std::size_t first = 0) {
  float left = 1e9f, top = 1e9f, right = -1e9f, bottom = -1e9f;
  for (std::size_t i = first; i < canvas.vertices().size(); ++i) {
    const OverlayCanvas::Vertex& v = canvas.vertices()[i];
    left = std::min(left, v.x), right = std::max(right, v.x);
    top = std::min(top, v.y), bottom = std::max(bottom, v.y);
  }
  const auto scale = static_cast<float>(canvas.scale());
  return {left / scale, top / scale, (right - left) / scale, (bottom - top) / scale};
}

bool covers(const OverlayRect& outer, const OverlayRect& inner) {
  // Letters have cells a little wider than their ink, which may reach over the padding's edge.
  constexpr float kCell = 2;
  return inner.x >= outer.x - kCell && inner.y >= outer.y - kCell &&
         inner.x + inner.width <= outer.x + outer.width + kCell &&
         inner.y + inner.height <= outer.y + outer.height + kCell;
}

WindowStatistics busy_statistics() {
  WindowStatistics s;
  s.renderer = "OpenGL ES 3, llvmpipe";
  s.light = "a light with a rather long name that goes on (2 of 3)";
  s.path = "texture, chosen by measuring";
  s.why =
      "texture: measured cpu 2.00 ms, texture 3.40 ms, fused 1.20 ms a frame, at 5000 covered "
      "pixels";
  s.quality = "auto, 1.00";
  s.planes = "27 of 27";
  s.stages[0] = {"decode", 3.2};
  s.stages[1] = {"draw", 40};
  s.memory[0] = {"ring", 3u << 20, 4u << 20};
  s.memory[1] = {"GPU", 999u << 20, 0};
  for (int i = 0; i < 200; ++i) s.picture_ms.add(static_cast<float>(i)), s.buffer.add(2);
  return s;
}

}  // namespace

TEST_CASE("times and bytes are written for people") {
  std::array<char, 32> room{};
  CHECK(format_time(0, room) == "0:00.00");
  CHECK(format_time(65.2, room) == "1:05.20");
  CHECK(format_time(2.3999, room) == "0:02.39");
  CHECK(format_time(-1, room) == "0:00.00");
  CHECK(format_time(3723.9, room) == "1:02:03");
  CHECK(format_bytes(17, room) == "17 B");
  CHECK(format_bytes(2048, room) == "2 KiB");
  CHECK(format_bytes(3u << 20, room) == "3.0 MiB");
}

TEST_CASE("lines break at blanks, and within a word that is too long") {
  const float width = OverlayCanvas::text_width("hello world");
  CHECK(fitting_line("hello world", width) == 11);
  CHECK(fitting_line("hello world", width - 1) == 5);
  CHECK(fitting_line("helloworld", OverlayCanvas::text_width("hello")) == 5);
  CHECK(fitting_line("hello", 0) == 1);
  CHECK(fitting_line("…", 0) == 3);
  CHECK(fitting_line("", 10) == 0);
}

TEST_CASE("a history gives back its last values") {
  History history;
  CHECK(history.back(0) == 0);
  for (int i = 0; i < 400; ++i) history.add(static_cast<float>(i));
  CHECK(history.back(0) == 399);
  CHECK(history.back(History::kLength - 1) == 400 - static_cast<float>(History::kLength));
}

TEST_CASE("the controls lie within windows of any size, the bar within the panel") {
  for (const float width : {120.0f, 320.0f, 559.0f, 560.0f, 960.0f, 3840.0f}) {
    const ControlLayout layout = layout_controls(width, 300);
    CHECK(covers({0, 0, width, 300}, layout.panel));
    CHECK(layout.bar.width >= 0);
    if (width >= 320) {
      CHECK(covers(layout.panel, layout.bar));
      CHECK(layout.bar.width > 0.3f * width);
      CHECK(layout.pause.x + layout.pause.width <= layout.bar.x);
    }
  }
}

TEST_CASE("panels are as large as what they hold, at every scale") {
  const WindowStatistics statistics = busy_statistics();
  OverlayModel model;
  model.statistics = &statistics;
  model.title = "a_file_with_a_name_that_is_much_too_long_for_the_panel_that_it_is_in.relit";
  model.clip = "walk";
  model.message =
      "several words that do not fit into one line of this message, and "
      "/a/path/without/any/blank/in/it/that/does/not/fit/into/one/line/either.relit";
  model.message_visibility = 1;
  OverlayCanvas canvas;
  for (const int scale : {1, 2}) {
    canvas.begin(960 * scale, 720 * scale, scale);
    CHECK(covers(draw_statistics_panel(canvas, model), extent(canvas)));
    canvas.begin(960 * scale, 720 * scale, scale);
    CHECK(covers(draw_keys_panel(canvas), extent(canvas)));
    canvas.begin(960 * scale, 720 * scale, scale);
    CHECK(covers(draw_message(canvas, model), extent(canvas)));
    canvas.begin(960 * scale, 720 * scale, scale);
    model.controls = 1;
    draw_overlay(canvas, model);
    CHECK(covers({0, 0, 960, 720}, extent(canvas)));
    model.controls = 0;
  }
  // In a small window they are cut, and nothing lies beyond it.
  canvas.begin(200, 100, 1);
  model.keys = true, model.controls = 1;
  draw_overlay(canvas, model);
  CHECK(covers({0, 0, 200, 100}, extent(canvas)));
}

TEST_CASE("statistics and message do not lie over each other") {
  const WindowStatistics statistics = busy_statistics();
  OverlayModel model;
  model.statistics = &statistics;
  model.message = std::string_view("exposure +0.25"), model.message_visibility = 1;
  OverlayCanvas canvas;
  canvas.begin(960, 720, 1);
  const OverlayRect panel = draw_statistics_panel(canvas, model);
  const OverlayRect message = draw_message(canvas, model);
  CHECK(message.x + message.width < panel.x);
}

TEST_CASE("nothing is drawn that is not to be seen") {
  OverlayCanvas canvas;
  canvas.begin(960, 720, 1);
  OverlayModel model;
  draw_overlay(canvas, model);
  CHECK(canvas.vertices().empty());
  model.message = "unseen";
  draw_overlay(canvas, model);
  CHECK(canvas.vertices().empty());
  model.message_visibility = 0.5f;
  draw_overlay(canvas, model);
  CHECK_FALSE(canvas.vertices().empty());
}

TEST_CASE("the knob is where the time is, and the part played before it") {
  OverlayModel model;
  model.controls = 1, model.duration_s = 10, model.frame_count = 500;
  OverlayCanvas canvas;
  const OverlayRect bar = layout_controls(960, 720).bar;
  for (const double time_s : {0.0, 2.5, 10.0, 25.0}) {
    model.time_s = time_s;
    canvas.begin(960, 720, 1);
    draw_overlay(canvas, model);
    // The knob is the only shape of the size of its disc.
    const auto side = 2 * FontAtlas::kKnobRadius;
    float middle = -1;
    for (std::size_t i = 0; i + 5 < canvas.vertices().size(); i += 6) {
      const auto& a = canvas.vertices()[i];
      const auto& b = canvas.vertices()[i + 2];
      if (b.x - a.x == side && b.y - a.y == side) middle = 0.5f * (a.x + b.x);
    }
    const auto part = static_cast<float>(std::min(time_s / 10, 1.0));
    CHECK(std::abs(middle - (bar.x + part * bar.width)) <= 1);
  }
}
