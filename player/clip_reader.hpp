// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "container/byte_source.hpp"
#include "decoders/plane_decoder.hpp"
#include "decoders/pose.hpp"
#include "player/clip_demuxer.hpp"
#include "player/clip_frame.hpp"

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

/// One clip of a file as a sequence of frames: a ClipDemuxer and decoders on the caller's thread.
/// Reads segments as they are needed, holds the last good frame over damage, and says what was
/// lost. Going forward never seeks; going back needs a source that can. One thread at a time.
class ClipReader {
 public:
  /// Reads everything static. `name` is for messages. Where options.spares_bytes(), the source is
  /// told what will be read; one that fetches ranges should have been opened so. Errors: those of
  /// the reader and the decoders; kNotFound for a clip that is not there (names those that are),
  /// kOutOfMemory.
  static Result<ClipReader> open(std::unique_ptr<container::ByteSource> source,
                                 const std::string& name, const ClipOptions& options);

  [[nodiscard]] const container::FileContents& contents() const { return demuxer_.contents(); }
  [[nodiscard]] const container::ClipRecord& clip() const { return demuxer_.clip(); }
  [[nodiscard]] const container::ModelRecord& model() const { return demuxer_.model(); }
  [[nodiscard]] const std::vector<container::LayerRecord>& layers() const {
    return demuxer_.layers();
  }
  [[nodiscard]] const std::vector<decoders::Mesh>& meshes() const { return demuxer_.meshes(); }
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
  ClipReader(ClipDemuxer demuxer, decoders::PoseTrack poses)
      : demuxer_(std::move(demuxer)), poses_(std::move(poses)) {}

  static Result<ClipReader> open_clip(std::unique_ptr<container::ByteSource> source,
                                      const std::string& name, const ClipOptions& options);
  Status open_planes(const ClipOptions& options);
  Status decode_frame(std::uint64_t index, ClipFrame& out);
  Result<std::uint64_t> find_frame(std::uint64_t tick);
  Status read_until(std::uint64_t index);
  Status read_record(std::uint64_t target);
  Status take_chunk();
  Status decode(std::uint64_t index);
  void forget_before(std::uint64_t index);
  void forget_all();

  ClipDemuxer demuxer_;
  decoders::PoseTrack poses_;
  std::optional<decoders::PlaneDecoder> planes_;
  container::ChunkRecord chunk_;              ///< the last one
  std::vector<std::uint32_t> first_picture_;  ///< tracks that an impatient first frame needs
  std::vector<std::uint32_t> missing_;        ///< those of them that the segment still lacks
  bool impatient_ = false;                    ///< until the first frame has been shown
  std::uint64_t kept_begin_ = 0;              ///< frames before this one have been forgotten
  ClipFrame scratch_;
  bool shown_ = false;
  std::uint64_t lost_frames_ = 0;
};

}  // namespace relit::player
