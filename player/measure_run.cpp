// SPDX-License-Identifier: MIT
#include "player/measure_run.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "decoders/coverage.hpp"
#include "player/light.hpp"
#include "player/measure_file.hpp"
#include "player/measure_machine.hpp"
#include "player/measure_pictures.hpp"

namespace relit::player {
namespace {

Result<std::vector<MeasureLight>> lights_of(const MeasureRun& run) {
  std::vector<MeasureLight> lights;
  for (const std::string& path : run.lights) {
    RELIT_ASSIGN(const LoadedLight loaded, load_light(path));
    for (const std::string& warning : loaded.warnings) run.warn(warning);
    lights.push_back({loaded.name, loaded.light});
  }
  if (!lights.empty()) return lights;
  int number = 0;
  for (decoders::Light& light : decoders::standard_lights())
    lights.push_back({"standard light " + std::to_string(++number), std::move(light)});
  return lights;
}

// The 99.9th percentile of what the reference shines with, over the texels of the first file.
Result<double> peak_of(const MeasureReference& reference, const std::string& file,
                       const std::string& clip, std::span<const MeasureLight> lights) {
  const decoders::MapSize size = reference.shape().size;
  RELIT_ASSIGN(const TickFrames frames, TickFrames::open(file, {clip, -1, 1}));
  std::vector<std::uint8_t> covered(size.width * size.height);
  RELIT_TRY(decoders::mark_covered_texels(frames.reader().meshes(), static_cast<int>(size.width),
                                          static_cast<int>(size.height), covered));
  std::vector<decoders::Light> under;
  for (const MeasureLight& light : lights) under.push_back(light.light);
  decoders::RelitError error(under, reference.shape().coefficients(), covered);
  for (std::size_t i = 0; i < reference.ticks().size(); ++i)
    error.add_frame(reference.transfer(i), reference.transfer(i));
  const double peak = error.figures().peak;
  // The histogram's first step, of which 0 is a part, ends among the subnormal numbers.
  if (peak >= static_cast<double>(std::numeric_limits<float>::min())) return peak;
  return fail(ErrorCode::kCorrupt,
              reference.path() + ": is black under all lights; nothing can be scored against it");
}

Status read_files(const MeasureRun& run, MeasureReport& report) {
  for (const std::string& path : run.files) {
    RELIT_ASSIGN(MeasuredFile file, read_measured_file(path, run.clip));
    report.files.push_back(std::move(file));
  }
  return {};
}

Status expand(const MeasureSweep& sweep, MeasureReport& report) {
  for (std::size_t f = 0; f < report.files.size(); ++f) {
    RELIT_ASSIGN(const auto knobs, expand_measure_sweep(sweep, report.files[f]));
    for (const MeasureKnobs& k : knobs) {
      MeasuredPoint& point = report.points.emplace_back();
      point.file = f, point.knobs = k;
    }
  }
  return {};
}

void describe_reference(const MeasureReference& reference, MeasureReport& report) {
  const MeasureReference::Shape& shape = reference.shape();
  report.reference = reference.path();
  report.reference_baked = reference.baked();
  report.reference_frames = shape.frames;
  report.reference_coefficients = shape.coefficients();
  report.reference_width = static_cast<int>(shape.size.width);
  report.reference_height = static_cast<int>(shape.size.height);
  report.scored_frames = reference.ticks();
}

// The scored frame nearest to the one asked for; by default an odd one a third into the clip, which
// is blended where frames are left out.
std::uint64_t picture_frame(const MeasureRun& run, const MeasureReference& reference) {
  const std::uint64_t wanted = run.picture_frame >= 0
                                   ? static_cast<std::uint64_t>(run.picture_frame)
                                   : reference.shape().frames / 3;
  const auto distance = [&](std::uint64_t tick) {
    const std::uint64_t apart = tick > wanted ? tick - wanted : wanted - tick;
    return std::pair(run.picture_frame < 0 && tick % 2 == 0, apart);
  };
  return *std::min_element(
      reference.ticks().begin(), reference.ticks().end(),
      [&](std::uint64_t a, std::uint64_t b) { return distance(a) < distance(b); });
}

}  // namespace

Result<MeasureReport> measure(const MeasureRun& run) {
  MeasureReport report;
  report.command = command_words();
  RELIT_TRY(read_files(run, report));
  RELIT_ASSIGN(const std::vector<MeasureLight> lights, lights_of(run));
  for (const MeasureLight& light : lights) report.lights.push_back(light.name);
  RELIT_ASSIGN(
      auto reference,
      MeasureReference::open(run.reference.empty() ? run.files.front() : run.reference, run.clip));
  for (const MeasuredFile& file : report.files) RELIT_TRY(check_against(file, reference));
  std::vector<Backend> backends;
  report.machine = describe_machine(backends);
  RELIT_ASSIGN(const MeasureSweep sweep,
               parse_measure_sweep(run.sweep, run.files.size() == 1, backends));
  RELIT_TRY(expand(sweep, report));
  run.progress("reading the reference");
  RELIT_TRY(reference.load(run.frames));
  describe_reference(reference, report);
  RELIT_ASSIGN(report.peak, peak_of(reference, run.files.front(), run.clip, lights));
  PointMeter meter(report.files, reference, lights, report.peak, run.meter);
  for (std::size_t i = 0; i < report.points.size(); ++i) {
    run.progress("point " + std::to_string(i + 1) + " of " + std::to_string(report.points.size()) +
                 ": " + point_label(report, report.points[i]));
    RELIT_TRY(meter.measure(report.points[i]));
  }
  mark_fronts(report.points);
  if (!run.pictures) return report;
  if (backends.empty()) {
    run.warn("there is no GL on this machine: the page goes without pictures");
    return report;
  }
  constexpr std::size_t kPictures = 8;
  run.progress("drawing pictures");
  report.picture_frame = picture_frame(run, reference);
  RELIT_TRY(add_pictures(reference, lights, backends.front(), kPictures, report));
  return report;
}

}  // namespace relit::player
