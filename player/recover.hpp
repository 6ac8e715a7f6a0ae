// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "container/byte_sink.hpp"
#include "container/byte_source.hpp"

namespace relit::player {

/// Frames of a clip, first to last.
struct FrameRun {
  std::uint64_t first = 0, last = 0;
  bool operator==(const FrameRun&) const = default;
};

/// What a recovered file lacks of one track.
struct TrackLoss {
  std::uint32_t clip_id = 0;
  std::string clip;  ///< its name
  std::uint32_t track = 0;
  std::string what;  ///< "pose", "layer 3", "exponents of layer 3"
  std::vector<FrameRun> frames;
};

/// What recover() did.
struct RecoverReport {
  std::uint64_t source_bytes = 0;
  std::uint64_t damaged_bytes = 0;     ///< of the source, in no intact record
  std::uint64_t segments = 0;          ///< written
  std::uint64_t partial_segments = 0;  ///< of these, without some of their tracks
  std::uint64_t lost_segments = 0;     ///< not written, as far as they can be counted
  std::vector<std::string> repaired;   ///< what was hit and came back, a phrase each
  std::vector<std::string> lost;       ///< static records that did not, and what that costs
  std::vector<TrackLoss> tracks;       ///< frames that the output lacks, in the order of the tracks
  bool frames_lost = false;            ///< frames of `tracks` are gone through damage

  /// Everything that the source held or should have held is in the output.
  [[nodiscard]] bool clean() const { return lost.empty() && !frames_lost && lost_segments == 0; }
};

/// Writes what is left of a damaged or cut file as a complete one with new index, copies and end.
/// Nothing is decoded or encoded. Static records that were hit are taken from their copies,
/// wherever these stand; a segment keeps the chunks that were not hit, unless its pose or the first
/// layer of its models is among the lost ones: then nothing of it could be shown and it is left
/// out. Frames keep their numbers and times, so that what is missing is a gap. Unknown records that
/// may be copied are.
///
/// `source` must be able to seek; memory is what the static part and the largest segment need. On
/// failure the sink holds rubbish. Errors: kCorrupt when nothing can be used (says why),
/// kUnsupported for files of other versions, kLimit; those of source and sink.
Result<RecoverReport> recover(container::ByteSource& source, container::ByteSink& sink);

}  // namespace relit::player
