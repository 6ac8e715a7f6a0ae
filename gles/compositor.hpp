// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "container/base/plane_view.hpp"
#include "gles/light_map.hpp"
#include "gles/plane_sheets.hpp"

namespace relit::gles {

/// The composite in texture space on the GPU: light map = constant + Σ_k w[k] · value_k, one
/// fragment a texel. Planes stay as they were decoded: bytes go up, and mantissa and exponent are
/// joined in the fragment shader (Xu et al., section 3.3; here with signed mantissas and any
/// matrix).
///
/// Everything fits one pass where uniforms and texture units allow it (about 100 planes on ES 3, 27
/// to 48 on ES 2). More planes, and all but the smallest sets with half-float fragments (at most 16
/// lookups a pass, for their addresses must be varyings), take several passes that add up in the
/// half-float target. Values are scaled by a power of two so that no sum leaves the range of half
/// floats, and exponents count from the frame's largest one.
///
/// Steady state allocates nothing. GL state: see Device. One thread, the context's.
class Compositor {
 public:
  /// Compiles the shaders and allocates textures. Errors: kInvalid, kLimit (planes too large),
  /// kUnsupported (no such format; or several passes needed and a target that cannot add),
  /// kEnvironment and kOutOfMemory from the driver. In the last four cases the CPU composite is the
  /// way out.
  static Result<std::unique_ptr<Compositor>> create(const Device& device,
                                                    const PlaneSetDescription& description);

  /// Uploads a frame's planes, as many as were described and as described (bit depth, shifts, sizes
  /// at least the light map's). Those with an empty mantissa view are left out: for planes with
  /// weight 0. What the views point to can go when it returns. Errors: kInvalid; kEnvironment from
  /// GL.
  Status upload(std::span<const PlaneView> planes);

  /// Composites the planes uploaded last. Errors: kInvalid (count of weights, a number that is not
  /// finite, a plane with a weight that was not uploaded), kUnsupported for a light with a
  /// prediction plane, whose models the CPU composites. (s · E(N) would be one more additive pass
  /// at the end of this function: the posed meshes drawn in light-map coordinates, with their
  /// normals as an attribute, s's sheet as a texture and FoldedLight::irradiance as sixteen
  /// uniforms.)
  Result<LightMap> composite(const FoldedLight& light);

  /// Reads the last composite into [3][height][width], not multiplied by the light's magnitude:
  /// what decoders::CompositeJob computes. Negative values survive except from kSquareRoot8. Waits
  /// for the GPU. Errors: kInvalid for the wrong size or before the first composite.
  Status read_back(std::span<float> out);

  [[nodiscard]] LightMapFormat format() const { return storage_.format; }
  [[nodiscard]] int pass_count() const { return static_cast<int>(passes_.size()); }
  /// What textures take on the GPU, and buffers on the CPU, for the memory plan.
  [[nodiscard]] std::size_t gpu_bytes() const;
  [[nodiscard]] std::size_t cpu_bytes() const;

 private:
  // Up to three planes that are fetched together, with one exponent or none.
  struct Group {
    std::array<int, 3> planes{-1, -1, -1};
  };
  // Groups that fetch from the same sheets: one loop of the shader.
  struct Batch {
    int planes_per_group = 1;
    std::array<int, 3> sheets{-1, -1, -1};
    int exponent_sheet = -1;
    bool wide = false;
    std::vector<Group> groups;
    GLint data = -1;  // uniform locations
    GLint count = -1;
    [[nodiscard]] bool same_kind(const Batch& other) const;
    [[nodiscard]] int lookups() const { return planes_per_group + (exponent_sheet >= 0 ? 1 : 0); }
    [[nodiscard]] int stride() const {
      return 2 * planes_per_group + (exponent_sheet >= 0 ? 1 : 0);
    }
  };
  struct Pass {
    std::vector<Batch> batches;
    std::vector<int> sheets;  // by texture unit
    Program program;
    GLint constant = -1;
    GLint to_unit = -1;
    GLint place = -1;  // mediump only
    GLint weight = -1;
  };

  explicit Compositor(const Device& device) : device_(device) {}

  std::vector<Batch> group_planes(const PlaneSetDescription& description) const;
  void split_into_passes(std::vector<Batch> batches);
  Status build_pass(Pass& pass);
  [[nodiscard]] std::string loop_shader(const Pass& pass) const;
  [[nodiscard]] std::string unrolled_shader(const Pass& pass) const;

  void sample_planes(std::span<const PlaneView> planes);
  [[nodiscard]] double sampled_peak(const FoldedLight& light) const;
  Status check_light(const FoldedLight& light) const;
  [[nodiscard]] bool is_active(const Group& group, const FoldedLight& light) const;
  bool draw_pass(const Pass& pass, const FoldedLight& light, bool first);
  int fill_batch(const Batch& batch, const FoldedLight& light);
  void draw_unrolled(const Pass& pass, const FoldedLight& light);
  [[nodiscard]] std::array<float, 4> weight_of(int plane, const FoldedLight& light) const;

  const Device& device_;
  int width_ = 0, height_ = 0;
  LightMapStorage storage_;
  PlaneSheets sheets_;
  std::vector<Pass> passes_;
  Texture target_;
  FramebufferObject framebuffer_;
  LightMap result_;
  double normalisation_ = 1;     // texture = composite / normalisation, except for square roots
  std::vector<float> uniforms_;  // places and weights of a batch, as passed to GL
  std::vector<float> places_;    // mediump: vertex uniforms
  std::vector<float> samples_;   // square roots: [plane][kSamples], for the peak
  std::vector<float> pixels_;    // read_back()'s
};

}  // namespace relit::gles
