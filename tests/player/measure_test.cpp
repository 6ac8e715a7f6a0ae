// SPDX-License-Identifier: MIT
// What `relit measure` computes: fronts, sweeps, and scores against values counted by hand.
#include "player/measure.hpp"

#include <cmath>
#include <fstream>
#include <limits>

#include "decoders/npy.hpp"
#include "player/measure_run.hpp"
#include "player/measure_sweep.hpp"
#include "tests/player/coded_file.hpp"
#include "tests/player/files.hpp"
#include "tests/player/measure_report.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;

namespace {

std::string write_coded(const Folder& folder, const CodedFile& how = {}) {
  const std::string path = folder.file("coded.relit");
  const auto bytes = coded_file(how);
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  return path;
}

// The transfer of the clip's ticks, each value `off` too large, as a reference.
std::string write_reference(const Folder& folder, const std::string& clip, std::size_t frames,
                            float off, std::vector<float>* values = nullptr) {
  auto reference = MeasureReference::open(clip, "");
  REQUIRE(reference);
  REQUIRE(reference->shape().frames == frames);
  REQUIRE(reference->load(0));
  const decoders::MapSize size = reference->shape().size;
  const std::string path = folder.file("reference.npy");
  const std::uint64_t shape[] = {frames, 1, 3, size.height, size.width};
  auto writer = decoders::NpyWriter::create(path, decoders::NpyWriter::Type::kFloat32, shape);
  REQUIRE(writer);
  for (std::size_t i = 0; i < frames; ++i) {
    std::vector<float> frame(reference->transfer(i).begin(), reference->transfer(i).end());
    for (float& value : frame) value += off;
    REQUIRE(writer->write(std::span<const float>(frame)));
    if (values != nullptr) values->insert(values->end(), frame.begin(), frame.end());
  }
  REQUIRE(writer->commit());
  return path;
}

MeasureRun run_of(const std::string& file, const std::string& reference) {
  MeasureRun run;
  run.files = {file};
  run.reference = reference;
  run.frames = 0;
  run.sweep.composite = "cpu";
  run.sweep.threads = run.sweep.every = "1";
  run.meter.repeats = 1;
  run.progress = run.warn = [](const std::string&) {};
  return run;
}

}  // namespace

TEST_CASE("the front holds what nothing else beats, and of equals the first") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> costs{4, 2, 3, 1, 2, 5, 1, nan}, gains{40, 30, 29, 10, 30, 41, 9, 99};
  CHECK(pareto_front(costs, gains) == std::vector<std::uint8_t>{1, 1, 0, 1, 0, 1, 0, 0});
  CHECK(pareto_front({}, {}).empty());
  const std::vector<double> one{3}, infinite{std::numeric_limits<double>::infinity()};
  CHECK(pareto_front(one, infinite) == std::vector<std::uint8_t>{1});
  CHECK(pareto_front(one, std::vector<double>{nan}) == std::vector<std::uint8_t>{0});

  const MeasureReport report = sample_report();
  CHECK(report.points[0].on_bytes_front);
  CHECK(report.points[1].on_bytes_front);
  CHECK_FALSE(report.points[2].on_bytes_front);
  CHECK_FALSE(report.points[3].on_bytes_front);  // not scored
  CHECK(report.points[1].on_time_front);
}

TEST_CASE("the median of an even number of values is the mean of the two in the middle") {
  CHECK(median({}) == 0);
  CHECK(median({3}) == 3);
  CHECK(median({5, 1, 3}) == 3);
  CHECK(median({1, 9, 3, 5}) == 4);
}

TEST_CASE("a sweep turns one knob after another, or all of them together") {
  MeasuredFile file;
  file.path = "f";
  file.layers = {{1, 10}, {4, 20}, {6, 30}};
  CHECK(file.planes() == 11);
  CHECK(file.layers_for(11) == 3);
  CHECK(file.layers_for(5) == 2);
  CHECK(file.layers_for(2) == 2);
  CHECK(file.layers_for(1) == 1);
  MeasureSweepText text;
  text.planes = "all,layers,2", text.composite = "cpu,texture", text.threads = "1,4";
  text.every = "1";
  const std::vector<Backend> backends{Backend::kEgl, Backend::kOsmesa};
  auto sweep = parse_measure_sweep(text, true, backends);
  REQUIRE(sweep);
  auto points = expand_measure_sweep(*sweep, file);
  REQUIRE(points);
  // The base; 5, 1 and 2 planes; texture on two backends; four threads.
  REQUIRE(points->size() == 7);
  CHECK(points->front().planes == 11);
  CHECK((*points)[1].planes == 5);
  CHECK((*points)[2].planes == 1);
  CHECK((*points)[3].planes == 2);
  CHECK((*points)[5].backend == Backend::kOsmesa);
  CHECK((*points)[6].threads == 4);
  CHECK((*points)[6].path == CompositePath::kCpu);
  text.product = true;
  sweep = parse_measure_sweep(text, true, backends);
  REQUIRE(sweep);
  points = expand_measure_sweep(*sweep, file);
  REQUIRE(points);
  CHECK(points->size() == 4 * 3 * 2);

  const auto refused = [&](MeasureSweepText wrong) {
    const auto result = parse_measure_sweep(wrong, true, backends);
    return !result && (result.error().code == ErrorCode::kInvalid ||
                       result.error().code == ErrorCode::kEnvironment);
  };
  CHECK(refused({"0", "", "", "", "", false}));
  CHECK(refused({"1,,2", "", "", "", "", false}));
  CHECK(refused({"", "auto", "", "", "", false}));
  CHECK(refused({"", "cpu,gpu", "", "", "", false}));
  CHECK(refused({"", "", "egl-es2", "", "", false}));  // not there
  CHECK(refused({"", "", "cpu", "", "", false}));
  CHECK(refused({"", "", "", "65", "", false}));
  CHECK(refused({"", "", "", "", "0", false}));
  text.planes = "12";
  sweep = parse_measure_sweep(text, true, backends);
  REQUIRE(sweep);
  CHECK_FALSE(expand_measure_sweep(*sweep, file));
}

TEST_CASE("a file is scored as the definition says, against an array that is off by a constant") {
  const Folder folder;
  const std::string clip = write_coded(folder);
  constexpr float kOff = 0.01f;
  std::vector<float> values;
  const std::string reference = write_reference(folder, clip, kCodedFrames, kOff, &values);
  const auto report = measure(run_of(clip, reference));
  REQUIRE(report);
  REQUIRE(report->points.size() == 1);
  const MeasuredPoint& point = report->points.front();
  REQUIRE(point.scored());
  // Every composite is off by the light's mean coefficient times the constant; peak and mean square
  // go over all lights, channels and covered texels, and the error is the same for all texels.
  double squares = 0, most = 0, count = 0;
  for (const decoders::Light& light : decoders::standard_lights())
    for (const double value : light.sh[0]) {
      const double error = value * static_cast<double>(kOff);
      squares += error * error, most = std::max(most, error), ++count;
    }
  // Sums of floats near 1 are rounded to 2^-24, which beside an error of 0.03 is 2e-6 of it.
  CHECK(point.error.psnr_db ==
        Approx(10 * std::log10(report->peak * report->peak * count / squares)).epsilon(1e-5));
  CHECK(point.error.largest == Approx(most / report->peak).epsilon(1e-4));
  CHECK(point.light_bytes == report->files[0].layers[0].bytes);
  CHECK(point.light_bytes_per_s ==
        Approx(static_cast<double>(point.light_bytes) / report->files[0].duration_s));
  CHECK(point.file_bytes < report->files[0].bytes);
  CHECK(report->files[0].exponent_block == 4);
  CHECK(report->files[0].exponent_hold == 1);
  CHECK(point.decode_ms.has_value());
  CHECK(point.heap_bytes > 0);

  // Against itself nothing is lost but the rounding of a float sum: 2^-23 of values of about the
  // peak, more than 120 dB below it.
  const auto itself = measure(run_of(clip, ""));
  REQUIRE(itself);
  CHECK(itself->points[0].error.psnr_db > 120);
  CHECK_FALSE(itself->reference_baked);
}

TEST_CASE("frames that are left out are blended from those beside them") {
  const Folder folder;
  const std::string clip = write_coded(folder, {"ffv1", true, true, true});  // 6 ticks
  auto whole = TickFrames::open(clip, {"", -1, 1});
  REQUIRE(whole);
  const auto expect = [](const Result<FrameMix>& mix, std::uint64_t from, int to, double blend) {
    REQUIRE(mix);
    CHECK(mix->from->frame() == from);
    CHECK((mix->to != nullptr ? static_cast<int>(mix->to->frame()) : -1) == to);
    CHECK(static_cast<double>(mix->blend) == Approx(blend));
  };
  // Frames last 1, 2, 1 and 2 ticks.
  expect(whole->at(0), 0, -1, 0);
  expect(whole->at(1), 1, -1, 0);
  expect(whole->at(2), 1, 2, 0.5);
  expect(whole->at(3), 2, -1, 0);
  auto every_second = TickFrames::open(clip, {"", -1, 2});
  REQUIRE(every_second);
  expect(every_second->at(0), 0, -1, 0);
  expect(every_second->at(1), 0, 2, 1.0 / 3);
  expect(every_second->at(2), 0, 2, 2.0 / 3);
  expect(every_second->at(3), 2, -1, 0);
}

TEST_CASE("references that cannot be one are refused") {
  const Folder folder;
  const std::string clip = write_coded(folder);
  const auto code_of = [&](const std::string& reference) {
    const auto report = measure(run_of(clip, reference));
    return report ? ErrorCode{} : report.error().code;
  };
  const auto write = [&](const char* name, std::vector<std::uint64_t> shape, float value) {
    const std::string path = folder.file(name);
    auto writer = decoders::NpyWriter::create(path, decoders::NpyWriter::Type::kFloat32, shape);
    REQUIRE(writer);
    std::size_t count = 1;
    for (const std::uint64_t side : shape) count *= side;
    std::vector<float> values(count, value);
    REQUIRE(writer->write(std::span<const float>(values)));
    REQUIRE(writer->commit());
    return path;
  };
  CHECK(code_of(folder.file("none.npy")) == ErrorCode::kIo);
  CHECK(code_of(write("flat.npy", {4, 16, 16}, 1)) == ErrorCode::kCorrupt);
  CHECK(code_of(write("two.npy", {4, 2, 3, 16, 16}, 1)) == ErrorCode::kCorrupt);
  CHECK(code_of(write("frames.npy", {5, 1, 3, 16, 16}, 1)) == ErrorCode::kCorrupt);
  CHECK(code_of(write("small.npy", {4, 1, 3, 8, 16}, 1)) == ErrorCode::kCorrupt);
  CHECK(code_of(write("black.npy", {4, 1, 3, 16, 16}, 0)) == ErrorCode::kCorrupt);
  CHECK(code_of(write("nan.npy", {4, 1, 3, 16, 16}, std::numeric_limits<float>::quiet_NaN())) ==
        ErrorCode::kCorrupt);
  std::ofstream(folder.file("text.npy")) << "no array";
  CHECK(code_of(folder.file("text.npy")) == ErrorCode::kCorrupt);
  // Larger, and of more coefficients: what the file lacks counts as error.
  const auto larger = measure(run_of(clip, write("large.npy", {4, 4, 3, 32, 32}, 0.5f)));
  REQUIRE(larger);
  CHECK(larger->points[0].scored());
  CHECK(larger->points[0].error.psnr_db < 60);
}
