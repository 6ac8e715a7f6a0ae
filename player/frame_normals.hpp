// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "container/base/plane_view.hpp"
#include "container/base/result.hpp"
#include "container/records.hpp"
#include "decoders/texel_normals.hpp"

namespace relit::player {

/// The normals of a light map's texels for the frames of the moment: of two, as a blend takes.
/// Steady state allocates nothing.
class FrameNormals {
 public:
  /// `meshes` are the clip's and outlive this. Errors: those of TexelNormals::create().
  static Result<FrameNormals> create(std::span<const decoders::Mesh> meshes,
                                     const container::ModelRecord& model);

  /// Computes a frame's normals unless they are here, and gives the slot that holds them, 0 or 1:
  /// not `kept` (-1: either).
  int slot_of(std::uint64_t frame, const decoders::Pose& pose, int kept);

  /// [H][W]; of every second texel of every second row with `half`. Valid until the slot changes.
  [[nodiscard]] std::span<const glm::vec3> normals(int slot, bool half);
  /// x, y and z as planes for gles::Compositor: 16 bits, the three one below the other in one
  /// picture. Valid until the next call.
  [[nodiscard]] std::array<PlaneView, 3> planes(int slot);

  /// Forgets which frames it has; see Relighter::forget().
  void forget();
  /// Of everything that it comes to keep, with the CPU's composite, the GPU's or both.
  [[nodiscard]] static std::size_t memory_bytes(std::span<const container::MeshRecord> meshes,
                                                const container::ModelRecord& model, bool cpu,
                                                bool gpu);
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Slot {
    bool valid = false, has_half = false;
    std::uint64_t frame = 0;
    std::vector<glm::vec3> full, half;
  };

  FrameNormals(decoders::TexelNormals texels, int width, int height)
      : texels_(std::move(texels)), width_(width), height_(height) {}

  decoders::TexelNormals texels_;
  int width_, height_;
  std::size_t table_bytes_ = 0;  ///< of texels_
  std::array<Slot, 2> slots_;
  std::vector<std::uint16_t> samples_;  ///< [3][H][W]
};

}  // namespace relit::player
