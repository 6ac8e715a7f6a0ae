// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "container/base/plane_view.hpp"
#include "gles/flat_weights.hpp"
#include "gles/plane_sheets.hpp"

namespace relit::gles {

/// The frames that a composite adds up, by the slots of PlaneSheets that hold them: (1 -
/// blend)·from
/// + blend·to.
struct FrameSlots {
  int from = 0;
  int to = -1;  ///< -1: none
  float blend = 0;

  static constexpr int kRoles = 2;
  [[nodiscard]] float weight(int role) const {
    if (to < 0) return role == 0 ? 1.0f : 0.0f;
    return role == 0 ? 1 - blend : blend;
  }
  /// The slot in that role; where there is none, one that exists.
  [[nodiscard]] int slot(int role) const { return role == 0 || to < 0 ? from : to; }
};

/// Where a shader's sum of planes takes its texels: one for each texel of a light map, or the four
/// around a place, filtered bilinearly.
enum class PlaneTaps { kOne, kFour };

/// A part of s · E(N) + Σ_k w[k] · value_k that one shader can add up: which planes, the text of
/// the shader that does it, and its uniforms. Both composites on the GPU are made of these: in
/// texture space, where further passes add to the target, and fused, where one must do.
///
/// Planes of both roles of FrameSlots are in it, so that a blend is the same sum with more terms. A
/// shader is straight lines with the planes' places as literals, which runs several times faster
/// than a loop where compilers cannot unroll it, and leaves the uniforms to the weights. So there
/// is one for each of a few numbers of planes: counts, of groups of planes by batch, from the
/// front. A prediction is a batch of one group: s and the normal's three planes, by nine uniforms;
/// its light or its planes missing, it is none.
class PlanePass {
 public:
  struct Limits {
    int units = 8;    ///< texture units
    int vectors = 0;  ///< uniform vectors of the fragment shader
    int lookups = 0;  ///< > 0: lookups a pass, each a varying, for half-float fragments
  };
  /// As few passes as the limits allow, at least one; a pass that holds no more than it must may
  /// exceed them.
  static std::vector<PlanePass> plan(const PlaneSetDescription& description,
                                     const PlaneSheets& sheets, const Limits& limits);

  /// For a shader's head: samplers u_sheet0 …, weights, and the function `vec3 plane_sum()` of the
  /// groups that `counts` says. With `flat`, weights are taken from there, whose inputs have to be
  /// declared before.
  [[nodiscard]] std::string text(PlaneTaps taps, std::span<const int> counts,
                                 const PlaneSheets& sheets, FlatWeights* flat = nullptr) const;
  /// The weights' declarations alone, for the vertex shader that `flat` copies them in.
  [[nodiscard]] std::string weight_declarations(std::span<const int> counts) const;

  /// The same with lookups as varyings, which the vertex shader assigns, and of all groups.
  struct LookupText {
    std::string varyings;     ///< for both stages
    std::string assignments;  ///< from `vec2 texel`
    std::string uniforms;     ///< for the fragment shader's head
    std::string statements;   ///< that add to `vec3 sum`
  };
  [[nodiscard]] LookupText lookup_text(const PlaneSheets& sheets) const;

  /// Checks a folded light, and gives the power of two by which its sums are divided so that they
  /// stay within 2^6: far from half floats' overflow at 2^16, and products of a thousandth of a
  /// thousandth of that are still above their subnormals. Errors: kInvalid for a count of weights
  /// that is not the planes', a weight for a channel that the plane was not described to have, or
  /// numbers that are not finite or leave the range of floats; for a prediction plane that is not
  /// the described one, or a weight of a normal.
  static Result<double> normalise(const FoldedLight& light, const FrameSlots& frames,
                                  const PlaneSheets& sheets);

  /// The weights of all planes, as a shader takes them, and how many groups a shader must have.
  struct Weights {
    std::vector<std::vector<float>> data;  ///< by batch: a vec4 for each plane or harmonic
    std::vector<int> counts;               ///< by batch
    std::array<double, 3> constant{};      ///< to be added to the shader's
    bool any = false;                      ///< whether any plane has a weight
  };
  [[nodiscard]] Weights make_weights() const;
  /// Fills them for composite / normalisation. Counts are rounded up to a few; with lookups as
  /// varyings they are of all groups. Allocates nothing.
  void fill(const FoldedLight& light, const FrameSlots& frames, const PlaneSheets& sheets,
            double normalisation, Weights& out) const;
  /// Counts of all groups of the role `from`, and none of the other.
  [[nodiscard]] std::vector<int> all_of_one_frame() const;

  using Locations = std::vector<GLint>;  ///< of the weights, by batch
  /// Finds the uniforms of a program, which is in use, and gives its samplers their units.
  [[nodiscard]] Locations locate(const Functions& gl, const Program& program,
                                 int (*unit_of)(int)) const;
  void set_weights(const Functions& gl, const Locations& at, const Weights& weights) const;
  /// Binds the sheets; leaves unit 0 active.
  void bind(const Functions& gl, const FrameSlots& frames, const PlaneSheets& sheets,
            int (*unit_of)(int)) const;

  [[nodiscard]] int unit_count() const { return static_cast<int>(sheets_.size()); }
  [[nodiscard]] bool within(const Limits& limits) const;
  /// Whether it has to be drawn for a frame alone.
  [[nodiscard]] bool serves_one_frame() const;

 private:
  // Planes that are fetched together, with one exponent or none: up to three, or s and x, y, z of
  // the normal.
  struct Group {
    std::array<int, 4> planes{-1, -1, -1, -1};
    std::array<unsigned, 3> channels{7, 7, 7};
  };
  // Groups that fetch from the same sheets. Sheets of the second role are numbered on from those of
  // the first.
  struct Batch {
    int role = 0;
    int planes_per_group = 1;
    std::array<int, 4> sheets{-1, -1, -1, -1};
    int exponent_sheet = -1;
    bool wide = false;
    bool predicts = false;  // s · E(N)
    std::vector<Group> groups;
    [[nodiscard]] bool same_kind(const Batch& other) const;
    [[nodiscard]] int lookups() const { return planes_per_group + (exponent_sheet >= 0 ? 1 : 0); }
    [[nodiscard]] int vectors() const;  // uniforms a group
    [[nodiscard]] int count() const { return static_cast<int>(groups.size()); }
  };

  static std::vector<Batch> group_planes(const PlaneSetDescription& description,
                                         const PlaneSheets& sheets);
  static Batch prediction(const PlaneSetDescription& description, const PlaneSheets& sheets);
  [[nodiscard]] std::vector<int> sheets_with(const Batch& batch) const;
  [[nodiscard]] std::string samplers() const;
  [[nodiscard]] std::string weights_text(std::size_t index, int groups) const;
  [[nodiscard]] std::string batch_names(std::size_t index) const;
  [[nodiscard]] std::string sheet_name(int sheet) const;
  static std::string place_text(const Group& group, const Batch& batch, int lookup,
                                const PlaneSheets& sheets);
  static std::size_t plane_of(const Group& group, int slot);
  [[nodiscard]] std::string weight_names(std::size_t index, int group, FlatWeights* flat) const;
  [[nodiscard]] std::string harmonic_names(std::size_t index, FlatWeights* flat) const;
  [[nodiscard]] bool is_raw(const Batch& batch) const {
    return batch.exponent_sheet < 0 && !lookups_ && !batch.predicts;
  }
  int fill_batch(std::size_t index, const FoldedLight& light, const FrameSlots& frames,
                 const PlaneSheets& sheets, double share, Weights& weights) const;
  int fill_prediction(std::size_t index, const FoldedLight& light, const FrameSlots& frames,
                      const PlaneSheets& sheets, double share, Weights& weights) const;

  bool lookups_ = false;  // are varyings
  std::vector<Batch> batches_;
  std::vector<int> sheets_;  // by texture unit
};

}  // namespace relit::gles
