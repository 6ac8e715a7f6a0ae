// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "container/records.hpp"
#include "decoders/plane_decoder.hpp"
#include "decoders/pose.hpp"
#include "player/validator_static.hpp"

/// Decodes every packet of every track, one segment after the other.
namespace relit::player {

class TrackChecker {
 public:
  TrackChecker(FindingLog& log, int threads) : log_(log), threads_(threads) {}

  /// Opens the decoders of all tracks. `statics` outlives this object.
  void open(const StaticChecker& statics);
  /// Decodes a chunk whose packets belong to its segment.
  void check(const FindingPlace& place, const container::SegmentRecord& segment,
             container::ChunkRecord chunk);
  /// All chunks of the segment at `place` have been here: looks at its first picture as a whole.
  void end_segment(const FindingPlace& place, const container::SegmentRecord& segment);

 private:
  struct Video {
    const container::LayerRecord* layer = nullptr;
    bool exponents = false;
    std::optional<decoders::TrackDecoder> decoder;  ///< nothing: it does not open
    decoders::VideoFrame first;                     ///< of the current segment
  };
  /// Where the meshes have texels.
  struct Coverage {
    const container::ModelRecord* model = nullptr;
    std::vector<std::uint8_t> mask;
  };
  struct Range {
    double least = 0, greatest = 0;
  };

  void open_video(const FindingPlace& place, const container::LayerRecord& layer, bool exponents);
  void open_coverage(const StaticChecker& statics);
  void check_pose(const FindingPlace& place, const container::SegmentRecord& segment,
                  const container::ChunkRecord& chunk, decoders::PoseTrack& track);
  void check_video(const FindingPlace& place, const container::SegmentRecord& segment,
                   container::ChunkRecord chunk, Video& video);
  void check_order(const FindingPlace& place, const container::ChunkRecord& chunk,
                   const Video& video);
  void check_exponents(const FindingPlace& place, std::int64_t frame, const Video& video,
                       const decoders::VideoFrame& picture);
  [[nodiscard]] std::optional<Range> mean_transfer(const Coverage& coverage) const;

  FindingLog& log_;
  int threads_;
  std::map<std::uint32_t, std::optional<decoders::PoseTrack>> poses_;  ///< by track id
  std::map<std::uint32_t, Video> videos_;
  std::vector<Coverage> coverage_;
  const StaticChecker* statics_ = nullptr;
  decoders::Pose pose_;
};

}  // namespace relit::player
