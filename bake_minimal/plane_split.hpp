// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "bake_minimal/coding_options.hpp"
#include "bake_minimal/principal_planes.hpp"
#include "bake_minimal/push_pull.hpp"
#include "bake_minimal/transfer_shape.hpp"
#include "container/base/plane_view.hpp"
#include "container/records.hpp"

/// Transfer -> values of planes, and what the model says of them: the matrix M, μ and which plane
/// is s (design, section 2).
namespace relit::bake {

/// The three planes, or one, into which the RGB of a coefficient turns.
enum class Basis : std::uint8_t { kYCoCg, kGbr, kLuma };

/// The basis of resolved options.
[[nodiscard]] Basis basis_of(const CodingOptions& options);
/// 3 or 1.
[[nodiscard]] int component_count(Basis basis);

/// Y = (R+2G+B)/4, Co = (R−B)/2, Cg = (2G−R−B)/4; G, B, R; or (R+G+B)/3, which is the least squares
/// best where all channels count alike, as they do under white light. Exact inverse of the columns
/// of M where there is one: R = Y+Co−Cg, G = Y+Cg, B = Y−Co−Cg.
[[nodiscard]] std::array<double, 3> to_components(Basis basis, const std::array<double, 3>& rgb);
[[nodiscard]] std::array<double, 3> to_rgb(Basis basis, const std::array<double, 3>& components);

/// The split of a clip. Planes come in tiles: those of one tile lie in the same place of the
/// components of a picture and share their exponents.
class PlaneSplit {
 public:
  /// A tile for each coefficient, with the components of its colour.
  static PlaneSplit colour(const TransferShape& shape, const CodingOptions& resolved);
  /// A tile for each plane: s first, if there is a prediction, then the principal ones. `known`,
  /// [H][W]: texels elsewhere are filled smoothly from those where it is nonzero.
  static PlaneSplit principal(const TransferShape& shape, PrincipalPlanes planes,
                              std::span<const std::uint8_t> known);

  [[nodiscard]] const TransferShape& shape() const { return shape_; }
  [[nodiscard]] int tiles() const;
  [[nodiscard]] int components() const { return principal_ ? 1 : component_count(basis_); }
  /// How many tiles each layer takes, in order of importance; `one`: a single layer.
  [[nodiscard]] std::vector<int> layer_tiles(bool one) const;

  /// The frame that split() takes from now on; it is borrowed. Errors: those of check_transfer(),
  /// with `number` as the frame's; kInvalid for normals of another size.
  Status begin_frame(const TransferFrame& frame, std::uint64_t number);
  /// Values of the planes of a tile, [component][texels]. Any number of threads at once.
  void split(int tile, std::vector<std::vector<double>>& out) const;

  /// RMS error in composites that an error of one in a plane of the tile makes, but for a common
  /// factor: quantisation steps are in inverse proportion to it.
  [[nodiscard]] double weight(int tile) const;
  /// Whether μ can hold the middle of its values: not of s.
  [[nodiscard]] bool centred(int tile) const;
  /// The plane's column of M.
  [[nodiscard]] std::vector<container::MatrixEntry> column(int tile, int component) const;
  /// μ, for values that are coded relative to `middles`, [tile][component].
  [[nodiscard]] std::vector<Rgb> mean(std::span<const std::array<double, 3>> middles) const;
  /// The middles that such a mean, rounded to floats, stands for.
  [[nodiscard]] std::vector<std::array<double, 3>> middles(
      std::span<const std::array<double, 3>> wanted, std::span<const Rgb> mean) const;
  /// Number of the plane s among all planes; -1: no prediction.
  [[nodiscard]] int prediction_plane() const { return predicted() ? 0 : -1; }
  [[nodiscard]] bool predicted() const { return principal_ && principal_->predicted; }
  [[nodiscard]] const PrincipalPlanes* principal_planes() const {
    return principal_ ? &*principal_ : nullptr;
  }

 private:
  void split_colour(int tile, std::vector<std::vector<double>>& out) const;
  void split_principal(int plane, std::vector<double>& out) const;

  TransferShape shape_;
  Basis basis_ = Basis::kYCoCg;
  std::array<double, 4> band_rms_{};  ///< of the light on colour planes, by band
  std::optional<PrincipalPlanes> principal_;
  std::shared_ptr<const PushPull> fill_;  ///< of principal planes
  std::vector<std::uint8_t> known_;
  TransferFrame frame_;
  std::vector<double> scales_;  ///< s of the frame, where it is known
};

}  // namespace relit::bake
