// SPDX-License-Identifier: MIT
#include "gles/program.hpp"

#include <vector>

#include "gles/shaders.hpp"

namespace relit::gles {
namespace {

std::string head(Profile profile, GLenum stage, const std::string& defines) {
  std::string text =
      profile == Profile::kEs3 ? "#version 300 es\n#define RELIT_ES3\n" : "#version 100\n";
  if (stage == GL_FRAGMENT_SHADER) text += "#define RELIT_FRAGMENT\n";
  if (profile == Profile::kEs2Mediump) text += "#define RELIT_MEDIUMP\n";
  for (std::size_t at = 0; at < defines.size();) {
    const std::size_t end = defines.find('\n', at);
    text += "#define " + defines.substr(at, end - at) + '\n';
    if (end == std::string::npos) break;
    at = end + 1;
  }
  return text;
}

std::string shader_log(const Functions& gl, GLuint shader) {
  GLint length = 0;
  gl.GetShaderiv(shader, GL_INFO_LOG_LENGTH, &length);
  std::string log(static_cast<std::size_t>(length > 0 ? length : 0), '\0');
  if (length > 0) gl.GetShaderInfoLog(shader, length, nullptr, log.data());
  return log;
}

std::string program_log(const Functions& gl, GLuint program) {
  GLint length = 0;
  gl.GetProgramiv(program, GL_INFO_LOG_LENGTH, &length);
  std::string log(static_cast<std::size_t>(length > 0 ? length : 0), '\0');
  if (length > 0) gl.GetProgramInfoLog(program, length, nullptr, log.data());
  return log;
}

Result<GLuint> compile(const Functions& gl, Profile profile, GLenum stage,
                       const ProgramSource& source) {
  const std::string first = head(profile, stage, source.defines);
  std::vector<const GLchar*> texts{first.data(), shaders::prelude.data()};
  std::vector<GLint> lengths{static_cast<GLint>(first.size()),
                             static_cast<GLint>(shaders::prelude.size())};
  for (const std::string_view part : stage == GL_VERTEX_SHADER ? source.vertex : source.fragment) {
    texts.push_back(part.data());
    lengths.push_back(static_cast<GLint>(part.size()));
  }
  const GLuint shader = gl.CreateShader(stage);
  gl.ShaderSource(shader, static_cast<GLsizei>(texts.size()), texts.data(), lengths.data());
  gl.CompileShader(shader);
  GLint compiled = GL_FALSE;
  gl.GetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  if (compiled == GL_TRUE) return shader;
  const std::string log = shader_log(gl, shader);
  gl.DeleteShader(shader);
  return fail(ErrorCode::kEnvironment, std::string("the driver refused the ") +
                                           (stage == GL_VERTEX_SHADER ? "vertex" : "fragment") +
                                           " shader of \"" + std::string(source.name) +
                                           "\": " + log);
}

}  // namespace

Result<Program> build_program(const Functions& gl, Profile profile, const ProgramSource& source) {
  RELIT_ASSIGN(const GLuint vertex, compile(gl, profile, GL_VERTEX_SHADER, source));
  auto fragment = compile(gl, profile, GL_FRAGMENT_SHADER, source);
  if (!fragment) {
    gl.DeleteShader(vertex);
    return Unexpected{std::move(fragment).error()};
  }
  Program program(gl);
  gl.AttachShader(program.name(), vertex);
  gl.AttachShader(program.name(), *fragment);
  for (std::size_t i = 0; i < source.attributes.size(); ++i)
    gl.BindAttribLocation(program.name(), static_cast<GLuint>(i),
                          std::string(source.attributes[i]).c_str());
  gl.LinkProgram(program.name());
  // Deleted with the program they are attached to.
  gl.DeleteShader(vertex);
  gl.DeleteShader(*fragment);
  GLint linked = GL_FALSE;
  gl.GetProgramiv(program.name(), GL_LINK_STATUS, &linked);
  if (linked == GL_TRUE) return program;
  return fail(ErrorCode::kEnvironment, "the driver could not link the program \"" +
                                           std::string(source.name) +
                                           "\": " + program_log(gl, program.name()));
}

}  // namespace relit::gles
