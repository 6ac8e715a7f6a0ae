// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include "gles/device.hpp"
#include "gles/overlay_canvas.hpp"

namespace relit::gles {

/// Draws an OverlayCanvas over a picture: one buffer, one draw. GL state: see Device.
class Overlay {
 public:
  /// `device` is borrowed and outlives this object. Errors: kEnvironment, kOutOfMemory.
  static Result<std::unique_ptr<Overlay>> create(const Device& device);

  /// Blends what the canvas holds over the framebuffer that is bound, whose size canvas.begin() was
  /// given; alpha stays premultiplied. Uploads the letters when the canvas has drawn new ones.
  /// Errors: kEnvironment, kOutOfMemory.
  Status draw(const OverlayCanvas& canvas);

 private:
  explicit Overlay(const Device& device) : device_(device) {}
  Status upload(const FontAtlas& atlas);

  const Device& device_;
  Program program_;
  GLint to_clip_ = -1, to_atlas_ = -1;
  Buffer vertices_;
  VertexArray array_;  // ES 3
  Texture letters_;
  int letters_scale_ = 0;
};

}  // namespace relit::gles
