// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>
#include <vector>

#include "gles/light_map.hpp"

namespace relit::gles {

/// Cross-fades two light maps of one atlas: (1 - weight)·a + weight·b, each filtered bilinearly
/// where its texels are not the result's. The result has `a`'s place, is rounded once more, to its
/// format, and dithered again where that is square roots. A shader is compiled when two kinds of
/// maps are first mixed; besides, nothing is allocated after creation. GL state: see Device.
class LightMapMixer {
 public:
  /// Errors: kInvalid for a size out of range, kLimit, kUnsupported for the format, kEnvironment,
  /// kOutOfMemory.
  static Result<LightMapMixer> create(const Device& device, int width, int height,
                                      LightMapFormat format = LightMapFormat::kAuto);

  /// Errors: kInvalid for a weight outside 0..1 or a map without a texture, kUnsupported for floats
  /// into square roots, kEnvironment.
  Result<LightMap> mix(const LightMap& a, const LightMap& b, float weight);

  /// Reads the last mix as Compositor::read_back() does.
  Status read_back(std::span<float> out);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] std::size_t gpu_bytes() const;

 private:
  struct Shader {
    Program program;
    std::array<GLint, 2> place{-1, -1}, size{-1, -1};
    GLint share = -1;
  };
  Result<Shader*> shader_for(const LightMap& a, const LightMap& b);

  const Device* device_ = nullptr;
  int width_ = 0, height_ = 0;
  LightMapStorage storage_;
  Texture target_;
  FramebufferObject framebuffer_;
  std::array<Shader, 16> shaders_;  // by how the two maps are sampled
  LightMap result_;
  std::vector<float> pixels_;  // read_back()'s
};

}  // namespace relit::gles
