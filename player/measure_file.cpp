// SPDX-License-Identifier: MIT
#include "player/measure_file.hpp"

#include <algorithm>
#include <chrono>

#include "player/file_survey.hpp"
#include "player/prefetcher.hpp"
#include "player/source.hpp"
#include "player/video_tracks.hpp"

namespace relit::player {
namespace {

// With their framing, and their copies where the file has any.
std::uint64_t image_bytes(const FileSurvey& survey) {
  std::uint64_t originals = 0, copies = 0;
  for (const container::ImageRecord& image : survey.contents.images)
    originals += image.bytes.size();
  for (const PassedOver& record : survey.passed_over)
    if (record.header.type == container::types::kImage) copies += record.header.payload_bytes;
  return originals + copies;
}

// Frames a picture, over the intact chunks of a track; 0: none came.
int frames_a_picture(const FileSurvey& survey, std::uint32_t track) {
  std::uint64_t frames = 0, pictures = 0;
  for (const SurveyedSegment& segment : survey.segments) {
    for (const SurveyedChunk& chunk : segment.chunks) {
      if (chunk.track_id != track) continue;
      frames += segment.record.frame_count;
      pictures += chunk.packets.size();
    }
  }
  return pictures == 0 ? 0 : static_cast<int>((frames + pictures / 2) / pictures);
}

std::uint64_t bytes_of(const FileSurvey& survey, const container::LayerRecord& layer) {
  const auto track = [&survey](std::uint32_t id) {
    const auto found = survey.track_bytes.find(id);
    return found == survey.track_bytes.end() ? 0 : found->second;
  };
  return track(layer.mantissa_track) + (layer.has_exponents ? track(layer.exponent_track) : 0);
}

void describe_layers(const FileSurvey& survey, const container::ModelRecord& model,
                     MeasuredFile& out) {
  const std::vector<container::LayerRecord> layers = survey.contents.layers_of(model.id);
  for (const container::LayerRecord& layer : layers)
    out.layers.push_back({static_cast<int>(layer.planes.size()), bytes_of(survey, layer)});
  const container::LayerRecord& first = layers.front();
  out.codec = first.codec;
  out.chroma = chroma_name(first.chroma);
  out.bit_depth = first.bit_depth;
  out.lossless = first.lossless;
  if (!first.has_exponents) return;
  out.exponent_block = first.exponent_block;
  out.exponent_hold = frames_a_picture(survey, first.exponent_track);
}

}  // namespace

Result<MeasuredFile> read_measured_file(const std::string& path, const std::string& clip) {
  const auto in_file = [&path](const Error& error) {
    return Unexpected{{error.code, path + ": " + error.message}};
  };
  RELIT_ASSIGN(auto source, open_source(path));
  const auto survey = survey_file(std::move(source), true);
  if (!survey) return in_file(survey.error());
  const auto found = find_clip(survey->contents, clip, path);
  if (!found) return Unexpected{found.error()};
  const container::ClipRecord& record = **found;
  const auto& models = survey->contents.models;
  const auto model = std::find_if(models.begin(), models.end(),
                                  [&](const auto& m) { return m.clip_id == record.id; });
  if (model == models.end() || survey->contents.layers_of(model->id).empty())
    return fail(ErrorCode::kUnsupported, path + ": its clip has no appearance model");
  MeasuredFile out;
  out.path = path;
  out.clip = record.name;
  out.model = "shlm";
  out.order = model->order, out.width = model->width, out.height = model->height;
  out.prediction = model->prediction_plane >= 0;
  out.frames = record.frame_count, out.ticks = record.duration_ticks;
  out.duration_s = container::duration_s(record);
  out.bytes = survey->bytes;
  out.image_bytes = image_bytes(*survey);
  describe_layers(*survey, *model, out);
  return out;
}

Result<MemoryPlan> plan_for_point(const MeasuredFile& file, const MeasureKnobs& knobs,
                                  int picture_side) {
  RELIT_ASSIGN(auto source, open_source(file.path));
  RELIT_ASSIGN(auto reader, container::Reader::open(std::move(source)));
  RELIT_ASSIGN(const auto contents, container::load_static(reader));
  RELIT_ASSIGN(const container::ClipRecord* clip, find_clip(contents, file.clip, file.path));
  RELIT_ASSIGN(const SegmentScale segments, largest_segment(reader, *clip));
  MemoryWishes wishes;
  wishes.clip = file.clip;
  wishes.layers = static_cast<int>(file.layers_for(knobs.planes));
  wishes.threads = knobs.threads;
  wishes.path = knobs.path;
  if (knobs.backend) {
    DrawingScale drawing;
    drawing.framebuffer_width = drawing.framebuffer_height = picture_side;
    wishes.drawing = drawing;
  }
  return plan_memory(contents, segments, wishes, std::nullopt);
}

namespace {

Result<double> play_once(const MeasuredFile& file, const MeasureKnobs& knobs) {
  using Clock = std::chrono::steady_clock;
  RELIT_ASSIGN(auto source, open_source(file.path));
  RELIT_ASSIGN(auto demuxer,
               ClipDemuxer::open(std::move(source), file.path, {file.clip, false, nullptr}));
  PrefetchOptions options;
  options.every = knobs.every;
  options.impatient = false;
  options.layers.assign(demuxer.layers().size(), 0);
  std::fill_n(options.layers.begin(), file.layers_for(knobs.planes), std::uint8_t{1});
  RELIT_ASSIGN(auto pool, WorkerPool::create(knobs.threads));
  const Clock::time_point begin = Clock::now();
  RELIT_ASSIGN(const auto clip, Prefetcher::create(std::move(demuxer), std::move(pool), options));
  constexpr double kPatience_s = 60;
  for (std::uint64_t k = 0; k < file.frames; k += knobs.every) {
    clip->want(k);
    RELIT_ASSIGN(const bool here, clip->wait(k, kPatience_s));
    if (!here)
      return fail(ErrorCode::kEnvironment,
                  file.path + ": frame " + std::to_string(k) + " is not decoded within a minute");
  }
  const std::chrono::duration<double, std::milli> spent = Clock::now() - begin;
  return spent.count() / static_cast<double>(file.ticks);
}

}  // namespace

Result<double> time_decoding(const MeasuredFile& file, const MeasureKnobs& knobs, int repeats) {
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) {
    RELIT_ASSIGN(const double ms, play_once(file, knobs));
    times.push_back(ms);
  }
  return median(std::move(times));
}

}  // namespace relit::player
