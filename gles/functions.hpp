// SPDX-License-Identifier: MIT
#pragma once

#ifndef GL_GLES_PROTOTYPES
#define GL_GLES_PROTOTYPES 0  // every call goes through the table, so nothing of GL is linked
#endif
#include <GLES3/gl3.h>
// After gl3.h, whose types it needs.
#include <GLES2/gl2ext.h>

#include <functional>

#include "container/base/result.hpp"

namespace relit::gles {

/// Finds an entry point of the current context by its name ("glClear"); null when there is none.
using GetProcAddress = std::function<void*(const char* name)>;

// Name without "gl", pointer type.
#define RELIT_GL_ES2_FUNCTIONS(X)                                \
  X(ActiveTexture, PFNGLACTIVETEXTUREPROC)                       \
  X(AttachShader, PFNGLATTACHSHADERPROC)                         \
  X(BindAttribLocation, PFNGLBINDATTRIBLOCATIONPROC)             \
  X(BindBuffer, PFNGLBINDBUFFERPROC)                             \
  X(BindFramebuffer, PFNGLBINDFRAMEBUFFERPROC)                   \
  X(BindRenderbuffer, PFNGLBINDRENDERBUFFERPROC)                 \
  X(BindTexture, PFNGLBINDTEXTUREPROC)                           \
  X(BlendEquation, PFNGLBLENDEQUATIONPROC)                       \
  X(BlendFunc, PFNGLBLENDFUNCPROC)                               \
  X(BlendFuncSeparate, PFNGLBLENDFUNCSEPARATEPROC)               \
  X(BufferData, PFNGLBUFFERDATAPROC)                             \
  X(CheckFramebufferStatus, PFNGLCHECKFRAMEBUFFERSTATUSPROC)     \
  X(Clear, PFNGLCLEARPROC)                                       \
  X(ClearColor, PFNGLCLEARCOLORPROC)                             \
  X(ClearDepthf, PFNGLCLEARDEPTHFPROC)                           \
  X(ColorMask, PFNGLCOLORMASKPROC)                               \
  X(CompileShader, PFNGLCOMPILESHADERPROC)                       \
  X(CreateProgram, PFNGLCREATEPROGRAMPROC)                       \
  X(CreateShader, PFNGLCREATESHADERPROC)                         \
  X(CullFace, PFNGLCULLFACEPROC)                                 \
  X(DeleteBuffers, PFNGLDELETEBUFFERSPROC)                       \
  X(DeleteFramebuffers, PFNGLDELETEFRAMEBUFFERSPROC)             \
  X(DeleteProgram, PFNGLDELETEPROGRAMPROC)                       \
  X(DeleteRenderbuffers, PFNGLDELETERENDERBUFFERSPROC)           \
  X(DeleteShader, PFNGLDELETESHADERPROC)                         \
  X(DeleteTextures, PFNGLDELETETEXTURESPROC)                     \
  X(DepthFunc, PFNGLDEPTHFUNCPROC)                               \
  X(DepthMask, PFNGLDEPTHMASKPROC)                               \
  X(DepthRangef, PFNGLDEPTHRANGEFPROC)                           \
  X(Disable, PFNGLDISABLEPROC)                                   \
  X(DisableVertexAttribArray, PFNGLDISABLEVERTEXATTRIBARRAYPROC) \
  X(DrawArrays, PFNGLDRAWARRAYSPROC)                             \
  X(DrawElements, PFNGLDRAWELEMENTSPROC)                         \
  X(Enable, PFNGLENABLEPROC)                                     \
  X(EnableVertexAttribArray, PFNGLENABLEVERTEXATTRIBARRAYPROC)   \
  X(Finish, PFNGLFINISHPROC)                                     \
  X(FramebufferRenderbuffer, PFNGLFRAMEBUFFERRENDERBUFFERPROC)   \
  X(FramebufferTexture2D, PFNGLFRAMEBUFFERTEXTURE2DPROC)         \
  X(FrontFace, PFNGLFRONTFACEPROC)                               \
  X(GenBuffers, PFNGLGENBUFFERSPROC)                             \
  X(GenFramebuffers, PFNGLGENFRAMEBUFFERSPROC)                   \
  X(GenRenderbuffers, PFNGLGENRENDERBUFFERSPROC)                 \
  X(GenTextures, PFNGLGENTEXTURESPROC)                           \
  X(GenerateMipmap, PFNGLGENERATEMIPMAPPROC)                     \
  X(GetError, PFNGLGETERRORPROC)                                 \
  X(GetFloatv, PFNGLGETFLOATVPROC)                               \
  X(GetIntegerv, PFNGLGETINTEGERVPROC)                           \
  X(GetProgramInfoLog, PFNGLGETPROGRAMINFOLOGPROC)               \
  X(GetProgramiv, PFNGLGETPROGRAMIVPROC)                         \
  X(GetShaderInfoLog, PFNGLGETSHADERINFOLOGPROC)                 \
  X(GetShaderPrecisionFormat, PFNGLGETSHADERPRECISIONFORMATPROC) \
  X(GetShaderiv, PFNGLGETSHADERIVPROC)                           \
  X(GetString, PFNGLGETSTRINGPROC)                               \
  X(GetUniformLocation, PFNGLGETUNIFORMLOCATIONPROC)             \
  X(IsEnabled, PFNGLISENABLEDPROC)                               \
  X(LinkProgram, PFNGLLINKPROGRAMPROC)                           \
  X(PixelStorei, PFNGLPIXELSTOREIPROC)                           \
  X(ReadPixels, PFNGLREADPIXELSPROC)                             \
  X(RenderbufferStorage, PFNGLRENDERBUFFERSTORAGEPROC)           \
  X(Scissor, PFNGLSCISSORPROC)                                   \
  X(ShaderSource, PFNGLSHADERSOURCEPROC)                         \
  X(TexImage2D, PFNGLTEXIMAGE2DPROC)                             \
  X(TexParameterf, PFNGLTEXPARAMETERFPROC)                       \
  X(TexParameteri, PFNGLTEXPARAMETERIPROC)                       \
  X(TexSubImage2D, PFNGLTEXSUBIMAGE2DPROC)                       \
  X(Uniform1f, PFNGLUNIFORM1FPROC)                               \
  X(Uniform1i, PFNGLUNIFORM1IPROC)                               \
  X(Uniform2f, PFNGLUNIFORM2FPROC)                               \
  X(Uniform3f, PFNGLUNIFORM3FPROC)                               \
  X(Uniform4f, PFNGLUNIFORM4FPROC)                               \
  X(Uniform4fv, PFNGLUNIFORM4FVPROC)                             \
  X(UniformMatrix3fv, PFNGLUNIFORMMATRIX3FVPROC)                 \
  X(UniformMatrix4fv, PFNGLUNIFORMMATRIX4FVPROC)                 \
  X(UseProgram, PFNGLUSEPROGRAMPROC)                             \
  X(VertexAttrib4f, PFNGLVERTEXATTRIB4FPROC)                     \
  X(VertexAttribPointer, PFNGLVERTEXATTRIBPOINTERPROC)           \
  X(Viewport, PFNGLVIEWPORTPROC)

#define RELIT_GL_ES3_FUNCTIONS(X)                    \
  X(BindSampler, PFNGLBINDSAMPLERPROC)               \
  X(BindVertexArray, PFNGLBINDVERTEXARRAYPROC)       \
  X(BlitFramebuffer, PFNGLBLITFRAMEBUFFERPROC)       \
  X(DeleteVertexArrays, PFNGLDELETEVERTEXARRAYSPROC) \
  X(GenVertexArrays, PFNGLGENVERTEXARRAYSPROC)       \
  X(GetStringi, PFNGLGETSTRINGIPROC)                 \
  X(RenderbufferStorageMultisample, PFNGLRENDERBUFFERSTORAGEMULTISAMPLEPROC)

// Null where the context has none.
#define RELIT_GL_OPTIONAL_FUNCTIONS(X)               \
  X(BindVertexArrayOES, PFNGLBINDVERTEXARRAYOESPROC) \
  X(GetGraphicsResetStatus, PFNGLGETGRAPHICSRESETSTATUSEXTPROC)

/// The entry points that this folder calls, named without their "gl". Those of ES 3 are null in a
/// table that was loaded for ES 2, so that nothing of ES 3 can slip into an ES 2 path.
struct Functions {
#define RELIT_GL_MEMBER(name, type) type name = nullptr;
  RELIT_GL_ES2_FUNCTIONS(RELIT_GL_MEMBER)
  RELIT_GL_ES3_FUNCTIONS(RELIT_GL_MEMBER)
  RELIT_GL_OPTIONAL_FUNCTIONS(RELIT_GL_MEMBER)
#undef RELIT_GL_MEMBER

  [[nodiscard]] bool is_es3() const { return BindVertexArray != nullptr; }
};

/// Loads the ES 2 entry points, and those of ES 3 if `es3`. The context must be current. Errors:
/// kEnvironment, naming the first entry point that is missing.
[[nodiscard]] Result<Functions> load_functions(const GetProcAddress& get_proc_address, bool es3);

/// Loads what a context has besides: the reset status under the name that its version or extension
/// gives it (null: none), and vertex arrays of ES 2. (An address alone does not prove that the
/// context has a function.)
void load_optional_functions(const GetProcAddress& get_proc_address, const char* reset_status,
                             bool vertex_arrays, Functions& gl);

/// Makes deleting GL objects do nothing, for a context that is gone with all its objects.
void forget_deletions(Functions& gl);

}  // namespace relit::gles
