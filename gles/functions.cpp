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

}  // namespace relit::gles
