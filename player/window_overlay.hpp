// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "gles/overlay_canvas.hpp"

/// What lies over the picture in the window, from plain numbers. Lengths are points.
namespace relit::player {

/// The last values of a figure, oldest first.
class History {
 public:
  static constexpr std::size_t kLength = 150;

  void add(float value) {
    values_[next_] = value;
    next_ = (next_ + 1) % kLength;
  }
  /// The newest is at 0.
  [[nodiscard]] float back(std::size_t age) const {
    return values_[(next_ + 2 * kLength - 1 - age) % kLength];
  }

 private:
  std::array<float, kLength> values_{};
  std::size_t next_ = 0;
};

/// For the panel of F2. Counts are since the clip was opened, times the means of about a second.
struct WindowStatistics {
  std::string renderer;  ///< what draws
  std::string light;
  std::string path;     ///< the composite path that runs
  std::string why;      ///< and why
  std::string quality;  ///< what the governor has decided, in words
  std::string planes;   ///< composited ones, likewise
  double pictures_per_s = 0;
  double target_per_s = 60;
  double clip_per_s = 0;  ///< frames of the clip a second
  int width_px = 0, height_px = 0;

  struct Stage {
    const char* name = nullptr;
    double ms = 0;
  };
  std::array<Stage, 6> stages{};  ///< those with a name

  struct Memory {
    const char* name = nullptr;
    std::uint64_t bytes = 0;
    std::uint64_t limit_bytes = 0;  ///< 0: none
  };
  std::array<Memory, 8> memory{};  ///< those with a name

  std::uint64_t shown = 0, repeated = 0, late = 0, skipped = 0, lost = 0;
  std::uint32_t ring_frames = 0;
  History picture_ms;  ///< from one picture to the next
  History buffer;      ///< how full the ring is, 0..1
};

/// Everything that is to be seen. Texts are borrowed.
struct OverlayModel {
  // Controls, along the bottom.
  float controls = 0;  ///< 0 hidden, 1 shown
  double time_s = 0, duration_s = 0;
  double buffered_s = 0;  ///< decoded ahead of time_s
  std::uint64_t frame = 0, frame_count = 0;
  double speed = 1;
  bool paused = false;

  // A message, in the upper left corner.
  float message_visibility = 0;
  std::string_view message;
  bool message_is_error = false;

  bool keys = false;
  const WindowStatistics* statistics = nullptr;  ///< null: no panel
  std::string_view title, clip;                  ///< for the panel
};

/// Where the controls lie in a window of so many points.
struct ControlLayout {
  gles::OverlayRect panel;
  gles::OverlayRect pause;  ///< what a click must hit
  gles::OverlayRect bar;    ///< likewise; its left and right ends are the clip's
};
[[nodiscard]] ControlLayout layout_controls(float width, float height);

/// Appends all that the model shows to a canvas that has begun its picture.
void draw_overlay(gles::OverlayCanvas& canvas, const OverlayModel& model);

/// Around panels and inside them, in points.
inline constexpr float kPanelMargin = 12, kPanelPadding = 12;

/// The panels by themselves: return the rectangle that they cover.
gles::OverlayRect draw_keys_panel(gles::OverlayCanvas& canvas);
gles::OverlayRect draw_statistics_panel(gles::OverlayCanvas& canvas, const OverlayModel& model);
gles::OverlayRect draw_message(gles::OverlayCanvas& canvas, const OverlayModel& model);

/// How much of `text` fits into a line of `width`: up to a blank where there is one. At least one
/// character.
[[nodiscard]] std::size_t fitting_line(std::string_view text, float width);

/// "1:05.20"; "1:02:03" from an hour on.
[[nodiscard]] std::string_view format_time(double time_s, std::array<char, 32>& room);
/// "3.4 MiB".
[[nodiscard]] std::string_view format_bytes(std::uint64_t bytes, std::array<char, 32>& room);

}  // namespace relit::player
