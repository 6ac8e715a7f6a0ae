// SPDX-License-Identifier: MIT
#include "gles/picture.hpp"

#include <algorithm>

#include "gles/shaders.hpp"

namespace relit::gles {

Result<Framebuffer> Framebuffer::create(const Device& device, const FramebufferOptions& options) {
  RELIT_TRY(device.ready("creating a picture"));
  const Capabilities& caps = device.caps();
  GLint limit = 0;
  device.gl().GetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &limit);
  limit = std::min(limit, caps.max_texture_size);
  if (options.width < 1 || options.height < 1 ||
      (options.samples != 1 && options.samples != 4 && options.samples != 16))
    return fail(ErrorCode::kInvalid, "a picture of " + std::to_string(options.width) + "x" +
                                         std::to_string(options.height) + " pixels with " +
                                         std::to_string(options.samples) +
                                         " samples; at least one pixel and 1, 4 or 16 samples are "
                                         "possible");
  if (options.width > limit || options.height > limit)
    return fail(ErrorCode::kLimit, "a picture of " + std::to_string(options.width) + "x" +
                                       std::to_string(options.height) +
                                       " pixels; this GPU draws at most " + std::to_string(limit) +
                                       " a side");
  Framebuffer framebuffer;
  framebuffer.device_ = &device;
  framebuffer.width_ = options.width;
  framebuffer.height_ = options.height;
  int samples = options.samples;
  if (samples >= 4 && device.is_es3() && caps.max_samples >= 4) {
    framebuffer.multisamples_ = 4;
    samples /= 4;
  }
  for (; samples >= 4; samples /= 4)
    if (2 * framebuffer.factor_ * std::max(options.width, options.height) <= limit)
      framebuffer.factor_ *= 2;

  StateGuard guard(device);
  const std::string_view vertex[] = {shaders::present_vert};
  const std::string_view fragment[] = {shaders::present_frag};
  const std::string_view attributes[] = {"a_position"};
  RELIT_ASSIGN(framebuffer.present_, build_program(device.gl(), device.profile(),
                                                   {"present", "", vertex, fragment, attributes}));
  RELIT_TRY(framebuffer.allocate());
  return framebuffer;
}

Status Framebuffer::allocate() {
  const Functions& gl = device_->gl();
  TextureFormat format;
  if (device_->is_es3()) format.internal_format = GL_RGBA8;
  format.filter = GL_LINEAR;
  for (int factor = factor_; factor >= 1; factor /= 2) {
    Level level;
    level.width = width_ * factor;
    level.height = height_ * factor;
    level.color = make_texture(*device_, format, level.width, level.height);
    level.framebuffer = FramebufferObject(gl);
    RELIT_TRY(attach(level.framebuffer, level.color));
    levels_.push_back(std::move(level));
  }
  depth_ = Renderbuffer(gl);
  gl.BindRenderbuffer(GL_RENDERBUFFER, depth_.name());
  const GLenum depth_format =
      device_->caps().depth24 ? GLenum{GL_DEPTH_COMPONENT24_OES} : GLenum{GL_DEPTH_COMPONENT16};
  if (multisamples_ > 0) {
    gl.RenderbufferStorageMultisample(GL_RENDERBUFFER, multisamples_, depth_format, draw_width(),
                                      draw_height());
    draw_color_ = Renderbuffer(gl);
    gl.BindRenderbuffer(GL_RENDERBUFFER, draw_color_.name());
    gl.RenderbufferStorageMultisample(GL_RENDERBUFFER, multisamples_, GL_RGBA8, draw_width(),
                                      draw_height());
    draw_ = FramebufferObject(gl);
    gl.BindFramebuffer(GL_FRAMEBUFFER, draw_.name());
    gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                               draw_color_.name());
  } else {
    gl.RenderbufferStorage(GL_RENDERBUFFER, depth_format, draw_width(), draw_height());
    gl.BindFramebuffer(GL_FRAMEBUFFER, levels_.front().framebuffer.name());
  }
  gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth_.name());
  gl.BindRenderbuffer(GL_RENDERBUFFER, 0);
  if (gl.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    return fail(ErrorCode::kEnvironment, "the GPU refuses to draw into a picture of " +
                                             std::to_string(draw_width()) + "x" +
                                             std::to_string(draw_height()) + " pixels");
  return device_->check("creating a picture");
}

Status Framebuffer::attach(const FramebufferObject& framebuffer, const Texture& color) const {
  const Functions& gl = device_->gl();
  gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
  gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, color.name(), 0);
  if (gl.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    return fail(ErrorCode::kEnvironment, "the GPU refuses to draw into an RGBA texture");
  return {};
}

void Framebuffer::bind() const {
  device_->gl().BindFramebuffer(
      GL_FRAMEBUFFER, multisamples_ > 0 ? draw_.name() : levels_.front().framebuffer.name());
}

Status Framebuffer::resolve() {
  RELIT_TRY(device_->ready("resolving a picture"));
  const Functions& gl = device_->gl();
  StateGuard guard(*device_);
  if (multisamples_ > 0) {
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, draw_.name());
    gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, levels_.front().framebuffer.name());
    gl.BlitFramebuffer(0, 0, draw_width(), draw_height(), 0, 0, draw_width(), draw_height(),
                       GL_COLOR_BUFFER_BIT, GL_NEAREST);
  }
  for (std::size_t i = 1; i < levels_.size(); ++i) {
    gl.BindFramebuffer(GL_FRAMEBUFFER, levels_[i].framebuffer.name());
    gl.Viewport(0, 0, levels_[i].width, levels_[i].height);
    draw_picture(levels_[i - 1].color);
  }
  return device_->check("resolving a picture");
}

void Framebuffer::draw_picture(const Texture& source) const {
  const Functions& gl = device_->gl();
  gl.UseProgram(present_.name());
  gl.BindTexture(GL_TEXTURE_2D, source.name());
  device_->draw_fullscreen();
}

Status Framebuffer::present(GLuint framebuffer, int width, int height) const {
  RELIT_TRY(device_->ready("presenting a picture"));
  const Functions& gl = device_->gl();
  StateGuard guard(*device_);
  gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  gl.Viewport(0, 0, width, height);
  draw_picture(levels_.back().color);
  return device_->check("presenting a picture");
}

Status Framebuffer::read_back(std::span<std::uint8_t> rgba, bool straight) const {
  const std::size_t row = 4 * static_cast<std::size_t>(width_);
  if (rgba.size() != row * static_cast<std::size_t>(height_))
    return fail(ErrorCode::kInvalid, "reading back a picture needs room for " +
                                         std::to_string(row * static_cast<std::size_t>(height_)) +
                                         " bytes, not " + std::to_string(rgba.size()));
  RELIT_TRY(device_->ready("reading a picture back"));
  const Functions& gl = device_->gl();
  StateGuard guard(*device_);
  gl.BindFramebuffer(GL_FRAMEBUFFER, levels_.back().framebuffer.name());
  gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
  gl.ReadPixels(0, 0, width_, height_, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
  // GL's first row is the picture's last.
  for (std::size_t top = 0, bottom = static_cast<std::size_t>(height_) - 1; top < bottom;
       ++top, --bottom)
    std::swap_ranges(rgba.begin() + static_cast<std::ptrdiff_t>(top * row),
                     rgba.begin() + static_cast<std::ptrdiff_t>((top + 1) * row),
                     rgba.begin() + static_cast<std::ptrdiff_t>(bottom * row));
  if (straight)
    for (std::size_t i = 0; i < rgba.size(); i += 4) {
      const unsigned alpha = rgba[i + 3];
      if (alpha == 0 || alpha == 255) continue;
      for (std::size_t c = 0; c < 3; ++c)
        rgba[i + c] =
            static_cast<std::uint8_t>(std::min(255u, (rgba[i + c] * 255u + alpha / 2) / alpha));
    }
  return device_->check("reading a picture back");
}

std::size_t Framebuffer::gpu_bytes() const {
  const std::size_t pixels =
      static_cast<std::size_t>(draw_width()) * static_cast<std::size_t>(draw_height());
  std::size_t bytes = 4 * pixels * static_cast<std::size_t>(std::max(multisamples_, 1));
  if (multisamples_ > 0) bytes *= 2;  // colour and depth of every sample
  for (const Level& level : levels_)
    bytes += 4 * static_cast<std::size_t>(level.width) * static_cast<std::size_t>(level.height);
  return bytes;
}

}  // namespace relit::gles
