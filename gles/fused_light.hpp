// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gles/character_shaders.hpp"
#include "gles/plane_pass.hpp"

namespace relit::gles {

/// A composite that has not been made: planes and weights for the shader that draws the meshes,
/// which sums the four texels around each fragment and filters them bilinearly, as it would a light
/// map. Cheaper where the meshes cover few pixels. Belongs to a Compositor, see Compositor::fuse().
class FusedLight {
 public:
  /// Errors: kUnsupported where the planes do not fit one shader.
  static Result<std::unique_ptr<FusedLight>> create(const Device& device,
                                                    const PlaneSetDescription& description,
                                                    const PlaneSheets& sheets);

  /// Errors: as Compositor::composite().
  Status set(const FoldedLight& light, const FrameSlots& frames);

  /// Composite × scale × magnitude is the exit radiance for albedo 1.
  [[nodiscard]] float scale() const { return scale_; }
  [[nodiscard]] float magnitude() const { return magnitude_; }

  /// For CharacterRenderer: the text that gives `vec3 fused_light(vec2 uv)`; units 0 and 2 onwards
  /// are the planes', 1 the material's.
  [[nodiscard]] std::string text() const;
  [[nodiscard]] int unit_count() const { return pass_.unit_count() + 1; }
  /// A program's uniforms, found once.
  void locate(const Functions& gl, CharacterShader& shader) const;
  /// Binds the planes' textures; leaves unit 0 active.
  void bind(const Functions& gl) const;
  /// Sets the weights of the program in use, unless it has them already.
  void apply(const Functions& gl, CharacterShader& shader) const;
  /// The programs that were compiled with its text of the moment.
  [[nodiscard]] CharacterShaders& shaders() { return variants_[variant_].shaders; }

 private:
  explicit FusedLight(const PlaneSheets& sheets) : sheets_(sheets) {}

  const PlaneSheets& sheets_;
  PlanePass pass_;
  PlanePass::Weights weights_;
  std::array<float, 3> constant_{};
  float scale_ = 1, magnitude_ = 1;
  FrameSlots frames_;
  int width_ = 0, height_ = 0;
  std::uint64_t serial_ = 0;  // of the weights
  struct Variant {
    std::vector<int> counts;
    CharacterShaders shaders;
  };
  std::vector<Variant> variants_;  // by number of planes
  std::size_t variant_ = 0;
};

}  // namespace relit::gles
