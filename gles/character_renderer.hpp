// SPDX-License-Identifier: MIT
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "gles/background.hpp"
#include "gles/character_shaders.hpp"
#include "gles/fused_light.hpp"
#include "gles/light_map.hpp"
#include "gles/material_textures.hpp"
#include "gles/view.hpp"

namespace relit::gles {

/// One mesh as set_meshes() reads it. Optional spans are empty or have vertex_count entries.
struct MeshView {
  std::size_t vertex_count = 0;            ///< 1 to 65 535
  std::span<const glm::vec2> lightmap_uv;  ///< in [0,1]; v = 0 is the light map's row 0
  std::span<const glm::vec2> albedo_uv;    ///< optional: the same as lightmap_uv
  std::span<const glm::u8vec4> colors;     ///< optional; linear, straight alpha
  std::span<const std::uint16_t> indices;  ///< triangles, counter-clockwise from the front
  std::uint32_t material = 0;              ///< into set_materials()'s
};

/// Draws meshes whose light is in a light map: picture = sRGB(tone map(exposure × magnitude × light
/// map × albedo)), dithered, over a background. The light map is filtered bilinearly and clamped at
/// zero after that. Only front faces are drawn. Opaque and masked meshes come first; blended ones
/// after them, the farthest first, over the display values that are there.
///
/// Call set_materials(), set_meshes(), update_positions() for every mesh, then draw(). draw() and
/// update_positions() allocate nothing but what the driver does; a shader is compiled when a
/// combination of material, light map and tone map is first drawn. GL state: see Device. One
/// thread, the context's.
class CharacterRenderer {
 public:
  /// Errors: kEnvironment.
  static Result<std::unique_ptr<CharacterRenderer>> create(const Device& device);

  /// Replaces all materials. The images can go when it returns. On failure the old ones stay.
  /// Errors: kInvalid, kOutOfMemory, kEnvironment.
  Status set_materials(std::span<const ImageView> images, std::span<const MaterialView> materials);
  /// The same of images that are loaded one at a time; see MaterialTextures::create().
  Status set_materials(std::size_t image_count, const ImageLoader& load,
                       std::span<const MaterialView> materials);

  /// Replaces all meshes; their positions are then unknown and they are not drawn until they are
  /// given. What the views point to can go when it returns. Errors: kInvalid for counts that
  /// disagree, an index out of range or a texture coordinate that is not finite, kLimit,
  /// kOutOfMemory.
  Status set_meshes(std::span<const MeshView> meshes);

  /// The posed vertices of a mesh, model space, vertex_count of them. Of GL's state it touches only
  /// the array buffer's binding, which it leaves empty. Errors: kInvalid.
  Status update_positions(std::size_t mesh, std::span<const glm::vec3> positions);

  /// What is behind the meshes.
  [[nodiscard]] BackgroundRenderer& background() { return background_; }

  /// Draws into the framebuffer that is bound, which has a depth buffer, within the view's
  /// rectangle. A framebuffer with multisampling smooths edges (see Framebuffer). Errors: kInvalid
  /// for a view or a light map that is not finite, or a mesh whose material does not exist;
  /// kEnvironment from GL.
  Status draw(const View& view, const LightMap& light_map);
  /// The same picture, with a light that is composited in the meshes' shader.
  Status draw(const View& view, FusedLight& light);
  /// The background without meshes. Errors: as draw().
  Status draw_background(const View& view);

  /// Buffers and textures, for the memory plan.
  [[nodiscard]] std::size_t gpu_bytes() const;

 private:
  struct Mesh {
    std::size_t vertex_count = 0;
    GLsizei index_count = 0;
    std::uint32_t material = 0;
    bool has_albedo_uv = false;
    bool has_color = false;
    bool has_positions = false;
    glm::vec3 centre{0.0f};  // of the positions' box; blended meshes are sorted by it
    Buffer positions;
    Buffer attributes;  // light-map UVs, then albedo UVs, then colours
    Buffer indices;
    VertexArray array;
  };
  // One of two.
  struct Light {
    const LightMap* map = nullptr;
    FusedLight* fused = nullptr;
    [[nodiscard]] float scale() const {
      return map != nullptr ? map->scale * map->magnitude : fused->scale() * fused->magnitude();
    }
  };

  explicit CharacterRenderer(const Device& device) : device_(device) {}

  Status check_mesh(const MeshView& mesh, std::size_t index) const;
  Mesh upload_mesh(const MeshView& view) const;
  void set_attributes(const Mesh& mesh) const;
  void draw_mesh(const Mesh& mesh) const;
  void sort_meshes(const View& view);
  Status draw(const View& view, const Light& light);
  Status draw_with_material(const Mesh& mesh, const View& view, const Light& light);
  void set_light(const CharacterShader& shader, const View& view, const Light& light) const;

  const Device& device_;
  BackgroundRenderer background_;
  MaterialTextures materials_;
  std::vector<Mesh> meshes_;
  std::vector<std::uint32_t> order_;  // of drawing: opaque by material, then blended by depth
  std::vector<float> depths_;
  CharacterShaders shaders_;  // for light maps
  glm::mat4 view_projection_{1.0f};
  std::size_t mesh_bytes_ = 0;
};

}  // namespace relit::gles
