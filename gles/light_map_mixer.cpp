// SPDX-License-Identifier: MIT
#include "gles/light_map_mixer.hpp"

#include <cmath>

#include "gles/shaders.hpp"

namespace relit::gles {
namespace {

// How a map is sampled: two bits.
unsigned kind_of(const LightMap& map) {
  return (map.square_root ? 1u : 0u) | (map.linear_filter ? 0u : 2u);
}

std::string defines_of(unsigned kind, const char* name) {
  std::string defines;
  if (kind & 1u) defines += std::string("ROOT_") + name + " 1\n";
  if (kind & 2u) defines += std::string("MANUAL_") + name + " 1\n";
  return defines;
}

}  // namespace

Result<LightMapMixer> LightMapMixer::create(const Device& device, int width, int height,
                                            LightMapFormat format) {
  RELIT_TRY(device.ready("creating a light-map mixer"));
  if (width < 1 || height < 1)
    return fail(ErrorCode::kInvalid, "a light map needs at least one texel a side");
  if (width > device.caps().max_texture_size || height > device.caps().max_texture_size)
    return fail(ErrorCode::kLimit, "a light map of " + std::to_string(width) + "x" +
                                       std::to_string(height) +
                                       " texels is larger than textures can be here");
  LightMapMixer mixer;
  mixer.device_ = &device;
  mixer.width_ = width;
  mixer.height_ = height;
  RELIT_ASSIGN(mixer.storage_, choose_light_map_storage(device, format, true));
  StateGuard guard(device);
  const Functions& gl = device.gl();
  mixer.target_ = make_texture(device, mixer.storage_.texture, width, height);
  mixer.framebuffer_ = FramebufferObject(gl);
  gl.BindFramebuffer(GL_FRAMEBUFFER, mixer.framebuffer_.name());
  gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, mixer.target_.name(),
                          0);
  if (gl.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    return fail(ErrorCode::kUnsupported, "the GPU refuses to draw into a light map");
  RELIT_TRY(device.check("creating a light-map mixer"));
  return mixer;
}

Result<LightMapMixer::Shader*> LightMapMixer::shader_for(const LightMap& a, const LightMap& b) {
  Shader& shader = shaders_[kind_of(a) + 4 * kind_of(b)];
  if (shader.program) return &shader;
  std::string defines = defines_of(kind_of(a), "A") + defines_of(kind_of(b), "B");
  if (storage_.format == LightMapFormat::kSquareRoot8) defines += "SQUARE_ROOT 1\n";
  const std::string_view vertex[] = {shaders::mix_vert};
  const std::string_view fragment[] = {shaders::dither, shaders::mix_frag};
  const std::string_view attributes[] = {"a_position"};
  const Functions& gl = device_->gl();
  RELIT_ASSIGN(shader.program, build_program(gl, device_->profile(),
                                             {"mix", defines, vertex, fragment, attributes}));
  const GLuint program = shader.program.name();
  shader.place[0] = gl.GetUniformLocation(program, "u_place_a");
  shader.place[1] = gl.GetUniformLocation(program, "u_place_b");
  shader.size[0] = gl.GetUniformLocation(program, "u_size_a");
  shader.size[1] = gl.GetUniformLocation(program, "u_size_b");
  shader.share = gl.GetUniformLocation(program, "u_share");
  gl.UseProgram(program);
  gl.Uniform1i(gl.GetUniformLocation(program, "u_map_a"), 0);
  gl.Uniform1i(gl.GetUniformLocation(program, "u_map_b"), 1);
  return &shader;
}

Result<LightMap> LightMapMixer::mix(const LightMap& a, const LightMap& b, float weight) {
  RELIT_TRY(device_->ready("mixing light maps"));
  if (a.texture == 0 || b.texture == 0 || !(weight >= 0) || weight > 1)
    return fail(ErrorCode::kInvalid, "mixing needs two light maps and a weight from 0 to 1");
  const bool roots = storage_.format == LightMapFormat::kSquareRoot8;
  if (roots && !(a.square_root && b.square_root))
    return fail(ErrorCode::kUnsupported,
                "light maps of floats do not mix into square roots, whose peak must be known");
  const double share_a = (1 - static_cast<double>(weight)) * static_cast<double>(a.scale);
  const double share_b = static_cast<double>(weight) * static_cast<double>(b.scale) *
                         static_cast<double>(b.magnitude) / static_cast<double>(a.magnitude);
  // With shares that sum to one the result stays in the range that its parts' texels have.
  const double scale = share_a + share_b;
  if (!(scale > 0) || !std::isfinite(static_cast<float>(scale)))
    return fail(ErrorCode::kInvalid, "the light maps' scales are too far apart to be mixed");
  const Functions& gl = device_->gl();
  StateGuard guard(*device_, 2);
  RELIT_ASSIGN(Shader * shader, shader_for(a, b));
  gl.UseProgram(shader->program.name());
  // In `a`'s own texture coordinates t = a.place.xy·uv + a.place.zw.
  std::array<std::array<float, 4>, 2> place{{{1, 1, 0, 0}, b.place}};
  for (std::size_t i = 0; i < 2; ++i) {
    place[1][i] = b.place[i] / a.place[i];
    place[1][i + 2] = b.place[i + 2] - place[1][i] * a.place[i + 2];
  }
  for (const std::size_t i : {std::size_t{1}, std::size_t{0}}) {
    const LightMap& map = i == 0 ? a : b;
    const auto width = static_cast<float>(map.width), height = static_cast<float>(map.height);
    gl.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(i));
    gl.BindTexture(GL_TEXTURE_2D, map.texture);
    gl.Uniform4f(shader->place[i], place[i][0], place[i][1], place[i][2], place[i][3]);
    gl.Uniform4f(shader->size[i], width, height, 1 / width, 1 / height);
  }
  gl.Uniform2f(shader->share, static_cast<float>(share_a / scale),
               static_cast<float>(share_b / scale));
  gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  gl.Viewport(0, 0, width_, height_);
  device_->draw_fullscreen();
  result_ = {};
  result_.texture = target_.name();
  result_.width = width_;
  result_.height = height_;
  result_.square_root = roots;
  result_.linear_filter = storage_.linear_filter;
  result_.scale = static_cast<float>(scale);
  result_.magnitude = a.magnitude;
  result_.place = a.place;
  RELIT_TRY(device_->check("mixing light maps"));
  return result_;
}

Status LightMapMixer::read_back(std::span<float> out) {
  RELIT_TRY(device_->ready("reading a light map back"));
  const std::size_t texels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  if (result_.texture == 0 || out.size() != 3 * texels)
    return fail(ErrorCode::kInvalid, "reading back a light map needs room for " +
                                         std::to_string(3 * texels) + " floats");
  StateGuard guard(*device_);
  pixels_.resize(4 * texels);
  device_->gl().BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  return read_light_map(*device_, result_, pixels_, out);
}

std::size_t LightMapMixer::gpu_bytes() const {
  return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) *
         static_cast<std::size_t>(storage_.texture.bytes_per_texel);
}

}  // namespace relit::gles
