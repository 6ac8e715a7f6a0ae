// SPDX-License-Identifier: MIT
#include "player/window_overlay.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "player/window_colors.hpp"
#include "player/window_input.hpp"

namespace relit::player {
namespace {

using gles::kTextHeight;
using gles::OverlayCanvas;
using gles::OverlayRect;

}  // namespace

std::string_view format_time(double time_s, std::array<char, 32>& room) {
  // Hundredths are cut and not rounded: the last frame of 2.4 s is not at 2.40.
  const auto hundredths = static_cast<long long>(std::max(time_s, 0.0) * 100 + 1e-6);
  const long long seconds = hundredths / 100, minutes = seconds / 60;
  int length = 0;
  if (minutes >= 60) {
    length = std::snprintf(room.data(), room.size(), "%lld:%02lld:%02lld", minutes / 60,
                           minutes % 60, seconds % 60);
  } else {
    length = std::snprintf(room.data(), room.size(), "%lld:%02lld.%02lld", minutes, seconds % 60,
                           hundredths % 100);
  }
  return {room.data(), static_cast<std::size_t>(std::clamp(length, 0, 31))};
}

std::string_view format_bytes(std::uint64_t bytes, std::array<char, 32>& room) {
  const double value = static_cast<double>(bytes);
  int length = 0;
  if (bytes < 1024) {
    length = std::snprintf(room.data(), room.size(), "%d B", static_cast<int>(bytes));
  } else if (bytes < std::uint64_t{1} << 20) {
    length = std::snprintf(room.data(), room.size(), "%.0f KiB", value / 1024);
  } else {
    length = std::snprintf(room.data(), room.size(), "%.1f MiB", value / 1048576);
  }
  return {room.data(), static_cast<std::size_t>(std::clamp(length, 0, 31))};
}

std::size_t fitting_line(std::string_view text, float width) {
  std::string_view rest = text;
  float used = 0;
  std::size_t fits = 0, blank = 0;
  while (!rest.empty()) {
    const std::size_t at = text.size() - rest.size();
    const char32_t character = gles::next_character(rest);
    if (character == U' ') blank = at;
    used += gles::FontAtlas::advance(character);
    if (used - 2 > width && fits > 0) return blank > 0 ? blank : fits;
    fits = text.size() - rest.size();
  }
  return fits;
}

ControlLayout layout_controls(float width, float height) {
  ControlLayout layout;
  constexpr float kHeight = 40;
  layout.panel = {kPanelMargin, height - kPanelMargin - kHeight,
                  std::max(width - 2 * kPanelMargin, 0.0f), kHeight};
  layout.pause = {layout.panel.x, layout.panel.y, 36, kHeight};
  // A time of seven figures on the left; on the right it has the frame beside it where there is
  // room.
  const float left = layout.panel.x + 36 + 64;
  const float right = layout.panel.x + layout.panel.width - (width >= 560 ? 196.0f : 72.0f);
  layout.bar = {left, layout.panel.y, std::max(right - left, 0.0f), kHeight};
  return layout;
}

namespace {

void draw_controls(OverlayCanvas& canvas, const OverlayModel& model) {
  const float visibility = std::clamp(model.controls, 0.0f, 1.0f);
  const ControlLayout layout = layout_controls(canvas.width(), canvas.height());
  const auto color = [&](gles::OverlayColor of) { return faded(of, visibility); };
  canvas.panel(layout.panel, color(kPanel));
  const float line = layout.panel.y + 0.5f * (layout.panel.height - kTextHeight);
  canvas.text(layout.pause.x + 14, line, model.paused ? "▶" : "⏸", color(kText));

  std::array<char, 32> room{};
  canvas.text_right(layout.bar.x - 14, line, format_time(model.time_s, room), color(kText));
  const double duration_s = std::max(model.duration_s, 1e-9);
  const auto at = [&](double time_s) {
    return static_cast<float>(std::clamp(time_s / duration_s, 0.0, 1.0)) * layout.bar.width;
  };
  const float middle = layout.bar.y + 0.5f * layout.bar.height;
  const OverlayRect& bar = layout.bar;
  const float played = at(model.time_s), ahead = at(model.time_s + model.buffered_s);
  canvas.rect({bar.x, middle - 2, bar.width, 4}, color(kTrack));
  canvas.rect({bar.x + played, middle - 2, ahead - played, 4}, color(kAhead));
  canvas.rect({bar.x, middle - 2, played, 4}, color(kAccent));
  canvas.knob(bar.x + played, middle, color(kAccent));

  const float after = bar.x + bar.width + 14;
  float pen = canvas.text(after, line, format_time(model.duration_s, room), color(kDim));
  if (canvas.width() < 560) return;
  std::array<char, 48> frame{};
  std::snprintf(frame.data(), frame.size(), "%llu / %llu",
                static_cast<unsigned long long>(model.frame),
                static_cast<unsigned long long>(model.frame_count));
  canvas.text_right(layout.panel.x + layout.panel.width - 14, line, frame.data(), color(kText));
  if (std::abs(model.speed - 1) > 1e-6) {
    std::snprintf(frame.data(), frame.size(), "%.2f×", model.speed);
    canvas.text(pen + 6, line, frame.data(), color(kAccent));
  }
}

}  // namespace

OverlayRect draw_message(OverlayCanvas& canvas, const OverlayModel& model) {
  const float visibility = std::clamp(model.message_visibility, 0.0f, 1.0f);
  const float most =
      std::max(std::min(canvas.width() - 2 * (kPanelMargin + kPanelPadding), 520.0f), 40.0f);
  // Measured first, so that the panel lies below its text.
  float width = 0;
  int lines = 0;
  const auto each_line = [&](const auto& visit) {
    for (std::string_view rest = model.message; !rest.empty();) {
      const std::size_t length = fitting_line(rest, most);
      visit(rest.substr(0, length));
      rest.remove_prefix(length);
      while (!rest.empty() && rest.front() == ' ') rest.remove_prefix(1);
    }
  };
  each_line([&](std::string_view line) {
    width = std::max(width, OverlayCanvas::text_width(line));
    ++lines;
  });
  const OverlayRect panel{kPanelMargin, kPanelMargin, width + 2 * kPanelPadding,
                          static_cast<float>(lines) * kTextHeight + 14};
  canvas.panel(panel, faded(kPanel, visibility));
  float y = panel.y + 7;
  each_line([&](std::string_view line) {
    canvas.text(panel.x + kPanelPadding, y, line,
                faded(model.message_is_error ? kBad : kText, visibility));
    y += kTextHeight;
  });
  return panel;
}

OverlayRect draw_keys_panel(OverlayCanvas& canvas) {
  constexpr float kLine = 18, kColumn = 352, kWhat = 136, kGroupGap = 8;
  const std::vector<KeyHelp>& help = key_help();
  const bool two = canvas.width() >= 2 * kColumn + 2 * (kPanelMargin + kPanelPadding);
  // Where the second column begins: the group at which both are about as long.
  std::size_t split = help.size();
  if (two) {
    for (std::size_t i = help.size() / 2; i < help.size() && split == help.size(); ++i)
      if (help[i].keys == nullptr) split = i;
  }
  const auto length = [&](std::size_t from, std::size_t to) {
    float sum = 0;
    for (std::size_t i = from; i < to; ++i)
      sum += kLine + (help[i].keys == nullptr && i != from ? kGroupGap : 0);
    return sum;
  };
  const float rows = std::max(length(0, split), length(split, help.size()));
  OverlayRect panel;
  panel.width = (two ? 2 * kColumn : kColumn) + 2 * kPanelPadding;
  panel.height = rows + 2 * kPanelPadding;
  panel.x = std::max(0.5f * (canvas.width() - panel.width), 0.0f);
  panel.y = std::max(0.5f * (canvas.height() - panel.height), 0.0f);
  canvas.panel(panel, kPanel);
  float x = panel.x + kPanelPadding, y = panel.y + kPanelPadding;
  for (std::size_t i = 0; i < help.size(); ++i) {
    if (i == split) x += kColumn, y = panel.y + kPanelPadding;
    const KeyHelp& entry = help[i];
    if (entry.keys == nullptr) {
      if (i != 0 && i != split) y += kGroupGap;
      canvas.text(x, y, entry.what, kAccent);
    } else {
      canvas.text(x, y, entry.keys, kText);
      canvas.text(x + kWhat, y, entry.what, kDim);
    }
    y += kLine;
  }
  return panel;
}

void draw_overlay(OverlayCanvas& canvas, const OverlayModel& model) {
  if (model.statistics != nullptr) draw_statistics_panel(canvas, model);
  if (model.keys) draw_keys_panel(canvas);
  if (model.controls > 0) draw_controls(canvas, model);
  if (model.message_visibility > 0 && !model.message.empty()) draw_message(canvas, model);
}

}  // namespace relit::player
