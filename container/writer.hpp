// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "container/byte_sink.hpp"
#include "container/framing.hpp"
#include "container/records.hpp"
#include "container/references.hpp"
#include "container/segment_order.hpp"

namespace relit::container {

/// What a caller says of a segment; the writer adds the rest of SegmentRecord.
struct SegmentInfo {
  std::uint32_t clip_id = 0;
  std::uint64_t first_frame = 0;
  std::uint32_t frame_count = 0;
  std::vector<std::uint32_t> durations = {};  ///< ticks of each frame; empty: one tick each
  /// When the first frame is shown; nothing: when the clip's segment before this one ends.
  std::optional<std::uint64_t> first_tick = {};
};

struct WriterOptions {
  /// Stores HEAD and all static records a second time, behind the segments, so that one hit cannot
  /// cost the file. Players never read them unless the first ones are damaged.
  bool copies = true;
  /// Segments may lack tracks, and clips segments. For what is left of other files: nobody else has
  /// a reason.
  bool gaps = false;
};

/// Writes a .relit file from front to back:
///
///     Writer::create, add(…) in the order of the overloads below, write_segment(…)…, finish
///
/// Everything is checked before it is written. All functions return kInvalid for a record that
/// breaks a rule of the format (the message says which), kLimit, kUnsupported, or the sink's kIo;
/// after an error the writer takes nothing more. The same calls give the same bytes. One thread at
/// a time.
class Writer {
 public:
  /// Writes signature and header. `program` is the name and version of the calling program. The
  /// sink stays the caller's, outlives the writer, and is not committed by it.
  static Result<Writer> create(ByteSink& sink, const std::string& program,
                               const WriterOptions& options = {});

  Status add(const ClipRecord& record);
  Status add(const ImageRecord& record);
  Status add(const MaterialRecord& record);
  Status add(const MeshRecord& record);
  Status add(const SkeletonRecord& record);  ///< at most once
  Status add(const PoseTrackRecord& record);
  Status add(const ModelRecord& record);
  Status add(const LayerRecord& record);

  /// An ancillary record of a type that is not of this format; allowed anywhere between the others.
  Status add_ancillary(RecordType type, std::span<const std::uint8_t> payload);

  /// A segment with a chunk for every track of its clip, in any order: they are written in the
  /// order of the tracks' declaration. The segments of a clip follow one another without gaps from
  /// frame 0 (but see WriterOptions::gaps); those of several clips may be mixed. `segment_index` of
  /// the chunks is filled in.
  Status write_segment(const SegmentInfo& info, std::vector<ChunkRecord> chunks);

  /// Writes copies, index and end record. Every clip that has tracks must be complete,
  /// unless there may be gaps.
  Status finish();

  [[nodiscard]] std::uint64_t bytes_written() const { return offset_; }

 private:
  Writer(ByteSink& sink, const WriterOptions& options) : sink_(&sink), options_(options) {}

  template <class R>
  Status add_static(RecordType type, const R& record);
  Status check_tracks(std::uint32_t clip_id, const std::vector<ChunkRecord>& chunks) const;
  Result<SegmentOrder*> order_of_clip(std::uint32_t clip_id);
  Status write_record(RecordType type, std::span<const std::uint8_t> payload,
                      std::uint32_t record_flags = 0);
  Status write_static(RecordType type, std::vector<std::uint8_t> payload);
  Status check_complete() const;
  Status write_bytes(std::span<const std::uint8_t> bytes);
  Status enter(int order);
  /// Closes the writer on failure; a breach of the format becomes kInvalid.
  Status settle(Status status, const char* doing);

  ByteSink* sink_;
  WriterOptions options_;
  std::uint64_t offset_ = 0;
  int order_ = -1;  ///< order_of() of the last record
  bool closed_ = false;
  std::uint64_t static_bytes_ = 0;
  ReferenceChecker references_;
  std::map<std::uint32_t, SegmentOrder> written_;  ///< by clip
  struct Stored {
    RecordType type;
    std::vector<std::uint8_t> payload;
  };
  std::vector<Stored> statics_;  ///< to be copied
  IndexRecord index_;
};

}  // namespace relit::container
