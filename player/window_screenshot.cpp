// SPDX-License-Identifier: MIT
#include "player/window_screenshot.hpp"

#include <cstdio>
#include <filesystem>
#include <vector>

#include "gles/picture.hpp"
#include "player/picture_writer.hpp"

namespace relit::player {
namespace {

constexpr int kMostScreenshots = 9999;

Result<std::string> free_name() {
  for (int number = 1; number <= kMostScreenshots; ++number) {
    char name[32];
    std::snprintf(name, sizeof name, "relit-%04d.png", number);
    std::error_code error;
    if (!std::filesystem::exists(name, error)) return std::string(name);
  }
  return fail(ErrorCode::kIo, "relit-0001.png to relit-9999.png are all taken");
}

Result<std::vector<std::uint8_t>> picture_of(
    const gles::Device& device, int width, int height,
    const std::function<Status(int width, int height)>& draw) {
  RELIT_ASSIGN(gles::Framebuffer framebuffer,
               gles::Framebuffer::create(device, {width, height, 4}));
  framebuffer.bind();
  RELIT_TRY(draw(framebuffer.draw_width(), framebuffer.draw_height()));
  RELIT_TRY(framebuffer.resolve());
  std::vector<std::uint8_t> rgba(std::size_t{4} * static_cast<std::size_t>(width) *
                                 static_cast<std::size_t>(height));
  RELIT_TRY(framebuffer.read_back(rgba));
  return rgba;
}

}  // namespace

Result<std::string> write_screenshot(const gles::Device& device, int width, int height,
                                     const std::function<Status(int width, int height)>& draw) {
  RELIT_ASSIGN(const std::string name, free_name());
  GLint screen = 0;
  device.gl().GetIntegerv(GL_FRAMEBUFFER_BINDING, &screen);
  const auto rgba = picture_of(device, width, height, draw);
  device.gl().BindFramebuffer(GL_FRAMEBUFFER, static_cast<GLuint>(screen));
  if (!rgba) return Unexpected{rgba.error()};
  PictureWriter::Options options;
  options.path = name;
  options.width = width, options.height = height;
  RELIT_ASSIGN(auto writer, PictureWriter::create(options));
  RELIT_TRY(writer->add(*rgba));
  RELIT_TRY(writer->finish());
  return name;
}

}  // namespace relit::player
