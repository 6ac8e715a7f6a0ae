// SPDX-License-Identifier: MIT
#include "player/measure_point.hpp"

#include <algorithm>
#include <chrono>
#include <thread>

#include "decoders/coverage.hpp"
#include "player/measure_file.hpp"

namespace relit::player {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

std::string key_of(const MeasuredFile& file, const std::string& rest) {
  return file.path + '\n' + rest;
}

}  // namespace

Status on_own_thread(const std::function<Status()>& work) {
  Status result;
  std::thread([&] { result = work(); }).join();
  return result;
}

Status check_against(const MeasuredFile& file, const MeasureReference& reference) {
  const MeasureReference::Shape& shape = reference.shape();
  const auto refuse = [&](const std::string& what) {
    return fail(ErrorCode::kCorrupt,
                file.path + ": " + what + "; the reference is " + reference.path());
  };
  if (file.ticks != shape.frames) {
    return refuse("lasts " + std::to_string(file.ticks) + " ticks, and the reference has " +
                  std::to_string(shape.frames) + " frames");
  }
  if (file.order > shape.order) {
    return refuse("order " + std::to_string(file.order) + " is beyond the reference's, " +
                  std::to_string(shape.order));
  }
  const auto width = static_cast<std::size_t>(file.width),
             height = static_cast<std::size_t>(file.height);
  if (width > shape.size.width || height > shape.size.height) {
    return refuse(std::to_string(width) + "x" + std::to_string(height) +
                  " texels are more than the reference's " + std::to_string(shape.size.width) +
                  "x" + std::to_string(shape.size.height));
  }
  return {};
}

Result<TickFrames> open_point(const MeasuredFile& file, const MeasureKnobs& knobs) {
  return TickFrames::open(
      file.path, {file.clip, static_cast<int>(file.layers_for(knobs.planes)), knobs.every});
}

Result<std::unique_ptr<Relighter>> relighter_for(const ClipReader& clip, const MeasureKnobs& knobs,
                                                 const gles::Device* device) {
  RelightOptions options;
  options.device = device;
  options.path = knobs.path;
  options.meshes = clip.meshes();
  RELIT_ASSIGN(auto relighter, Relighter::create(clip.model(), clip.layers(), options));
  RelightQuality quality;
  quality.planes = knobs.planes;
  relighter->set_quality(quality);
  return relighter;
}

Result<PointMeter::Score> PointMeter::score(const MeasuredFile& file,
                                            const MeasureKnobs& knobs) const {
  RELIT_ASSIGN(TickFrames frames, open_point(file, knobs));
  if (knobs.path == CompositePath::kCpu) return score_with(file, knobs, nullptr, frames);
  Result<Score> result = fail(ErrorCode::kEnvironment, "no GL");
  RELIT_TRY(on_own_thread([&]() -> Status {
    RELIT_ASSIGN(const GlBackend gl, open_backend(*knobs.backend));
    result = score_with(file, knobs, gl.device.get(), frames);
    return {};
  }));
  return result;
}

Result<PointMeter::Score> PointMeter::score_with(const MeasuredFile& file,
                                                 const MeasureKnobs& knobs,
                                                 const gles::Device* device,
                                                 TickFrames& frames) const {
  const decoders::MapSize full = reference_.shape().size,
                          size{static_cast<std::size_t>(file.width),
                               static_cast<std::size_t>(file.height)};
  const std::size_t texels = full.width * full.height, own_texels = size.width * size.height;
  std::vector<std::uint8_t> covered(texels);
  RELIT_TRY(decoders::mark_covered_texels(frames.reader().meshes(), static_cast<int>(full.width),
                                          static_cast<int>(full.height), covered));
  std::vector<decoders::Light> lights;
  for (const MeasureLight& light : lights_) lights.push_back(light.light);
  decoders::RelitError error(lights, reference_.shape().coefficients(), covered, peak_);
  RELIT_ASSIGN(const auto relighter, relighter_for(frames.reader(), knobs, device));
  std::vector<float> own(3 * own_texels), map(size == full ? 0 : 3 * texels);
  for (std::size_t i = 0; i < reference_.ticks().size(); ++i) {
    RELIT_ASSIGN(const FrameMix mix, frames.at(reference_.ticks()[i]));
    for (std::size_t l = 0; l < lights.size(); ++l) {
      RELIT_TRY(relighter->set_light(lights[l]));
      RELIT_TRY(relighter->composite(mix));
      RELIT_TRY(relighter->read(own));
      for (std::size_t c = 0; c < 3 && !map.empty(); ++c) {
        decoders::resize_map(std::span(own).subspan(c * own_texels, own_texels), size,
                             std::span(map).subspan(c * texels, texels), full);
      }
      if (error.add_light_map(l, reference_.transfer(i), map.empty() ? own : map)) continue;
      return fail(ErrorCode::kUnsupported, "frame " + std::to_string(reference_.ticks()[i]) +
                                               " under " + lights_[l].name +
                                               ": the light map is not finite");
    }
  }
  return Score{error.figures(), frames.reader().loss().frames};
}

// Frame by frame: what a new frame takes, what another light takes while the frame rests, and what
// drawing takes. The first frames compile and allocate, and do not count.
Result<PointMeter::GlTimes> PointMeter::time(const MeasuredFile& file,
                                             const MeasureKnobs& knobs) const {
  constexpr std::uint64_t kWarm = 2;
  RELIT_ASSIGN(
      TickFrames frames,
      TickFrames::open(file.path, {file.clip, static_cast<int>(file.layers_for(knobs.planes)), 1}));
  const ClipReader& clip = frames.reader();
  std::vector<double> fresh, again, drawn;
  decoders::Light light = lights_.front().light, turned = light;
  decoders::rotate_light_y(turned, 0.1);
  const auto run = [&]() -> Status {
    std::unique_ptr<MeasureStage> stage;
    if (knobs.backend) {
      RELIT_ASSIGN(stage, MeasureStage::create(*knobs.backend, clip, {options_.picture_side, 1}));
      stage->expose(light);
    }
    const gles::Device* device = stage ? &stage->device() : nullptr;
    RELIT_ASSIGN(const auto relighter, relighter_for(clip, knobs, device));
    // What the CPU's sum alone takes, without the upload of its light map.
    const bool on_cpu = knobs.path == CompositePath::kCpu;
    std::unique_ptr<Relighter> alone;
    if (on_cpu) {
      RELIT_ASSIGN(alone, relighter_for(clip, knobs, nullptr));
    }
    Relighter& summing = on_cpu ? *alone : *relighter;
    const auto finish = [&] {
      if (stage) stage->finish();
    };
    const std::uint64_t count = std::min<std::uint64_t>(
        file.ticks, static_cast<std::uint64_t>(options_.timed_frames) + kWarm);
    for (std::uint64_t tick = 0; tick < count; ++tick) {
      RELIT_ASSIGN(const FrameMix mix, frames.at(tick));
      const bool counts = tick >= kWarm || count <= kWarm;
      RELIT_TRY(relighter->set_light(light));
      finish();
      Clock::time_point begin = Clock::now();
      RELIT_TRY(relighter->composite(mix));
      finish();
      if (counts) fresh.push_back(ms_since(begin));
      if (alone) {
        RELIT_TRY(alone->set_light(light));
        RELIT_TRY(alone->composite(mix));
      }
      RELIT_TRY(summing.set_light(turned));
      begin = Clock::now();
      RELIT_TRY(summing.composite(mix));
      finish();
      if (counts) again.push_back(ms_since(begin));
      if (!stage) continue;
      RELIT_TRY(stage->pose(mix));
      finish();
      begin = Clock::now();
      RELIT_TRY(stage->draw(*relighter));
      finish();
      if (counts) drawn.push_back(ms_since(begin));
    }
    return {};
  };
  RELIT_TRY(on_own_thread(run));
  const double sum = median(again);
  return GlTimes{std::max(median(fresh) - sum, 0.0), sum, median(drawn)};
}

Result<double> PointMeter::decoding(const MeasuredPoint& point) {
  const MeasuredFile& file = files_[point.file];
  const std::string key =
      key_of(file, std::to_string(point.layers) + " " + std::to_string(point.knobs.threads) + " " +
                       std::to_string(point.knobs.every));
  const auto found = decoding_.find(key);
  if (found != decoding_.end()) return found->second;
  RELIT_ASSIGN(const double ms, time_decoding(file, point.knobs, options_.repeats));
  decoding_.emplace(key, ms);
  return ms;
}

void PointMeter::add_times(MeasuredPoint& point) {
  const MeasuredFile& file = files_[point.file];
  const MeasureKnobs& knobs = point.knobs;
  if (const auto ms = decoding(point)) point.decode_ms = *ms;
  const std::string key = key_of(file, std::to_string(knobs.planes) + path_label(knobs));
  auto found = times_.find(key);
  if (found == times_.end()) found = times_.emplace(key, time(file, knobs)).first;
  if (!found->second) return;
  point.upload_ms = found->second->upload_ms;
  point.composite_ms = found->second->composite_ms;
  if (!knobs.backend) return;
  // A light map is drawn alike, whatever it was made of; all files are of one character.
  const bool fused = knobs.path == CompositePath::kFused;
  const std::string drawn = fused ? key
                                  : std::string(backend_name(*knobs.backend)) + " " +
                                        std::to_string(file.width) + "x" +
                                        std::to_string(file.height);
  point.draw_ms = drawing_.emplace(drawn, found->second->draw_ms).first->second;
}

Status PointMeter::add_score(MeasuredPoint& point) {
  const MeasuredFile& file = files_[point.file];
  const std::string key =
      key_of(file, std::to_string(point.knobs.planes) + path_label(point.knobs) + " " +
                       std::to_string(point.knobs.every));
  auto found = scores_.find(key);
  if (found == scores_.end()) found = scores_.emplace(key, score(file, point.knobs)).first;
  const Result<Score>& result = found->second;
  if (result) {
    point.error = result->error;
    point.lost_frames = result->lost_frames;
    return {};
  }
  if (result.error().code == ErrorCode::kOutOfMemory || result.error().code == ErrorCode::kIo)
    return Unexpected{result.error()};
  point.failure = result.error().message;
  point.impossible = result.error().code == ErrorCode::kUnsupported ||
                     result.error().code == ErrorCode::kEnvironment;
  return {};
}

Status PointMeter::measure(MeasuredPoint& point) {
  const MeasuredFile& file = files_[point.file];
  point.layers = file.layers_for(point.knobs.planes);
  for (std::size_t l = 0; l < file.layers.size(); ++l) {
    point.file_bytes -= l < point.layers ? 0 : file.layers[l].bytes;
    point.light_bytes += l < point.layers ? file.layers[l].bytes : 0;
  }
  point.file_bytes += file.bytes - file.image_bytes;
  point.light_bytes_per_s = static_cast<double>(point.light_bytes) / file.duration_s;
  point.file_bytes_per_s = static_cast<double>(point.file_bytes) / file.duration_s;
  if (const auto plan = plan_for_point(file, point.knobs, options_.picture_side)) {
    point.heap_bytes = plan->heap_bytes(), point.gpu_bytes = plan->gpu_bytes();
  }
  RELIT_TRY(add_score(point));
  if (point.scored()) add_times(point);
  return {};
}

}  // namespace relit::player
