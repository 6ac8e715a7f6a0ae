// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "bake_minimal/rate_search.hpp"
#include "container/base/result.hpp"
#include "container/records.hpp"

namespace relit::bake {

enum class Layout : std::uint8_t {
  kLayered,  ///< a layer for each SH band: 1, 3, 5 and 7 tiles
  kGrid,     ///< one layer, tile n at row ⌊n/(N+1)⌋, column n mod (N+1), as in Xu et al.
};

enum class Planes : std::uint8_t {
  kAuto,       ///< principal wherever the other options allow it
  kColour,     ///< the channels of each coefficient, or YCoCg of them
  kPrincipal,  ///< the axes of what the mesh's normals do not predict: PrincipalPlanes
};

/// How the transfer is quantised and coded (design, section 4). What is left open takes the best
/// value for the rest, see resolve().
struct CodingOptions {
  /// FFmpeg's name of the mantissas' codec: "h264", "mpeg4", "ffv1", "hevc", "vp9" or "av1".
  std::string codec = "h264";

  /// Quality, in the units of x264's constant rate factor: lower is better, +6 doubles the step and
  /// about halves the bytes. -12..51 with h264 (below 0 only with 10 bits), 0..51 with hevc and
  /// mpeg4, 0..63 with vp9 and av1. MPEG-4's quantiser is the one of the same step, qscale =
  /// 2^((crf-10)/6), rounded to 1..31. Default: 24; 22 for mpeg4;
  /// 18 with principal planes.
  std::optional<double> crf;

  /// Mantissas are coded without loss; what remains is the quantiser's error, quantiser_bound().
  /// Always so with ffv1. Needs 4:4:4 (planes are G, B, R) or luma.
  bool lossless = false;

  std::optional<int>
      bit_depth;  ///< of mantissas, 8 or 10. Default: 10; 8 for mpeg4 and with exponents

  /// Principal planes take luma, or 4:2:0 with grey chroma, and no exponents; with kAuto they are
  /// taken unless chroma, exponents, the grid, lossless coding or a codec without luma is asked
  /// for.
  Planes planes = Planes::kAuto;
  /// Principal planes besides s, at most; 0: as many as leave less than 1e-5 of the composites'
  /// mean square out, which is about 60 dB below their peaks.
  int principal_count = 0;
  /// Whether principal planes hold what s·A_l/π·Y(N) leaves, or all.
  bool predict = true;

  /// 4:2:0 and 4:4:4 hold Y, Co, Cg (lossless: G, B, R); luma holds (R+G+B)/3 alone.
  /// Default: 4:2:0; lossless 4:4:4.
  std::optional<container::Chroma> chroma;

  /// Side of the square of texels that shares one exponent: 1, 2, 4, 8, 16 or 32. 0: no exponents,
  /// every coefficient has one scale for the whole clip.
  int exponent_block = 0;
  /// Frames that share one exponent picture, from the segment's first frame on; 0: the whole
  /// segment.
  int exponent_hold = 0;

  /// Every so many frames are kept of those that were traced, and players blend in between (Xu et
  /// al., key frames). 0: all, or with a goal what it takes.
  int frame_step = 0;

  Layout layout = Layout::kLayered;
  int segment_frames = 25;  ///< frames a segment, each a closed group of pictures

  /// The encoder's own preset ("medium", "veryslow", …; cpu-used for vp9 and av1). Empty: veryslow
  /// for h264, slow for hevc.
  std::string preset;
  /// Pictures that a decoder has to keep, at most (h264, hevc). More costs the player memory and
  /// gains next to nothing: 2, 4 and 16 were within 0.5 % of each other.
  int reference_frames = 3;
  /// Bytes that the pictures of all tracks' decoders may take together: what they refer to and what
  /// waits for its turn (h264, hevc) is cut down until they fit. 0: no bound.
  std::uint64_t decode_memory = 0;

  /// Without exponents: the same quantisation step for all bands, instead of steps in inverse
  /// proportion to the light that falls on the band (light_metric()).
  bool uniform_steps = false;
  /// Without exponents: the middle of each coefficient's range becomes the model's mean μ, so that
  /// the mantissas use their whole range.
  bool centred = true;

  /// Layers encoded at once. The bytes do not depend on it.
  int threads = 1;
};

/// The rate factors that a codec takes, and how finely.
[[nodiscard]] RateRange rate_range(const CodingOptions& resolved);

/// Xu et al., section 4: the order-N grid, mantissas of 8 bits through MPEG-4's 4:2:0, one exponent
/// for every texel of every frame, through FFV1.
[[nodiscard]] CodingOptions paper_options();

/// Whether a clip has the same planes, ranges and steps under both, which are resolved: they differ
/// in what an encoder makes of them alone.
[[nodiscard]] bool same_planes(const CodingOptions& a, const CodingOptions& b);

/// `base` within what hardware decoders take everywhere: H.264 High, 8 bits, 4:2:0, of which
/// principal planes leave the chroma grey. Errors: kInvalid for lossless coding and exponents.
[[nodiscard]] Result<CodingOptions> hardware_options(const CodingOptions& base);

/// Fills in what is open and checks the combination. Errors: kInvalid, saying what would be right.
[[nodiscard]] Result<CodingOptions> resolve(CodingOptions options);

}  // namespace relit::bake
