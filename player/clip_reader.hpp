// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "container/byte_source.hpp"
#include "container/reader.hpp"
#include "container/timeline.hpp"
#include "decoders/mesh.hpp"
#include "decoders/plane_decoder.hpp"
#include "decoders/pose.hpp"

namespace relit::player {

struct ClipOptions {
  std::string clip;    ///< by name or number; empty: the first
  int layers = -1;     ///< decode so many layers, from the most important on; -1: all
  int threads = 1;     ///< of each mantissa decoder
  bool planes = true;  ///< false: poses only
  /// Not all frames will be asked for, so that of a source with byte ranges only what is needed
  /// should be fetched. Leaving out layers means that too.
  bool sparing = false;
  /// The first frame need not wait for all layers: it is given as soon as the pose and the most
  /// important layer are here, with the planes of the others empty, and the next one waits.
  bool impatient = false;

  [[nodiscard]] bool spares_bytes() const { return sparing || layers >= 0 || !planes; }
};

/// What was lost to damage so far.
struct PlaybackLoss {
  std::uint64_t frames = 0;    ///< shown with older planes or poses
  std::uint64_t records = 0;   ///< dropped because they were damaged
  std::uint64_t segments = 0;  ///< that never came, by the gaps in their numbers
  std::string first;           ///< the first reason, for the user
  [[nodiscard]] bool any() const { return frames != 0 || !first.empty(); }
};

/// One frame, decoded. Reuse one object from frame to frame.
struct ClipFrame {
  decoders::FrameView planes;
  decoders::Pose pose;
  bool complete = true;
};

/// One clip of a file as a sequence of frames: reads segments as they are needed, decodes planes
/// and poses, holds the last good frame over damage, and says what was lost. Going forward never
/// seeks; going back needs a source that can. One thread at a time.
class ClipReader {
 public:
  /// Reads everything static. `name` is for messages. Where options.spares_bytes(), the source is
  /// told what will be read; one that fetches ranges should have been opened so. Errors: those of
  /// the reader and the decoders; kNotFound for a clip that is not there (names those that are),
  /// kOutOfMemory.
  static Result<ClipReader> open(std::unique_ptr<container::ByteSource> source,
                                 const std::string& name, const ClipOptions& options);

  [[nodiscard]] const container::FileContents& contents() const { return contents_; }
  [[nodiscard]] const container::ClipRecord& clip() const { return clip_; }
  [[nodiscard]] const container::ModelRecord& model() const { return model_; }
  [[nodiscard]] const std::vector<container::LayerRecord>& layers() const { return layers_; }
  [[nodiscard]] const std::vector<decoders::Mesh>& meshes() const { return meshes_; }
  [[nodiscard]] PlaybackLoss loss() const;

  /// Decodes frame `index` of the clip. Errors: kNotFound beyond the clip, or behind what was read
  /// where the source cannot seek, or when nothing that could be shown has arrived; kIo,
  /// kCancelled, kOutOfMemory. Damage is no error once a frame has been shown: the last one stays
  /// and loss() counts.
  Status frame(std::uint64_t index, ClipFrame& out);

  /// The frame shown at `tick` of the clip. Where frames are unevenly spaced this may read ahead,
  /// or seek. Errors: kNotFound beyond the clip or what can be read of it; kIo, kCancelled,
  /// kOutOfMemory.
  Result<std::uint64_t> frame_at(std::uint64_t tick);
  /// When a frame that frame() has given begins, and how many ticks it is shown.
  [[nodiscard]] std::uint64_t first_tick(std::uint64_t index) const;
  [[nodiscard]] std::uint32_t ticks_of(std::uint64_t index) const;

 private:
  ClipReader(container::Reader reader, std::string name)
      : reader_(std::move(reader)), name_(std::move(name)) {}

  static Result<ClipReader> open_clip(std::unique_ptr<container::ByteSource> source,
                                      const std::string& name, const ClipOptions& options);
  Status decode_frame(std::uint64_t index, ClipFrame& out);
  Result<std::uint64_t> find_frame(std::uint64_t tick);
  Status choose_clip(const std::string& wanted);
  Status read_until(std::uint64_t index);
  Status load_index();
  void note_segment(const container::IndexRecord::Entry& entry);
  Result<bool> jump(std::uint64_t index);
  Status take(container::Record record);
  void note_arrival(std::uint32_t track_id);
  Status decode(std::uint64_t index);
  Status note_damage(const Error& error);
  void forget_before(std::uint64_t index);
  [[nodiscard]] Unexpected in_file(const Error& error) const;

  container::Reader reader_;
  std::string name_;
  container::FileContents contents_;
  container::ClipRecord clip_;
  container::ModelRecord model_;
  std::vector<container::LayerRecord> layers_;
  std::uint32_t pose_track_ = 0;
  std::vector<decoders::Mesh> meshes_;
  std::optional<decoders::PoseTrack> poses_;
  std::optional<decoders::PlaneDecoder> planes_;
  std::vector<std::uint32_t> tracks_;  ///< wanted, sorted
  container::Timeline timeline_;
  std::map<std::uint64_t, container::IndexRecord::Entry> segments_;  ///< known ones, by first frame
  std::map<std::uint64_t, std::uint64_t> first_frames_;              ///< of the same, by first tick
  bool index_loaded_ = false;
  std::optional<container::SegmentRecord> segment_;  ///< whose chunks are coming in
  std::uint32_t last_chunk_ = 0;                     ///< track of the last one that is wanted
  std::uint64_t wanted_frame_ = 0;                   ///< that read_until() is on its way to
  std::vector<std::uint32_t> first_picture_;         ///< tracks that an impatient first frame needs
  std::vector<std::uint32_t> missing_;               ///< those of them that the segment still lacks
  bool impatient_ = false;                           ///< until the first frame has been shown
  std::uint64_t complete_end_ = 0;                   ///< frames before this one have come
  std::uint64_t kept_begin_ = 0;                     ///< frames before this one have been forgotten
  ClipFrame scratch_;
  bool ended_ = false;
  bool shown_ = false;
  PlaybackLoss loss_;
};

}  // namespace relit::player
