// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "gles/overlay_font.hpp"

namespace relit::gles {

/// Points from the upper left corner of the picture; a point is `scale` pixels.
struct OverlayRect {
  float x = 0, y = 0, width = 0, height = 0;

  [[nodiscard]] bool contains(float at_x, float at_y) const {
    return at_x >= x && at_y >= y && at_x < x + width && at_y < y + height;
  }
};

/// sRGB display values; alpha is not multiplied into them.
struct OverlayColor {
  std::uint8_t r = 255, g = 255, b = 255, a = 255;
};

/// Collects text and flat shapes as triangles for Overlay to draw; knows nothing of GL. Later
/// shapes cover earlier ones. Edges are put on whole pixels. After the first pictures nothing
/// allocates, unless one has more shapes than any before it. One thread at a time.
class OverlayCanvas {
 public:
  /// A corner of a triangle: pixels from the upper left, texels of the atlas, a colour.
  struct Vertex {
    float x = 0, y = 0;
    std::uint16_t u = 0, v = 0;
    OverlayColor color;
  };
  /// Two triangles each; what is drawn beyond so many is left out.
  static constexpr std::size_t kMaxQuads = 8192;

  OverlayCanvas();

  /// Begins a picture of so many pixels; `scale` is held between 1 and FontAtlas::kMaxScale, and
  /// letters are drawn anew when it changes.
  void begin(int width_px, int height_px, int scale);
  [[nodiscard]] float width() const { return width_; }    ///< points
  [[nodiscard]] float height() const { return height_; }  ///< points
  [[nodiscard]] int scale() const { return atlas_->scale(); }

  void rect(const OverlayRect& rect, OverlayColor color);
  /// With corners of FontAtlas::kCornerRadius, less where the rectangle is smaller.
  void panel(const OverlayRect& rect, OverlayColor color);
  /// A disc of FontAtlas::kKnobRadius around a point.
  void knob(float x, float y, OverlayColor color);
  /// A line of text whose top left corner is (x, y); returns where the next character would begin.
  float text(float x, float y, std::string_view utf8, OverlayColor color);
  /// The same, ending at `right`.
  void text_right(float right, float y, std::string_view utf8, OverlayColor color);
  /// Points; without the gap behind the last character.
  [[nodiscard]] static float text_width(std::string_view utf8);

  /// Cuts everything that follows to a rectangle; none: to the picture.
  void clip(const std::optional<OverlayRect>& rect);

  [[nodiscard]] const std::vector<Vertex>& vertices() const { return vertices_; }
  [[nodiscard]] const FontAtlas& atlas() const { return *atlas_; }

 private:
  struct Box {
    float left = 0, top = 0, right = 0, bottom = 0;
  };
  void add(Box at, Box texels, OverlayColor color);
  void add_solid(const Box& at, OverlayColor color);
  [[nodiscard]] float snap(float points) const;
  [[nodiscard]] Box pixels(const OverlayRect& rect) const;

  std::unique_ptr<FontAtlas> atlas_;
  float width_ = 0, height_ = 0;
  Box clip_;
  std::vector<Vertex> vertices_;
};

}  // namespace relit::gles
