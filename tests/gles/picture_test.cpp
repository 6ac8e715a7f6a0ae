// SPDX-License-Identifier: MIT
#include "gles/picture.hpp"

#include "tests/gles/backends.hpp"
#include "tests/gles/drawing.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::gles;
using namespace relit::test;

namespace {

// Clears the lower left quarter of what is bound to one colour, the rest to another.
void paint(const Device& device, const Framebuffer& framebuffer) {
  const Functions& gl = device.gl();
  framebuffer.bind();
  gl.ClearColor(0, 0, 1, 1);
  gl.Clear(GL_COLOR_BUFFER_BIT);
  gl.Enable(GL_SCISSOR_TEST);
  gl.Scissor(0, 0, framebuffer.draw_width() / 2, framebuffer.draw_height() / 2);
  gl.ClearColor(0.2f, 0, 0, 0.4f);
  gl.Clear(GL_COLOR_BUFFER_BIT);
  gl.Disable(GL_SCISSOR_TEST);
  gl.BindFramebuffer(GL_FRAMEBUFFER, 0);
}

}  // namespace

TEST_CASE("pictures are read top row first, with any number of samples", "[gles][es2]") {
  on_each_backend([&](const Device& device, const Backend&) {
    for (const int samples : {1, 4, 16}) {
      auto framebuffer = Framebuffer::create(device, {10, 6, samples});
      if (!framebuffer) FAIL(framebuffer.error().message);
      paint(device, *framebuffer);
      REQUIRE(framebuffer->resolve());
      Picture picture{10, 6, std::vector<std::uint8_t>(4 * 10 * 6)};
      REQUIRE(framebuffer->read_back(picture.rgba));
      CHECK(picture.at(0, 0) == std::array<int, 4>{0, 0, 255, 255});
      CHECK(picture.at(9, 5) == std::array<int, 4>{0, 0, 255, 255});
      CHECK(picture.at(4, 3) == std::array<int, 4>{51, 0, 0, 102});
      CHECK(picture.at(5, 3) == std::array<int, 4>{0, 0, 255, 255});
      CHECK(picture.at(4, 2) == std::array<int, 4>{0, 0, 255, 255});
      // Straight alpha: 51/102 of 255, rounded.
      REQUIRE(framebuffer->read_back(picture.rgba, true));
      CHECK(picture.at(0, 5) == std::array<int, 4>{128, 0, 0, 102});
      CHECK_FALSE(framebuffer->read_back(std::span(picture.rgba).first(7)));
      CHECK(framebuffer->gpu_bytes() >= 4u * 10 * 6 * static_cast<unsigned>(samples));
    }
  });
}

TEST_CASE("pictures are presented to another framebuffer upright", "[gles][es2]") {
  on_each_backend([&](const Device& device, const Backend&) {
    auto source = Framebuffer::create(device, {10, 6, 4});
    auto target = Framebuffer::create(device, {20, 12, 1});
    REQUIRE(source);
    REQUIRE(target);
    paint(device, *source);
    REQUIRE(source->resolve());
    target->bind();
    GLint name = 0;
    device.gl().GetIntegerv(GL_FRAMEBUFFER_BINDING, &name);
    device.gl().BindFramebuffer(GL_FRAMEBUFFER, 0);
    REQUIRE(source->present(static_cast<GLuint>(name), 20, 12));
    Picture picture{20, 12, std::vector<std::uint8_t>(4 * 20 * 12)};
    REQUIRE(target->read_back(picture.rgba));
    CHECK(picture.at(1, 10) == std::array<int, 4>{51, 0, 0, 102});
    CHECK(picture.at(1, 1) == std::array<int, 4>{0, 0, 255, 255});
    CHECK(picture.at(18, 10) == std::array<int, 4>{0, 0, 255, 255});
  });
}

TEST_CASE("pictures of impossible sizes are refused", "[gles][es2]") {
  on_each_backend([&](const Device& device, const Backend&) {
    CHECK(Framebuffer::create(device, {0, 6, 1}).error().code == ErrorCode::kInvalid);
    CHECK(Framebuffer::create(device, {6, 6, 3}).error().code == ErrorCode::kInvalid);
    CHECK(Framebuffer::create(device, {1 << 20, 6, 1}).error().code == ErrorCode::kLimit);
  });
}
