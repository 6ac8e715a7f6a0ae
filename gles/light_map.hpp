// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "gles/device.hpp"
#include "gles/plane_set.hpp"

namespace relit::gles {

/// A light map on the GPU, for CharacterRenderer::draw() and for hosts that draw themselves.
/// Belongs to the object that made it and is valid until that object makes the next one.
///
///     radiance for albedo 1 = max(0, texel filtered at place.xy·uv + place.zw) × scale × magnitude
///
/// where a texel that is a square root is squared after filtering.
struct LightMap {
  GLuint texture = 0;  ///< RGBA, row 0 is v = 0, clamped at the edges, linear where filterable
  int width = 0;
  int height = 0;
  bool square_root = false;  ///< texels are square roots
  bool linear_filter =
      true;             ///< false: the format cannot be filtered here, shaders take four texels
  float scale = 1;      ///< composite = texel (squared, if square_root) × scale
  float magnitude = 1;  ///< exit radiance for albedo 1 = composite × magnitude
  /// From light-map coordinates to the texture's: (1, 1, 0, 0), but for maps of half size, whose
  /// texels are every second one of the full map and lie where those lie.
  std::array<float, 4> place{1, 1, 0, 0};
};

/// A light map's sides at half size, and their LightMap::place.
[[nodiscard]] constexpr int half_side(int side) { return (side + 1) / 2; }
[[nodiscard]] std::array<float, 4> half_place(int width, int height);

/// Which of the formats a light map of this device gets, as a texture format. `render` asks for one
/// that can be drawn into. Errors: kUnsupported when the one asked for does not exist here.
struct LightMapStorage {
  LightMapFormat format = LightMapFormat::kHalfFloat;  ///< never kAuto
  TextureFormat texture;
  bool linear_filter = true;
};
[[nodiscard]] Result<LightMapStorage> choose_light_map_storage(const Device& device,
                                                               LightMapFormat wanted, bool render);

/// Light maps composited on the CPU, as textures of the same kinds. Double-buffered; allocates
/// nothing after creation.
class LightMapUploader {
 public:
  /// Errors: kInvalid for a size out of range, kLimit when textures cannot be that large,
  /// kUnsupported for the format, kOutOfMemory.
  static Result<LightMapUploader> create(const Device& device, int width, int height,
                                         LightMapFormat format = LightMapFormat::kAuto);

  /// Uploads `composite`, [3][height][width], linear, divided by `magnitude` (FoldedLight's).
  /// Values that are not finite become 0; a square-root map drops negative ones. Errors: kInvalid.
  Result<LightMap> upload(std::span<const float> composite, float magnitude);

  [[nodiscard]] std::size_t gpu_bytes() const;
  [[nodiscard]] std::size_t cpu_bytes() const { return texels_.size(); }

 private:
  void pack_float(std::span<const float> composite);
  void pack_half(std::span<const float> composite);
  float pack_square_root(std::span<const float> composite);

  const Device* device_ = nullptr;
  int width_ = 0, height_ = 0;
  LightMapStorage storage_;
  std::array<Texture, 2> textures_;
  std::size_t next_ = 0;
  std::vector<std::uint8_t> texels_;  // as uploaded
};

/// Rounds to the nearest half float (ties to even). Beyond its range: ±65504. NaN becomes 0.
[[nodiscard]] std::uint16_t to_half(float value);

/// The value of a half float; infinities and NaN count as ±65536 and more.
[[nodiscard]] float from_half(std::uint16_t half);

/// Reads RGBA floats from the framebuffer that is bound, bottom row first: 4 × width × height
/// values. A half-float one may give only half floats (ES 2), which are converted. Errors:
/// kEnvironment from GL.
Status read_float_pixels(const Device& device, int width, int height, std::span<float> rgba);

/// Reads a light map whose texture is the colour of the framebuffer that is bound into
/// [3][height][width], texels times `map.scale`. `pixels` is room for 4 × width × height values.
/// Errors: kEnvironment from GL.
Status read_light_map(const Device& device, const LightMap& map, std::span<float> pixels,
                      std::span<float> out);

}  // namespace relit::gles
