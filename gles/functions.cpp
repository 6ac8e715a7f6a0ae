// SPDX-License-Identifier: MIT
#include "gles/functions.hpp"

#include <bit>

namespace relit::gles {

Result<Functions> load_functions(const GetProcAddress& get_proc_address, bool es3) {
  Functions gl;
  const char* missing = nullptr;
  auto load = [&]<class F>(F& function, const char* name) {
    function = std::bit_cast<F>(get_proc_address(name));
    if (function == nullptr && missing == nullptr) missing = name;
  };
#define RELIT_GL_LOAD(name, type) load(gl.name, "gl" #name);
  RELIT_GL_ES2_FUNCTIONS(RELIT_GL_LOAD)
  if (es3) {
    RELIT_GL_ES3_FUNCTIONS(RELIT_GL_LOAD)
  }
#undef RELIT_GL_LOAD
  if (missing != nullptr)
    return fail(ErrorCode::kEnvironment,
                std::string("the OpenGL ES implementation has no ") + missing +
                    (es3 ? "; an ES 3.0 context (or the ES 2 profile) is needed"
                         : "; an ES 2.0 context is needed"));
  return gl;
}

void load_optional_functions(const GetProcAddress& get_proc_address, const char* reset_status,
                             bool vertex_arrays, Functions& gl) {
  auto load = [&]<class F>(F& function, const char* name) {
    function = std::bit_cast<F>(get_proc_address(name));
  };
  if (reset_status != nullptr) load(gl.GetGraphicsResetStatus, reset_status);
  if (vertex_arrays) load(gl.BindVertexArrayOES, "glBindVertexArrayOES");
}

void forget_deletions(Functions& gl) {
  gl.DeleteBuffers = [](GLsizei, const GLuint*) {};
  gl.DeleteFramebuffers = [](GLsizei, const GLuint*) {};
  gl.DeleteProgram = [](GLuint) {};
  gl.DeleteRenderbuffers = [](GLsizei, const GLuint*) {};
  gl.DeleteShader = [](GLuint) {};
  gl.DeleteTextures = [](GLsizei, const GLuint*) {};
  gl.DeleteVertexArrays = [](GLsizei, const GLuint*) {};
}

}  // namespace relit::gles
