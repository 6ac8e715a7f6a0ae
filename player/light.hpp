// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "decoders/sh.hpp"
#include "player/light_field.hpp"

/// Lights from files: what `--light L` names.
namespace relit::player {

struct LightOptions {
  int order = 3;          ///< of the result, at most: 0..3; a file of lower order stays as it is
  double rotate_rad = 0;  ///< about +Y, added to φ
  bool window = false;    ///< (1 + cos(πl/5)) / 2 on band l
};

struct LoadedLight {
  decoders::Light light;  ///< turned and windowed as asked; of a field its mean, for the exposure
  std::optional<LightField> field;  ///< of a light that varies; turned and windowed likewise
  /// The picture as the file has it, for drawing the background; a direction's φ is
  /// φ(picture) + environment_rotation_rad. Null for a .json.
  std::shared_ptr<const decoders::Environment> environment;
  double environment_rotation_rad = 0;
  std::string name;  ///< the file's, without folder and suffix
  /// The least radiance of `light` over all directions, per channel. Below zero where cutting the
  /// harmonics off rings; a window lessens that.
  std::array<double, 3> minimum_radiance{};
  std::vector<std::string> warnings;  ///< sentences for the user that name the file
};

/// Loads a light: an equirectangular picture, Radiance .hdr or OpenEXR .exr, or a .json
/// `{"sh": [[r,g,b], …]}` with 1, 4, 9 or 16 rows, or one that varies with time and place
/// (PLAYBACK.md has its forms). The content decides which it is, and the suffix where the content
/// does not.
///
/// A picture that is not twice as wide as it is high is stretched over the whole sphere, with a
/// warning. Of an .exr, channels R, G, B or only Y of half or float are read, alpha is ignored, and
/// what lies outside the data window is black, with a warning; the display window must begin at (0,
/// 0), and compression must not be DWAA or DWAB. The bytes of
/// an .hdr count from the middle of their step, as Radiance reads them; its exposure lines are not
/// applied.
///
/// Errors, all with the path and the place: kIo, kTruncated, kCorrupt, kUnsupported, kLimit (files
/// beyond 512 MiB, 4 MiB for .json; pictures beyond limits::kImageSide or kImageTexels; fields
/// beyond LightField's limits), kInvalid (radiance that is negative or not finite, rows that are
/// not three finite numbers, options), kOutOfMemory. Any thread.
Result<LoadedLight> load_light(const std::string& path, const LightOptions& options = {});

/// The light as the .json that load_light reads: the same bytes for the same light, and the same
/// doubles when read again. Errors: kInvalid for a light that is not finite or has not 1, 4, 9 or
/// 16 rows.
Result<std::string> light_json(const decoders::Light& light);

/// Writes light_json() or light_field_json() to `path`. Errors: also kIo.
Status write_light_json(const std::string& path, const decoders::Light& light);
Status write_light_json(const std::string& path, const LightField& field);

}  // namespace relit::player
