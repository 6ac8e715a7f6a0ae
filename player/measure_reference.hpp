// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "decoders/npy.hpp"
#include "decoders/relit_error.hpp"
#include "decoders/texel_normals.hpp"
#include "player/measure_frames.hpp"

namespace relit::player {

/// What files are scored against: transfer by tick, from the unquantised bake that `relit-bake
/// --reference` writes, or else decoded from a .relit in double precision.
class MeasureReference {
 public:
  struct Shape {
    std::uint64_t frames = 0;
    int order = 0;
    decoders::MapSize size;
    [[nodiscard]] int coefficients() const { return decoders::coefficient_count(order); }
  };

  /// `path` ends in .npy, or is a .relit, whose clip is `clip`. Errors, with the path: those of
  /// NpyReader; kCorrupt for a shape that is not [frames][1, 4, 9 or 16][3][H][W], or [1, 4, 9 or
  /// 16][3][H][W] for one frame; those of TickFrames.
  static Result<MeasureReference> open(const std::string& path, const std::string& clip);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] bool baked() const { return npy_.has_value(); }
  [[nodiscard]] const Shape& shape() const { return shape_; }

  /// Loads `count` frames, evenly spread over the clip from the first on, or all of them; they stay
  /// in memory. Errors, with path and frame: kInvalid for numbers that are not finite; those of
  /// reading.
  Status load(std::uint64_t count);
  /// The ticks of the frames that are loaded, ascending.
  [[nodiscard]] const std::vector<std::uint64_t>& ticks() const { return ticks_; }
  /// [coefficients][3][H][W] of the frame ticks()[i].
  [[nodiscard]] std::span<const float> transfer(std::size_t i) const { return frames_[i]; }

 private:
  MeasureReference() = default;
  Status open_npy();
  Status open_clip(const std::string& clip);
  Status read(std::uint64_t tick, std::vector<float>& out);
  Status decode(std::uint64_t tick, std::vector<float>& out);
  Status reconstruct(const decoders::FrameView& planes, const decoders::Pose& pose,
                     std::span<float> out);

  std::string path_, clip_;
  Shape shape_;
  std::optional<decoders::NpyReader> npy_;
  std::optional<TickFrames> frames_of_clip_;
  std::optional<decoders::TexelNormals> texels_;
  std::vector<glm::vec3> normals_;
  std::vector<std::uint64_t> ticks_;
  std::vector<std::vector<float>> frames_;
};

}  // namespace relit::player
