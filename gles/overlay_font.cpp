// SPDX-License-Identifier: MIT
#include "gles/overlay_font.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <glm/glm.hpp>

#include "gles/overlay_glyphs.hpp"

namespace relit::gles {
namespace {

constexpr float kHalfStroke = 0.66f;
constexpr std::size_t kFirstGlyph = 3;  // after the solid spot and the two discs

std::size_t shape_index(char32_t character) {
  if (character >= 32 && character < 32 + kAsciiShapes) return character - 32;
  for (std::size_t i = kAsciiShapes; i < kGlyphShapes.size(); ++i)
    if (kGlyphShapes[i].character == character) return i;
  return kGlyphShapes.size() - 1;
}

struct Corner {
  glm::vec2 at{};
  bool round = false;
};

struct Stroke {
  std::vector<glm::vec2> line;
  bool filled = false;
};

// A rounded corner takes all of a side that ends sharp, half of one that does not: a parabola,
// which is a little fuller than a circle.
Stroke make_stroke(const std::vector<Corner>& corners, bool closed, bool filled) {
  constexpr int kSteps = 6;
  Stroke stroke;
  stroke.filled = filled;
  const std::size_t n = corners.size();
  for (std::size_t i = 0; i < n; ++i) {
    const bool end = !closed && (i == 0 || i + 1 == n);
    const glm::vec2 at = corners[i].at;
    if (!corners[i].round || end) {
      stroke.line.push_back(at);
      continue;
    }
    const Corner& before = corners[(i + n - 1) % n];
    const Corner& after = corners[(i + 1) % n];
    const auto room = [&](const Corner& other) {
      return glm::length(other.at - at) * (other.round ? 0.5f : 1.0f);
    };
    const float radius = std::min({room(before), room(after), 3.5f});
    const glm::vec2 from = at + radius * glm::normalize(before.at - at);
    const glm::vec2 to = at + radius * glm::normalize(after.at - at);
    for (int step = 0; step <= kSteps; ++step) {
      const float t = static_cast<float>(step) / kSteps;
      stroke.line.push_back((1 - t) * (1 - t) * from + 2 * t * (1 - t) * at + t * t * to);
    }
  }
  if (closed && !stroke.line.empty()) stroke.line.push_back(stroke.line.front());
  return stroke;
}

std::vector<Stroke> parse_strokes(const char* text) {
  std::vector<Stroke> strokes;
  std::vector<Corner> corners;
  bool closed = false, filled = false;
  const auto finish = [&] {
    if (!corners.empty()) strokes.push_back(make_stroke(corners, closed, filled));
    corners.clear();
    closed = filled = false;
  };
  const char* const end = text + std::strlen(text);
  Corner corner;
  while (text != end) {
    switch (*text) {
      case ' ':
        ++text;
        break;
      case '|':
        finish();
        ++text;
        break;
      case '~':
        corner.round = true;
        ++text;
        break;
      case 'f':
        filled = true;
        [[fallthrough]];
      case 'o':
        closed = true;
        ++text;
        break;
      default:
        text = std::from_chars(text, end, corner.at.x).ptr + 1;  // and the comma
        text = std::from_chars(text, end, corner.at.y).ptr;
        corners.push_back(corner);
        corner = {};
        break;
    }
  }
  finish();
  return strokes;
}

float distance_to(const glm::vec2& p, const glm::vec2& a, const glm::vec2& b) {
  const glm::vec2 along = b - a;
  const float squared = glm::dot(along, along);
  const float t = squared > 0 ? std::clamp(glm::dot(p - a, along) / squared, 0.0f, 1.0f) : 0.0f;
  return glm::length(p - a - t * along);
}

// The distance from a point to the ink, negative inside.
float distance_to(const std::vector<Stroke>& strokes, const glm::vec2& p) {
  float nearest = 1e9f;
  for (const Stroke& stroke : strokes) {
    bool inside = false;
    for (std::size_t i = 0; i + 1 < stroke.line.size(); ++i) {
      const glm::vec2 &a = stroke.line[i], &b = stroke.line[i + 1];
      nearest = std::min(nearest, distance_to(p, a, b) - kHalfStroke);
      if ((a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x))
        inside = !inside;
    }
    if (stroke.filled && inside) nearest = -1e9f;
  }
  return nearest;
}

std::uint8_t coverage_at(float distance_px) {
  return static_cast<std::uint8_t>(std::clamp(0.5f - distance_px, 0.0f, 1.0f) * 255 + 0.5f);
}

}  // namespace

char32_t next_character(std::string_view& text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned first = byte(0);
  const std::size_t length = first < 0x80                    ? 1
                             : first >= 0xC2 && first < 0xE0 ? 2
                             : first >= 0xE0 && first < 0xF0 ? 3
                             : first >= 0xF0 && first < 0xF5 ? 4
                                                             : 0;
  bool valid = length != 0 && length <= text.size();
  char32_t character = length <= 1 ? first : first & (0x7Fu >> length);
  for (std::size_t i = 1; valid && i < length; ++i) {
    valid = (byte(i) & 0xC0u) == 0x80u;
    character = (character << 6) | (byte(i) & 0x3Fu);
  }
  text.remove_prefix(valid ? length : 1);
  return valid ? character : kUnknownShape;
}

float FontAtlas::advance(char32_t character) {
  return kGlyphShapes[shape_index(character)].width + kGlyphGap;
}

const AtlasGlyph& FontAtlas::glyph(char32_t character) const {
  return glyphs_[kFirstGlyph + shape_index(character)];
}

FontAtlas::FontAtlas(int scale) : scale_(scale), width_(128 * scale) {
  glyphs_.reserve(kFirstGlyph + kGlyphShapes.size());
  AtlasGlyph& solid = place(3, 3);
  for (int y = 0; y < 3; ++y)
    std::fill_n(coverage_.begin() + (solid.y + y) * width_ + solid.x, 3, std::uint8_t{255});
  // Drawn from its middle, so that no neighbour is ever near.
  solid.x = static_cast<std::uint16_t>(solid.x + 1),
  solid.y = static_cast<std::uint16_t>(solid.y + 1);
  solid.width = solid.height = 1;
  draw_disc(kCornerRadius);
  draw_disc(kKnobRadius);
  const auto s = static_cast<float>(scale);
  for (const GlyphShape& shape : kGlyphShapes) {
    // Room for the strokes to be wide and slanted: a point before and below, two above and behind.
    AtlasGlyph& glyph = place((static_cast<int>(std::ceil(shape.width)) + 4) * scale, 16 * scale);
    glyph.left = -scale, glyph.top = (static_cast<int>(kTextTop) - 2) * scale;
    const std::vector<Stroke> strokes = parse_strokes(shape.strokes);
    if (strokes.empty()) continue;
    for (int y = 0; y < glyph.height; ++y) {
      std::uint8_t* row = coverage_.data() + (glyph.y + y) * width_ + glyph.x;
      for (int x = 0; x < glyph.width; ++x) {
        // Points count from the middle of the pixel at the pen.
        const glm::vec2 p((static_cast<float>(x) + 0.5f) / s - 1.5f,
                          (static_cast<float>(y) + 0.5f) / s - 2.5f);
        row[x] = coverage_at(distance_to(strokes, p) * s);
      }
    }
  }
}

// The next free place, with a texel of room around it.
AtlasGlyph& FontAtlas::place(int width, int height) {
  if (pen_x_ + width + 1 > width_) {
    pen_x_ = 0;
    pen_y_ += row_height_;
    row_height_ = 0;
  }
  row_height_ = std::max(row_height_, height + 1);
  height_ = std::max(height_, pen_y_ + row_height_);
  coverage_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  AtlasGlyph glyph;
  glyph.x = static_cast<std::uint16_t>(pen_x_), glyph.y = static_cast<std::uint16_t>(pen_y_);
  glyph.width = static_cast<std::uint16_t>(width);
  glyph.height = static_cast<std::uint16_t>(height);
  pen_x_ += width + 1;
  glyphs_.push_back(glyph);
  return glyphs_.back();
}

void FontAtlas::draw_disc(float radius) {
  const int side = static_cast<int>(2 * radius) * scale_;
  const AtlasGlyph& disc = place(side, side);
  const float middle = 0.5f * static_cast<float>(side);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const float distance =
          std::hypot(static_cast<float>(x) + 0.5f - middle, static_cast<float>(y) + 0.5f - middle);
      coverage_[static_cast<std::size_t>((disc.y + y) * width_ + disc.x + x)] =
          coverage_at(distance - middle);
    }
}

}  // namespace relit::gles
