// SPDX-License-Identifier: MIT
#include <algorithm>
#include <string>
#include <utility>

#include "container/base/limits.hpp"
#include "decoders/plane_decoder.hpp"

namespace relit::decoders {

Result<TrackDecoder> TrackDecoder::open(const VideoFormat& format,
                                        const VideoDecoderOptions& options) {
  RELIT_ASSIGN(VideoDecoder video, VideoDecoder::open(format, options));
  return TrackDecoder(std::move(video), format.track_id, options.threads);
}

/// Checks the packets and notes when they are shown.
Status TrackDecoder::list_shown(const container::SegmentRecord& segment, Chunk& chunk) const {
  const auto where = [&] {
    return "track " + std::to_string(track_id_) + ", segment " + std::to_string(segment.index) +
           ": ";
  };
  const container::ChunkRecord& record = chunk.record;
  std::vector<std::int64_t>& shown = chunk.shown;
  shown.clear();
  if (segment.frame_count == 0 || segment.frame_count > limits::kFramesPerSegment ||
      segment.first_frame > limits::kFrames || record.packets.size() > limits::kPacketsPerChunk) {
    return fail(ErrorCode::kLimit, where() + "too many frames or packets, or none");
  }
  const std::uint64_t end_frame = segment.first_frame + segment.frame_count;
  for (const container::Packet& packet : record.packets) {
    if (packet.size > record.data.size() || packet.offset > record.data.size() - packet.size) {
      return fail(ErrorCode::kCorrupt, where() + "a packet reaches outside its chunk");
    }
    if (packet.pts < static_cast<std::int64_t>(segment.first_frame) ||
        packet.pts >= static_cast<std::int64_t>(end_frame)) {
      return fail(ErrorCode::kCorrupt, where() + "a packet of frame " + std::to_string(packet.pts) +
                                           " is outside the segment's frames");
    }
    shown.push_back(packet.pts);
  }
  chunk.earliest = shown;
  for (std::size_t i = shown.size(); i-- > 1;)
    chunk.earliest[i - 1] = std::min(chunk.earliest[i - 1], chunk.earliest[i]);
  std::sort(shown.begin(), shown.end());
  if (std::adjacent_find(shown.begin(), shown.end()) != shown.end()) {
    return fail(ErrorCode::kCorrupt, where() + "two packets of one frame");
  }
  return {};
}

Status TrackDecoder::add_chunk(const container::SegmentRecord& segment,
                               container::ChunkRecord chunk) {
  Chunk stored;
  stored.record = std::move(chunk);
  RELIT_TRY(list_shown(segment, stored));
  stored.end_frame = segment.first_frame + segment.frame_count;
  const auto next = chunks_.lower_bound(segment.first_frame);
  if ((next != chunks_.end() && next->first != segment.first_frame &&
       next->first < stored.end_frame) ||
      (next != chunks_.begin() && std::prev(next)->second.end_frame > segment.first_frame)) {
    return fail(ErrorCode::kCorrupt, "track " + std::to_string(track_id_) + ", segment " +
                                         std::to_string(segment.index) +
                                         ": its frames overlap those of another segment");
  }
  if (segment_ == segment.first_frame) segment_.reset();
  chunks_.insert_or_assign(segment.first_frame, std::move(stored));
  return {};
}

Status TrackDecoder::replace_chunk(const container::SegmentRecord& segment,
                                   container::ChunkRecord& chunk) {
  segment_.reset();
  while (chunks_.size() > 1) chunks_.erase(chunks_.begin());
  if (chunks_.empty()) chunks_.try_emplace(0);
  auto node = chunks_.extract(chunks_.begin());
  std::swap(node.mapped().record, chunk);
  RELIT_TRY(list_shown(segment, node.mapped()));
  node.key() = segment.first_frame;
  node.mapped().end_frame = segment.first_frame + segment.frame_count;
  chunks_.insert(std::move(node));
  return {};
}

TrackDecoder::Chunks::const_iterator TrackDecoder::find(std::uint64_t frame) const {
  auto it = chunks_.upper_bound(frame);
  if (it == chunks_.begin()) return chunks_.end();
  --it;
  return frame < it->second.end_frame ? it : chunks_.end();
}

bool TrackDecoder::has_segment_of(std::uint64_t frame) const {
  return find(frame) != chunks_.end();
}

void TrackDecoder::restart(std::uint64_t first_frame) {
  // A segment starts with a decoder that knows nothing of the one before. Damage is gone for
  // certain only with the decoder that met it.
  if (!damage_ || !decoder_.reopen()) {
    if (next_packet_ > 0) decoder_.flush();
  }
  segment_ = first_frame;
  next_packet_ = 0;
  unshown_end_ = 0;
  drained_ = false;
  skipping_ = false;
  damage_.reset();
  suspects_.clear();
  current_.clear();
  ahead_.clear();
}

void TrackDecoder::note_damage(const Chunk& chunk, Error error) {
  skipping_ = true;
  // An error belongs to one of the packets in flight. libavcodec may show the rest of the picture
  // all the same when it is drained.
  const std::size_t in_flight =
      std::min(next_packet_, static_cast<std::size_t>(std::max(threads_, 1)));
  for (std::size_t i = next_packet_ - in_flight; i < next_packet_; ++i) {
    suspects_.push_back(chunk.record.packets[i].pts);
  }
  // No codec holds pictures back for longer.
  constexpr std::size_t kLongestDelay = 128;
  if (suspects_.size() > kLongestDelay) {
    suspects_.erase(suspects_.begin(), suspects_.end() - kLongestDelay);
  }
  if (!damage_) damage_ = std::move(error);
}

void TrackDecoder::show_every(std::uint64_t n) {
  // What has been left out may be asked for now.
  if (n % every_ != 0) segment_.reset();
  every_ = n;
}

// A picture is shown until the next one is.
bool TrackDecoder::is_shown(const Chunk& chunk, std::int64_t pts) const {
  if (every_ == 1 || pts == asked_) return true;
  const auto next = std::upper_bound(chunk.shown.begin(), chunk.shown.end(), pts);
  const std::uint64_t end =
      next != chunk.shown.end() ? static_cast<std::uint64_t>(*next) : chunk.end_frame;
  return (static_cast<std::uint64_t>(pts) + every_ - 1) / every_ * every_ < end;
}

// Packets are not even sent where no picture is shown before the next key packet, or to the end. A
// key packet in mid-chunk is trusted to begin anew only where no picture after it comes before it
// in time: such a one may refer to what was passed over. What has been looked at is not looked at
// again: segments of 65 536 packets would take as many passes.
void TrackDecoder::pass_unshown(const Chunk& chunk) {
  const auto& packets = chunk.record.packets;
  for (std::size_t at = std::max(unshown_end_, next_packet_); at < packets.size(); ++at) {
    const container::Packet& packet = packets[at];
    if (at != next_packet_ && packet.key && packet.pts == chunk.earliest[at]) next_packet_ = at;
    unshown_end_ = at;
    if (is_shown(chunk, packet.pts)) return;
  }
  next_packet_ = packets.size();
}

void TrackDecoder::feed(const Chunk& chunk) {
  const auto& packets = chunk.record.packets;
  // Damage ends what the codec can be trusted with: packets up to the next key packet are left out,
  // and the pictures that they would have shown are reported as lost.
  while (next_packet_ < packets.size() && skipping_ && !packets[next_packet_].key) ++next_packet_;
  if (every_ > 1) pass_unshown(chunk);
  if (next_packet_ == packets.size()) {
    if (Status drained = decoder_.drain(); !drained) note_damage(chunk, std::move(drained).error());
    drained_ = true;
    return;
  }
  const container::Packet& packet = packets[next_packet_++];
  if (next_packet_ == 1 && !packet.key) {
    note_damage(chunk, {ErrorCode::kCorrupt, "track " + std::to_string(track_id_) + ", frame " +
                                                 std::to_string(packet.pts) +
                                                 ": the segment does not begin with a key packet"});
    return;
  }
  skipping_ = false;
  const auto bytes =
      std::span(chunk.record.data)
          .subspan(static_cast<std::size_t>(packet.offset), static_cast<std::size_t>(packet.size));
  if (Status sent = decoder_.send(bytes, packet.pts, packet.key, is_shown(chunk, packet.pts));
      !sent) {
    note_damage(chunk, std::move(sent).error());
  }
}

void TrackDecoder::advance(const Chunk& chunk) {
  ahead_.clear();
  // Each turn takes a packet, a picture or an error; a decoder that only ever fails while draining
  // would not end by itself.
  for (int failures = 0; failures < 64;) {
    Result<VideoDecoder::Received> received = decoder_.receive(ahead_);
    if (!received) {
      ++failures;
      note_damage(chunk, std::move(received).error());
      continue;
    }
    if (*received == VideoDecoder::Received::kFrame) {
      ++pictures_;
      const std::int64_t pts = ahead_.pts();
      const std::int64_t after = current_.empty() ? -1 : current_.pts();
      if (std::find(suspects_.begin(), suspects_.end(), pts) != suspects_.end()) {
        ahead_.clear();
        continue;
      }
      const bool known = std::binary_search(chunk.shown.begin(), chunk.shown.end(), pts);
      if (known && pts > after) return;
      note_damage(chunk, {ErrorCode::kCorrupt,
                          "track " + std::to_string(track_id_) +
                              ": a picture with the time stamp of none of the packets, "
                              "or out of order, after frame " +
                              std::to_string(after)});
      ahead_.clear();
      continue;
    }
    if (*received == VideoDecoder::Received::kEnd || drained_) return;
    feed(chunk);
  }
  ahead_.clear();
}

bool TrackDecoder::decode_until(const Chunk& chunk, std::int64_t pts) {
  while (current_.empty() || current_.pts() < pts) {
    if (ahead_.empty()) advance(chunk);
    if (ahead_.empty() || ahead_.pts() > pts) break;
    current_ = std::move(ahead_);
    ahead_.clear();
  }
  return !current_.empty() && current_.pts() == pts;
}

Result<const VideoFrame*> TrackDecoder::picture(std::uint64_t frame) {
  const auto where = [&] {
    return "track " + std::to_string(track_id_) + ", frame " + std::to_string(frame) + ": ";
  };
  const auto found = find(frame);
  if (found == chunks_.end()) {
    return fail(ErrorCode::kNotFound, where() + "its segment is not here");
  }
  const Chunk& chunk = found->second;
  const auto wanted = static_cast<std::int64_t>(frame);
  const auto after = std::upper_bound(chunk.shown.begin(), chunk.shown.end(), wanted);
  if (after == chunk.shown.begin()) {
    return fail(ErrorCode::kCorrupt, where() + "no packet at or before it in its segment");
  }
  const std::int64_t expected = *std::prev(after);
  asked_ = -1;
  const bool foreseen = is_shown(chunk, expected);
  asked_ = expected;
  if (!foreseen) unshown_end_ = 0;
  if (segment_ != found->first || (!current_.empty() && current_.pts() > expected)) {
    restart(found->first);
  }
  if (decode_until(chunk, expected)) return &current_;
  if (decoder_.fell_back() || !foreseen) {
    restart(found->first);
    if (decode_until(chunk, expected)) return &current_;
  }
  return fail(ErrorCode::kCorrupt,
              where() + "lost" + (damage_ ? " (" + damage_->message + ")" : ""));
}

void TrackDecoder::forget_all() {
  segment_.reset();
  chunks_.clear();
  current_.clear();
  ahead_.clear();
}

void TrackDecoder::forget_before(std::uint64_t frame) {
  while (!chunks_.empty() && chunks_.begin()->second.end_frame <= frame) {
    if (segment_ == chunks_.begin()->first) segment_.reset();
    chunks_.erase(chunks_.begin());
  }
}

}  // namespace relit::decoders
