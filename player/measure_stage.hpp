// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gles/picture.hpp"
#include "player/character.hpp"
#include "player/gl_backend.hpp"
#include "player/measure_frames.hpp"
#include "player/posed_meshes.hpp"
#include "player/relighter.hpp"

namespace relit::player {

/// A clip's character in front of a camera, in a GL context of its own: where points are drawn,
/// timed and photographed. One thread, on which no other kind of context has been.
class MeasureStage {
 public:
  struct Picture {
    int side = 512;   ///< pixels
    int samples = 4;  ///< gles::FramebufferOptions::samples
  };
  /// `clip` outlives it. Errors: kEnvironment without such a backend; those of Character.
  static Result<std::unique_ptr<MeasureStage>> create(Backend backend, const ClipReader& clip,
                                                      const Picture& picture);

  [[nodiscard]] const gles::Device& device() const { return *gl_.device; }
  /// Waits until the GPU has done everything.
  void finish() const { gl_.device->gl().Finish(); }

  /// The exposure that suits the light.
  void expose(const decoders::Light& light);
  /// Puts the meshes where they are at a moment.
  Status pose(const FrameMix& mix);
  /// Draws with a relighter's light of the moment, or with a light map that is uploaded,
  /// [3][height][width].
  Status draw(Relighter& light);
  Status draw(std::span<const float> light_map, int width, int height);
  /// The picture that was drawn, RGBA, straight alpha, transparent beside the character.
  Result<std::vector<std::uint8_t>> read();

 private:
  MeasureStage(GlBackend gl, const ClipReader& clip) : gl_(std::move(gl)), posed_(clip.meshes()) {}

  GlBackend gl_;
  std::unique_ptr<Character> character_;
  std::optional<gles::Framebuffer> framebuffer_;
  PosedMeshes posed_;
  decoders::Pose blended_;
  gles::View view_;
};

}  // namespace relit::player
