// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "container/reader.hpp"
#include "container/records.hpp"

/// A small clip with video of several codecs, made by libavcodec: for what handles packets and
/// never looks at planes.
namespace relit::player::test {

struct VideoClip {
  container::ClipRecord clip;
  container::ModelRecord model;
  std::vector<container::LayerRecord> layers;
  std::vector<container::SegmentRecord> segments;
  std::vector<std::vector<container::ChunkRecord>> chunks;  ///< by segment, then track

  /// As a .relit file.
  [[nodiscard]] std::vector<std::uint8_t> file() const;
};

/// 24 frames in segments of 8, of which the second is unevenly spaced. Track 1: H.264 with B-frames
/// and parameter sets of its own; track 2: its exponents, FFV1, a picture every fourth frame;
/// track 3: MPEG-4 with B-frames.
VideoClip video_clip(container::Rational tick_rate = {30000, 1001});

struct Contents {
  container::FileContents records;
  std::vector<container::SegmentRecord> segments;
  std::vector<container::ChunkRecord> chunks;
};
/// Everything in a file; it has to be whole.
Contents read_all(const std::string& path);

}  // namespace relit::player::test
