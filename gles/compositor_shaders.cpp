// SPDX-License-Identifier: MIT
#include <algorithm>
#include <bit>

#include "gles/compositor.hpp"
#include "gles/shaders.hpp"

namespace relit::gles {
namespace {

std::string define(const std::string& name, const std::string& value) {
  return "#define " + name + " " + value + "\n";
}

std::string sheet_name(const std::vector<int>& sheets, int sheet) {
  const auto unit = std::find(sheets.begin(), sheets.end(), sheet) - sheets.begin();
  return "u_sheet" + std::to_string(unit);
}

}  // namespace

std::string Compositor::loop_shader(const Pass& pass) const {
  std::string text = "VARYING vec2 v_texel;\n";
  std::string sums;
  for (std::size_t b = 0; b < pass.batches.size(); ++b) {
    const Batch& batch = pass.batches[b];
    const std::string index = std::to_string(b);
    std::string names =
        "BATCH_DATA BATCH_COUNT BATCH_SUM BATCH_GROUPS BATCH_STRIDE BATCH_PLANES "
        "BATCH_MANTISSA BATCH_SHEET_0 BATCH_SHEET_1 BATCH_SHEET_2 BATCH_EXPONENTS ";
    text += define("BATCH_DATA", "u_batch" + index);
    text += define("BATCH_COUNT", "u_count" + index);
    text += define("BATCH_SUM", "sum" + index);
    text += define("BATCH_GROUPS", std::to_string(batch.groups.size()));
    text += define("BATCH_STRIDE", std::to_string(batch.stride()));
    text += define("BATCH_PLANES", std::to_string(batch.planes_per_group));
    text += define("BATCH_MANTISSA", batch.wide ? "mantissa10" : "mantissa8");
    for (int slot = 0; slot < batch.planes_per_group; ++slot)
      text += define("BATCH_SHEET_" + std::to_string(slot),
                     sheet_name(pass.sheets, batch.sheets[static_cast<std::size_t>(slot)]));
    if (batch.exponent_sheet >= 0)
      text += define("BATCH_EXPONENTS", sheet_name(pass.sheets, batch.exponent_sheet));
    text += shaders::composite_loop;
    for (std::size_t at = 0; at < names.size();) {
      const std::size_t end = names.find(' ', at);
      text += "#undef " + names.substr(at, end - at) + "\n";
      at = end + 1;
    }
    sums += "  sum += sum" + index + "(v_texel);\n";
  }
  return text + "void main() {\n  vec3 sum = u_constant;\n" + sums;
}

std::string Compositor::unrolled_shader(const Pass& pass) const {
  if (pass.batches.empty()) return "void main() {\n  vec3 sum = u_constant;\n";
  const Batch& batch = pass.batches.front();
  const int planes = batch.planes_per_group;
  const std::size_t groups = batch.groups.size();
  std::string text =
      "uniform vec4 u_weight[" + std::to_string(groups * static_cast<std::size_t>(planes)) + "];\n";
  text += define("BATCH_PLANES", std::to_string(planes));
  text += define("BATCH_MANTISSA", batch.wide ? "mantissa10" : "mantissa8");
  for (int slot = 0; slot < planes; ++slot)
    text += define("BATCH_SHEET_" + std::to_string(slot),
                   sheet_name(pass.sheets, batch.sheets[static_cast<std::size_t>(slot)]));
  if (batch.exponent_sheet >= 0)
    text += define("BATCH_EXPONENTS", sheet_name(pass.sheets, batch.exponent_sheet));
  text += "void main() {\n  vec3 sum = u_constant;\n";
  std::size_t varying = 0;
  for (std::size_t g = 0; g < groups; ++g) {
    text += define("GROUP", std::to_string(g));
    std::string undefine = "#undef GROUP\n";
    for (int slot = 0; slot < batch.lookups(); ++slot) {
      const std::string name =
          "GROUP_UV_" + (slot < planes ? std::to_string(slot) : std::string("E"));
      text += define(name, "v" + std::to_string(varying++));
      undefine += "#undef " + name + "\n";
    }
    text += shaders::composite_unrolled;
    text += undefine;
  }
  return text;
}

Status Compositor::build_pass(Pass& pass) {
  const bool mediump = device_.profile() == Profile::kEs2Mediump;
  std::string varyings;
  std::string assignments;
  std::size_t lookups = 0;
  if (mediump && !pass.batches.empty())
    lookups = pass.batches.front().groups.size() *
              static_cast<std::size_t>(pass.batches.front().lookups());
  for (std::size_t i = 0; i < lookups; ++i) {
    const std::string v = "v" + std::to_string(i);
    varyings += "VARYING vec2 " + v + ";\n";
    assignments += v + " = PLACE(" + std::to_string(i) + "); ";
  }
  std::string defines;
  if (lookups > 0)
    defines += "LOOKUPS " + std::to_string(lookups) + "\nASSIGN_PLACES " + assignments + "\n";
  if (storage_.format == LightMapFormat::kSquareRoot8) defines += "SQUARE_ROOT 1\n";
  if constexpr (std::endian::native == std::endian::big) defines += "BIG_ENDIAN 1\n";

  std::string uniforms;
  for (std::size_t unit = 0; unit < pass.sheets.size(); ++unit)
    uniforms += "uniform sampler2D u_sheet" + std::to_string(unit) + ";\n";
  if (storage_.format == LightMapFormat::kSquareRoot8) uniforms += "uniform float u_to_unit;\n";
  const std::string body = mediump ? unrolled_shader(pass) : loop_shader(pass);

  const std::string_view vertex[] = {varyings, shaders::composite_vert};
  const std::string_view fragment[] = {
      varyings, uniforms, shaders::dither, shaders::composite_head, body, shaders::composite_tail};
  const std::string_view attributes[] = {"a_position"};
  RELIT_ASSIGN(pass.program, build_program(device_.gl(), device_.profile(),
                                           {"composite", defines, vertex, fragment, attributes}));

  const Functions& gl = device_.gl();
  const GLuint program = pass.program.name();
  pass.constant = gl.GetUniformLocation(program, "u_constant");
  pass.to_unit = gl.GetUniformLocation(program, "u_to_unit");
  pass.place = gl.GetUniformLocation(program, "u_place");
  pass.weight = gl.GetUniformLocation(program, "u_weight");
  for (std::size_t b = 0; b < pass.batches.size(); ++b) {
    pass.batches[b].data = gl.GetUniformLocation(program, ("u_batch" + std::to_string(b)).c_str());
    pass.batches[b].count = gl.GetUniformLocation(program, ("u_count" + std::to_string(b)).c_str());
  }
  gl.UseProgram(program);
  gl.Uniform2f(gl.GetUniformLocation(program, "u_size"), static_cast<float>(width_),
               static_cast<float>(height_));
  for (std::size_t unit = 0; unit < pass.sheets.size(); ++unit)
    gl.Uniform1i(gl.GetUniformLocation(program, ("u_sheet" + std::to_string(unit)).c_str()),
                 static_cast<GLint>(unit));
  return {};
}

}  // namespace relit::gles
