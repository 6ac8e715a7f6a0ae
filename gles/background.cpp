// SPDX-License-Identifier: MIT
#include "gles/background.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "container/base/limits.hpp"
#include "gles/light_map.hpp"
#include "gles/shaders.hpp"

namespace relit::gles {
namespace {

constexpr std::string_view kBackgroundAttributes[] = {"a_position"};

// The eight-bit form: bytes are roots of values over their texel's largest, which is in alpha. The
// most that it holds is kRootRange², in means of the environment.
constexpr float kRootRange = 16;

std::array<std::uint8_t, 4> shared_root(const float* rgb) {
  float root[3];
  float most = 1.0f / 255.0f;
  for (int c = 0; c < 3; ++c) {
    root[c] = std::min(std::sqrt(rgb[c]) / kRootRange, 1.0f);
    most = std::max(most, root[c]);
  }
  const float multiplier = std::ceil(most * 255.0f) / 255.0f;
  std::array<std::uint8_t, 4> out{};
  for (std::size_t c = 0; c < 3; ++c)
    out[c] = static_cast<std::uint8_t>(std::min(root[c] / multiplier, 1.0f) * 255.0f + 0.5f);
  out[3] = static_cast<std::uint8_t>(multiplier * 255.0f + 0.5f);
  return out;
}

// From (x, y, 1) in normalised device coordinates to the direction through that point: the
// difference of two points on the ray, which holds for perspective and parallel projections and is
// affine in x, y.
glm::mat3 ray_matrix(const View& view, float rotation_rad) {
  const glm::mat4 inverse = glm::inverse(view.projection * glm::mat4(glm::mat3(view.view)));
  auto ray = [&](float x, float y) {
    const glm::vec4 near = inverse * glm::vec4(x, y, -1, 1);
    const glm::vec4 deep = inverse * glm::vec4(x, y, 0.5f, 1);
    return glm::vec3(deep) / deep.w - glm::vec3(near) / near.w;
  };
  const glm::vec3 origin = ray(0, 0);
  glm::mat3 rays(ray(1, 0) - origin, ray(0, 1) - origin, origin);
  // φ runs from +x to +z, against the sense of a right-handed turn about +y: a light turned by the
  // angle is looked up at φ - angle, which is a right-handed turn of the direction by +angle.
  rays = glm::mat3(glm::rotate(glm::mat4(1.0f), rotation_rad, glm::vec3(0, 1, 0))) * rays;
  const float length = glm::length(rays[2]);
  return length > 0 ? rays / length : rays;
}

}  // namespace

Result<BackgroundRenderer> BackgroundRenderer::create(const Device& device) {
  RELIT_TRY(device.ready("creating a background"));
  // Programs are made when they are first needed; the state that a call leaves is promised all the
  // same.
  const StateGuard guard(device);
  BackgroundRenderer renderer;
  renderer.device_ = &device;
  renderer.half_float_ = device.caps().half_float_texture && device.caps().half_float_linear;
  return renderer;
}

Status BackgroundRenderer::set(const Background& b) {
  RELIT_TRY(device_->ready("setting the background"));
  const bool environment = b.kind == Background::Kind::kEnvironment;
  const bool harmonics = b.kind == Background::Kind::kHarmonics;
  if (environment || harmonics) {
    const std::size_t n = b.harmonics.size();
    const int limit = static_cast<int>(limits::kImageSide);
    if (harmonics && n != 1 && n != 4 && n != 9 && n != 16)
      return fail(ErrorCode::kInvalid, "a background of " + std::to_string(n) +
                                           " spherical harmonics; 1, 4, 9 or 16 are possible");
    if (environment &&
        (b.environment.width < 1 || b.environment.height < 1 || b.environment.width > limit ||
         b.environment.height > limit || b.max_side < 2 || b.max_side > 1024 ||
         !(b.blur_rad >= 0) || b.blur_rad > 3.2f ||
         b.environment.rgb.size() != 3 * static_cast<std::size_t>(b.environment.width) *
                                         static_cast<std::size_t>(b.environment.height)))
      return fail(
          ErrorCode::kInvalid,
          "the background's picture must have 1 to " + std::to_string(limit) +
              " pixels a side and three floats a pixel, its cube map 2 to 1024 texels a side "
              "and its blur 0 to 3.2 rad");
    StateGuard guard(*device_);
    const CubeMap cube = environment
                             ? make_cube_map(b.environment, b.blur_rad,
                                             std::min(b.max_side, device_->caps().max_cube_size))
                             : make_cube_map(b.harmonics, 64);
    Texture texture = upload(cube);
    RELIT_TRY(device_->check("uploading the background"));
    cube_ = std::move(texture);
    cube_scale_ = cube.scale;
  } else {
    for (const std::array<float, 3>& color : {b.top, b.bottom})
      for (const float c : color)
        if (!(c >= 0 && c <= 1))
          return fail(ErrorCode::kInvalid, "the background's colours must be between 0 and 1");
    cube_ = Texture();
  }
  kind_ = b.kind;
  top_ = b.top;
  bottom_ = b.kind == Background::Kind::kColor ? b.top : b.bottom;
  return {};
}

Texture BackgroundRenderer::upload(const CubeMap& cube) const {
  const Functions& gl = device_->gl();
  Texture texture(gl);
  gl.BindTexture(GL_TEXTURE_CUBE_MAP, texture.name());
  gl.TexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  gl.TexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  gl.TexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  gl.TexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  const std::size_t texels =
      static_cast<std::size_t>(cube.side) * static_cast<std::size_t>(cube.side);
  const TextureFormat format = half_float_ ? half_float_format(*device_) : TextureFormat{};
  std::vector<std::uint16_t> halves(half_float_ ? 4 * texels : 0);
  std::vector<std::uint8_t> bytes(half_float_ ? 0 : 4 * texels);
  std::vector<float> face_rgb(3 * texels);
  for (int face = 0; face < 6; ++face) {
    cube.write(face, face_rgb);
    const float* rgb = face_rgb.data();
    for (std::size_t i = 0; i < texels; ++i) {
      if (half_float_) {
        for (std::size_t c = 0; c < 3; ++c) halves[4 * i + c] = to_half(rgb[3 * i + c]);
        halves[4 * i + 3] = 0x3C00;
      } else {
        const std::array<std::uint8_t, 4> texel = shared_root(rgb + 3 * i);
        std::copy(texel.begin(), texel.end(), bytes.begin() + static_cast<std::ptrdiff_t>(4 * i));
      }
    }
    const void* data = half_float_ ? static_cast<const void*>(halves.data()) : bytes.data();
    gl.TexImage2D(GL_TEXTURE_CUBE_MAP_POSITIVE_X + static_cast<GLenum>(face), 0,
                  format.internal_format, cube.side, cube.side, 0, format.format, format.type,
                  data);
  }
  gl.BindTexture(GL_TEXTURE_CUBE_MAP, 0);
  return texture;
}

Status BackgroundRenderer::make_gradient() {
  const std::string_view vertex[] = {shaders::present_vert};
  const std::string_view fragment[] = {shaders::dither, shaders::gradient_frag};
  RELIT_ASSIGN(gradient_, build_program(device_->gl(), device_->profile(),
                                        {"gradient", "", vertex, fragment, kBackgroundAttributes}));
  gradient_top_ = device_->gl().GetUniformLocation(gradient_.name(), "u_top");
  gradient_bottom_ = device_->gl().GetUniformLocation(gradient_.name(), "u_bottom");
  return {};
}

Result<BackgroundRenderer::SkyProgram*> BackgroundRenderer::sky_program(ToneMap tone_map) {
  SkyProgram& sky = skies_[static_cast<std::size_t>(tone_map)];
  if (sky.program) return &sky;
  const std::string defines = "TONE_MAP " + std::to_string(static_cast<int>(tone_map)) + "\n" +
                              (half_float_ ? "" : "SHARED_ROOT 1\n");
  const std::string_view vertex[] = {shaders::background_vert};
  const std::string_view fragment[] = {shaders::dither, shaders::color, shaders::background_frag};
  RELIT_ASSIGN(sky.program,
               build_program(device_->gl(), device_->profile(),
                             {"background", defines, vertex, fragment, kBackgroundAttributes}));
  const Functions& gl = device_->gl();
  sky.rays = gl.GetUniformLocation(sky.program.name(), "u_rays");
  sky.scale = gl.GetUniformLocation(sky.program.name(), "u_scale");
  gl.UseProgram(sky.program.name());
  gl.Uniform1i(gl.GetUniformLocation(sky.program.name(), "u_environment"), 0);
  return &sky;
}

Status BackgroundRenderer::draw(const View& view) {
  if (kind_ == Background::Kind::kKeep) return {};
  const Functions& gl = device_->gl();
  // A clear is cut to the scissor, not to the viewport.
  gl.Enable(GL_SCISSOR_TEST);
  gl.Scissor(view.x, view.y, view.width, view.height);
  gl.ClearColor(0, 0, 0, 0);
  gl.ClearDepthf(1);
  gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  gl.Disable(GL_SCISSOR_TEST);
  if (kind_ == Background::Kind::kTransparent) return {};
  if (kind_ == Background::Kind::kEnvironment || kind_ == Background::Kind::kHarmonics)
    return draw_sky(view);
  if (!gradient_) RELIT_TRY(make_gradient());
  gl.UseProgram(gradient_.name());
  gl.Uniform4f(gradient_top_, top_[0], top_[1], top_[2], 1);
  gl.Uniform4f(gradient_bottom_, bottom_[0], bottom_[1], bottom_[2], 1);
  device_->draw_fullscreen();
  return {};
}

Status BackgroundRenderer::draw_sky(const View& view) {
  const Functions& gl = device_->gl();
  RELIT_ASSIGN(SkyProgram * sky, sky_program(view.tone_map));
  gl.UseProgram(sky->program.name());
  const glm::mat3 rays = ray_matrix(view, rotation_rad_);
  gl.UniformMatrix3fv(sky->rays, 1, GL_FALSE, glm::value_ptr(rays));
  const float range = half_float_ ? 1.0f : kRootRange * kRootRange;
  const float most = device_->profile() == Profile::kEs2Mediump ? 60000.0f : 1e30f;
  gl.Uniform1f(sky->scale, std::min(cube_scale_ * view.exposure * range, most));
  gl.BindTexture(GL_TEXTURE_CUBE_MAP, cube_.name());
  device_->draw_fullscreen();
  gl.BindTexture(GL_TEXTURE_CUBE_MAP, 0);
  return {};
}

}  // namespace relit::gles
