// SPDX-License-Identifier: MIT
#include "player/packet_feed.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "container/base/limits.hpp"
#include "decoders/codec_private.hpp"

namespace relit::player {
namespace {

std::string seconds(std::int64_t time_ns) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4f s", static_cast<double>(time_ns) * 1e-9);
  return text;
}

}  // namespace

PacketFeed::PacketFeed(MatroskaReader reader, std::string name)
    : reader_(std::move(reader)), name_(std::move(name)), waiting_(reader_.tracks().size()) {}

Unexpected PacketFeed::wrong(const MatroskaPacket& packet, const std::string& what) const {
  return fail(ErrorCode::kCorrupt, name_ + ": track " +
                                       std::to_string(tracks()[packet.track].track_id) +
                                       ", packet at " + seconds(packet.time_ns) + ": " + what);
}

Result<bool> PacketFeed::wait_for(std::size_t track) {
  while (waiting_[track].empty()) {
    RELIT_ASSIGN(std::optional<MatroskaPacket> packet, reader_.next());
    if (!packet) return false;
    waiting_bytes_ += packet->bytes.size();
    if (waiting_bytes_ > limits::kRecordBytes) {
      return fail(ErrorCode::kLimit,
                  name_ + ": its tracks are not interleaved; remux it with `ffmpeg -c copy`");
    }
    waiting_[packet->track].push_back(std::move(*packet));
  }
  return true;
}

Status PacketFeed::append(const ClipTimes& times, const MatroskaPacket& packet,
                          container::ChunkRecord& chunk) const {
  const auto frame = times.frame_near(packet.time_ns, resolution_ns());
  if (!frame) return wrong(packet, "no frame of its segment begins then");
  const auto pts = static_cast<std::int64_t>(*frame);
  for (const container::Packet& other : chunk.packets) {
    if (other.pts == pts) {
      return wrong(packet, "frame " + std::to_string(pts) + " has a packet already");
    }
  }
  const std::string& codec = tracks()[packet.track].codec;
  if (const Status checked = decoders::check_packet(codec, packet.bytes); !checked) {
    return wrong(packet, checked.error().message);
  }
  if (chunk.packets.size() >= limits::kPacketsPerChunk ||
      chunk.data.size() + packet.bytes.size() > limits::kRecordBytes) {
    return fail(ErrorCode::kLimit, name_ + ": a segment with more packets than a chunk can hold");
  }
  chunk.packets.push_back({pts, packet.key, chunk.data.size(), packet.bytes.size()});
  chunk.data.insert(chunk.data.end(), packet.bytes.begin(), packet.bytes.end());
  return {};
}

Result<container::ChunkRecord> PacketFeed::chunk(const container::SegmentRecord& segment,
                                                 std::size_t track, const ClipTimes& times) {
  container::ChunkRecord chunk;
  chunk.track_id = tracks()[track].track_id;
  for (;;) {
    RELIT_ASSIGN(const bool there, wait_for(track));
    if (!there || times.past(waiting_[track].front().time_ns)) break;
    const MatroskaPacket packet = std::move(waiting_[track].front());
    waiting_[track].pop_front();
    waiting_bytes_ -= packet.bytes.size();
    RELIT_TRY(append(times, packet, chunk));
    ++packets_;
  }
  const auto first = static_cast<std::int64_t>(segment.first_frame);
  if (chunk.packets.empty() || !chunk.packets.front().key || chunk.packets.front().pts != first) {
    return fail(ErrorCode::kCorrupt,
                name_ + ": track " + std::to_string(chunk.track_id) + ": segment " +
                    std::to_string(segment.index) + " has to begin with a key packet of frame " +
                    std::to_string(first) + ", at " + seconds(times.time_ns(segment.first_frame)) +
                    "; encode it with key frames there and closed groups of pictures");
  }
  return chunk;
}

Status PacketFeed::finish() {
  for (std::size_t track = 0; track < waiting_.size(); ++track) {
    RELIT_ASSIGN(const bool there, wait_for(track));
    if (there) return wrong(waiting_[track].front(), "the clip has ended before");
  }
  return {};
}

}  // namespace relit::player
