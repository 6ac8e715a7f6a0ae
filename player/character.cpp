// SPDX-License-Identifier: MIT
#include "player/character.hpp"

#include <algorithm>

#include "decoders/image.hpp"

namespace relit::player {
namespace {

gles::Wrap to_gl(container::Wrap wrap) {
  switch (wrap) {
    case container::Wrap::kRepeat:
      return gles::Wrap::kRepeat;
    case container::Wrap::kClamp:
      return gles::Wrap::kClamp;
    case container::Wrap::kMirror:
      return gles::Wrap::kMirror;
  }
  return gles::Wrap::kRepeat;
}

gles::AlphaMode to_gl(container::AlphaMode mode) {
  switch (mode) {
    case container::AlphaMode::kOpaque:
      return gles::AlphaMode::kOpaque;
    case container::AlphaMode::kMask:
      return gles::AlphaMode::kMask;
    case container::AlphaMode::kBlend:
      return gles::AlphaMode::kBlend;
  }
  return gles::AlphaMode::kOpaque;
}

}  // namespace

Result<std::unique_ptr<Character>> Character::create(const container::FileContents& contents,
                                                     std::span<const decoders::Mesh> meshes,
                                                     const gles::Device& device) {
  std::unique_ptr<Character> character(new Character(contents, meshes));
  RELIT_ASSIGN(character->renderer_, gles::CharacterRenderer::create(device));
  RELIT_TRY(character->set_materials());
  RELIT_TRY(character->set_meshes());
  return character;
}

Status Character::set_materials() {
  std::vector<gles::MaterialView> materials;
  for (const container::MaterialRecord& record : contents_.materials) {
    gles::MaterialView material;
    material.base_color = record.base_color;
    for (std::size_t i = 0; i < contents_.images.size(); ++i) {
      if (static_cast<std::int64_t>(contents_.images[i].id) == record.image_id)
        material.image = static_cast<int>(i);
    }
    material.wrap_u = to_gl(record.wrap_u), material.wrap_v = to_gl(record.wrap_v);
    material.linear_filter = record.linear_filter;
    material.alpha_mode = to_gl(record.alpha_mode);
    material.alpha_cutoff = record.alpha_cutoff;
    materials.push_back(material);
  }
  decoders::DecodedImage image;
  const auto load = [&](std::size_t index) -> std::optional<gles::ImageView> {
    const container::ImageRecord& record = contents_.images[index];
    image = {};  // the one before goes first
    auto decoded = decoders::decode_image(record.bytes, record.media_type);
    if (!decoded) {
      warnings_.push_back("image " + std::to_string(record.id) + ": " + decoded.error().message);
      return std::nullopt;
    }
    image = std::move(*decoded);
    return gles::ImageView{image.width, image.height, image.rgba};
  };
  return renderer_->set_materials(contents_.images.size(), load, materials);
}

Status Character::set_meshes() {
  const std::vector<container::MaterialRecord>& materials = contents_.materials;
  std::vector<gles::MeshView> views;
  for (const decoders::Mesh& mesh : meshes_) {
    gles::MeshView view;
    view.vertex_count = mesh.positions.size();
    view.lightmap_uv = mesh.lightmap_uv;
    view.albedo_uv = mesh.albedo_uv;
    view.colors = mesh.colors;
    view.indices = mesh.indices;
    const auto material =
        std::find_if(materials.begin(), materials.end(),
                     [&](const container::MaterialRecord& m) { return m.id == mesh.material_id; });
    view.material = static_cast<std::uint32_t>(material - materials.begin());
    views.push_back(view);
  }
  return renderer_->set_meshes(views);
}

}  // namespace relit::player
