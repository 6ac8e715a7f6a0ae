// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>

#include "gles/device.hpp"
#include "gles/environment.hpp"
#include "gles/view.hpp"

namespace relit::gles {

/// What is seen behind the meshes.
struct Background {
  enum class Kind {
    kTransparent,  ///< nothing: alpha 0; the picture is premultiplied
    kColor,        ///< `top`, everywhere
    kGradient,     ///< from `bottom` to `top` of the picture
    kEnvironment,  ///< the picture of the light, exposed and tone mapped like the meshes
    kHarmonics,    ///< the radiance that spherical harmonics give back, likewise
    kKeep,         ///< what the framebuffer holds: colour and depth stay
  };
  Kind kind = Kind::kTransparent;
  std::array<float, 3> top{};  ///< sRGB display values 0..1, neither exposed nor tone mapped
  std::array<float, 3> bottom{};
  EnvironmentView environment;  ///< kEnvironment; read by set() only
  float blur_rad = 0;           ///< standard deviation of a soft focus; kEnvironment
  int max_side = 256;           ///< of the cube map's faces, texels: 2..1024; 256 takes 3 MiB
  std::span<const std::array<float, 3>>
      harmonics;  ///< kHarmonics: 1, 4, 9 or 16; read by set() only
};

/// Keeps and draws a background. GL state: see Device.
class BackgroundRenderer {
 public:
  /// Errors: kEnvironment.
  static Result<BackgroundRenderer> create(const Device& device);

  /// Takes a background; environments become cube maps here, which takes a while. On failure the
  /// old one stays. Errors: kInvalid for sizes or counts that make no sense, kEnvironment,
  /// kOutOfMemory.
  Status set(const Background& background);

  /// Turns the light about +Y: `angle_rad` is added to φ.
  void set_rotation(float angle_rad) { rotation_rad_ = angle_rad; }

  /// Fills the view's rectangle of the bound framebuffer, depth included (to 1), or keeps it.
  /// Inside a StateGuard.
  Status draw(const View& view);

 private:
  struct SkyProgram {
    Program program;
    GLint rays = -1;
    GLint scale = -1;
  };
  Result<SkyProgram*> sky_program(ToneMap tone_map);
  Status make_gradient();
  Texture upload(const CubeMap& cube) const;
  Status draw_sky(const View& view);

  const Device* device_ = nullptr;
  bool half_float_ = false;
  Background::Kind kind_ = Background::Kind::kTransparent;
  std::array<float, 3> top_{}, bottom_{};
  float rotation_rad_ = 0;
  Texture cube_;
  float cube_scale_ = 1;
  std::array<SkyProgram, 3> skies_;  // by tone map, compiled when first used
  Program gradient_;                 // likewise
  GLint gradient_top_ = -1, gradient_bottom_ = -1;
};

}  // namespace relit::gles
