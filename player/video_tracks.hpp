// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "container/reader.hpp"
#include "container/records.hpp"
#include "player/matroska.hpp"

/// What export and import share: the video tracks of a clip, and the times of its frames.
namespace relit::player {

struct VideoTrack {
  MatroskaTrack stream;
  std::size_t layer = 0;  ///< in FileContents::layers
  bool exponents = false;
};

/// Mantissas and exponents of all layers of the clip's models, in the order of the file.
[[nodiscard]] std::vector<VideoTrack> video_tracks(const container::FileContents& contents,
                                                   std::uint32_t clip_id);

/// The clip that the user named, by name or by its place in the file; "" is the first.
/// Errors: kNotFound, listing the clips.
[[nodiscard]] Result<const container::ClipRecord*> find_clip(
    const container::FileContents& contents, const std::string& wanted, const std::string& file);

/// When the frames of a clip are shown, segment by segment.
class ClipTimes {
 public:
  explicit ClipTimes(container::ClipRecord clip) : clip_(std::move(clip)) {}
  [[nodiscard]] const container::ClipRecord& clip() const { return clip_; }

  /// Takes a segment of the clip. Errors: kUnsupported when one of its frames is shown for less
  /// than `resolution_ns`, so that two could not be told apart.
  Status begin(const container::SegmentRecord& segment, std::int64_t resolution_ns);

  /// When a frame of the segment begins to be shown, from the start of the clip, to the nearest
  /// nanosecond. Requires first_frame <= frame < first_frame + frame_count.
  [[nodiscard]] std::int64_t time_ns(std::uint64_t frame) const {
    return times_[static_cast<std::size_t>(frame - first_frame_)];
  }
  /// When the segment ends.
  [[nodiscard]] std::int64_t end_ns() const { return times_.back(); }
  /// The frame of the segment that begins within `tolerance_ns` of `time_ns`; of two as near, the
  /// earlier, as Matroska's writers round halves up. Nothing where there is none.
  [[nodiscard]] std::optional<std::uint64_t> frame_near(std::int64_t time_ns,
                                                        std::int64_t tolerance_ns) const;
  /// Whether `time_ns` is nearer to the end of the segment than to its last frame, or beyond.
  [[nodiscard]] bool past(std::int64_t time_ns) const {
    return time_ns - times_[times_.size() - 2] > times_.back() - time_ns;
  }

 private:
  container::ClipRecord clip_;
  std::uint64_t first_frame_ = 0;
  std::vector<std::int64_t> times_{0, 0};  ///< of each frame, and where the last one ends
};

}  // namespace relit::player
