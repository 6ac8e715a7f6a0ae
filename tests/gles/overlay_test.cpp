// SPDX-License-Identifier: MIT
#include "gles/overlay.hpp"

#include "tests/gles/backends.hpp"
#include "tests/gles/drawing.hpp"
#include "tests/test.hpp"

namespace {

using namespace relit;
using namespace relit::gles;
using namespace relit::test;

using Pixel = std::array<int, 4>;

constexpr OverlayColor kWhite{255, 255, 255, 255}, kRed{255, 0, 0, 255};

// The canvas over a picture of one colour.
Picture show(const Device& device, Overlay& overlay, const OverlayCanvas& canvas, int width,
             int height, float gray = 0, float alpha = 1) {
  auto framebuffer = Framebuffer::create(device, {width, height, 1});
  if (!framebuffer) FAIL(framebuffer.error().message);
  framebuffer->bind();
  device.gl().ClearColor(gray, gray, gray, alpha);
  device.gl().Clear(GL_COLOR_BUFFER_BIT);
  if (const Status drawn = overlay.draw(canvas); !drawn) FAIL(drawn.error().message);
  Picture picture{width, height,
                  std::vector<std::uint8_t>(static_cast<std::size_t>(4 * width * height))};
  REQUIRE(framebuffer->read_back(picture.rgba));
  device.gl().BindFramebuffer(GL_FRAMEBUFFER, 0);
  return picture;
}

void on_each_overlay(const std::function<void(const Device&, Overlay&, OverlayCanvas&)>& body) {
  on_each_backend([&](const Device& device, const Backend&) {
    auto overlay = Overlay::create(device);
    if (!overlay) FAIL(overlay.error().message);
    OverlayCanvas canvas;
    body(device, **overlay, canvas);
  });
}

}  // namespace

TEST_CASE("the overlay draws letters where and as large as they are asked for", "[gles][es2]") {
  on_each_overlay([](const Device& device, Overlay& overlay, OverlayCanvas& canvas) {
    for (const int scale : {1, 2, 3}) {
      INFO("scale " << scale);
      canvas.begin(24 * scale, 24 * scale, scale);
      // An L at (4, 2): its upright in column 4 from row 2 + 3 to 2 + 12, its foot in row 14.
      CHECK(canvas.text(4, 2, "L", kWhite) == 4.0f + 5 + 3);
      const Picture picture = show(device, overlay, canvas, 24 * scale, 24 * scale);
      const auto at = [&](int x, int y) {
        return picture.at(x * scale + scale / 2, y * scale + scale / 2)[0];
      };
      for (int y = 5; y <= 14; ++y) CHECK(at(4, y) == 255);
      for (int x = 4; x <= 9; ++x) CHECK(at(x, 14) == 255);
      // Two points off the strokes there is nothing.
      for (int y = 0; y < 24; ++y) {
        CHECK(at(2, y) == 0);
        CHECK(at(12, y) == 0);
      }
      for (int x = 6; x < 12; ++x) CHECK(at(x, 10) == 0);
      for (int x = 0; x < 24; ++x) {
        CHECK(at(x, 3) == 0);
        CHECK(at(x, 16) == 0);
      }
    }
  });
}

TEST_CASE("the overlay cuts text and shapes at its clip and at the picture", "[gles][es2]") {
  on_each_overlay([](const Device& device, Overlay& overlay, OverlayCanvas& canvas) {
    canvas.begin(32, 24, 1);
    canvas.rect({-10, -10, 200, 14}, kRed);
    canvas.clip(OverlayRect{8, 8, 8, 8});
    canvas.rect({0, 0, 32, 24}, kWhite);
    canvas.text(100, 100, "far away", kWhite);
    canvas.clip({});
    const Picture cut = show(device, overlay, canvas, 32, 24);
    for (int y = 0; y < 24; ++y)
      for (int x = 0; x < 32; ++x) {
        const bool inside = x >= 8 && x < 16 && y >= 8 && y < 16;
        const Pixel wanted = y < 4    ? Pixel{255, 0, 0, 255}
                             : inside ? Pixel{255, 255, 255, 255}
                                      : Pixel{0, 0, 0, 255};
        CHECK(cut.at(x, y) == wanted);
      }
    // Half an H: what is left of it is where it was.
    canvas.begin(32, 24, 1);
    canvas.text(4, 2, "H", kWhite);
    const Picture whole = show(device, overlay, canvas, 32, 24);
    canvas.begin(32, 24, 1);
    canvas.clip(OverlayRect{0, 0, 7, 9});
    canvas.text(4, 2, "H", kWhite);
    const Picture half = show(device, overlay, canvas, 32, 24);
    for (int y = 0; y < 24; ++y)
      for (int x = 0; x < 32; ++x)
        CHECK(half.at(x, y) == (x < 7 && y < 9 ? whole.at(x, y) : Pixel{0, 0, 0, 255}));
  });
}

TEST_CASE("the overlay blends over the picture and keeps alpha premultiplied", "[gles][es2]") {
  on_each_overlay([](const Device& device, Overlay& overlay, OverlayCanvas& canvas) {
    canvas.begin(16, 16, 1);
    canvas.rect({0, 0, 16, 16}, {255, 0, 0, 128});
    // 128/255 of red over 0.4, and over nothing. Eight bits round twice: 1.
    const Pixel over_gray = show(device, overlay, canvas, 16, 16, 0.4f).at(8, 8);
    CHECK(std::abs(over_gray[0] - 179) <= 1);
    CHECK(std::abs(over_gray[1] - 51) <= 1);
    CHECK(over_gray[3] == 255);
    const Pixel over_nothing = show(device, overlay, canvas, 16, 16, 0, 0).at(8, 8);
    CHECK(std::abs(over_nothing[0] - 128) <= 1);
    CHECK(std::abs(over_nothing[3] - 128) <= 1);
  });
}

TEST_CASE("the overlay's panels have round corners, its knobs are round", "[gles][es2]") {
  on_each_overlay([](const Device& device, Overlay& overlay, OverlayCanvas& canvas) {
    canvas.begin(64, 64, 2);
    canvas.panel({2, 2, 24, 12}, kWhite);
    canvas.knob(16, 24, kRed);
    const Picture picture = show(device, overlay, canvas, 64, 64);
    // The arc of 10 pixels' radius leaves the corner out, and nothing of the sides.
    for (const int x : {4, 51})
      for (const int y : {4, 27}) CHECK(picture.at(x, y)[1] == 0);
    CHECK(picture.at(4, 16)[1] == 255);
    CHECK(picture.at(51, 16)[1] == 255);
    CHECK(picture.at(28, 4)[1] == 255);
    CHECK(picture.at(28, 27)[1] == 255);
    CHECK(picture.at(8, 8)[1] == 255);
    // The overlap of two shapes would show where a panel is translucent.
    canvas.begin(64, 64, 2);
    canvas.panel({2, 2, 24, 12}, {255, 255, 255, 100});
    const Picture veil = show(device, overlay, canvas, 64, 64);
    for (int y = 4; y < 28; ++y)
      for (int x = 4; x < 52; ++x) CHECK(veil.at(x, y)[0] <= 100);
    for (int x = 14; x < 42; ++x) CHECK(veil.at(x, 14)[0] == 100);
    CHECK(picture.at(32, 48) == Pixel{255, 0, 0, 255});
    CHECK(picture.at(32 - 13, 48) == Pixel{255, 0, 0, 255});
    CHECK(picture.at(32 - 12, 48 - 12) == Pixel{0, 0, 0, 255});
  });
}

TEST_CASE("the overlay leaves GL as the device promises", "[gles][es2]") {
  on_each_overlay([](const Device& device, Overlay& overlay, OverlayCanvas& canvas) {
    const Functions& gl = device.gl();
    canvas.begin(16, 16, 1);
    canvas.text(0, 0, "x", kWhite);
    auto framebuffer = Framebuffer::create(device, {16, 16, 1});
    REQUIRE(framebuffer);
    framebuffer->bind();
    gl.Viewport(1, 2, 3, 4);
    REQUIRE(overlay.draw(canvas));
    GLint viewport[4] = {}, program = -1, buffer = -1, texture = -1, alignment = -1;
    gl.GetIntegerv(GL_VIEWPORT, viewport);
    gl.GetIntegerv(GL_CURRENT_PROGRAM, &program);
    gl.GetIntegerv(GL_ARRAY_BUFFER_BINDING, &buffer);
    gl.GetIntegerv(GL_TEXTURE_BINDING_2D, &texture);
    gl.GetIntegerv(GL_UNPACK_ALIGNMENT, &alignment);
    CHECK((viewport[0] == 1 && viewport[1] == 2 && viewport[2] == 3 && viewport[3] == 4));
    CHECK(program == 0);
    CHECK(buffer == 0);
    CHECK(texture == 0);
    CHECK(alignment == 4);
    CHECK(gl.IsEnabled(GL_BLEND) == GL_FALSE);
    // Nothing to draw is nothing done.
    canvas.begin(16, 16, 1);
    CHECK(overlay.draw(canvas));
    gl.BindFramebuffer(GL_FRAMEBUFFER, 0);
  });
}

TEST_CASE("characters come off UTF-8 text, and bytes that are none one at a time") {
  std::string_view text = "a×→\xF0\x9F\x98\x80\xE2\x96";
  std::vector<char32_t> characters;
  while (!text.empty()) characters.push_back(next_character(text));
  CHECK(characters == std::vector<char32_t>{U'a', U'×', U'→', U'\U0001F600', U'\uFFFD', U'\uFFFD'});
}

TEST_CASE("every letter has ink of its own within its cell") {
  for (const int scale : {1, 2, 4}) {
    const FontAtlas atlas(scale);
    std::vector<std::vector<std::uint8_t>> seen;
    std::vector<char32_t> characters{U'°', U'·', U'×', U'–', U'…',   U'←',
                                     U'↑', U'→', U'↓', U'▶', U'⏸', U'\uFFFD'};
    for (char32_t c = 33; c < 127; ++c) characters.push_back(c);
    for (const char32_t character : characters) {
      INFO("character " << static_cast<unsigned>(character) << " at scale " << scale);
      const AtlasGlyph& glyph = atlas.glyph(character);
      REQUIRE(glyph.x + glyph.width <= atlas.width());
      REQUIRE(glyph.y + glyph.height <= atlas.height());
      std::vector<std::uint8_t> ink;
      int darkest = 0, at_edge = 0;
      for (int y = 0; y < glyph.height; ++y)
        for (int x = 0; x < glyph.width; ++x) {
          const int value = atlas.coverage()[static_cast<std::size_t>(
              (glyph.y + y) * atlas.width() + glyph.x + x)];
          ink.push_back(static_cast<std::uint8_t>(value));
          darkest = std::max(darkest, value);
          if (x == 0 || y == 0 || x + 1 == glyph.width || y + 1 == glyph.height)
            at_edge = std::max(at_edge, value);
        }
      // A slanted stroke of 1.32 points passes within 0.35 of the middle of some pixel.
      CHECK(darkest >= 200);
      // A stroke of 1.32 points reaches 0.16 into the point of room around it.
      CHECK(at_edge <= 60);
      CHECK(std::find(seen.begin(), seen.end(), ink) == seen.end());
      seen.push_back(std::move(ink));
    }
    CHECK(&atlas.glyph(U'Ж') == &atlas.glyph(U'\uFFFD'));
  }
}

TEST_CASE("text is as wide as its letters, and figures are alike") {
  for (const char32_t digit : std::u32string_view(U"0123456789"))
    CHECK(FontAtlas::advance(digit) == FontAtlas::advance(U'0'));
  CHECK(OverlayCanvas::text_width("") == 0);
  CHECK(OverlayCanvas::text_width("LL") == 2 * (5.0f + 3) - 2);
  OverlayCanvas canvas;
  canvas.begin(100, 20, 1);
  canvas.text_right(90, 0, "L", {});
  // The foot of an L ends at the right edge of its last pixel.
  float right = 0;
  for (const auto& vertex : canvas.vertices()) right = std::max(right, vertex.x);
  CHECK(right == 92);  // and two points of room
}

TEST_CASE("a canvas allocates nothing once it has seen its largest picture") {
  OverlayCanvas canvas;
  const auto draw = [&] {
    canvas.begin(640, 480, 2);
    for (int i = 0; i < 40; ++i)
      canvas.text(0, static_cast<float>(i), "0123456789 0123456789 0123456789", {});
  };
  draw();
  const auto* first = canvas.vertices().data();
  const std::size_t capacity = canvas.vertices().capacity();
  for (int i = 0; i < 3; ++i) draw();
  CHECK(canvas.vertices().data() == first);
  CHECK(canvas.vertices().capacity() == capacity);
}

TEST_CASE("a canvas leaves out what is beyond its most shapes") {
  OverlayCanvas canvas;
  canvas.begin(64, 64, 1);
  for (std::size_t i = 0; i < OverlayCanvas::kMaxQuads + 10; ++i) canvas.rect({0, 0, 1, 1}, {});
  CHECK(canvas.vertices().size() == 6 * OverlayCanvas::kMaxQuads);
}
