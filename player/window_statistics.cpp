// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdio>

#include "player/window_colors.hpp"
#include "player/window_overlay.hpp"

namespace relit::player {
namespace {

using gles::kTextHeight;
using gles::OverlayCanvas;
using gles::OverlayColor;
using gles::OverlayRect;

constexpr float kWidth = 348, kLabel = 84, kLine = 17;

// Writes the panel from top to bottom; with `measuring` it only counts how long it is.
class Column {
 public:
  Column(OverlayCanvas& canvas, float x, float y, bool measuring)
      : canvas_(canvas), x_(x), y_(y), measuring_(measuring) {}

  [[nodiscard]] float y() const { return y_; }
  void gap(float height) { y_ += height; }

  void title(std::string_view left, std::string_view right) {
    const float room = kWidth - 2 * kPanelPadding - OverlayCanvas::text_width(right) - 12;
    if (!measuring_) {
      canvas_.clip(OverlayRect{x_, y_, room, kTextHeight});
      canvas_.text(x_, y_, left, kAccent);
      canvas_.clip({});
      canvas_.text_right(right_edge(), y_, right, kDim);
    }
    y_ += kLine;
  }

  // A label, and a value that takes as many lines as it needs.
  void row(std::string_view label, std::string_view value, OverlayColor color = kText) {
    if (!measuring_) canvas_.text(x_, y_, label, kDim);
    if (value.empty()) y_ += kLine;
    while (!value.empty()) {
      const std::size_t length = fitting_line(value, kWidth - 2 * kPanelPadding - kLabel);
      if (!measuring_) canvas_.text(x_ + kLabel, y_, value.substr(0, length), color);
      value.remove_prefix(length);
      while (!value.empty() && value.front() == ' ') value.remove_prefix(1);
      y_ += kLine;
    }
  }

  // A label, a bar, and a value at the right.
  void bar(std::string_view label, double fraction, std::string_view value, OverlayColor color) {
    constexpr float kValue = 136;
    if (!measuring_) {
      canvas_.text(x_, y_, label, kDim);
      const float width = kWidth - 2 * kPanelPadding - kLabel - kValue;
      const OverlayRect track{x_ + kLabel, y_ + 6, width, 6};
      canvas_.rect(track, kTrack);
      const auto part = static_cast<float>(std::clamp(fraction, 0.0, 1.0));
      canvas_.rect({track.x, track.y, width * part, track.height}, color);
      canvas_.text_right(right_edge(), y_, value, kText);
    }
    y_ += kLine;
  }

  // Columns from the oldest to the newest; `line` of `most` is marked.
  void graph(const History& history, float most, float line, OverlayColor color) {
    constexpr float kHeight = 36;
    if (!measuring_) {
      const float column = (kWidth - 2 * kPanelPadding) / static_cast<float>(History::kLength);
      canvas_.rect({x_, y_, kWidth - 2 * kPanelPadding, kHeight}, kTrack);
      for (std::size_t i = 0; i < History::kLength; ++i) {
        const float value = history.back(History::kLength - 1 - i);
        const float height = kHeight * std::clamp(value / most, 0.0f, 1.0f);
        if (height <= 0) continue;
        canvas_.rect({x_ + static_cast<float>(i) * column, y_ + kHeight - height, column, height},
                     line > 0 && value > 1.5f * line ? kBad : color);
      }
      if (line > 0)
        canvas_.rect({x_, y_ + kHeight * (1 - line / most), kWidth - 2 * kPanelPadding, 1}, kAhead);
    }
    y_ += kHeight + 6;
  }

 private:
  [[nodiscard]] float right_edge() const { return x_ + kWidth - 2 * kPanelPadding; }

  OverlayCanvas& canvas_;
  float x_, y_;
  bool measuring_;
};

void write_playback(Column& column, const OverlayModel& model) {
  const WindowStatistics& s = *model.statistics;
  std::array<char, 160> text{};
  column.title(model.title, s.renderer);
  column.gap(4);
  std::snprintf(text.data(), text.size(), "%.1f of %.0f a second, %d × %d", s.pictures_per_s,
                s.target_per_s, s.width_px, s.height_px);
  column.row("pictures", text.data());
  std::snprintf(text.data(), text.size(), "%.*s, %.4g frames a second",
                static_cast<int>(model.clip.size()), model.clip.data(), s.clip_per_s);
  column.row("clip", text.data());
  column.row("light", s.light);
  column.row("path", s.path);
  if (!s.why.empty()) column.row("", s.why, kDim);
  column.row("quality", s.quality);
  column.row("planes", s.planes);
  std::snprintf(text.data(), text.size(), "%llu new, %llu repeated, %llu late",
                static_cast<unsigned long long>(s.shown),
                static_cast<unsigned long long>(s.repeated),
                static_cast<unsigned long long>(s.late));
  column.row("shown", text.data());
  std::snprintf(text.data(), text.size(), "%llu skipped, %llu damaged",
                static_cast<unsigned long long>(s.skipped),
                static_cast<unsigned long long>(s.lost));
  column.row("dropped", text.data(), s.lost != 0 ? kBad : kText);
}

void write_times(Column& column, const WindowStatistics& s) {
  std::array<char, 64> text{};
  const double target_ms = 1000 / std::max(s.target_per_s, 1.0);
  std::snprintf(text.data(), text.size(), "of %.1f ms", target_ms);
  column.title("Time", text.data());
  for (const WindowStatistics::Stage& stage : s.stages) {
    if (stage.name == nullptr) continue;
    std::snprintf(text.data(), text.size(), "%.2f ms", stage.ms);
    column.bar(stage.name, stage.ms / target_ms, text.data(), stage.ms > target_ms ? kBad : kGood);
  }
  column.gap(4);
  column.graph(s.picture_ms, static_cast<float>(3 * target_ms), static_cast<float>(target_ms),
               kGood);
}

void write_memory(Column& column, const WindowStatistics& s) {
  std::uint64_t most = 1;
  for (const WindowStatistics::Memory& memory : s.memory)
    most = std::max({most, memory.bytes, memory.limit_bytes});
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%u frames ahead", s.ring_frames);
  column.title("Memory", text.data());
  for (const WindowStatistics::Memory& memory : s.memory) {
    if (memory.name == nullptr) continue;
    std::array<char, 32> bytes{}, limit{};
    const std::string_view taken = format_bytes(memory.bytes, bytes);
    if (memory.limit_bytes != 0) {
      std::snprintf(text.data(), text.size(), "%.*s of %s", static_cast<int>(taken.size()),
                    taken.data(), format_bytes(memory.limit_bytes, limit).data());
    } else {
      std::snprintf(text.data(), text.size(), "%.*s", static_cast<int>(taken.size()), taken.data());
    }
    const std::uint64_t whole = memory.limit_bytes != 0 ? memory.limit_bytes : most;
    column.bar(memory.name, static_cast<double>(memory.bytes) / static_cast<double>(whole),
               text.data(), kAccent);
  }
  column.gap(4);
  column.graph(s.buffer, 1, 0, kAccent);
}

void write(Column& column, const OverlayModel& model) {
  write_playback(column, model);
  column.gap(8);
  write_times(column, *model.statistics);
  column.gap(8);
  write_memory(column, *model.statistics);
}

}  // namespace

OverlayRect draw_statistics_panel(OverlayCanvas& canvas, const OverlayModel& model) {
  OverlayRect panel;
  panel.width = kWidth;
  panel.x = std::max(canvas.width() - kPanelMargin - kWidth, 0.0f);
  panel.y = kPanelMargin;
  Column measured(canvas, panel.x + kPanelPadding, panel.y + kPanelPadding, true);
  write(measured, model);
  panel.height = measured.y() + kPanelPadding - panel.y;
  canvas.panel(panel, kPanel);
  Column column(canvas, panel.x + kPanelPadding, panel.y + kPanelPadding, false);
  write(column, model);
  return panel;
}

}  // namespace relit::player
