// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "gles/functions.hpp"

namespace relit::gles {

/// The version of a context, from GL_VERSION.
struct ContextVersion {
  bool is_es = true;  ///< false: desktop OpenGL, whose version is in major and minor
  int major = 2;
  int minor = 0;

  /// The OpenGL ES version whose shaders and entry points this folder may use: 2 or 3.
  /// Desktop OpenGL 4.3 has all of ES 3; Mesa's 3.3 core contexts accept ES 3 shaders too.
  [[nodiscard]] int es_major() const { return major >= 3 ? 3 : 2; }
};

/// Parses "OpenGL ES 3.2 Mesa …", "OpenGL ES-CM 1.1" (refused) or "4.5 (Core Profile) Mesa …".
/// Errors: kEnvironment for anything else and for versions below ES 2.0 or OpenGL 3.0.
[[nodiscard]] Result<ContextVersion> parse_version(std::string_view text);

/// Whether a list of names separated by blanks holds `name` as a whole word.
[[nodiscard]] bool has_word(std::string_view list, std::string_view name);

/// What a context can do, seen through a profile: extensions that the profile or its user ignores
/// count as absent.
struct Capabilities {
  ContextVersion version;
  int es_major = 2;  ///< the profile's: 2 even on an ES 3 context when ES 2 was asked for
  std::string renderer;
  std::string version_text;

  bool fragment_highp = false;      ///< highp floats in fragment shaders
  bool mediump_is_half = false;     ///< mediump really is 16 bits there (10 bits of mantissa)
  bool half_float_texture = false;  ///< RGBA16F textures
  bool half_float_linear = false;   ///< with linear filtering
  bool half_float_target = false;   ///< … as render targets (proven by a complete framebuffer)
  bool float_texture = false;       ///< RGBA32F, as above
  bool float_linear = false;
  bool float_target = false;
  bool float_blend = false;  ///< blending into RGBA32F
  bool npot_repeat = false;  ///< repeat and mipmaps for sizes that are no powers of two
  bool unpack_row_length = false;
  bool depth24 = false;
  bool vertex_array_object = false;    ///< OES_vertex_array_object, of ES 2
  const char* reset_status = nullptr;  ///< name of glGetGraphicsResetStatus here; null: none
  int max_texture_size = 64;           ///< texels
  int max_cube_size = 16;              ///< texels
  int max_texture_units = 8;           ///< of the fragment shader
  int max_varying_vectors = 8;
  int max_vertex_attributes = 8;
  int max_vertex_uniform_vectors = 128;
  int max_fragment_uniform_vectors = 16;
  int max_samples = 0;  ///< of renderbuffers; 0: no multisampling
  float max_anisotropy = 1;
};

/// Asks the current context. `es_major` is the profile's version; `ignored_extensions` is a list of
/// names separated by blanks. Leaves no object bound and no error set. Errors: kEnvironment.
[[nodiscard]] Result<Capabilities> query_capabilities(const Functions& gl, ContextVersion version,
                                                      int es_major,
                                                      std::string_view ignored_extensions);

}  // namespace relit::gles
