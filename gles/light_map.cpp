// SPDX-License-Identifier: MIT
#include "gles/light_map.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "container/base/limits.hpp"

namespace relit::gles {
namespace {

// Threshold of the 8×8 Bayer matrix in [0, 1): the shaders' dither() plus a half.
float bayer(int x, int y) {
  int value = 0;
  for (int bit = 0; bit < 3; ++bit) {
    const int a = (x >> bit) & 1;
    const int b = (y >> bit) & 1;
    value = 4 * value + 2 * (a ^ b) + b;
  }
  return (static_cast<float>(value) + 0.5f) / 64.0f;
}

float finite_or_zero(float value) { return std::isfinite(value) ? value : 0.0f; }

}  // namespace

std::uint16_t to_half(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const auto sign = static_cast<std::uint16_t>((bits >> 16) & 0x8000u);
  const float magnitude = std::bit_cast<float>(bits & 0x7FFFFFFFu);
  if (!(magnitude >= 0)) return 0;
  if (magnitude >= 65504.0f) return static_cast<std::uint16_t>(sign | 0x7BFFu);
  if (magnitude < 6.103515625e-5f) {
    // Subnormal: adding 0.5 leaves the value's multiple of 2^-24 in the low bits, rounded by the
    // FPU.
    const auto shifted = std::bit_cast<std::uint32_t>(magnitude + 0.5f);
    return static_cast<std::uint16_t>(sign | (shifted - 0x3F000000u));
  }
  const std::uint32_t m = bits & 0x7FFFFFFFu;
  const std::uint32_t rounded = m + 0xFFFu + ((m >> 13) & 1u);
  const std::uint32_t half = (rounded >> 13) - ((127u - 15u) << 10);
  return static_cast<std::uint16_t>(sign | std::min(half, 0x7BFFu));
}

float from_half(std::uint16_t half) {
  const int exponent = (half >> 10) & 31;
  const auto mantissa = static_cast<float>(half & 1023);
  const float value =
      exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(mantissa + 1024.0f, exponent - 25);
  return (half & 0x8000) != 0 ? -value : value;
}

Status read_float_pixels(const Device& device, int width, int height, std::span<float> rgba) {
  const Functions& gl = device.gl();
  GLint format = 0;
  GLint type = 0;
  gl.GetIntegerv(GL_IMPLEMENTATION_COLOR_READ_FORMAT, &format);
  gl.GetIntegerv(GL_IMPLEMENTATION_COLOR_READ_TYPE, &type);
  gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
  // EXT_color_buffer_half_float promises floats too, but Mesa's ES 2.0 refuses them.
  const bool half =
      !device.is_es3() && format == GL_RGBA && (type == GL_HALF_FLOAT_OES || type == GL_HALF_FLOAT);
  if (!half) {
    gl.ReadPixels(0, 0, width, height, GL_RGBA, GL_FLOAT, rgba.data());
    return device.check("reading float pixels");
  }
  gl.ReadPixels(0, 0, width, height, GL_RGBA, static_cast<GLenum>(type), rgba.data());
  // The halves fill the first part of the buffer; from the end, none is overwritten before it is
  // read.
  const auto* halves = reinterpret_cast<const std::uint8_t*>(rgba.data());
  for (std::size_t i = rgba.size(); i-- > 0;) {
    std::uint16_t value;
    std::memcpy(&value, halves + 2 * i, sizeof value);
    rgba[i] = from_half(value);
  }
  return device.check("reading half-float pixels");
}

Status read_light_map(const Device& device, const LightMap& map, std::span<float> pixels,
                      std::span<float> out) {
  if (map.square_root) {
    device.gl().ReadPixels(0, 0, map.width, map.height, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
    RELIT_TRY(device.check("reading a light map back"));
  } else {
    RELIT_TRY(read_float_pixels(device, map.width, map.height, pixels));
  }
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(pixels.data());
  const std::size_t texels = out.size() / 3;
  for (std::size_t i = 0; i < texels; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      float value = pixels[4 * i + c];
      if (map.square_root) {
        value = static_cast<float>(bytes[4 * i + c]) / 255.0f;
        value *= value;
      }
      out[c * texels + i] = value * map.scale;
    }
  }
  return {};
}

// Texel X of the half map is texel 2X of the full one: full coordinate p = u·W is X + ½ = p/2 + ¼.
std::array<float, 4> half_place(int width, int height) {
  const double w = half_side(width), h = half_side(height);
  return {static_cast<float>(0.5 * width / w), static_cast<float>(0.5 * height / h),
          static_cast<float>(0.25 / w), static_cast<float>(0.25 / h)};
}

Result<LightMapStorage> choose_light_map_storage(const Device& device, LightMapFormat wanted,
                                                 bool render) {
  const Capabilities& caps = device.caps();
  const bool half = render ? caps.half_float_target : caps.half_float_texture;
  const bool full = render ? caps.float_target : caps.float_texture;
  // Filtering by hand needs addresses that mediump cannot hold.
  const bool by_hand = device.profile() != Profile::kEs2Mediump;
  LightMapStorage storage;
  storage.format = wanted;
  if (wanted == LightMapFormat::kAuto)
    storage.format = half && (caps.half_float_linear || by_hand) ? LightMapFormat::kHalfFloat
                                                                 : LightMapFormat::kSquareRoot8;
  switch (storage.format) {
    case LightMapFormat::kFloat:
      storage.texture = float_format(device);
      storage.linear_filter = caps.float_linear;
      if (!full)
        return fail(ErrorCode::kUnsupported,
                    "this GPU has no 32-bit float light maps; use half floats");
      break;
    case LightMapFormat::kAuto:
    case LightMapFormat::kHalfFloat:
      storage.texture = half_float_format(device);
      storage.linear_filter = caps.half_float_linear;
      if (!half)
        return fail(ErrorCode::kUnsupported,
                    "this GPU has no half-float light maps; use 8-bit ones");
      break;
    case LightMapFormat::kSquareRoot8:
      break;
  }
  if (!storage.linear_filter && !by_hand)
    return fail(ErrorCode::kUnsupported,
                "this GPU cannot filter float light maps; use 8-bit ones (square roots)");
  storage.texture.filter = storage.linear_filter ? GL_LINEAR : GL_NEAREST;
  return storage;
}

Result<LightMapUploader> LightMapUploader::create(const Device& device, int width, int height,
                                                  LightMapFormat format) {
  RELIT_TRY(device.ready("creating a light map"));
  const int limit =
      std::min(static_cast<int>(limits::kLightMapSide), device.caps().max_texture_size);
  if (width < 1 || height < 1)
    return fail(ErrorCode::kInvalid, "a light map needs at least one texel a side");
  if (width > limit || height > limit)
    return fail(ErrorCode::kLimit, "a light map of " + std::to_string(width) + "x" +
                                       std::to_string(height) + " texels; at most " +
                                       std::to_string(limit) + " a side are possible here");
  LightMapUploader uploader;
  uploader.device_ = &device;
  uploader.width_ = width;
  uploader.height_ = height;
  RELIT_ASSIGN(uploader.storage_, choose_light_map_storage(device, format, false));
  StateGuard guard(device);
  for (Texture& texture : uploader.textures_)
    texture = make_texture(device, uploader.storage_.texture, width, height);
  uploader.texels_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                          static_cast<std::size_t>(uploader.storage_.texture.bytes_per_texel));
  RELIT_TRY(device.check("creating light-map textures"));
  return uploader;
}

Result<LightMap> LightMapUploader::upload(std::span<const float> composite, float magnitude) {
  const std::size_t texels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  if (composite.size() != 3 * texels || !(magnitude > 0) || !std::isfinite(magnitude))
    return fail(ErrorCode::kInvalid, "a light map of " + std::to_string(composite.size()) +
                                         " floats; " + std::to_string(3 * texels) +
                                         " and a positive magnitude were expected");
  LightMap map;
  map.width = width_;
  map.height = height_;
  map.magnitude = magnitude;
  map.linear_filter = storage_.linear_filter;
  if (storage_.format == LightMapFormat::kSquareRoot8) {
    map.square_root = true;
    map.scale = pack_square_root(composite);
  } else if (storage_.format == LightMapFormat::kFloat) {
    pack_float(composite);
  } else {
    pack_half(composite);
  }
  RELIT_TRY(device_->ready("uploading a light map"));
  next_ = 1 - next_;
  map.texture = textures_[next_].name();
  const Functions& gl = device_->gl();
  StateGuard guard(*device_);
  gl.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
  gl.BindTexture(GL_TEXTURE_2D, map.texture);
  gl.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width_, height_, storage_.texture.format,
                   storage_.texture.type, texels_.data());
  RELIT_TRY(device_->check("uploading a light map"));
  return map;
}

void LightMapUploader::pack_float(std::span<const float> composite) {
  const std::size_t texels = composite.size() / 3;
  for (std::size_t i = 0; i < texels; ++i) {
    const float rgba[4] = {finite_or_zero(composite[i]), finite_or_zero(composite[texels + i]),
                           finite_or_zero(composite[2 * texels + i]), 1.0f};
    std::memcpy(texels_.data() + 16 * i, rgba, sizeof rgba);
  }
}

void LightMapUploader::pack_half(std::span<const float> composite) {
  const std::size_t texels = composite.size() / 3;
  for (std::size_t i = 0; i < texels; ++i) {
    const std::uint16_t rgba[4] = {to_half(finite_or_zero(composite[i])),
                                   to_half(finite_or_zero(composite[texels + i])),
                                   to_half(finite_or_zero(composite[2 * texels + i])), 0x3C00};
    std::memcpy(texels_.data() + 8 * i, rgba, sizeof rgba);
  }
}

float LightMapUploader::pack_square_root(std::span<const float> composite) {
  const std::size_t texels = composite.size() / 3;
  float peak = 0;
  for (const float value : composite) peak = std::max(peak, finite_or_zero(value));
  if (peak < 1e-30f) peak = 1;
  std::size_t i = 0;
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x, ++i) {
      const float threshold = bayer(x, y);
      for (std::size_t c = 0; c < 3; ++c) {
        const float value = std::max(finite_or_zero(composite[c * texels + i]), 0.0f);
        texels_[4 * i + c] = static_cast<std::uint8_t>(
            std::min(255.0f, 255.0f * std::sqrt(value / peak) + threshold));
      }
      texels_[4 * i + 3] = 255;
    }
  }
  return peak;
}

std::size_t LightMapUploader::gpu_bytes() const { return textures_.size() * texels_.size(); }

}  // namespace relit::gles
