// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bake_minimal/scene.hpp"
#include "container/base/result.hpp"
#include "container/records.hpp"

namespace relit::bake {

/// The materials and images that the meshes need, numbered anew.
struct PackedMaterials {
  std::vector<container::MaterialRecord> materials;
  std::vector<container::ImageRecord> images;
  /// The images' texels, 8-bit sRGB with straight alpha, as the player will see them; as `images`.
  std::vector<Image> texels;
  std::vector<int> packed_index;    ///< by Scene::materials; -1: unused
  std::vector<TextureUse> texture;  ///< by packed material: whose UV set and transform hold; image
                                    ///< is into `images`
  std::vector<std::string> warnings;
};

/// Packs the materials listed in `used` (indices into Scene::materials). Albedo is base colour
/// times (1 − metallic) in linear light: a metallic texture is multiplied into a new PNG where it
/// shares the base colour texture's UV set, transform and wrapping, or stands alone; otherwise its
/// mean is taken and a warning given. Images that need no change pass through byte for byte; equal
/// ones are stored once. Errors: kInvalid (indices, texels that are missing), kEnvironment (no PNG
/// encoder).
[[nodiscard]] Result<PackedMaterials> pack_materials(const Scene& scene, std::span<const int> used);

}  // namespace relit::bake
