// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "player/camera.hpp"
#include "player/character.hpp"
#include "player/clip_reader.hpp"
#include "player/light.hpp"
#include "player/relighter.hpp"

namespace relit::player {

/// How a clip is shown, as the user said it.
struct ViewOptions {
  OrbitCamera camera;
  std::string exposure = "auto";     ///< auto, or stops: radiance × 2^stops
  std::string tone_map = "neutral";  ///< neutral, filmic or linear
  std::string background = "light";  ///< light, sh, none or #rrggbb
  double background_blur_deg = 0;
  int layers = -1;  ///< decoded layers, from the most important on; -1: all
  CompositePath composite = CompositePath::kTexture;
};

/// Of ViewOptions::exposure: stops; none for "auto". Errors: kInvalid.
[[nodiscard]] Result<std::optional<double>> parse_exposure(const std::string& text);
/// Of ViewOptions::tone_map. Errors: kInvalid.
[[nodiscard]] Result<gles::ToneMap> parse_tone_map(const std::string& text);

/// A clip in a GL context, under a light, from a camera: what `relit render` and `relit play`
/// share.
class SceneView {
 public:
  /// `clip` and `device` are borrowed. Errors: options that make no sense (kInvalid), those of GL.
  static Result<std::unique_ptr<SceneView>> create(const ClipReader& clip,
                                                   const gles::Device& device,
                                                   const ViewOptions& options);

  /// Takes a light, and its picture as the background. Errors: kInvalid, those of GL.
  Status set_light(const LoadedLight& light);
  /// Takes what the light that set_light() took has become at a time and place; it has no picture.
  /// The exposure stays.
  Status vary_light(const decoders::Light& light);
  /// Composites and poses a frame, which stays until the next one. Call it again after a change of
  /// light.
  Status set_frame(const ClipFrame& frame);
  /// Draws into the framebuffer that is bound, over all of its width × height pixels.
  Status draw(const OrbitCamera& camera, int width, int height);

  [[nodiscard]] const Relighter& relighter() const { return *relighter_; }

  [[nodiscard]] const std::vector<std::string>& warnings() const { return character_->warnings(); }

 private:
  SceneView(const ClipReader& clip, ViewOptions options)
      : clip_(clip), options_(std::move(options)) {}
  Status set_background(const LoadedLight& light);
  Status fold(const decoders::Light& light);

  const ClipReader& clip_;
  ViewOptions options_;
  const ClipFrame* frame_ = nullptr;  // of the last set_frame()
  std::unique_ptr<Relighter> relighter_;
  std::unique_ptr<Character> character_;
  gles::View view_;
};

/// The layers of a clip that are decoded when only the first `layers` are: by layer, 0 or 1.
[[nodiscard]] std::vector<std::uint8_t> decoded_layers(const ClipReader& clip, int layers);

}  // namespace relit::player
