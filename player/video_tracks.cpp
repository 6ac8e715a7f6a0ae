// SPDX-License-Identifier: MIT
#include "player/video_tracks.hpp"

#include <algorithm>

extern "C" {
#include <libavutil/mathematics.h>
}

namespace relit::player {
namespace {

VideoTrack mantissa_track(const container::LayerRecord& layer, std::size_t place) {
  VideoTrack track;
  track.layer = place;
  track.stream.track_id = layer.mantissa_track;
  track.stream.title = "layer " + std::to_string(layer.id) + " mantissas";
  track.stream.codec = layer.codec;
  track.stream.codec_private = layer.codec_private;
  track.stream.width = layer.coded_width;
  track.stream.height = layer.coded_height;
  return track;
}

VideoTrack exponent_track(const container::LayerRecord& layer, std::size_t place) {
  VideoTrack track;
  track.layer = place;
  track.exponents = true;
  track.stream.track_id = layer.exponent_track;
  track.stream.title = "layer " + std::to_string(layer.id) + " exponents";
  track.stream.codec = layer.exponent_codec;
  track.stream.codec_private = layer.exponent_private;
  track.stream.width = layer.exponent_width;
  track.stream.height = layer.exponent_height;
  return track;
}

}  // namespace

std::vector<VideoTrack> video_tracks(const container::FileContents& contents,
                                     std::uint32_t clip_id) {
  std::vector<VideoTrack> tracks;
  for (std::size_t i = 0; i < contents.layers.size(); ++i) {
    const container::LayerRecord& layer = contents.layers[i];
    const container::ModelRecord* model = contents.find_model(layer.model_id);
    if (model == nullptr || model->clip_id != clip_id) continue;
    tracks.push_back(mantissa_track(layer, i));
    const container::ClipRecord* clip = contents.find_clip(clip_id);
    if (clip != nullptr && clip->duration_ticks == clip->frame_count) {
      tracks.back().stream.frame_rate = clip->tick_rate;
    }
    if (layer.has_exponents) tracks.push_back(exponent_track(layer, i));
  }
  return tracks;
}

Result<const container::ClipRecord*> find_clip(const container::FileContents& contents,
                                               const std::string& wanted, const std::string& file) {
  std::string names;
  for (std::size_t i = 0; i < contents.clips.size(); ++i) {
    const container::ClipRecord& clip = contents.clips[i];
    if (wanted.empty() || clip.name == wanted) return &clip;
    names += (names.empty() ? "" : ", ") + clip.name;
  }
  for (std::size_t i = 0; i < contents.clips.size(); ++i) {
    if (wanted == std::to_string(i)) return &contents.clips[i];
  }
  return fail(ErrorCode::kNotFound, file + ": no clip \"" + wanted + "\"; there are: " + names);
}

Status ClipTimes::begin(const container::SegmentRecord& segment, std::int64_t resolution_ns) {
  // Ticks and both parts of the rate stay below 2^32: av_rescale() computes in 128 bits.
  const auto time = [&](std::uint64_t tick) {
    return av_rescale(static_cast<std::int64_t>(tick), clip_.tick_rate.den * 1'000'000'000,
                      clip_.tick_rate.num);
  };
  first_frame_ = segment.first_frame;
  std::uint64_t tick = segment.first_tick;
  times_.assign(1, time(tick));
  for (std::uint32_t i = 0; i < segment.frame_count; ++i) {
    tick += segment.durations.empty() ? 1 : segment.durations[i];
    times_.push_back(time(tick));
    if (times_[i + 1] - times_[i] < resolution_ns) {
      return fail(ErrorCode::kUnsupported,
                  "clip \"" + clip_.name + "\": frame " + std::to_string(first_frame_ + i) +
                      " is shown for " + std::to_string(times_[i + 1] - times_[i]) +
                      " ns; Matroska's times differ by at least " + std::to_string(resolution_ns));
    }
  }
  return {};
}

std::optional<std::uint64_t> ClipTimes::frame_near(std::int64_t time_ns,
                                                   std::int64_t tolerance_ns) const {
  const auto begin = times_.begin(), end = times_.end() - 1;
  auto nearest = std::lower_bound(begin, end, time_ns);
  if (nearest == end || (nearest != begin && time_ns - nearest[-1] <= *nearest - time_ns))
    --nearest;
  if (time_ns < *nearest - tolerance_ns || time_ns > *nearest + tolerance_ns) return {};
  return first_frame_ + static_cast<std::uint64_t>(nearest - begin);
}

}  // namespace relit::player
