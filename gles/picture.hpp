// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gles/device.hpp"

namespace relit::gles {

struct FramebufferOptions {
  int width = 0;  ///< of the picture, pixels
  int height = 0;
  /// Samples a pixel against jagged edges: 1, or 4 by multisampling where there is any and by
  /// drawing at twice the size elsewhere; 16 does both (or draws at four times the size).
  int samples = 4;
};

/// A picture of 8-bit RGBA, with depth, that is drawn off the screen. GL state: see Device; bind()
/// is the exception, it leaves the framebuffer bound.
class Framebuffer {
 public:
  /// Errors: kInvalid, kLimit when the GPU cannot draw pictures as large (samples are reduced
  /// first), kEnvironment, kOutOfMemory.
  static Result<Framebuffer> create(const Device& device, const FramebufferOptions& options);

  /// Binds it for drawing. The view's rectangle is (0, 0, draw_width(), draw_height()).
  void bind() const;
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] int draw_width() const { return width_ * factor_; }    ///< more than width() when
  [[nodiscard]] int draw_height() const { return height_ * factor_; }  ///< drawing at a larger size

  /// Averages the samples into the picture. Call it after drawing, before present() or read_back().
  Status resolve();

  /// Draws the picture into the rectangle (0, 0, width, height) of a framebuffer of the host's,
  /// filtered where the sizes differ. Errors: kEnvironment from GL.
  Status present(GLuint framebuffer, int width, int height) const;

  /// Reads the picture: height × width × 4 bytes, top row first, premultiplied where alpha is not
  /// 255, unless `straight`. Waits for the GPU. Errors: kInvalid for the wrong size.
  Status read_back(std::span<std::uint8_t> rgba, bool straight = false) const;

  [[nodiscard]] std::size_t gpu_bytes() const;

 private:
  Status allocate();
  Status attach(const FramebufferObject& framebuffer, const Texture& color) const;
  void draw_picture(const Texture& source) const;

  const Device* device_ = nullptr;
  int width_ = 0, height_ = 0;
  int factor_ = 1;        // drawing is this much larger than the picture
  int multisamples_ = 0;  // 0: none
  // Drawing goes to draw_; where that is multisampled it is resolved to levels_[0]. Each following
  // level halves the size, down to the picture.
  struct Level {
    int width = 0, height = 0;
    Texture color;
    FramebufferObject framebuffer;
  };
  std::vector<Level> levels_;
  FramebufferObject draw_;
  Renderbuffer draw_color_;
  Renderbuffer depth_;
  Program present_;
};

}  // namespace relit::gles
