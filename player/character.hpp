// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "container/reader.hpp"
#include "decoders/mesh.hpp"
#include "gles/character_renderer.hpp"

namespace relit::player {

/// The meshes and materials of a clip in GL: what a frame's pose and light map are drawn with.
class Character {
 public:
  /// Decodes the albedo images and uploads everything that stays the same. `contents`, `meshes` and
  /// `device` outlive this object. An image that does not decode is a warning, and its material
  /// goes without. Errors: those of gles::CharacterRenderer.
  static Result<std::unique_ptr<Character>> create(const container::FileContents& contents,
                                                   std::span<const decoders::Mesh> meshes,
                                                   const gles::Device& device);

  [[nodiscard]] gles::CharacterRenderer& renderer() { return *renderer_; }
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  Character(const container::FileContents& contents, std::span<const decoders::Mesh> meshes)
      : contents_(contents), meshes_(meshes) {}
  Status set_materials();
  Status set_meshes();

  const container::FileContents& contents_;
  std::span<const decoders::Mesh> meshes_;
  std::unique_ptr<gles::CharacterRenderer> renderer_;
  std::vector<std::string> warnings_;
};

}  // namespace relit::player
