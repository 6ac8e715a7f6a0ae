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
/// GL state. Every public operation of this folder sets all the state that it needs, whatever the
/// host left, and leaves:
///
/// - framebuffers (ES 3: drawing and reading), viewport and scissor box as they were (but see
///   Framebuffer::bind());
/// - no program, renderbuffer, array buffer, element buffer or vertex array bound; ES 3: no pixel
///   pack or unpack buffer bound;
/// - attribute arrays disabled (ES 3: those of vertex array 0 are not touched); the value of
///   attribute 3 (1, 1, 1, 1) if anything was drawn;
/// - unit 0 active; no 2D or cube texture and no sampler bound to the units used (at most 16, from
///   0);
/// - off: blend, depth, cull, scissor and stencil test, polygon offset, sample coverage, sample
///   alpha to coverage; ES 3: rasterizer discard; ES 3.1: sample mask;
/// - on: dithering, all colour and depth masks;
/// - at GL's defaults: blend equation and function, depth function and range, cull face, front
///   face, clear colour and depth, pixel store.
///
/// Everything else is neither changed nor looked at, but for what no operation can do without: no
/// transform feedback may be active, and a framebuffer of the host's that is drawn into must be
/// complete and not encode sRGB by itself.
///
/// A context that is lost, or not current, makes operations fail with kEnvironment; see abandon().
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

  /// Whether the context is there: for the beginnings of public operations. Errors: kEnvironment
  /// where it is not current on this thread, was lost, or was abandoned.
  [[nodiscard]] Status ready(const char* operation) const;
  /// A message for any pending GL error, naming the operation; for the ends of public operations.
  /// Errors: kOutOfMemory, kEnvironment.
  [[nodiscard]] Status check(const char* operation) const;

  /// Says that the context is gone, and its objects with it: objects of this folder can then be
  /// destroyed without one, and do nothing but fail until they are.
  void abandon();

 private:
  Device() = default;

  Functions gl_;
  Capabilities caps_;
  Profile profile_ = Profile::kEs3;
  bool abandoned_ = false;
  Buffer triangle_;
  VertexArray triangle_array_;
};

/// Sets the state that an operation counts on, and at its end what Device promises to leave.
class StateGuard {
 public:
  /// `units`: of the textures that the operation uses, from 0.
  explicit StateGuard(const Device& device, int units = 1);
  ~StateGuard();
  StateGuard(const StateGuard&) = delete;
  StateGuard& operator=(const StateGuard&) = delete;

  /// The framebuffer that was bound for drawing when the guard was made.
  [[nodiscard]] GLuint framebuffer() const { return static_cast<GLuint>(framebuffer_); }

 private:
  void set_defaults() const;
  void set_pixel_store() const;
  void unbind() const;

  const Device& device_;
  const Functions& gl_;
  int units_;
  GLint framebuffer_ = 0;
  GLint read_framebuffer_ = 0;
  GLint viewport_[4] = {};
  GLint scissor_[4] = {};
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
