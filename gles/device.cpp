// SPDX-License-Identifier: MIT
#include "gles/device.hpp"

#include <cstdio>
#include <initializer_list>

namespace relit::gles {
namespace {

// Three vertices whose triangle contains the whole of clip space.
constexpr float kTriangle[] = {-1, -1, 3, -1, -1, 3};

Result<Profile> choose_profile(const DeviceOptions& options, const Functions& gl,
                               const ContextVersion& version) {
  if (options.profile == Profile::kEs3 && version.es_major() < 3)
    return fail(
        ErrorCode::kEnvironment,
        "the ES 3 profile was asked for, but the context is only ES 2; use the ES 2 profile");
  if (options.profile && *options.profile != Profile::kEs2) return *options.profile;
  if (!options.profile && version.es_major() >= 3) return Profile::kEs3;
  GLint range[2] = {};
  GLint bits = 0;
  gl.GetShaderPrecisionFormat(GL_FRAGMENT_SHADER, GL_HIGH_FLOAT, range, &bits);
  const bool highp = bits >= 16;
  if (!options.profile) return highp ? Profile::kEs2 : Profile::kEs2Mediump;
  if (!highp)
    return fail(ErrorCode::kEnvironment,
                "this GPU has no highp floats in fragment shaders; use the ES 2 mediump profile");
  return Profile::kEs2;
}

}  // namespace

Result<std::unique_ptr<Device>> Device::create(const DeviceOptions& options) {
  if (!options.get_proc_address)
    return fail(ErrorCode::kInvalid, "Device::create() needs a get_proc_address function");
  RELIT_ASSIGN(const Functions es2, load_functions(options.get_proc_address, false));
  const auto* text = reinterpret_cast<const char*>(es2.GetString(GL_VERSION));
  if (text == nullptr)
    return fail(ErrorCode::kEnvironment,
                "no OpenGL ES context is current on this thread; make one current first");
  RELIT_ASSIGN(const ContextVersion version, parse_version(text));
  RELIT_ASSIGN(const Profile profile, choose_profile(options, es2, version));

  std::unique_ptr<Device> device(new Device);
  device->profile_ = profile;
  const bool es3 = profile == Profile::kEs3;
  RELIT_ASSIGN(device->gl_, load_functions(options.get_proc_address, es3));
  device->caps_.version = version;
  StateGuard guard(*device);
  RELIT_ASSIGN(device->caps_,
               query_capabilities(device->gl_, version, es3 ? 3 : 2, options.ignored_extensions));
  load_optional_functions(options.get_proc_address, device->caps_.reset_status,
                          !es3 && device->caps_.vertex_array_object, device->gl_);
  const Functions& gl = device->gl_;
  device->triangle_ = Buffer(gl);
  if (es3) {
    device->triangle_array_ = VertexArray(gl);
    gl.BindVertexArray(device->triangle_array_.name());
  }
  gl.BindBuffer(GL_ARRAY_BUFFER, device->triangle_.name());
  gl.BufferData(GL_ARRAY_BUFFER, sizeof kTriangle, kTriangle, GL_STATIC_DRAW);
  if (es3) {
    gl.VertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
    gl.EnableVertexAttribArray(0);
    gl.BindVertexArray(0);
  }
  gl.BindBuffer(GL_ARRAY_BUFFER, 0);
  RELIT_TRY(device->check("creating the device"));
  return device;
}

void Device::draw_fullscreen() const {
  if (is_es3()) {
    gl_.BindVertexArray(triangle_array_.name());
    gl_.DrawArrays(GL_TRIANGLES, 0, 3);
    gl_.BindVertexArray(0);
    return;
  }
  gl_.BindBuffer(GL_ARRAY_BUFFER, triangle_.name());
  gl_.VertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
  gl_.EnableVertexAttribArray(0);
  gl_.DrawArrays(GL_TRIANGLES, 0, 3);
  gl_.DisableVertexAttribArray(0);
  gl_.BindBuffer(GL_ARRAY_BUFFER, 0);
}

Status Device::ready(const char* operation) const {
  const char* reason = nullptr;
  if (abandoned_) {
    reason = "was abandoned";
  } else if (gl_.GetString(GL_VERSION) == nullptr) {
    reason = "is not current on this thread";
  } else if (gl_.GetGraphicsResetStatus != nullptr && gl_.GetGraphicsResetStatus() != GL_NO_ERROR) {
    reason = "was lost";
  }
  if (reason == nullptr) return {};
  return fail(ErrorCode::kEnvironment,
              std::string("the OpenGL ES context ") + reason + " while " + operation);
}

Status Device::check(const char* operation) const {
  RELIT_TRY(ready(operation));
  const GLenum error = gl_.GetError();
  if (error == GL_NO_ERROR) return {};
  char code[16];
  std::snprintf(code, sizeof code, "0x%04X", error);
  return fail(error == GL_OUT_OF_MEMORY ? ErrorCode::kOutOfMemory : ErrorCode::kEnvironment,
              std::string("OpenGL ES error ") + code + " while " + operation);
}

void Device::abandon() {
  abandoned_ = true;
  forget_deletions(gl_);
}

StateGuard::StateGuard(const Device& device, int units)
    : device_(device), gl_(device.gl()), units_(units) {
  gl_.GetIntegerv(GL_FRAMEBUFFER_BINDING, &framebuffer_);
  if (device.is_es3()) gl_.GetIntegerv(GL_READ_FRAMEBUFFER_BINDING, &read_framebuffer_);
  gl_.GetIntegerv(GL_VIEWPORT, viewport_);
  gl_.GetIntegerv(GL_SCISSOR_BOX, scissor_);
  unbind();
  set_defaults();
  gl_.Disable(GL_DITHER);
}

StateGuard::~StateGuard() {
  unbind();
  set_defaults();
  gl_.Enable(GL_DITHER);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, static_cast<GLuint>(framebuffer_));
  if (device_.is_es3() && read_framebuffer_ != framebuffer_)
    gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, static_cast<GLuint>(read_framebuffer_));
  gl_.Viewport(viewport_[0], viewport_[1], viewport_[2], viewport_[3]);
  gl_.Scissor(scissor_[0], scissor_[1], scissor_[2], scissor_[3]);
}

void StateGuard::unbind() const {
  gl_.UseProgram(0);
  // Vertex arrays first: the element buffer belongs to the one that is bound.
  if (device_.is_es3()) {
    gl_.BindVertexArray(0);
    gl_.BindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
    gl_.BindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  } else {
    if (gl_.BindVertexArrayOES != nullptr) gl_.BindVertexArrayOES(0);
    for (int i = 0; i < device_.caps().max_vertex_attributes; ++i)
      gl_.DisableVertexAttribArray(static_cast<GLuint>(i));
  }
  gl_.BindBuffer(GL_ARRAY_BUFFER, 0);
  gl_.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, 0);
  gl_.BindRenderbuffer(GL_RENDERBUFFER, 0);
  for (int unit = units_ - 1; unit >= 0; --unit) {
    gl_.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
    gl_.BindTexture(GL_TEXTURE_2D, 0);
    gl_.BindTexture(GL_TEXTURE_CUBE_MAP, 0);
    if (device_.is_es3()) gl_.BindSampler(static_cast<GLuint>(unit), 0);
  }
}

void StateGuard::set_defaults() const {
  constexpr GLenum kSampleMask = 0x8E51;
  for (const GLenum state : std::initializer_list<GLenum>{
           GL_BLEND, GL_DEPTH_TEST, GL_CULL_FACE, GL_SCISSOR_TEST, GL_STENCIL_TEST,
           GL_POLYGON_OFFSET_FILL, GL_SAMPLE_COVERAGE, GL_SAMPLE_ALPHA_TO_COVERAGE})
    gl_.Disable(state);
  if (device_.is_es3()) gl_.Disable(GL_RASTERIZER_DISCARD);
  const ContextVersion& version = device_.caps().version;
  if (device_.is_es3() && (!version.is_es || version.major > 3 || version.minor >= 1))
    gl_.Disable(kSampleMask);
  gl_.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  gl_.DepthMask(GL_TRUE);
  gl_.BlendEquation(GL_FUNC_ADD);
  gl_.BlendFunc(GL_ONE, GL_ZERO);
  gl_.DepthFunc(GL_LESS);
  gl_.DepthRangef(0, 1);
  gl_.CullFace(GL_BACK);
  gl_.FrontFace(GL_CCW);
  gl_.ClearColor(0, 0, 0, 0);
  gl_.ClearDepthf(1);
  set_pixel_store();
}

void StateGuard::set_pixel_store() const {
  gl_.PixelStorei(GL_UNPACK_ALIGNMENT, 4);
  gl_.PixelStorei(GL_PACK_ALIGNMENT, 4);
  if (device_.caps().unpack_row_length || device_.is_es3())
    for (const GLenum parameter : std::initializer_list<GLenum>{
             GL_UNPACK_ROW_LENGTH, GL_UNPACK_SKIP_ROWS, GL_UNPACK_SKIP_PIXELS})
      gl_.PixelStorei(parameter, 0);
  if (!device_.is_es3()) return;
  for (const GLenum parameter :
       std::initializer_list<GLenum>{GL_UNPACK_IMAGE_HEIGHT, GL_UNPACK_SKIP_IMAGES,
                                     GL_PACK_ROW_LENGTH, GL_PACK_SKIP_ROWS, GL_PACK_SKIP_PIXELS})
    gl_.PixelStorei(parameter, 0);
}

Texture make_texture(const Device& device, const TextureFormat& format, int width, int height,
                     const void* texels) {
  const Functions& gl = device.gl();
  Texture texture(gl);
  gl.BindTexture(GL_TEXTURE_2D, texture.name());
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, format.filter);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, format.filter);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  gl.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
  gl.TexImage2D(GL_TEXTURE_2D, 0, format.internal_format, width, height, 0, format.format,
                format.type, texels);
  return texture;
}

TextureFormat half_float_format(const Device& device) {
  if (device.is_es3()) return {GL_RGBA16F, GL_RGBA, GL_HALF_FLOAT, GL_NEAREST, 8};
  return {GL_RGBA, GL_RGBA, GL_HALF_FLOAT_OES, GL_NEAREST, 8};
}

TextureFormat float_format(const Device& device) {
  if (device.is_es3()) return {GL_RGBA32F, GL_RGBA, GL_FLOAT, GL_NEAREST, 16};
  return {GL_RGBA, GL_RGBA, GL_FLOAT, GL_NEAREST, 16};
}

}  // namespace relit::gles
