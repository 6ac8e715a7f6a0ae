// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <string>
#include <vector>

#include "container/base/plane_view.hpp"
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

/// A part of Σ_k w[k] · value_k that one shader can add up: which planes, the text of the shader
/// that does it, and its uniforms. Both composites on the GPU are made of these: in texture space,
/// where further passes add to the target, and fused, where one must do.
///
/// Planes of both roles of FrameSlots are in it, so that a blend is the same sum with more terms;
/// what has no weight costs nothing.
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

  /// For a shader's head: samplers u_sheet0 … and, unless lookups are varyings, the function
  /// `vec3 plane_sum()`.
  [[nodiscard]] std::string text(PlaneTaps taps) const;
  /// The same with lookups as varyings v0 …: statements that add to `sum`.
  [[nodiscard]] std::string samplers() const;
  [[nodiscard]] std::string unrolled_uniforms() const;
  [[nodiscard]] std::string unrolled_statements() const;

  /// Checks a folded light, and gives the power of two by which its sums are divided so that they
  /// stay within 2^6: far from half floats' overflow at 2^16, and products of a thousandth of a
  /// thousandth of that are still above their subnormals. Errors: kInvalid for a count of weights
  /// that is not the planes', or numbers that are not finite or leave the range of floats;
  /// kUnsupported for a light with a prediction plane.
  static Result<double> normalise(const FoldedLight& light, const FrameSlots& frames,
                                  const PlaneSheets& sheets);

  /// Places and weights of the planes that have any, as a shader takes them.
  struct Uniforms {
    struct Part {
      std::vector<float> data;
      int count = 0;  ///< of groups
    };
    std::vector<Part> parts;  ///< one for each batch
  };
  [[nodiscard]] Uniforms make_uniforms() const;
  /// Fills them for composite / normalisation. Returns whether any plane has a weight.
  bool fill(const FoldedLight& light, const FrameSlots& frames, const PlaneSheets& sheets,
            double normalisation, Uniforms& out) const;

  struct Locations {
    struct Part {
      GLint data = -1, count = -1;
    };
    std::vector<Part> parts;
  };
  /// Finds the uniforms of a program, which is in use, and gives its samplers their units.
  [[nodiscard]] Locations locate(const Functions& gl, const Program& program,
                                 int (*unit_of)(int)) const;
  void set_uniforms(const Functions& gl, const Locations& at, const Uniforms& uniforms) const;
  /// Binds the sheets; leaves unit 0 active.
  void bind(const Functions& gl, const FrameSlots& frames, const PlaneSheets& sheets,
            int (*unit_of)(int)) const;

  [[nodiscard]] int unit_count() const { return static_cast<int>(sheets_.size()); }
  [[nodiscard]] bool within(const Limits& limits) const;
  /// Whether planes of a role are in it.
  [[nodiscard]] bool has_role(int role) const;

  /// With lookups as varyings there is at most one batch; these are its numbers.
  [[nodiscard]] int planes_per_group() const;
  [[nodiscard]] int lookups_per_group() const;
  [[nodiscard]] int group_count() const;
  [[nodiscard]] int stride() const;

 private:
  // Up to three planes that are fetched together, with one exponent or none.
  struct Group {
    std::array<int, 3> planes{-1, -1, -1};
  };
  // Groups that fetch from the same sheets: one loop of the shader. Sheets of the second role are
  // numbered on from those of the first.
  struct Batch {
    int role = 0;
    int planes_per_group = 1;
    std::array<int, 3> sheets{-1, -1, -1};
    int exponent_sheet = -1;
    bool wide = false;
    std::vector<Group> groups;
    [[nodiscard]] bool same_kind(const Batch& other) const;
    [[nodiscard]] int lookups() const { return planes_per_group + (exponent_sheet >= 0 ? 1 : 0); }
    [[nodiscard]] int stride() const {
      return 2 * planes_per_group + (exponent_sheet >= 0 ? 1 : 0);
    }
  };

  static std::vector<Batch> group_planes(const PlaneSetDescription& description,
                                         const PlaneSheets& sheets);
  [[nodiscard]] std::vector<int> sheets_with(const Batch& batch) const;
  [[nodiscard]] std::string batch_text(std::size_t index) const;
  [[nodiscard]] std::string sheet_name(int sheet) const;
  int fill_batch(const Batch& batch, const FoldedLight& light, const FrameSlots& frames,
                 const PlaneSheets& sheets, double normalisation, std::vector<float>& out) const;

  std::vector<Batch> batches_;
  std::vector<int> sheets_;  // by texture unit
};

}  // namespace relit::gles
