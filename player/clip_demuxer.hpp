// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "container/base/kept.hpp"
#include "container/base/result.hpp"
#include "container/byte_source.hpp"
#include "container/reader.hpp"
#include "container/timeline.hpp"
#include "decoders/mesh.hpp"
#include "decoders/pose.hpp"
#include "player/clip_frame.hpp"
#include "player/interrupt.hpp"

namespace relit::player {

struct DemuxOptions {
  std::string clip;  ///< by name or number; empty: the first
  /// Of a source with byte ranges only what is needed should be fetched (ReaderOptions::sparing).
  bool sparing = false;
  /// What the source's own interrupt polls, where it has one; a Prefetcher raises it to stop a read
  /// that blocks. May be null.
  std::shared_ptr<Interrupt> interrupt;
};

/// One clip of a file as segments and the chunks of those tracks that are wanted. Reads, seeks and
/// finds its way over damage; decodes the meshes while opening and nothing else. Going forward
/// never seeks; going back needs a source that can. One thread at a time.
class ClipDemuxer {
 public:
  /// Everything of a file that does not change while it is played.
  struct Statics {
    container::FileContents contents;
    std::vector<decoders::Mesh> meshes;
  };

  /// Reads everything static; blocks while the source does. `name` is for messages. Errors: those
  /// of the reader and the decoders; kNotFound for a clip that is not there (names those that are),
  /// kUnsupported for one without a model or poses, kOutOfMemory.
  static Result<ClipDemuxer> open(std::unique_ptr<container::ByteSource> source,
                                  const std::string& name, const DemuxOptions& options);
  /// Another clip of the same file, from a source of its own (SharedSource); what is static is
  /// shared and not read again where the file has an index. Errors: as open().
  [[nodiscard]] Result<ClipDemuxer> another(std::unique_ptr<container::ByteSource> source,
                                            const DemuxOptions& options) const;

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const container::FileContents& contents() const { return statics_->contents; }
  [[nodiscard]] const std::vector<decoders::Mesh>& meshes() const { return statics_->meshes; }
  [[nodiscard]] const std::shared_ptr<const Statics>& statics() const { return statics_; }
  [[nodiscard]] const container::ClipRecord& clip() const { return clip_; }
  [[nodiscard]] const container::ModelRecord& model() const { return model_; }
  [[nodiscard]] const std::vector<container::LayerRecord>& layers() const { return layers_; }
  [[nodiscard]] const container::PoseTrackRecord& pose_record() const { return pose_; }
  /// Decodes the clip's pose packets. Errors: those of PoseTrack::create().
  [[nodiscard]] Result<decoders::PoseTrack> open_poses() const;
  [[nodiscard]] bool seekable() const { return reader_.seekable(); }
  [[nodiscard]] const std::shared_ptr<Interrupt>& interrupt() const { return options_.interrupt; }

  /// From the next chunk on, step() gives those of the poses and of the layers for which `wanted`
  /// is not 0; at first, those of all. Empty: of all.
  void want_layers(std::span<const std::uint8_t> wanted);
  /// The same without planes.
  void want_poses_alone();

  enum class Event {
    kSegment,  ///< segment() is another one, or none that concerns this clip
    kChunk,    ///< `chunk` belongs to segment()
    kNothing,  ///< nothing of this clip, or something was lost: loss() tells
    kEnd,      ///< no segments follow
  };
  /// Reads one record. Segments that end at or before frame `target` are passed over as a whole.
  /// `chunk` is written only for kChunk; recycle() it afterwards, and nothing is allocated. Errors:
  /// kIo, kCancelled, kUnsupported, kOutOfMemory, with the file's name; damage is none.
  Result<Event> step(std::uint64_t target, container::ChunkRecord& chunk);
  /// Gives the storage of a chunk back, for those to come.
  void recycle(container::ChunkRecord&& chunk);

  /// The one whose chunks are coming; null between segments.
  /// Storage of chunks that were given back.
  [[nodiscard]] std::size_t spare_bytes() const { return reader_.spare_bytes(); }

  [[nodiscard]] const container::SegmentRecord* segment() const {
    return segment_ ? &*segment_ : nullptr;
  }
  /// Frames of the clip before this one have come, or never will: all wanted chunks up to here have
  /// been given.
  [[nodiscard]] std::uint64_t complete_end() const { return complete_end_; }
  [[nodiscard]] bool ended() const { return ended_; }

  /// Goes to the segment of a frame. False, and nothing has changed, where the source cannot seek
  /// or the place is not known. Errors: as step().
  Result<bool> jump(std::uint64_t frame);
  /// Goes to the segment that is shown at a tick, as far as is known. As jump().
  Result<bool> jump_to_tick(std::uint64_t tick);
  /// Passes over the rest of the current segment's chunks.
  void skip_segment();

  /// Errors: kNotFound, saying when the clip ended, for a tick beyond it.
  [[nodiscard]] Status check_tick(std::uint64_t tick) const;
  /// The error of a tick whose segment is not to be found.
  [[nodiscard]] Unexpected missing_tick(std::uint64_t tick) const;
  /// Errors: kNotFound, saying how many frames there are, for one beyond the clip.
  [[nodiscard]] Status check_frame(std::uint64_t frame) const;
  /// The error of a frame behind what a source that cannot go back has read.
  [[nodiscard]] Unexpected gone_by(std::uint64_t frame) const;

  /// What is known of the frames' times so far.
  [[nodiscard]] const container::Timeline& timeline() const { return timeline_; }
  /// Losses of the container; `frames` is 0.
  [[nodiscard]] PlaybackLoss loss() const;
  /// Notes damage that somebody else found; what comes from the source itself, or is of a later
  /// version, is returned as an error with the file's name.
  Status note_damage(const Error& error);
  [[nodiscard]] Unexpected in_file(const Error& error) const;

 private:
  ClipDemuxer(container::Reader reader, std::string name, DemuxOptions options)
      : reader_(std::move(reader)), name_(std::move(name)), options_(std::move(options)) {}

  static Result<ClipDemuxer> open_clip(std::unique_ptr<container::ByteSource> source,
                                       const std::string& name, const DemuxOptions& options,
                                       std::shared_ptr<const Statics> statics);
  Result<std::shared_ptr<const Statics>> load_statics();
  Status pass_statics();
  Status choose_clip();
  Status load_index();
  void note_segment(const container::IndexRecord::Entry& entry);
  Event take(container::Record record, std::uint64_t target, container::ChunkRecord& chunk);
  Event take_segment(container::SegmentRecord segment, std::uint64_t offset_bytes,
                     std::uint64_t target);
  void find_last_chunk();
  Result<Event> pass_damage(const Error& error);

  container::Reader reader_;
  std::string name_;
  DemuxOptions options_;
  std::shared_ptr<const Statics> statics_;
  container::ClipRecord clip_;
  container::ModelRecord model_;
  std::vector<container::LayerRecord> layers_;
  container::PoseTrackRecord pose_;
  std::vector<std::uint32_t> tracks_;  ///< wanted, sorted
  container::Timeline timeline_;
  std::map<std::uint64_t, container::IndexRecord::Entry> segments_;  ///< known ones, by first frame
  std::map<std::uint64_t, std::uint64_t> first_frames_;              ///< of the same, by first tick
  bool index_loaded_ = false;
  Kept<container::SegmentRecord> segment_;   ///< whose chunks are coming in
  std::optional<std::uint32_t> last_chunk_;  ///< track of its last one that is wanted
  std::uint64_t complete_end_ = 0;
  bool ended_ = false;
  std::string first_loss_;
};

}  // namespace relit::player
