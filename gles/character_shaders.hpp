// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "gles/device.hpp"
#include "gles/material_textures.hpp"
#include "gles/plane_pass.hpp"
#include "gles/view.hpp"

namespace relit::gles {

class FusedLight;
struct LightMap;

/// A program that draws meshes, and its uniforms.
struct CharacterShader {
  Program program;
  GLint view_projection = -1, base_color = -1, light_scale = -1, light_map_size = -1,
        light_map_place = -1, alpha_cutoff = -1, wrap = -1;
  PlanePass::Locations planes;     ///< of a fused light
  GLint constant = -1;             ///< likewise
  std::uint64_t fused_serial = 0;  ///< of the fused light's uniforms that the program has
};

/// Attributes are bound to these locations.
enum CharacterAttribute : GLuint { kPosition = 0, kLightMapUv = 1, kAlbedoUv = 2, kColor = 3 };

/// The programs for combinations of material, light and tone map, each compiled when it is first
/// asked for.
class CharacterShaders {
 public:
  /// For meshes lit by a light map. Errors: kEnvironment.
  Result<CharacterShader*> find(const Device& device, const MaterialTexture& material,
                                ToneMap tone_map, const LightMap& map);
  /// For meshes lit by a fused light. Errors: kEnvironment.
  Result<CharacterShader*> find(const Device& device, const MaterialTexture& material,
                                ToneMap tone_map, const FusedLight& fused);

 private:
  Result<CharacterShader*> find(const Device& device, unsigned key, const FusedLight* fused);

  std::map<unsigned, CharacterShader> shaders_;
};

}  // namespace relit::gles
