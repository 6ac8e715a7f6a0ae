// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "decoders/sh.hpp"
#include "player/measure.hpp"
#include "player/measure_reference.hpp"
#include "player/measure_stage.hpp"

namespace relit::player {

/// A light under which files are scored.
struct MeasureLight {
  std::string name;
  decoders::Light light;
};

struct MeasureOptions {
  int repeats = 3;         ///< of decoding
  int timed_frames = 24;   ///< of which upload, composite and draw are timed, at most
  int picture_side = 512;  ///< of the pictures that are drawn for timing, pixels
};

/// Measures points, and measures nothing twice: what a knob has no part in (threads in the error,
/// frames left out in the time of a composite) is taken from the point that has it already.
class PointMeter {
 public:
  /// All are borrowed; the reference has its frames loaded.
  PointMeter(std::span<const MeasuredFile> files, const MeasureReference& reference,
             std::span<const MeasureLight> lights, double peak, const MeasureOptions& options)
      : files_(files), reference_(reference), lights_(lights), peak_(peak), options_(options) {}

  /// Fills in everything but the fronts. What cannot be measured of the point goes to its
  /// `failure`, or leaves its times without a value. Errors: kOutOfMemory and kIo, which end
  /// everything.
  Status measure(MeasuredPoint& point);

 private:
  struct Score {
    decoders::RelitError::Figures error;
    std::uint64_t lost_frames = 0;
  };
  struct GlTimes {
    double upload_ms = 0, composite_ms = 0, draw_ms = 0;
  };
  Result<Score> score(const MeasuredFile& file, const MeasureKnobs& knobs) const;
  Result<Score> score_with(const MeasuredFile& file, const MeasureKnobs& knobs,
                           const gles::Device* device, TickFrames& frames) const;
  Result<GlTimes> time(const MeasuredFile& file, const MeasureKnobs& knobs) const;
  Result<double> decoding(const MeasuredPoint& point);
  void add_times(MeasuredPoint& point);
  Status add_score(MeasuredPoint& point);

  std::span<const MeasuredFile> files_;
  const MeasureReference& reference_;
  std::span<const MeasureLight> lights_;
  double peak_;
  MeasureOptions options_;
  std::map<std::string, Result<Score>> scores_;
  std::map<std::string, Result<GlTimes>> times_;
  std::map<std::string, double> decoding_, drawing_;
};

/// The file's frames for a point. Errors: as TickFrames::open().
[[nodiscard]] Result<TickFrames> open_point(const MeasuredFile& file, const MeasureKnobs& knobs);
/// What composites them. `device` null: the CPU. Errors: those of Relighter::create().
[[nodiscard]] Result<std::unique_ptr<Relighter>> relighter_for(const ClipReader& clip,
                                                               const MeasureKnobs& knobs,
                                                               const gles::Device* device);

/// Whether a file can be scored against the reference. Errors, with the file: kInvalid, naming what
/// does not fit.
[[nodiscard]] Status check_against(const MeasuredFile& file, const MeasureReference& reference);

/// Calls `work` on a thread of its own, and waits: EGL and OSMesa do not share one.
[[nodiscard]] Status on_own_thread(const std::function<Status()>& work);

}  // namespace relit::player
