// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "container/records.hpp"
#include "player/matroska.hpp"
#include "player/video_tracks.hpp"

namespace relit::player {

/// The packets of a Matroska file as the chunks of a clip's segments, in the order of the clip.
class PacketFeed {
 public:
  /// `name` is the file's, for messages.
  PacketFeed(MatroskaReader reader, std::string name);

  [[nodiscard]] const std::vector<MatroskaTrack>& tracks() const { return reader_.tracks(); }
  [[nodiscard]] std::int64_t resolution_ns() const { return reader_.resolution_ns(); }
  [[nodiscard]] std::uint64_t packets() const { return packets_; }

  /// The packets of a track (its place in tracks()) that belong to the segment which `times` has
  /// begun. Errors: kCorrupt where they do not make a chunk of it: no key packet at its first
  /// frame, times of no frame, two packets of a frame, packets of the segment before, or contents
  /// that are not of the form that the codec's packets have; kLimit when other tracks' packets come
  /// so much earlier that they fill the memory; those of MatroskaReader.
  Result<container::ChunkRecord> chunk(const container::SegmentRecord& segment, std::size_t track,
                                       const ClipTimes& times);

  /// Whether all packets have been taken. Errors: kCorrupt, naming what is left.
  Status finish();

 private:
  /// Reads until the track has a packet waiting; false at the end of the file.
  Result<bool> wait_for(std::size_t track);
  Status append(const ClipTimes& times, const MatroskaPacket& packet,
                container::ChunkRecord& chunk) const;
  [[nodiscard]] Unexpected wrong(const MatroskaPacket& packet, const std::string& what) const;

  MatroskaReader reader_;
  std::string name_;
  std::vector<std::deque<MatroskaPacket>> waiting_;  ///< by track
  std::uint64_t waiting_bytes_ = 0;
  std::uint64_t packets_ = 0;
};

}  // namespace relit::player
