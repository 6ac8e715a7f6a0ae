// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "gles/capabilities.hpp"
#include "gles/program.hpp"

namespace relit::gles {

struct DeviceOptions {
  GetProcAddress get_proc_address;  ///< of the context that is current
  std::optional<Profile> profile;   ///< none: the best the context offers
  std::string ignored_extensions;   ///< names separated by blanks, treated as absent; ES 3 features
                                    ///< are ignored under the name of the extension that ES 2 has
};

/// What this folder knows of one context. The host owns the context, and makes it current on the
/// calling thread for every call to an object of this folder, construction and destruction
/// included.
///
/// GL state. Every public operation of this folder sets all the state it needs and leaves: the
/// framebuffer binding and the viewport as they were; no program, vertex array (ES 3) or buffer
/// bound and no attribute array enabled; every texture unit it used empty and unit 0 active;
/// blending, depth test, culling and scissor test off; colour and depth masks on; pixel-store
/// parameters at GL's defaults. It expects what only a host would change to be at GL's defaults:
/// stencil test, polygon offset and sample coverage off, no pixel buffers bound, blend equation
/// ADD.
class Device {
 public:
  /// Loads entry points and asks for capabilities. Errors: kEnvironment when the context is older
  /// than ES 2.0, lacks what the profile asks for, or is not current.
  static Result<std::unique_ptr<Device>> create(const DeviceOptions& options);

  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  [[nodiscard]] const Functions& gl() const { return gl_; }
  [[nodiscard]] const Capabilities& caps() const { return caps_; }
  [[nodiscard]] Profile profile() const { return profile_; }
  [[nodiscard]] bool is_es3() const { return profile_ == Profile::kEs3; }

  /// Draws one triangle that covers the viewport with attribute 0 (vec2) running over [-1,1]²
  /// inside it. Inside a StateGuard.
  void draw_fullscreen() const;

  /// A message for any pending GL error, naming the operation; for the ends of public operations.
  [[nodiscard]] Status check(const char* operation) const;

 private:
  Device() = default;

  Functions gl_;
  Capabilities caps_;
  Profile profile_ = Profile::kEs3;
  Buffer triangle_;
  VertexArray triangle_array_;
};

/// Puts back the state that Device promises to leave, at the end of a public operation.
class StateGuard {
 public:
  explicit StateGuard(const Device& device, int units = 1);
  ~StateGuard();
  StateGuard(const StateGuard&) = delete;
  StateGuard& operator=(const StateGuard&) = delete;

  /// The framebuffer that was bound when the guard was made.
  [[nodiscard]] GLuint framebuffer() const { return static_cast<GLuint>(framebuffer_); }

 private:
  const Functions& gl_;
  int units_;
  GLint framebuffer_ = 0;
  GLint viewport_[4] = {};
};

/// A 2D texture's storage and sampling in one call; leaves it bound to the active unit.
struct TextureFormat {
  GLint internal_format = GL_RGBA;
  GLenum format = GL_RGBA;
  GLenum type = GL_UNSIGNED_BYTE;
  GLint filter = GL_NEAREST;
  int bytes_per_texel = 4;
};
[[nodiscard]] Texture make_texture(const Device& device, const TextureFormat& format, int width,
                                   int height, const void* texels = nullptr);

/// RGBA in half floats, as the profile names it.
[[nodiscard]] TextureFormat half_float_format(const Device& device);
/// RGBA in floats, as the profile names it.
[[nodiscard]] TextureFormat float_format(const Device& device);

}  // namespace relit::gles
