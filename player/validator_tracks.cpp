// SPDX-License-Identifier: MIT
#include "player/validator_tracks.hpp"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "decoders/coverage.hpp"
#include "decoders/sh_constants.hpp"

namespace relit::player {

using namespace container;
using decoders::TrackDecoder;
using decoders::VideoFrame;

namespace {

/// T_0 of a point that sees nothing but a uniform light: 1/√(4π).
constexpr double kUnoccluded = decoders::kBand0;
/// Lossy coding overshoots, and light between surfaces of unit albedo adds up; a mistake in a scale
/// or a matrix goes further.
constexpr double kTransferTolerance = 0.5 * kUnoccluded;

std::string track_name(std::uint32_t track) { return "track " + std::to_string(track); }

/// Adds what a plane contributes to coefficient 0, in all texels of [channel][y][x].
void add_mean(const PlaneRecord& plane, const PlaneView& view, const ModelRecord& model,
              std::vector<double>& sums) {
  const std::size_t texels = std::size_t{model.width} * model.height;
  for (const MatrixEntry& entry : plane.matrix) {
    if (entry.coefficient != 0) continue;
    double* out = sums.data() + entry.channel * texels;
    for (int y = 0; y < model.height; ++y) {
      for (int x = 0; x < model.width; ++x)
        *out++ += double{entry.value} * decoders::plane_value(view, x, y);
    }
  }
}

}  // namespace

void TrackChecker::open(const StaticChecker& statics) {
  statics_ = &statics;
  for (const auto& pose : statics.pose_tracks()) {
    auto& track = poses_[pose.record.track_id];
    if (!statics.meshes() || track) continue;
    auto created = decoders::PoseTrack::create(statics.skeleton(), pose.record, *statics.meshes());
    if (created)
      track = std::move(*created);
    else if (statics.trusted())
      log_.add("DECODE_POSE_TRACK", pose.place, created.error().message);
  }
  for (const auto& layer : statics.layers()) {
    open_video(layer.place, layer.record, false);
    if (layer.record.has_exponents) open_video(layer.place, layer.record, true);
  }
  open_coverage(statics);
}

void TrackChecker::open_video(const FindingPlace& place, const LayerRecord& layer, bool exponents) {
  const auto format =
      exponents ? decoders::exponent_format(layer) : decoders::mantissa_format(layer);
  const auto [at, fresh] = videos_.try_emplace(format.track_id);
  if (!fresh) return;
  at->second.layer = &layer;
  at->second.exponents = exponents;
  auto decoder = TrackDecoder::open(format, {threads_, {}, nullptr});
  if (decoder)
    at->second.decoder.emplace(std::move(*decoder));
  else if (decoder.error().code == ErrorCode::kUnsupported)
    log_.add("VIDEO_CODEC", place, decoder.error().message);
  else
    log_.add("VIDEO_OPEN", place, decoder.error().message);
}

void TrackChecker::open_coverage(const StaticChecker& statics) {
  // Where a record is missing, planes and matrices need not fit one another.
  if (!statics.meshes() || !statics.trusted()) return;
  for (const auto& model : statics.models()) {
    const ModelRecord& record = model.record;
    Coverage coverage{&record, {}};
    coverage.mask.resize(std::size_t{record.width} * record.height);
    // No rule forbids charts that overlap; without the mask, transfer is not looked at.
    if (!decoders::mark_covered_texels(*statics.meshes(), record.width, record.height,
                                       coverage.mask))
      return;
    coverage_.push_back(std::move(coverage));
  }
}

void TrackChecker::check(const FindingPlace& place, const SegmentRecord& segment,
                         ChunkRecord chunk) {
  const auto pose = poses_.find(chunk.track_id);
  if (pose != poses_.end()) {
    if (chunk.packets.size() != 1)
      log_.add("CHNK_POSE_PACKETS", place,
               "pose " + track_name(chunk.track_id) + " has " +
                   std::to_string(chunk.packets.size()) + " packets in this segment, not one");
    else if (pose->second)
      check_pose(place, segment, chunk, *pose->second);
    return;
  }
  const auto video = videos_.find(chunk.track_id);
  if (video == videos_.end()) return;
  check_order(place, chunk, video->second);
  if (video->second.decoder) check_video(place, segment, std::move(chunk), video->second);
}

void TrackChecker::check_pose(const FindingPlace& place, const SegmentRecord& segment,
                              const ChunkRecord& chunk, decoders::PoseTrack& track) {
  const Status added = track.add_packet(chunk.data, segment.first_frame, segment.frame_count);
  if (!added) {
    log_.add("DECODE_POSE_PACKET", place,
             track_name(chunk.track_id) + ": " + added.error().message);
    return;
  }
  for (std::uint32_t i = 0; i < segment.frame_count; ++i) {
    const std::uint64_t frame = segment.first_frame + i;
    const Status posed = track.sample(static_cast<double>(frame), pose_);
    if (posed) continue;
    log_.add("DECODE_POSE_MATRIX", place,
             "frame " + std::to_string(frame) + ": " + posed.error().message);
    break;
  }
  track.forget_before(std::numeric_limits<std::uint64_t>::max());
}

void TrackChecker::check_order(const FindingPlace& place, const ChunkRecord& chunk,
                               const Video& video) {
  const auto pictures =
      video.exponents ? video.layer->exponent_pictures : video.layer->mantissa_pictures;
  if (pictures != 1) return;
  // FFV1 refers to no picture: what its packets hand on is the state of the entropy coder.
  const bool intra = (video.exponents ? video.layer->exponent_codec : video.layer->codec) == "ffv1";
  std::int64_t previous = -1;
  for (const Packet& packet : chunk.packets) {
    if ((packet.key || intra) && packet.pts > previous) {
      previous = packet.pts;
      continue;
    }
    log_.add("VIDEO_PICTURES", place,
             track_name(chunk.track_id) + " promises a decoder of one picture, but its packet of " +
                 "frame " + std::to_string(packet.pts) +
                 (packet.key ? " is out of order" : " is not a key"));
    return;
  }
}

void TrackChecker::check_video(const FindingPlace& place, const SegmentRecord& segment,
                               ChunkRecord chunk, Video& video) {
  std::vector<std::int64_t> shown;
  for (const Packet& packet : chunk.packets) shown.push_back(packet.pts);
  std::ranges::sort(shown);
  const std::uint32_t track = chunk.track_id;
  TrackDecoder& decoder = *video.decoder;
  decoder.forget_before(std::numeric_limits<std::uint64_t>::max());
  if (const Status added = decoder.add_chunk(segment, std::move(chunk)); !added) {
    log_.add("VIDEO_PICTURE", place, added.error().message);
    return;
  }
  std::size_t lost = 0;
  std::string reason;
  for (const std::int64_t pts : shown) {
    const auto picture = decoder.picture(static_cast<std::uint64_t>(pts));
    if (!picture) {
      if (lost++ == 0) reason = picture.error().message;
      continue;
    }
    if (pts == shown.front()) video.first = **picture;
    if (video.exponents) check_exponents(place, pts, video, **picture);
  }
  if (lost > 0)
    log_.add("VIDEO_PICTURE", place,
             track_name(track) + ": " + std::to_string(lost) + " of " +
                 std::to_string(shown.size()) + " pictures are lost; " + reason);
}

void TrackChecker::check_exponents(const FindingPlace& place, std::int64_t frame,
                                   const Video& video, const VideoFrame& picture) {
  const LayerRecord& layer = *video.layer;
  const int least = layer.bit_depth == 8 ? 9 : 11;
  const Rect* previous = nullptr;
  for (const PlaneRecord& plane : layer.planes) {
    const Rect& rect = plane.exponent_rect;
    if (previous != nullptr && *previous == rect) continue;
    previous = &rect;
    const SampleView view = decoders::crop(picture, 0, rect, 0);
    for (int y = 0; y < view.height; ++y) {
      for (int x = 0; x < view.width; ++x) {
        const int value = view.at(x, y);
        if (value == 0 || value >= least) continue;
        log_.add("VIDEO_EXPONENT", place,
                 track_name(layer.exponent_track) + ", frame " + std::to_string(frame) +
                     ": exponent " + std::to_string(value) + " at sample " +
                     std::to_string(rect.x + x) + ", " + std::to_string(rect.y + y) +
                     "; writers emit 0 or at least " + std::to_string(least));
        return;
      }
    }
  }
}

std::optional<TrackChecker::Range> TrackChecker::mean_transfer(const Coverage& coverage) const {
  const ModelRecord& model = *coverage.model;
  const std::size_t texels = coverage.mask.size();
  std::vector<double> sums(3 * texels);
  for (std::size_t i = 0; i < sums.size(); ++i) sums[i] = double{model.mean[0][i / texels]};
  std::int64_t number = 0;
  for (const auto& layer : statics_->layers()) {
    const LayerRecord& record = layer.record;
    if (record.model_id != model.id) continue;
    const VideoFrame& mantissas = videos_.at(record.mantissa_track).first;
    const VideoFrame* exponents =
        record.has_exponents ? &videos_.at(record.exponent_track).first : nullptr;
    if (mantissas.empty() || (exponents != nullptr && exponents->empty())) return std::nullopt;
    for (const PlaneRecord& plane : record.planes) {
      const PlaneView view = decoders::view_plane(record, plane, mantissas, exponents);
      add_mean(plane, view, model, sums);
      if (number++ != model.prediction_plane) continue;
      // s · A_0/π · Y_0, the same for every normal.
      PlaneRecord predicted = plane;
      const auto y0 = static_cast<float>(kUnoccluded);
      predicted.matrix = {{0, 0, y0}, {0, 1, y0}, {0, 2, y0}};
      add_mean(predicted, view, model, sums);
    }
  }
  std::optional<Range> range;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    if (coverage.mask[i % texels] == 0) continue;
    if (!range) range = Range{sums[i], sums[i]};
    range->least = std::min(range->least, sums[i]);
    range->greatest = std::max(range->greatest, sums[i]);
  }
  return range;
}

void TrackChecker::end_segment(const FindingPlace& place, const SegmentRecord& segment) {
  for (const Coverage& coverage : coverage_) {
    if (coverage.model->clip_id != segment.clip_id) continue;
    const auto range = mean_transfer(coverage);
    if (!range || (range->least >= -kTransferTolerance &&
                   range->greatest <= kUnoccluded + kTransferTolerance))
      continue;
    log_.add("VIDEO_TRANSFER", place,
             "model " + std::to_string(coverage.model->id) + ", frame " +
                 std::to_string(segment.first_frame) + ": T_0 goes from " +
                 std::to_string(range->least) + " to " + std::to_string(range->greatest) +
                 ", expected are 0 to 0.2821");
  }
  for (auto& [id, video] : videos_) video.first.clear();
}

}  // namespace relit::player
