// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "container/records.hpp"
#include "decoders/composite.hpp"
#include "decoders/plane_decoder.hpp"
#include "gles/compositor.hpp"
#include "gles/light_map.hpp"
#include "gles/offscreen.hpp"

namespace relit::player {

/// Which GL draws, and who composites.
enum class Backend {
  kEgl,            ///< EGL without a display, OpenGL ES 3
  kEglEs2,         ///< the same, restricted to OpenGL ES 2
  kEglEs2Mediump,  ///< the same, with half-float fragment arithmetic
  kOsmesa,         ///< Mesa's software renderer, loaded at run time
  kCpu,            ///< composites on the CPU, draws with whichever GL there is
};

/// "egl", "egl-es2", "egl-es2-mediump", "osmesa" or "cpu". Errors: kInvalid.
[[nodiscard]] Result<Backend> parse_backend(const std::string& name);
[[nodiscard]] const char* backend_name(Backend backend);

/// A context of a backend and what it can do.
struct GlBackend {
  std::unique_ptr<gles::OffscreenContext> context;
  std::unique_ptr<gles::Device> device;  ///< destroyed before the context
  GlBackend() = default;
  GlBackend(GlBackend&&) = default;
  GlBackend& operator=(GlBackend&&) = default;
  ~GlBackend() { device.reset(); }
};
/// Creates it, current on this thread. Errors: kEnvironment, saying what to install.
[[nodiscard]] Result<GlBackend> open_backend(Backend backend);

/// Planes and a light -> a light map, on the CPU or the GPU: light map = Σ_n L_n T_n (design,
/// section 2).
class Relighter {
 public:
  /// `device` null: composites on the CPU, and read() is the only way to the result; otherwise it
  /// outlives this object. `on_gpu` says where to composite. Records are borrowed. Errors: those of
  /// gles::Compositor.
  static Result<std::unique_ptr<Relighter>> create(const container::ModelRecord& model,
                                                   std::span<const container::LayerRecord> layers,
                                                   const gles::Device* device, bool on_gpu);

  /// Folds a light into the model. Planes of layers that `decoded` says are not there weigh
  /// nothing; empty: all are. Errors: kInvalid.
  Status set_light(const decoders::Light& light, std::span<const std::uint8_t> decoded = {});

  /// Composites a frame. Steady state allocates nothing. Errors: kInvalid, kEnvironment.
  Status composite(const decoders::FrameView& frame);

  /// The light map as a texture. Requires a device; valid until the next composite.
  Result<gles::LightMap> texture();

  /// The light map itself, radiance for unit albedo, [3][H][W], never clamped. Errors: kInvalid.
  Status read(std::span<float> out);

 private:
  Relighter() = default;

  const container::ModelRecord* model_ = nullptr;
  std::span<const container::LayerRecord> layers_;
  decoders::FoldedWeights folded_;
  std::unique_ptr<gles::Compositor> compositor_;
  std::unique_ptr<gles::LightMapUploader> uploader_;
  std::vector<float> composite_;  ///< the CPU's, [3][H][W], divided by the magnitude
  gles::LightMap light_map_;
};

}  // namespace relit::player
