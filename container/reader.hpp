// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "container/base/kept.hpp"
#include "container/base/limits.hpp"
#include "container/base/result.hpp"
#include "container/byte_source.hpp"
#include "container/framing.hpp"
#include "container/record_input.hpp"
#include "container/records.hpp"

namespace relit::container {

using RecordBody = std::variant<ClipRecord, ImageRecord, MaterialRecord, MeshRecord, SkeletonRecord,
                                PoseTrackRecord, ModelRecord, LayerRecord, SegmentRecord,
                                ChunkRecord, IndexRecord, EndRecord>;

struct Record {
  RecordType type{};
  std::uint64_t offset_bytes = 0;  ///< of its header, from the start of the file
  RecordBody body;
};

struct ReaderOptions {
  /// Only fuzzers switch it off, to get past the checksums.
  bool verify_checksums = true;
  /// Payload of one record, and of all records before the first segment: a small machine may want
  /// less.
  std::uint64_t max_record_bytes = limits::kRecordBytes;
  std::uint64_t max_static_bytes = limits::kStaticBytes;
  /// Told of every intact header whose record next() passes over: copies and unknown ancillary
  /// records, not chunks of unwanted tracks.
  std::function<void(const RecordHeader& header, std::uint64_t offset_bytes)> on_passed_over = {};
  /// Is given the ancillary records of unknown type that the reader passes over, as far as they are
  /// intact; the payload is valid during the call.
  std::function<void(RecordType, std::span<const std::uint8_t>)> on_unknown = {};
  /// Tells the source which bytes will be read (ByteSource::expect), so that one with byte ranges
  /// fetches no tracks that are not wanted. Costs one read at the end of the file while opening,
  /// and at most two requests a segment; reading everything is cheaper without.
  bool sparing = false;
};

/// What the reader could not give.
struct ReaderLoss {
  std::uint64_t damaged_records = 0;
  std::uint64_t dropped_bytes = 0;     ///< damaged, or passed over by resync()
  std::uint64_t missing_segments = 0;  ///< by the gaps in the segments' numbers
};

/// Reads a .relit file from front to back, never going back by itself.
///
/// Every error names record type and byte offset. After one, can_continue() tells whether next()
/// may simply be called again (the record is lost, the framing is not); otherwise resync() finds
/// the next segment. Errors of next():
///   kTruncated    the source ended inside a record or a segment
///   kCorrupt      checksums, contradictions, records out of their place
///   kLimit        more than limits.hpp or the options allow
///   kUnsupported  a critical record, flag or value of a later version; not to be read past
///   kOutOfMemory  and the source's own (kIo, kCancelled)
/// One thread at a time.
class Reader {
 public:
  /// Takes the source, reads signature and header. Errors: as next(); kUnsupported for a newer
  /// major version.
  static Result<Reader> open(std::unique_ptr<ByteSource> source, const ReaderOptions& options = {});

  [[nodiscard]] const HeaderRecord& header() const { return header_; }

  /// The next record; nothing at the end. Records of unknown ancillary types, repeated copies, and
  /// the chunks of tracks that are not wanted are passed over. Cross-references between records are
  /// not checked here, but see load_static(); chunks are checked against their segment.
  Result<std::optional<Record>> next();

  /// Whether the next record belongs to a segment or comes after them (or there is none):
  /// everything static has been read. Errors: as next().
  Result<bool> static_part_ended();

  /// Takes records that next() gave back: later ones use their storage, a chunk preferably that of
  /// its own track, so that reading on and on allocates nothing.
  void recycle(SegmentRecord&& segment) { spare_segment_ = std::move(segment); }
  void recycle(ChunkRecord&& chunk);
  /// What the storage of the chunks that were given back takes.
  [[nodiscard]] std::size_t spare_bytes() const;

  /// From the next chunk on, only chunks of these tracks come out of next(); by default all do.
  void set_wanted_tracks(std::optional<std::vector<std::uint32_t>> tracks);
  /// Passes over the rest of the current segment's chunks.
  void skip_segment();

  /// Whether next() makes sense after an error.
  [[nodiscard]] bool can_continue() const { return !fatal_ && !input_.framing_lost(); }
  /// Finds the next segment by its marker: behind the damage, or from here on if there was none.
  /// True: next() gives its SegmentRecord; false: the source ends without one. Errors: the
  /// source's, and kUnsupported after a record that must not be read past.
  Result<bool> resync();

  /// Whether the end record has been read. A source that ends without it was cut, or is a live
  /// stream.
  [[nodiscard]] bool finished() const { return finished_; }
  [[nodiscard]] ReaderLoss loss() const;
  /// Where the next record starts.
  [[nodiscard]] std::uint64_t offset_bytes() const { return input_.offset_bytes(); }

  [[nodiscard]] bool seekable() const { return source_->seekable(); }
  /// The index, read from the end of the source; the reader then stands where it stood. Errors:
  /// kUnsupported if the source cannot seek, kNotFound if the file has no end record or no index,
  /// else as next().
  Result<IndexRecord> read_index();
  /// The copies of the static records, in the order of the file and without the header's; nothing
  /// in the place of a damaged one. The reader then stands where it stood. Errors: as read_index(),
  /// kNotFound if the file has no copies.
  Result<std::vector<std::optional<Record>>> read_copies();
  /// Goes to a segment; next() gives its SegmentRecord. Errors: as next(), kUnsupported if the
  /// source cannot seek. kCorrupt, here or from next(), if the segment is not what the index says.
  Status seek_to_segment(const IndexRecord::Entry& entry);

 private:
  Reader(std::unique_ptr<ByteSource> source, const ReaderOptions& options)
      : source_(std::move(source)),
        options_(options),
        input_(*source_, 0, options.verify_checksums) {}

  Status read_header();
  Status learn_layout();
  void announce();
  [[nodiscard]] std::uint64_t wanted_run() const;
  [[nodiscard]] bool is_wanted(std::uint32_t track_id) const;
  [[nodiscard]] std::uint64_t behind_segments(std::uint64_t begin) const;
  void pass_copies(std::uint64_t offset);
  Result<std::optional<Record>> next_record();
  Result<std::optional<RecordHeader>> peek_known();
  void pass_unwanted_chunks();
  void pass_unknown(const RecordHeader& header, std::uint64_t offset);
  Status check_place(const RecordHeader& header);
  Result<RecordBody> read_body(const RecordHeader& header);
  Result<RecordBody> parse_payload(RecordType type, std::span<const std::uint8_t> payload);
  [[nodiscard]] ChunkRecord take_spare(std::uint32_t track_id);
  Result<RecordBody> accept(RecordBody body, std::uint64_t offset);
  Status accept_segment(const SegmentRecord& segment);
  Status accept_end(const EndRecord& end, std::uint64_t offset) const;
  Unexpected damaged(const Error& error, RecordType type, std::uint64_t offset);
  void count_damage(const Error& error);
  void enter_segments();
  template <class Read>
  auto read_aside(Read&& read) -> decltype(read(std::declval<RecordInput&>(), std::uint64_t{}));

  std::unique_ptr<ByteSource> source_;
  ReaderOptions options_;
  RecordInput input_;
  HeaderRecord header_;

  int order_ = 0;                ///< order_of() of the last record
  Kept<SegmentRecord> segment_;  ///< whose chunks are being read
  std::size_t chunk_ = 0;        ///< the next of them
  std::optional<std::uint32_t> next_segment_index_ = 0;
  std::optional<IndexRecord::Entry> sought_;
  std::optional<std::vector<std::uint32_t>> wanted_;  ///< sorted
  SegmentRecord spare_segment_;
  std::vector<ChunkRecord> spare_chunks_;
  std::uint64_t static_bytes_ = 0;
  std::optional<EndRecord> end_;       ///< read beforehand, where that spares bytes
  std::uint64_t static_end_ = 0;       ///< where the first segment is expected; 0: unknown
  std::uint64_t segments_end_ = 0;     ///< known where end_ is
  std::uint64_t announced_end_ = 0;    ///< what the source was told to expect
  std::uint64_t segment_guess_ = 512;  ///< the next segment's record and first wanted chunks
  std::uint64_t index_offset_ = 0;     ///< 0: not seen
  std::uint64_t copies_offset_ = 0;    ///< of the first copy since the last other record
  bool jumped_ = false;                ///< by seek or resync: what was not seen may be there
  bool finished_ = false;
  std::optional<Error> fatal_;
  std::uint64_t damaged_records_ = 0;
  std::uint64_t missing_segments_ = 0;
};

/// Everything before the first segment.
struct FileContents {
  HeaderRecord header;
  std::uint32_t repaired = 0;     ///< records that were damaged and taken from their copies
  std::vector<ClipRecord> clips;  ///< at least one; all vectors in the order of the file
  std::vector<ImageRecord> images;
  std::vector<MaterialRecord> materials;
  std::vector<MeshRecord> meshes;
  SkeletonRecord skeleton;  ///< empty where the file has none
  std::vector<PoseTrackRecord> pose_tracks;
  std::vector<ModelRecord> models;
  std::vector<LayerRecord> layers;

  /// Errors: none, but null where there is no such id.
  [[nodiscard]] const ClipRecord* find_clip(std::uint32_t id) const;
  [[nodiscard]] const ModelRecord* find_model(std::uint32_t id) const;
  /// The layers of a model in order of importance; planes are numbered through them.
  [[nodiscard]] std::vector<LayerRecord> layers_of(std::uint32_t model_id) const;
};

/// Reads everything before the first segment from a reader that has just been opened, and checks
/// what the records say about each other. Damaged records are taken from their copies where the
/// source can seek. next() then gives the first segment. Errors: as Reader::next().
Result<FileContents> load_static(Reader& reader);

}  // namespace relit::container
