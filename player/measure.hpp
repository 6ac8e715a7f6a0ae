// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "decoders/relit_error.hpp"
#include "player/gl_backend.hpp"
#include "player/path_chooser.hpp"

/// What `relit measure` finds out: MEASURE.md says what each number means.
namespace relit::player {

/// What is chosen when a file is played; the rest was chosen when it was baked.
struct MeasureKnobs {
  int planes = 0;  ///< the first so many, by importance
  CompositePath path = CompositePath::kCpu;
  std::optional<Backend> backend;  ///< whose GL uploads and draws; none: there is no GL
  int threads = 1;                 ///< that decode
  std::uint64_t every = 1;         ///< only every so manieth frame is decoded, the others blended
  bool operator==(const MeasureKnobs&) const = default;
};

/// What a file says of itself.
struct MeasuredFile {
  std::string path;
  std::string clip;
  std::string model;  ///< the appearance model: "shlm"
  int order = 0, width = 0, height = 0;
  std::string codec, chroma;  ///< of the first layer
  int bit_depth = 0;
  bool lossless = false;
  int exponent_block = 0;  ///< texels; 0: no exponents
  int exponent_hold = 0;   ///< frames for which an exponent picture holds, on average; 0: none
  bool prediction = false;
  std::uint64_t frames = 0, ticks = 0;
  double duration_s = 0;
  std::uint64_t bytes = 0;        ///< of the file
  std::uint64_t image_bytes = 0;  ///< of these, embedded images and their copies
  struct Layer {
    int planes = 0;
    std::uint64_t bytes = 0;  ///< of its tracks
  };
  std::vector<Layer> layers;

  [[nodiscard]] int planes() const;
  /// How many layers hold the first `planes` planes.
  [[nodiscard]] std::size_t layers_for(int planes) const;
};

/// One choice of everything, and what it costs and gives.
struct MeasuredPoint {
  std::size_t file = 0;  ///< into MeasureReport::files
  MeasureKnobs knobs;
  std::size_t layers = 0;
  std::uint64_t light_bytes = 0;  ///< of the layers that are used
  std::uint64_t file_bytes = 0;   ///< without images and the layers that are not used
  double light_bytes_per_s = 0, file_bytes_per_s = 0;
  decoders::RelitError::Figures error;
  std::uint64_t lost_frames = 0;  ///< that damage hit
  // Medians, of one frame, milliseconds; none: not measured, as drawing is without GL.
  std::optional<double> decode_ms, upload_ms, composite_ms, draw_ms;
  std::uint64_t heap_bytes = 0, gpu_bytes = 0;  ///< of the memory plan
  std::string failure;                          ///< why nothing was scored; empty: it was
  bool impossible = false;  ///< that is because this machine, or any, cannot do it
  bool on_bytes_front = false, on_time_front = false;

  [[nodiscard]] bool scored() const { return failure.empty(); }
  /// Of what was measured.
  [[nodiscard]] double total_ms() const;
};

/// A point's picture of one frame under one light, and how far it is from the reference's.
struct MeasuredPicture {
  std::size_t point = 0;
  std::vector<std::uint8_t> png, difference_png;
};

struct MeasuredMachine {
  std::string cpu, system, version;
  int cores = 0;
  struct Gl {
    std::string backend, renderer, version;  ///< or why there is none, in `version`
  };
  std::vector<Gl> gl;
};

struct MeasureReport {
  std::vector<std::string> command;
  MeasuredMachine machine;
  std::string reference;         ///< file
  bool reference_baked = false;  ///< an unquantised bake; else decoded from a .relit
  std::uint64_t reference_frames = 0;
  int reference_coefficients = 0, reference_width = 0, reference_height = 0;
  double peak = 0;                           ///< of the reference's composites
  std::vector<std::uint64_t> scored_frames;  ///< of the reference
  std::vector<std::string> lights;
  std::vector<MeasuredFile> files;
  std::vector<MeasuredPoint> points;
  std::uint64_t picture_frame = 0;
  std::string picture_light;
  double difference_gain = 8;
  std::vector<std::uint8_t> reference_png;  ///< empty: no pictures
  std::vector<MeasuredPicture> pictures;
};

/// "texture on egl", "cpu".
[[nodiscard]] std::string path_label(const MeasureKnobs& knobs);
/// What tells a point from the others of its report: the file, and the knobs that are not at their
/// ends.
[[nodiscard]] std::string point_label(const MeasureReport& report, const MeasuredPoint& point);

/// Marks the points that no other beats: none has an error as small or smaller at a cost as low or
/// lower, and is better in one of the two; of equals the first one is marked. Points that were not
/// scored are on no front, and those whose time is not known are not on the second.
void mark_fronts(std::vector<MeasuredPoint>& points);

/// As many values as `points`, 1: on the front of low costs and high gains. Not finite: on none.
[[nodiscard]] std::vector<std::uint8_t> pareto_front(std::span<const double> costs,
                                                     std::span<const double> gains);

[[nodiscard]] double median(std::vector<double> values);

}  // namespace relit::player
