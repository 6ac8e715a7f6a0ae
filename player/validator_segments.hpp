// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "container/records.hpp"
#include "player/validator_static.hpp"
#include "player/validator_tracks.hpp"

/// Segments, their chunks, and the index that lists them.
namespace relit::player {

class SegmentChecker {
 public:
  SegmentChecker(FindingLog& log, const StaticChecker& statics, TrackChecker* tracks)
      : log_(log), statics_(statics), tracks_(tracks) {}

  /// A SEGM record. False: it is unusable, and nothing is known of its chunks.
  bool segment(const FindingPlace& place, std::span<const std::uint8_t> payload);
  /// Whether a chunk of the current segment is due.
  [[nodiscard]] bool inside() const { return segment_ && chunk_ < segment_->chunks.size(); }
  /// Whether chunks follow a segment that was lost, so that nothing can be said of them.
  [[nodiscard]] bool behind_lost_segment() const { return behind_lost_; }
  [[nodiscard]] const container::SegmentRecord* current() const {
    return segment_ ? &*segment_ : nullptr;
  }

  /// Whether a record with `type` and length is the chunk that is due; says so if not, and goes on
  /// with the chunk that it is, if it is one of this segment.
  bool expect_chunk(const FindingPlace& place, std::uint64_t record_bytes);
  /// The chunk that expect_chunk() let through; no payload: it is damaged.
  void chunk(const FindingPlace& place, std::optional<std::span<const std::uint8_t>> payload);
  /// Gives up the rest of the current segment.
  void abandon();
  /// Bytes from `begin` to `end`, or a record between them, were lost.
  void note_loss(std::uint64_t begin, std::uint64_t end);
  /// The segment at `place` was lost: its chunks will follow.
  void note_lost_segment(const FindingPlace& place, std::uint64_t record_bytes);

  /// The INDX record.
  void index(const FindingPlace& place, const container::IndexRecord& record);
  /// At the end of the file; `complete`: FEND was there.
  void finish(const FindingPlace& end, bool complete);
  [[nodiscard]] bool any() const { return !seen_.empty(); }

 private:
  struct Progress {
    std::uint64_t frames = 0;  ///< the end of the last segment
    std::uint64_t ticks = 0;
    bool gap = false;  ///< frames were left out, so that ticks are a lower bound
  };

  void check_number(const FindingPlace& place, const container::SegmentRecord& segment);
  void check_frames(const FindingPlace& place, const container::SegmentRecord& segment);
  void check_ticks(const FindingPlace& place, const container::SegmentRecord& segment,
                   const Progress& before);
  void check_tracks(const FindingPlace& place, const container::SegmentRecord& segment);
  bool check_packets(const FindingPlace& place, const container::ChunkRecord& chunk);
  void end_segment();
  [[nodiscard]] bool lost_between(std::uint64_t begin, std::uint64_t end) const;

  FindingLog& log_;
  const StaticChecker& statics_;
  TrackChecker* tracks_;  ///< null: packets are not decoded
  std::optional<container::SegmentRecord> segment_;
  FindingPlace segment_place_;
  std::size_t chunk_ = 0;
  bool behind_lost_ = false;
  std::optional<std::uint32_t> last_number_;
  std::map<std::uint32_t, Progress> progress_;       ///< by clip
  std::vector<container::IndexRecord::Entry> seen_;  ///< all segments, as an index has them
  std::vector<std::pair<std::uint64_t, std::uint64_t>> lost_;  ///< bytes; ends never fall
};

}  // namespace relit::player
