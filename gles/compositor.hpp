// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "container/base/plane_view.hpp"
#include "gles/fused_light.hpp"
#include "gles/light_map.hpp"
#include "gles/light_map_mixer.hpp"
#include "gles/plane_pass.hpp"
#include "gles/plane_sheets.hpp"

namespace relit::gles {

/// The composite on the GPU: light map = constant + Σ_k w[k] · value_k + s · E(N). Planes stay as
/// they were decoded: bytes go up, and mantissa and exponent are joined in the fragment shader (Xu
/// et al., section 3.3; here with signed mantissas and any matrix). composite() adds in texture
/// space, one fragment a texel; fuse() leaves the sum to the shader that draws the meshes.
///
/// s · E(N) is for models with a prediction: s is one of their planes, E(N) = Σ_{n<9}
/// FoldedLight::irradiance[n] · Y_n(N), and N is what three more planes hold, which the host makes
/// for each posed frame and uploads with its planes (see PlaneSetDescription::normal_planes).
/// Without any of these four in the slot, s · E(N) counts as zero. It takes four lookups, five with
/// exponents, and nine uniforms a frame. The 16 bits of N move E(N) by at most 5e-5 · Σ_n
/// |irradiance[n]|: ½/32767 a coordinate, and Y_6, the steepest, climbs by 1.9.
///
/// In texture space everything fits one pass where uniforms and texture units allow it (200 planes
/// and more on ES 3, some 100 on most of ES 2). More planes, and all but the smallest sets with
/// half-float fragments (at most 16 lookups a pass, for their addresses must be varyings), take
/// several passes that add up in the half-float target. Values are scaled by a power of two so that
/// no sum leaves the range of half floats, and exponents count from the frame's largest one.
///
/// Where planes change every frame there are two slots that hold a frame each, and a blend of both
/// is the same sum with twice the planes. Shaders are straight lines for the number of planes that
/// have a weight, in a few shades, and compiled when first needed: with the light's first frame,
/// with its first blend. Besides, steady state allocates nothing. GL state: see Device. One thread,
/// the context's.
class Compositor {
 public:
  /// Compiles the shaders and allocates textures. Errors: kInvalid, kLimit (planes too large),
  /// kUnsupported (no such format; or several passes needed and a target that cannot add),
  /// kEnvironment and kOutOfMemory from the driver. In the last four cases the CPU composite is the
  /// way out.
  static Result<std::unique_ptr<Compositor>> create(const Device& device,
                                                    const PlaneSetDescription& description);

  /// Uploads a frame's planes to a slot, as many as were described and as described (bit depth,
  /// shifts, sizes at least the light map's, the scale of normals). Those with an empty mantissa
  /// view, or with 0 in `wanted` (empty: all are wanted), are left out and count as zero; with
  /// `keep`, planes that the slot has of the same frame stay and are not uploaded again. What the
  /// views point to can go when it returns. Errors: kInvalid; kEnvironment from GL.
  Status upload(std::span<const PlaneView> planes, int slot,
                std::span<const std::uint8_t> wanted = {}, bool keep = false);
  /// The same to the slot that was not used last.
  Status upload(std::span<const PlaneView> planes);
  [[nodiscard]] int slot_count() const { return sheets_.slot_count(); }
  [[nodiscard]] bool holds(std::size_t plane, int slot) const {
    return sheets_.state(plane, slot).present;
  }

  /// Composites frames that were uploaded. `half_size`: every second texel of every second row, see
  /// LightMap::place. Errors: kInvalid (nothing uploaded, count of weights, another prediction
  /// plane than the described one, a weight of a normal, a number that is not finite).
  Result<LightMap> composite(const FoldedLight& light, const FrameSlots& frames,
                             bool half_size = false);
  /// The frame uploaded last.
  Result<LightMap> composite(const FoldedLight& light);

  /// The same sum for CharacterRenderer::draw() to take where it is seen. Valid, with the planes of
  /// the moment, until the next upload to a slot in use or the next fuse(). Errors: as composite();
  /// kUnsupported where the planes do not fit one shader besides the material's texture, or where
  /// fragments are half floats, which cannot address texels.
  Result<FusedLight*> fuse(const FoldedLight& light, const FrameSlots& frames);
  /// Whether fuse() can work, without a light. Errors: kUnsupported, saying why not.
  Status prepare_fused();

  /// Reads the last composite into [3][height][width] of its size, not multiplied by the light's
  /// magnitude: what decoders::CompositeJob computes. Negative values survive except from
  /// kSquareRoot8. Waits for the GPU. Errors: kInvalid for the wrong size or before the first
  /// composite.
  Status read_back(std::span<float> out);

  [[nodiscard]] LightMapFormat format() const { return storage_.format; }
  /// Passes for one frame; for a blend of two.
  [[nodiscard]] int pass_count() const;
  [[nodiscard]] int blend_pass_count() const { return static_cast<int>(passes_.size()); }
  /// What textures take on the GPU, and buffers on the CPU, for the memory plan.
  [[nodiscard]] std::size_t gpu_bytes() const;
  [[nodiscard]] std::size_t cpu_bytes() const;

 private:
  // A shader for so many groups of each batch of a pass; for any number where lookups are varyings.
  struct Shader {
    std::vector<int> counts;
    PlanePass::Locations locations;
    Program program;
    GLint constant = -1;
    GLint texels = -1;
    GLint to_unit = -1;
  };
  struct Pass {
    PlanePass planes;
    PlanePass::Weights weights;
    std::vector<Shader> shaders;
  };
  struct Target {
    int width = 0, height = 0;
    Texture texture;
    FramebufferObject framebuffer;
  };

  explicit Compositor(const Device& device) : device_(device) {}

  [[nodiscard]] bool has_lookups() const;
  Result<Shader> build_shader(const Pass& pass, std::span<const int> counts) const;
  Status build_first_shader();
  Result<Shader*> shader_for(Pass& pass);
  Status make_target(Target& target, int width, int height) const;
  void sample_planes(std::span<const PlaneView> planes, int slot);
  [[nodiscard]] double sampled_peak(const FoldedLight& light, const FrameSlots& frames) const;
  [[nodiscard]] std::array<double, 3> sampled_sum(const FoldedLight& light, int slot,
                                                  std::size_t sample) const;
  struct Drawing {
    const FoldedLight& light;
    const FrameSlots& frames;
    double normalisation;
    std::array<float, 4> texels;
  };
  Result<LightMap> composite_into(Target& target, const FoldedLight& light,
                                  const FrameSlots& frames, bool half_size);
  Result<LightMap> composite_apart(const FoldedLight& light, const FrameSlots& frames,
                                   bool half_size);
  Result<bool> draw_pass(Pass& pass, const Drawing& drawing, bool first);

  const Device& device_;
  PlaneSetDescription description_;
  LightMapStorage storage_;
  PlaneSheets sheets_;
  std::vector<Pass> passes_;
  bool can_add_ = false;
  std::array<Target, 4> targets_;  // full size, half size; the same for composite_apart()'s second
  std::array<std::unique_ptr<LightMapMixer>, 2> mixers_;  // composite_apart()'s, likewise
  std::unique_ptr<FusedLight> fused_;
  LightMap result_;
  const Target* drawn_ = nullptr;
  LightMapMixer* mixed_ = nullptr;  // who holds the last composite instead of drawn_; null: nobody
  int last_slot_ = -1;
  std::vector<float> samples_;  // square roots: [slot][plane][kSamples], for the peak
  std::vector<float> pixels_;   // read_back()'s
};

}  // namespace relit::gles
