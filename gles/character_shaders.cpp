// SPDX-License-Identifier: MIT
#include "gles/character_shaders.hpp"

#include "gles/fused_light.hpp"
#include "gles/light_map.hpp"
#include "gles/shaders.hpp"

namespace relit::gles {
namespace {

constexpr std::string_view kAttributes[] = {"a_position", "a_light_map_uv", "a_albedo_uv",
                                            "a_color"};

// What a shader was compiled for; the tone map is in the two lowest bits.
enum : unsigned {
  kTexture = 1u << 2,
  kMask = 1u << 3,
  kBlend = 1u << 4,
  kSquareRoot = 1u << 5,
  kManualBilinear = 1u << 6,
  kWrapInShader = 1u << 7,
};

unsigned key_of(const MaterialTexture& entry, ToneMap tone_map) {
  unsigned key = static_cast<unsigned>(tone_map);
  if (entry.texture >= 0) key |= kTexture;
  if (entry.material.alpha_mode == AlphaMode::kMask) key |= kMask;
  if (entry.material.alpha_mode == AlphaMode::kBlend) key |= kBlend;
  if (entry.wrap_in_shader) key |= kWrapInShader;
  return key;
}

std::string defines_of(unsigned key, const Device& device, bool fused) {
  std::string defines = "TONE_MAP " + std::to_string(key & 3u) + "\n";
  if (key & kTexture) defines += "ALBEDO_TEXTURE 1\n";
  if ((key & kTexture) && !device.is_es3()) defines += "DECODE_ALBEDO 1\n";
  if (key & kMask) defines += "ALPHA_MASK 1\n";
  if (key & kBlend) defines += "ALPHA_BLEND 1\n";
  if (key & kSquareRoot) defines += "SQUARE_ROOT 1\n";
  if (key & kManualBilinear) defines += "MANUAL_BILINEAR 1\n";
  if (key & kWrapInShader) defines += "WRAP_IN_SHADER 1\n";
  if (fused) defines += "FUSED 1\n";
  return defines;
}

}  // namespace

Result<CharacterShader*> CharacterShaders::find(const Device& device,
                                                const MaterialTexture& material, ToneMap tone_map,
                                                const LightMap& map) {
  unsigned key = key_of(material, tone_map);
  if (map.square_root) key |= kSquareRoot;
  if (!map.linear_filter) key |= kManualBilinear;
  return find(device, key, nullptr);
}

Result<CharacterShader*> CharacterShaders::find(const Device& device,
                                                const MaterialTexture& material, ToneMap tone_map,
                                                const FusedLight& fused) {
  return find(device, key_of(material, tone_map), &fused);
}

Result<CharacterShader*> CharacterShaders::find(const Device& device, unsigned key,
                                                const FusedLight* fused) {
  const auto known = shaders_.find(key);
  if (known != shaders_.end()) return &known->second;
  const std::string planes = fused != nullptr ? fused->text() : std::string();
  const std::string_view vertex[] = {shaders::character_vert};
  const std::string_view fragment[] = {shaders::dither, shaders::color, planes,
                                       shaders::character_frag};
  const Functions& gl = device.gl();
  CharacterShader shader;
  RELIT_ASSIGN(shader.program,
               build_program(gl, device.profile(),
                             {"character", defines_of(key, device, fused != nullptr), vertex,
                              fragment, kAttributes}));
  const GLuint program = shader.program.name();
  shader.view_projection = gl.GetUniformLocation(program, "u_view_projection");
  shader.base_color = gl.GetUniformLocation(program, "u_base_color");
  shader.light_scale = gl.GetUniformLocation(program, "u_light_scale");
  shader.light_map_size = gl.GetUniformLocation(program, "u_light_map_size");
  shader.light_map_place = gl.GetUniformLocation(program, "u_light_map_place");
  shader.alpha_cutoff = gl.GetUniformLocation(program, "u_alpha_cutoff");
  shader.wrap = gl.GetUniformLocation(program, "u_wrap");
  gl.UseProgram(program);
  gl.Uniform1i(gl.GetUniformLocation(program, "u_light_map"), 0);
  gl.Uniform1i(gl.GetUniformLocation(program, "u_albedo"), 1);
  if (fused != nullptr) fused->locate(gl, shader);
  return &shaders_.emplace(key, std::move(shader)).first->second;
}

}  // namespace relit::gles
