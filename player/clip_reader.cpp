// SPDX-License-Identifier: MIT
#include "player/clip_reader.hpp"

#include <algorithm>
#include <utility>

#include "container/base/out_of_memory.hpp"

namespace relit::player {

Result<ClipReader> ClipReader::open(std::unique_ptr<container::ByteSource> source,
                                    const std::string& name, const ClipOptions& options) {
  return catch_out_of_memory("opening a clip",
                             [&] { return open_clip(std::move(source), name, options); });
}

Result<ClipReader> ClipReader::open_clip(std::unique_ptr<container::ByteSource> source,
                                         const std::string& name, const ClipOptions& options) {
  RELIT_ASSIGN(ClipDemuxer demuxer,
               ClipDemuxer::open(std::move(source), name,
                                 {options.clip, options.spares_bytes(), /*interrupt=*/nullptr}));
  RELIT_ASSIGN(decoders::PoseTrack poses, demuxer.open_poses());
  ClipReader clip(std::move(demuxer), std::move(poses));
  clip.impatient_ = options.impatient;
  clip.first_picture_ = {clip.demuxer_.pose_record().track_id};
  clip.demuxer_.want_poses_alone();
  if (options.planes) RELIT_TRY(clip.open_planes(options));
  return clip;
}

Status ClipReader::open_planes(const ClipOptions& options) {
  std::vector<std::uint8_t> wanted(layers().size(), 1);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (options.layers >= 0 && i >= static_cast<std::size_t>(options.layers)) wanted[i] = 0;
  }
  auto planes = decoders::PlaneDecoder::open(model(), layers(), {options.threads, wanted});
  if (!planes) return demuxer_.in_file(planes.error());
  planes_ = std::move(*planes);
  if (!wanted.empty()) demuxer_.want_layers(wanted);
  if (wanted.empty() || wanted.front() == 0) return {};
  first_picture_.push_back(layers().front().mantissa_track);
  if (layers().front().has_exponents) first_picture_.push_back(layers().front().exponent_track);
  return {};
}

PlaybackLoss ClipReader::loss() const {
  PlaybackLoss loss = demuxer_.loss();
  loss.frames = lost_frames_;
  return loss;
}

Status ClipReader::take_chunk() {
  const container::SegmentRecord& segment = *demuxer_.segment();
  std::erase(missing_, chunk_.track_id);
  if (chunk_.track_id != demuxer_.pose_record().track_id) {
    if (!planes_) return {};
    const Status status = planes_->add_chunk(segment, std::move(chunk_));
    return status ? status : demuxer_.note_damage(status.error());
  }
  if (chunk_.packets.empty()) return {};
  const container::Packet& packet = chunk_.packets.front();
  const std::span<const std::uint8_t> bytes(chunk_.data.data() + packet.offset, packet.size);
  const Status status = poses_.add_packet(bytes, segment.first_frame, segment.frame_count);
  return status ? status : demuxer_.note_damage(status.error());
}

Status ClipReader::read_record(std::uint64_t target) {
  RELIT_ASSIGN(const ClipDemuxer::Event event, demuxer_.step(target, chunk_));
  if (event == ClipDemuxer::Event::kSegment) missing_ = first_picture_;
  if (event == ClipDemuxer::Event::kChunk) return take_chunk();
  return {};
}

Status ClipReader::read_until(std::uint64_t index) {
  while (!demuxer_.ended() && demuxer_.complete_end() <= index) {
    const container::SegmentRecord* segment = demuxer_.segment();
    const bool enough = segment != nullptr && index < segment->first_frame + segment->frame_count &&
                        impatient_ && missing_.empty();
    if (enough) break;
    RELIT_TRY(read_record(index));
  }
  return {};
}

// What was read elsewhere in the clip would only pile up.
void ClipReader::forget_all() {
  kept_begin_ = demuxer_.complete_end();
  poses_.forget_all();
  if (planes_) planes_->forget_all();
}

Status ClipReader::decode(std::uint64_t index) {
  RELIT_TRY(poses_.sample(static_cast<double>(index), scratch_.pose));
  scratch_.complete = true;
  if (!planes_) return {};
  Status decoded = planes_->frame(index, scratch_.planes);
  const bool early = std::exchange(impatient_, false) && missing_.empty();
  if (!decoded && decoded.error().code == ErrorCode::kNotFound && early) {
    scratch_.complete = false;
    return {};
  }
  return decoded;
}

Status ClipReader::frame(std::uint64_t index, ClipFrame& out) {
  return catch_out_of_memory("decoding a frame", [&] { return decode_frame(index, out); });
}

Status ClipReader::decode_frame(std::uint64_t index, ClipFrame& out) {
  RELIT_TRY(demuxer_.check_frame(index));
  const container::SegmentRecord* segment = demuxer_.segment();
  const std::uint64_t come = demuxer_.complete_end();
  const bool back = index < kept_begin_;
  const bool ahead =
      index > come && !(segment != nullptr && index < segment->first_frame + segment->frame_count);
  if (back || ahead) {
    RELIT_ASSIGN(const bool jumped, demuxer_.jump(index));
    if (back && !jumped) return demuxer_.gone_by(index);
    if (jumped) forget_all();
  }
  RELIT_TRY(read_until(index));
  const Status decoded = decode(index);
  if (decoded) {
    std::swap(out, scratch_);
    shown_ = true;
    forget_before(index);
    return {};
  }
  RELIT_TRY(demuxer_.note_damage(decoded.error()));
  if (!shown_) return demuxer_.in_file(decoded.error());
  ++lost_frames_;
  return {};
}

Result<std::uint64_t> ClipReader::frame_at(std::uint64_t tick) {
  return catch_out_of_memory("looking for a frame", [&] { return find_frame(tick); });
}

Result<std::uint64_t> ClipReader::find_frame(std::uint64_t tick) {
  RELIT_TRY(demuxer_.check_tick(tick));
  if (const auto known = demuxer_.timeline().frame_at(tick)) return *known;
  // The segment that begins last before the tick says which of its frames is shown.
  RELIT_ASSIGN(const bool jumped, demuxer_.jump_to_tick(tick));
  if (jumped) forget_all();
  while (!demuxer_.ended()) {
    RELIT_TRY(read_record(demuxer_.complete_end()));
    if (const auto known = demuxer_.timeline().frame_at(tick)) return *known;
  }
  return demuxer_.missing_tick(tick);
}

std::uint64_t ClipReader::first_tick(std::uint64_t index) const {
  return demuxer_.timeline().first_tick(index).value_or(index);
}

std::uint32_t ClipReader::ticks_of(std::uint64_t index) const {
  return demuxer_.timeline().ticks_of(index).value_or(1);
}

void ClipReader::forget_before(std::uint64_t index) {
  const container::SegmentRecord* segment = demuxer_.segment();
  if (segment == nullptr || segment->first_frame > index || segment->first_frame == kept_begin_)
    return;
  kept_begin_ = segment->first_frame;
  poses_.forget_before(kept_begin_);
  if (planes_) planes_->forget_before(kept_begin_);
}

}  // namespace relit::player
