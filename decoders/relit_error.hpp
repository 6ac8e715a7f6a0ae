// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "decoders/sh.hpp"

namespace relit::decoders {

/// The sixteen lights by which lossy choices are compared: four turns each of three environments,
/// and four suns with a sky; order 3, mean radiance 1, windowed
/// (media/lights/standard_lights.json).
[[nodiscard]] std::vector<Light> standard_lights();

/// How many values fall where, in steps of 2^-12 of a value (those of 20 leading bits of a float):
/// percentiles of any number of values in 16 MB, off by less than a step.
class Histogram {
 public:
  Histogram() : counts_(std::size_t{1} << kBits, 0) {}
  /// Negative values count as 0.
  void add(float value);
  /// The value that `percent` of all lie at or below, 0 to 100; 0 where there are none.
  [[nodiscard]] double percentile(double percent) const;

 private:
  static constexpr int kBits = 21;  ///< sign, exponent and 12 bits of the mantissa
  std::vector<std::uint64_t> counts_;
  std::uint64_t total_ = 0;
};

/// The relit PSNR: composites of every light, frame and covered texel of a reference and of what
/// was decoded. The peak is the 99.9th percentile of the reference's composites, the mean square
/// goes over lights, frames, texels and channels; PSNR = 10 log10(peak² / mean square).
///
/// The log-PSNR counts stops instead, so that what is dark weighs as much as what is bright: of
/// radiance v it takes log2(max(v, 0)/peak + 2^-kStops), which runs over kStops of them from black
/// to the peak; log-PSNR = 20 log10(kStops / root mean square of the difference). An error of 1 %
/// of what is far above the floor counts as 57 dB.
class RelitError {
 public:
  static constexpr int kStops = 10;
  struct Figures {
    double psnr_db = 0;      ///< infinite where nothing differs
    double log_psnr_db = 0;  ///< likewise; 0 where the peak was not known beforehand
    double p99 = 0;          ///< 99th percentile of the absolute error over the peak
    double largest = 0;      ///< of the absolute error, over the peak
    double peak = 0;
  };

  /// `covered`, [texels]: nonzero where a texel counts. `coefficients` is 1, 4, 9 or 16. `peak`, if
  /// it is known beforehand (see reference_peak()): without one there is no log-PSNR.
  RelitError(std::span<const Light> lights, int coefficients, std::span<const std::uint8_t> covered,
             double peak = 0);

  /// One frame, [coefficients][3][texels] each.
  void add_frame(std::span<const float> reference, std::span<const float> decoded);
  /// One frame under light number `light`: the reference's transfer as above, and the light map
  /// that was made of it, [3][texels], radiance for unit albedo. False where a covered texel of the
  /// map is not finite: there are no figures then.
  [[nodiscard]] bool add_light_map(std::size_t light, std::span<const float> reference,
                                   std::span<const float> light_map);
  [[nodiscard]] Figures figures() const;

 private:
  void add(double truth, double difference);

  std::size_t coefficients_;
  std::vector<std::array<std::vector<double>, 3>> lights_;  ///< [light][channel][coefficient]
  std::vector<std::size_t> texels_;
  std::size_t texel_count_;
  double peak_;  ///< 0: not known beforehand
  Histogram composites_, errors_;
  double squares_ = 0, log_squares_ = 0, largest_ = 0;
  std::uint64_t samples_ = 0;
};

/// A map of another size, [height][width], at the reference's: bilinear between texel centres, as
/// textures are filtered, clamped at the edges.
struct MapSize {
  std::size_t width = 0, height = 0;
  bool operator==(const MapSize&) const = default;
};
void resize_map(std::span<const float> from, const MapSize& from_size, std::span<float> to,
                const MapSize& to_size);

}  // namespace relit::decoders
