// SPDX-License-Identifier: MIT
#include "gles/capabilities.hpp"

#include <algorithm>
#include <charconv>

namespace relit::gles {
namespace {

constexpr GLenum kMaxFragmentUniformComponents =
    0x8B49;  // desktop OpenGL's name for four times that
constexpr GLenum kMaxVertexUniformComponents = 0x8B4A;
constexpr GLenum kMaxVaryingComponents = 0x8B4B;

int get_int(const Functions& gl, GLenum name) {
  GLint value = 0;
  gl.GetIntegerv(name, &value);
  return value;
}

std::string get_string(const Functions& gl, GLenum name) {
  const auto* text = reinterpret_cast<const char*>(gl.GetString(name));
  return text != nullptr ? text : "";
}

class Extensions {
 public:
  Extensions(const Functions& gl, std::string_view ignored) : ignored_(ignored) {
    if (!gl.is_es3()) {
      list_ = get_string(gl, GL_EXTENSIONS);
      return;
    }
    const int count = get_int(gl, GL_NUM_EXTENSIONS);
    for (int i = 0; i < count; ++i) {
      const auto* name =
          reinterpret_cast<const char*>(gl.GetStringi(GL_EXTENSIONS, static_cast<GLuint>(i)));
      if (name != nullptr) list_.append(name).push_back(' ');
    }
  }
  [[nodiscard]] bool has(std::string_view name) const {
    return has_word(list_, name) && !has_word(ignored_, name);
  }
  [[nodiscard]] bool ignores(std::string_view name) const { return has_word(ignored_, name); }

 private:
  std::string list_;
  std::string_view ignored_;
};

// Extensions promise render targets that some drivers then refuse, and the other way round; a
// complete framebuffer is the proof.
bool is_renderable(const Functions& gl, GLint internal_format, GLenum type) {
  GLuint texture = 0;
  GLuint framebuffer = 0;
  GLint bound = 0;
  gl.GetIntegerv(GL_FRAMEBUFFER_BINDING, &bound);
  gl.GenTextures(1, &texture);
  gl.BindTexture(GL_TEXTURE_2D, texture);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  gl.TexImage2D(GL_TEXTURE_2D, 0, internal_format, 4, 4, 0, GL_RGBA, type, nullptr);
  gl.GenFramebuffers(1, &framebuffer);
  gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, 0);
  const bool complete = gl.CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
  gl.BindFramebuffer(GL_FRAMEBUFFER, static_cast<GLuint>(bound));
  gl.DeleteFramebuffers(1, &framebuffer);
  gl.BindTexture(GL_TEXTURE_2D, 0);
  gl.DeleteTextures(1, &texture);
  return complete && gl.GetError() == GL_NO_ERROR;
}

void query_formats(const Functions& gl, const Extensions& extensions, Capabilities& caps) {
  const bool es3 = caps.es_major >= 3;
  const bool desktop = !caps.version.is_es;
  const bool es32 = caps.version.major > 3 || (caps.version.major == 3 && caps.version.minor >= 2);
  caps.half_float_texture = es3 ? !extensions.ignores("GL_OES_texture_half_float")
                                : extensions.has("GL_OES_texture_half_float");
  caps.half_float_linear =
      caps.half_float_texture && (es3 ? !extensions.ignores("GL_OES_texture_half_float_linear")
                                      : extensions.has("GL_OES_texture_half_float_linear"));
  caps.float_texture = es3 || extensions.has("GL_OES_texture_float");
  caps.float_linear =
      caps.float_texture && (desktop || extensions.has("GL_OES_texture_float_linear"));

  const bool core_float =
      es3 && (desktop || es32) && !extensions.ignores("GL_EXT_color_buffer_float");
  const bool float_buffers = es3 && (core_float || extensions.has("GL_EXT_color_buffer_float"));
  if (caps.half_float_texture &&
      (float_buffers || extensions.has("GL_EXT_color_buffer_half_float")) &&
      !extensions.ignores("GL_EXT_color_buffer_half_float"))
    caps.half_float_target = es3 ? is_renderable(gl, GL_RGBA16F, GL_HALF_FLOAT)
                                 : is_renderable(gl, GL_RGBA, GL_HALF_FLOAT_OES);
  if (float_buffers) caps.float_target = is_renderable(gl, GL_RGBA32F, GL_FLOAT);
  caps.float_blend = caps.float_target && (desktop || extensions.has("GL_EXT_float_blend"));
  caps.npot_repeat =
      (es3 && !extensions.ignores("GL_OES_texture_npot")) || extensions.has("GL_OES_texture_npot");
  caps.unpack_row_length = (es3 && !extensions.ignores("GL_EXT_unpack_subimage")) ||
                           extensions.has("GL_EXT_unpack_subimage");
  caps.vertex_array_object = extensions.has("GL_OES_vertex_array_object");
  if ((!desktop && es32) || (desktop && caps.version.major * 10 + caps.version.minor >= 45)) {
    caps.reset_status = "glGetGraphicsResetStatus";
  } else if (extensions.has("GL_KHR_robustness")) {
    caps.reset_status = desktop ? "glGetGraphicsResetStatus" : "glGetGraphicsResetStatusKHR";
  } else if (extensions.has("GL_EXT_robustness")) {
    caps.reset_status = "glGetGraphicsResetStatusEXT";
  }
  caps.depth24 = es3 || extensions.has("GL_OES_depth24");
}

void query_limits(const Functions& gl, const Extensions& extensions, Capabilities& caps) {
  caps.max_texture_size = get_int(gl, GL_MAX_TEXTURE_SIZE);
  caps.max_cube_size = get_int(gl, GL_MAX_CUBE_MAP_TEXTURE_SIZE);
  caps.max_texture_units = get_int(gl, GL_MAX_TEXTURE_IMAGE_UNITS);
  caps.max_vertex_attributes = get_int(gl, GL_MAX_VERTEX_ATTRIBS);
  if (caps.version.is_es) {
    caps.max_varying_vectors = get_int(gl, GL_MAX_VARYING_VECTORS);
    caps.max_vertex_uniform_vectors = get_int(gl, GL_MAX_VERTEX_UNIFORM_VECTORS);
    caps.max_fragment_uniform_vectors = get_int(gl, GL_MAX_FRAGMENT_UNIFORM_VECTORS);
  } else {
    caps.max_varying_vectors = get_int(gl, kMaxVaryingComponents) / 4;
    caps.max_vertex_uniform_vectors = get_int(gl, kMaxVertexUniformComponents) / 4;
    caps.max_fragment_uniform_vectors = get_int(gl, kMaxFragmentUniformComponents) / 4;
  }
  if (caps.es_major >= 3) caps.max_samples = get_int(gl, GL_MAX_SAMPLES);
  if (extensions.has("GL_EXT_texture_filter_anisotropic"))
    gl.GetFloatv(GL_MAX_TEXTURE_MAX_ANISOTROPY_EXT, &caps.max_anisotropy);
}

void query_precision(const Functions& gl, Capabilities& caps) {
  GLint range[2] = {};
  GLint bits = 0;
  gl.GetShaderPrecisionFormat(GL_FRAGMENT_SHADER, GL_HIGH_FLOAT, range, &bits);
  caps.fragment_highp = bits >= 16;
  gl.GetShaderPrecisionFormat(GL_FRAGMENT_SHADER, GL_MEDIUM_FLOAT, range, &bits);
  caps.mediump_is_half = bits > 0 && bits <= 10;
}

}  // namespace

bool has_word(std::string_view list, std::string_view name) {
  for (std::size_t at = list.find(name); at != std::string_view::npos;
       at = list.find(name, at + 1)) {
    const std::size_t end = at + name.size();
    if ((at == 0 || list[at - 1] == ' ') && (end == list.size() || list[end] == ' ')) return true;
  }
  return false;
}

Result<ContextVersion> parse_version(std::string_view text) {
  constexpr std::string_view kEs = "OpenGL ES ";
  ContextVersion version;
  version.is_es = text.starts_with(kEs);
  const std::string_view digits = version.is_es ? text.substr(kEs.size()) : text;
  const char* end = digits.data() + digits.size();
  const auto major = std::from_chars(digits.data(), end, version.major);
  if (major.ec == std::errc() && major.ptr != end && *major.ptr == '.') {
    const auto minor = std::from_chars(major.ptr + 1, end, version.minor);
    if (minor.ec == std::errc() && version.major >= (version.is_es ? 2 : 3)) return version;
  }
  return fail(ErrorCode::kEnvironment, "the context says it is \"" + std::string(text) +
                                           "\"; OpenGL ES 2.0 or later is needed");
}

Result<Capabilities> query_capabilities(const Functions& gl, ContextVersion version, int es_major,
                                        std::string_view ignored_extensions) {
  Capabilities caps;
  caps.version = version;
  caps.es_major = es_major;
  caps.renderer = get_string(gl, GL_RENDERER);
  caps.version_text = get_string(gl, GL_VERSION);
  const Extensions extensions(gl, ignored_extensions);
  query_limits(gl, extensions, caps);
  query_precision(gl, caps);
  query_formats(gl, extensions, caps);
  // A driver that does not know one of the names leaves an error, which belongs to nobody else. A
  // context without errors to give (lost, or not current) may answer for ever.
  for (int i = 0; i < 16 && gl.GetError() != GL_NO_ERROR; ++i) {
  }
  if (caps.max_texture_size < 64 || caps.max_texture_units < 1)
    return fail(ErrorCode::kEnvironment,
                "the OpenGL ES context reports a maximal texture size of " +
                    std::to_string(caps.max_texture_size) + "; is it current on this thread?");
  return caps;
}

}  // namespace relit::gles
