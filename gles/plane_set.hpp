// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

namespace relit::gles {

/// Where a plane's samples lie in a decoded picture. Views with the same `picture` point into one
/// component of one picture, in every frame at the same distances, so that what lies between them
/// can be uploaded with them in one call and read in place. A number stands for one component: for
/// layer l and component c, 3·l + c will do. Mantissas and exponents are numbered separately.
struct PicturePlace {
  int picture = -1;  ///< -1: unknown; the plane is uploaded by itself
  int x = 0;         ///< of the view's first sample, in samples of that component
  int y = 0;
};

/// What stays the same of a PlaneView from frame to frame.
struct PlaneDescription {
  int bit_depth = 8;  ///< 8, 10, or 16 for normals: mantissa_zero is 2^(bit_depth - 1); 10 and 16
                      ///< bits take two bytes
  int mantissa_shift = 0;  ///< as PlaneView's
  PicturePlace mantissa;
  unsigned channels = 7;  ///< bits 0..2: of the light map, that the plane ever has a weight for
  bool has_exponent = false;
  int exponent_shift = 0;  ///< as PlaneView's
  PicturePlace
      exponent;  ///< planes that share exponents give the same place, and are fetched together
};

/// The scale of normals' PlaneViews: their samples are 1 to 65535 for -1 to 1.
inline constexpr float kNormalScale = 1.0f / 32767;

/// How a light map is kept on the GPU.
enum class LightMapFormat {
  kAuto,         ///< half floats where they can be rendered to and filtered, else square roots
  kHalfFloat,    ///< RGBA16F
  kFloat,        ///< RGBA32F, for measurements
  kSquareRoot8,  ///< RGBA8: dithered square roots of values over a peak; negatives become 0
};

struct PlaneSetDescription {
  int width = 0;  ///< of the light map, texels
  int height = 0;
  std::vector<PlaneDescription> planes;  ///< in the model's order; a prediction's normals after it
  /// The plane s of the prediction s · E(N), FoldedLight::prediction_plane; -1: none. It may have a
  /// weight of its own, as any plane.
  int prediction_plane = -1;
  /// With a prediction, the first of three planes x, y, z of N, a unit normal in model space or
  /// zero for each texel of the light map: 16 bits, neither exponents nor a shift, value =
  /// kNormalScale · (m - 32768). The folded light has weights for them too: 0.
  int normal_planes = -1;
  bool changes_every_frame =
      true;  ///< double-buffers the planes, so that an upload waits for no draw
  LightMapFormat format = LightMapFormat::kAuto;
};

}  // namespace relit::gles
