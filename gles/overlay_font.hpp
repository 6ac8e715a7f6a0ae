// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

/// The overlay's typeface. Its letters are strokes and not pixels, so that they are as sharp at
/// two or three times the size; upright strokes lie on pixel centres, so that they are sharp at
/// one. All lengths are in points: one pixel at scale 1.
namespace relit::gles {

constexpr float kTextHeight = 16;    ///< from one line to the next
constexpr float kTextTop = 3;        ///< from the top of a line to the top of its capitals
constexpr float kTextBaseline = 13;  ///< from the top of a line to the foot of its letters

/// Takes the next character off UTF-8 text; what is not UTF-8 becomes U+FFFD, a byte at a time.
/// `text` must not be empty.
[[nodiscard]] char32_t next_character(std::string_view& text);

/// Where a glyph lies in a FontAtlas (texels), and where its upper left corner goes, from the pen
/// and the top of the line (pixels).
struct AtlasGlyph {
  std::uint16_t x = 0, y = 0, width = 0, height = 0;
  int left = 0, top = 0;
};

/// Printable ASCII and a few symbols (× ° · – … ← ↑ → ↓ ▶ ⏸); a frame stands for
/// everything else. Beside them a solid spot and two discs, of which the shapes are made.
class FontAtlas {
 public:
  static constexpr int kMaxScale = 4;
  static constexpr float kCornerRadius = 5, kKnobRadius = 7;

  /// Draws all glyphs at `scale` pixels a point, 1 to kMaxScale.
  explicit FontAtlas(int scale);

  [[nodiscard]] int scale() const { return scale_; }
  [[nodiscard]] int width() const { return width_; }    ///< texels
  [[nodiscard]] int height() const { return height_; }  ///< texels
  /// How much of each texel is inside, 255 being all: [height][width].
  [[nodiscard]] const std::vector<std::uint8_t>& coverage() const { return coverage_; }

  [[nodiscard]] const AtlasGlyph& glyph(char32_t character) const;
  [[nodiscard]] const AtlasGlyph& solid() const { return glyphs_[0]; }
  [[nodiscard]] const AtlasGlyph& corner_disc() const { return glyphs_[1]; }
  [[nodiscard]] const AtlasGlyph& knob_disc() const { return glyphs_[2]; }

  /// How far the pen goes for a character, points.
  [[nodiscard]] static float advance(char32_t character);

 private:
  AtlasGlyph& place(int width, int height);
  void draw_disc(float radius);

  int scale_, width_, height_ = 0;
  int pen_x_ = 0, pen_y_ = 0, row_height_ = 0;
  std::vector<AtlasGlyph> glyphs_;
  std::vector<std::uint8_t> coverage_;
};

}  // namespace relit::gles
