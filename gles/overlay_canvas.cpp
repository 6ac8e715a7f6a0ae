// SPDX-License-Identifier: MIT
#include "gles/overlay_canvas.hpp"

#include <algorithm>
#include <cmath>

namespace relit::gles {

OverlayCanvas::OverlayCanvas() : atlas_(std::make_unique<FontAtlas>(1)) {
  vertices_.reserve(std::size_t{6} * 1024);
}

void OverlayCanvas::begin(int width_px, int height_px, int scale) {
  scale = std::clamp(scale, 1, FontAtlas::kMaxScale);
  if (scale != atlas_->scale()) atlas_ = std::make_unique<FontAtlas>(scale);
  width_ = static_cast<float>(width_px) / static_cast<float>(scale);
  height_ = static_cast<float>(height_px) / static_cast<float>(scale);
  vertices_.clear();
  clip({});
}

float OverlayCanvas::snap(float points) const {
  return std::round(points * static_cast<float>(atlas_->scale()));
}

OverlayCanvas::Box OverlayCanvas::pixels(const OverlayRect& rect) const {
  return {snap(rect.x), snap(rect.y), snap(rect.x + rect.width), snap(rect.y + rect.height)};
}

void OverlayCanvas::clip(const std::optional<OverlayRect>& rect) {
  const Box picture = pixels({0, 0, width_, height_});
  clip_ = rect ? pixels(*rect) : picture;
  clip_.left = std::max(clip_.left, picture.left), clip_.top = std::max(clip_.top, picture.top);
  clip_.right = std::min(clip_.right, picture.right);
  clip_.bottom = std::min(clip_.bottom, picture.bottom);
}

// Boxes are as large in texels as in pixels, or lie within one solid texel.
void OverlayCanvas::add(Box at, Box texels, OverlayColor color) {
  const bool solid = texels.left == texels.right;
  const auto cut = [solid](float& edge, float& texel, float to) {
    if (!solid) texel += to - edge;
    edge = to;
  };
  if (at.left < clip_.left) cut(at.left, texels.left, clip_.left);
  if (at.top < clip_.top) cut(at.top, texels.top, clip_.top);
  if (at.right > clip_.right) cut(at.right, texels.right, clip_.right);
  if (at.bottom > clip_.bottom) cut(at.bottom, texels.bottom, clip_.bottom);
  if (!(at.left < at.right) || !(at.top < at.bottom) || color.a == 0) return;
  if (vertices_.size() >= 6 * kMaxQuads) return;
  const auto vertex = [&](float x, float y, float u, float v) {
    vertices_.push_back(
        {x, y, static_cast<std::uint16_t>(u), static_cast<std::uint16_t>(v), color});
  };
  vertex(at.left, at.top, texels.left, texels.top);
  vertex(at.left, at.bottom, texels.left, texels.bottom);
  vertex(at.right, at.bottom, texels.right, texels.bottom);
  vertex(at.left, at.top, texels.left, texels.top);
  vertex(at.right, at.bottom, texels.right, texels.bottom);
  vertex(at.right, at.top, texels.right, texels.top);
}

void OverlayCanvas::add_solid(const Box& at, OverlayColor color) {
  const AtlasGlyph& solid = atlas_->solid();
  const auto u = static_cast<float>(solid.x), v = static_cast<float>(solid.y);
  add(at, {u, v, u, v}, color);
}

void OverlayCanvas::rect(const OverlayRect& rect, OverlayColor color) {
  add_solid(pixels(rect), color);
}

void OverlayCanvas::panel(const OverlayRect& rect, OverlayColor color) {
  const AtlasGlyph& disc = atlas_->corner_disc();
  const Box box = pixels(rect);
  const float radius =
      std::floor(std::min({0.5f * static_cast<float>(disc.width), 0.5f * (box.right - box.left),
                           0.5f * (box.bottom - box.top)}));
  if (!(radius > 0)) return add_solid(box, color);
  const auto u = static_cast<float>(disc.x), v = static_cast<float>(disc.y);
  const float end_u = u + static_cast<float>(disc.width),
              end_v = v + static_cast<float>(disc.height);
  const Box inner{box.left + radius, box.top + radius, box.right - radius, box.bottom - radius};
  add({box.left, box.top, inner.left, inner.top}, {u, v, u + radius, v + radius}, color);
  add({inner.right, box.top, box.right, inner.top}, {end_u - radius, v, end_u, v + radius}, color);
  add({box.left, inner.bottom, inner.left, box.bottom}, {u, end_v - radius, u + radius, end_v},
      color);
  add({inner.right, inner.bottom, box.right, box.bottom},
      {end_u - radius, end_v - radius, end_u, end_v}, color);
  add_solid({inner.left, box.top, inner.right, inner.top}, color);
  add_solid({box.left, inner.top, box.right, inner.bottom}, color);
  add_solid({inner.left, inner.bottom, inner.right, box.bottom}, color);
}

void OverlayCanvas::knob(float x, float y, OverlayColor color) {
  const AtlasGlyph& disc = atlas_->knob_disc();
  const auto side = static_cast<float>(disc.width);
  const float left = snap(x) - 0.5f * side, top = snap(y) - 0.5f * side;
  const auto u = static_cast<float>(disc.x), v = static_cast<float>(disc.y);
  add({left, top, left + side, top + side}, {u, v, u + side, v + side}, color);
}

float OverlayCanvas::text(float x, float y, std::string_view utf8, OverlayColor color) {
  const auto scale = static_cast<float>(atlas_->scale());
  float pen = snap(x);
  const float top = snap(y);
  while (!utf8.empty()) {
    const char32_t character = next_character(utf8);
    if (character != U' ') {
      const AtlasGlyph& glyph = atlas_->glyph(character);
      const float left = pen + static_cast<float>(glyph.left);
      const float upper = top + static_cast<float>(glyph.top);
      const auto u = static_cast<float>(glyph.x), v = static_cast<float>(glyph.y);
      const auto w = static_cast<float>(glyph.width), h = static_cast<float>(glyph.height);
      add({left, upper, left + w, upper + h}, {u, v, u + w, v + h}, color);
    }
    pen += FontAtlas::advance(character) * scale;
  }
  return pen / scale;
}

void OverlayCanvas::text_right(float right, float y, std::string_view utf8, OverlayColor color) {
  text(right - text_width(utf8), y, utf8, color);
}

float OverlayCanvas::text_width(std::string_view utf8) {
  float width = 0;
  while (!utf8.empty()) width += FontAtlas::advance(next_character(utf8));
  return width > 0 ? width - 2 : 0;
}

}  // namespace relit::gles
