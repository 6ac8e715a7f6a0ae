// SPDX-License-Identifier: MIT
#include "container/reader.hpp"

#include <algorithm>
#include <string>

#include "container/base/limits.hpp"
#include "container/base/out_of_memory.hpp"
#include "container/record_codec.hpp"
#include "container/references.hpp"

namespace relit::container {
namespace {

const int kSegmentOrder = order_of(types::kSegment);

std::string place(RecordType type, std::uint64_t offset) {
  return "record '" + type_name(type) + "' at byte " + std::to_string(offset);
}

/// Widens a Result of one record to that of any.
template <class R>
Result<RecordBody> widen(Result<R> parsed) {
  if (!parsed) return Unexpected{std::move(parsed).error()};
  return RecordBody(std::move(*parsed));
}

Result<RecordBody> parse_body(RecordType type, std::span<const std::uint8_t> payload) {
  if (type == types::kClip) return widen(parse_clip(payload));
  if (type == types::kImage) return widen(parse_image(payload));
  if (type == types::kMaterial) return widen(parse_material(payload));
  if (type == types::kMesh) return widen(parse_mesh(payload));
  if (type == types::kSkeleton) return widen(parse_skeleton(payload));
  if (type == types::kPoseTrack) return widen(parse_pose_track(payload));
  if (type == types::kModel) return widen(parse_model(payload));
  if (type == types::kLayer) return widen(parse_layer(payload));
  if (type == types::kSegment) return widen(parse_segment(payload));
  if (type == types::kChunk) return widen(parse_chunk(payload));
  if (type == types::kIndex) return widen(parse_index(payload));
  return widen(parse_end(payload));
}

/// Types of which a file has at most one.
bool is_single(RecordType type) {
  return type == types::kHeader || type == types::kSkeleton || type == types::kIndex ||
         type == types::kEnd;
}

}  // namespace

Result<Reader> Reader::open(std::unique_ptr<ByteSource> source, const ReaderOptions& options) {
  return catch_out_of_memory("opening a file", [&]() -> Result<Reader> {
    Reader reader(std::move(source), options);
    RELIT_TRY(reader.read_header());
    if (options.sparing) RELIT_TRY(reader.learn_layout());
    return reader;
  });
}

Status Reader::read_header() {
  std::array<std::uint8_t, kSignature.size()> signature{};
  RELIT_TRY(input_.read_raw(signature));
  if (signature != kSignature) {
    const bool mangled = std::equal(signature.begin(), signature.begin() + 4, kSignature.begin());
    return fail(ErrorCode::kCorrupt,
                mangled ? "the signature at byte 0 is damaged as by a transfer in text mode"
                        : "not a .relit file: the signature 89 52 4C 54 0D 0A 1A 0A is missing at "
                          "byte 0");
  }
  const std::uint64_t offset = input_.offset_bytes();
  const auto read = [&]() -> Status {
    RELIT_ASSIGN(const auto header, input_.peek());
    if (!header) return fail(ErrorCode::kTruncated, "the data end before it");
    if (header->type != types::kHeader)
      return fail(ErrorCode::kCorrupt, "there is '" + type_name(header->type) + "' instead");
    if ((header->flags & flags::kCriticalMask) != 0)
      return fail(ErrorCode::kUnsupported,
                  "flags unknown to this version: a newer relit is needed");
    if (header->payload_bytes > options_.max_record_bytes)
      return fail(ErrorCode::kLimit, "too large");
    RELIT_ASSIGN(const auto payload, input_.payload());
    RELIT_ASSIGN(header_, parse_header(payload));
    return {};
  };
  auto status = read();
  if (status) return {};
  return damaged(status.error(), types::kHeader, offset);
}

Result<std::optional<Record>> Reader::next() {
  try {
    return next_record();
  } catch (const std::bad_alloc&) {
    input_.lose_framing(out_of_memory("reading a record"));
    return Unexpected{out_of_memory("reading a record")};
  }
}

Unexpected Reader::damaged(const Error& error, RecordType type, std::uint64_t offset) {
  count_damage(error);
  return fail(error.code, place(type, offset) + ": " + error.message);
}

/// Broken connections and cancellation are no damage of the file.
void Reader::count_damage(const Error& error) {
  if (error.code != ErrorCode::kIo && error.code != ErrorCode::kCancelled) ++damaged_records_;
}

void Reader::pass_unwanted_chunks() {
  while (segment_ && chunk_ < segment_->chunks.size()) {
    const auto& chunk = segment_->chunks[chunk_];
    if (is_wanted(chunk.track_id)) return;
    input_.skip_bytes(chunk.chunk_bytes);
    ++chunk_;
  }
  segment_.reset();
}

/// The next header whose record this version knows; passes over what it may ignore.
Result<std::optional<RecordHeader>> Reader::peek_known() {
  for (;;) {
    if (fatal_) return Unexpected{*fatal_};
    if (input_.framing_lost()) return input_.peek();
    pass_unwanted_chunks();
    announce();
    auto peeked = input_.peek();
    const std::uint64_t offset = input_.offset_bytes();
    if (!peeked) {
      count_damage(peeked.error());
      const bool behind_end = finished_ && peeked.error().code == ErrorCode::kTruncated;
      Error error{
          behind_end ? ErrorCode::kCorrupt : peeked.error().code,
          "record header at byte " + std::to_string(offset) + ": " + peeked.error().message};
      input_.lose_framing(error);
      return Unexpected{std::move(error)};
    }
    if (!*peeked) return *peeked;
    const RecordHeader& header = **peeked;
    const int order = order_of(header.type);
    // Segments, chunks and the end are never repeated, so that the flag says nothing of them.
    const bool may_be_copy = order < kSegmentOrder || header.type == types::kIndex;
    const std::uint32_t understood = may_be_copy ? flags::kKnownCritical : 0;
    const bool known = order >= 0 && (header.flags & flags::kCriticalMask & ~understood) == 0;
    const bool copy = known && (header.flags & flags::kCopy) != 0;
    if (known && !copy) return *peeked;
    if (!known && is_critical(header.type)) {
      fatal_ =
          Error{ErrorCode::kUnsupported, place(header.type, offset) + " is critical and " +
                                             (order_of(header.type) >= 0 ? "has flags " : "") +
                                             "unknown to this version: a newer relit is needed"};
      continue;
    }
    if (segment_ || finished_) return *peeked;  // for check_place() to refuse
    if (copy && order < kSegmentOrder && copies_offset_ == 0) copies_offset_ = offset;
    if (options_.on_passed_over) options_.on_passed_over(header, offset);
    if (copy) {
      input_.skip();
      pass_copies(offset);
    } else {
      pass_unknown(header, offset);
    }
  }
}

void Reader::pass_unknown(const RecordHeader& header, std::uint64_t offset) {
  const RecordType type = header.type;
  const bool plain = (header.flags & flags::kCriticalMask) == 0;
  if (!options_.on_unknown || !plain || header.payload_bytes > options_.max_record_bytes) {
    input_.skip();
    return;
  }
  const auto payload = input_.payload();
  if (payload)
    options_.on_unknown(type, *payload);
  else if (!input_.framing_lost())
    (void)damaged(payload.error(), type, offset);
}

Status Reader::check_place(const RecordHeader& header) {
  if (finished_) return fail(ErrorCode::kCorrupt, "stands behind the end record");
  if (segment_) {
    const auto& expected = segment_->chunks[chunk_];
    if (header.type != types::kChunk || record_bytes(header.payload_bytes) != expected.chunk_bytes)
      return fail(ErrorCode::kCorrupt,
                  "segment " + std::to_string(segment_->index) + " announces a chunk of " +
                      std::to_string(expected.chunk_bytes) + " bytes here, for track " +
                      std::to_string(expected.track_id));
    return {};
  }
  if (header.type == types::kChunk)
    return fail(ErrorCode::kCorrupt, "a chunk that no segment announces");
  const int order = order_of(header.type);
  if (order < order_ || (order == order_ && is_single(header.type)))
    return fail(ErrorCode::kCorrupt,
                "out of its place: records come in the order HEAD CLIP IMAG "
                "MATL MESH SKEL POSE MODL LAYR SEGM INDX FEND");
  return {};
}

Result<std::optional<Record>> Reader::next_record() {
  RELIT_ASSIGN(const auto header, peek_known());
  if (!header) {
    if (!segment_) return std::optional<Record>();
    const auto index = segment_->index;
    segment_.reset();
    ++damaged_records_;
    return fail(ErrorCode::kTruncated, "the data end at byte " +
                                           std::to_string(input_.offset_bytes()) +
                                           ", inside segment " + std::to_string(index));
  }
  const std::uint64_t offset = input_.offset_bytes();
  if (auto status = check_place(*header); !status) {
    auto failure = damaged(status.error(), header->type, offset);
    input_.lose_framing(failure.error);
    return failure;
  }
  order_ = order_of(header->type);
  // Copies in a stream do not count: those of the end stand behind everything else.
  if (order_ <= kSegmentOrder) copies_offset_ = 0;
  if (header->type == types::kIndex) index_offset_ = offset;
  if (header->type == types::kChunk) ++chunk_;

  auto body = read_body(*header);
  if (body) body = accept(std::move(*body), offset);
  if (body) return std::optional<Record>({header->type, offset, std::move(*body)});
  Error error = std::move(body).error();
  // Only the source may end too early; a payload of the right length that does is a contradiction.
  if (error.code == ErrorCode::kTruncated && !input_.framing_lost())
    error.code = ErrorCode::kCorrupt;
  auto failure = damaged(error, header->type, offset);
  // Without its segment record nothing is known of the chunks that follow.
  if (input_.framing_lost() || header->type == types::kSegment) input_.lose_framing(failure.error);
  return failure;
}

Result<RecordBody> Reader::read_body(const RecordHeader& header) {
  if (order_ < kSegmentOrder) {
    static_bytes_ += header.payload_bytes;
    if (static_bytes_ > options_.max_static_bytes) {
      fatal_ = Error{ErrorCode::kLimit, "the records before the first segment exceed " +
                                            std::to_string(options_.max_static_bytes) + " bytes"};
      return Unexpected{*fatal_};
    }
  }
  if (header.payload_bytes > options_.max_record_bytes) {
    input_.skip();
    return fail(ErrorCode::kLimit, std::to_string(header.payload_bytes) +
                                       " bytes exceed the limit of " +
                                       std::to_string(options_.max_record_bytes));
  }
  RELIT_ASSIGN(const auto payload, input_.payload());
  return parse_payload(header.type, payload);
}

Result<RecordBody> Reader::parse_payload(RecordType type, std::span<const std::uint8_t> payload) {
  if (type == types::kSegment) {
    SegmentRecord segment = std::exchange(spare_segment_, {});
    RELIT_TRY(parse_segment_into(payload, segment));
    return RecordBody(std::move(segment));
  }
  if (type == types::kChunk) {
    ChunkRecord chunk = take_spare(segment_->chunks[chunk_ - 1].track_id);
    RELIT_TRY(parse_chunk_into(payload, chunk));
    return RecordBody(std::move(chunk));
  }
  return parse_body(type, payload);
}

void Reader::recycle(ChunkRecord&& chunk) {
  constexpr std::size_t kMostSpares = 256;
  if (spare_chunks_.size() < kMostSpares) spare_chunks_.push_back(std::move(chunk));
}

std::size_t Reader::spare_bytes() const {
  std::size_t bytes = 0;
  for (const ChunkRecord& chunk : spare_chunks_) bytes += storage_bytes(chunk);
  return bytes;
}

ChunkRecord Reader::take_spare(std::uint32_t track_id) {
  if (spare_chunks_.empty()) return {};
  auto spare = std::ranges::find(spare_chunks_, track_id, &ChunkRecord::track_id);
  if (spare == spare_chunks_.end()) --spare;
  std::swap(*spare, spare_chunks_.back());
  ChunkRecord chunk = std::move(spare_chunks_.back());
  spare_chunks_.pop_back();
  return chunk;
}

/// Notes what the record says about its surroundings, and refuses what contradicts them.
Result<RecordBody> Reader::accept(RecordBody body, std::uint64_t offset) {
  if (const auto* segment = std::get_if<SegmentRecord>(&body)) {
    RELIT_TRY(accept_segment(*segment));
    segment_guess_ = input_.offset_bytes() - offset + wanted_run();
  } else if (const auto* chunk = std::get_if<ChunkRecord>(&body)) {
    const auto track = segment_->chunks[chunk_ - 1].track_id;
    if (chunk->track_id != track)
      return fail(ErrorCode::kCorrupt, "chunk of track " + std::to_string(chunk->track_id) +
                                           " where the segment announces track " +
                                           std::to_string(track));
    RELIT_TRY(check_chunk(*segment_, *chunk));
  } else if (const auto* end = std::get_if<EndRecord>(&body)) {
    RELIT_TRY(accept_end(*end, offset));
    finished_ = true;
  }
  return body;
}

Status Reader::accept_segment(const SegmentRecord& segment) {
  if (const auto sought = std::exchange(sought_, std::nullopt)) {
    if (segment.index != sought->segment_index || segment.clip_id != sought->clip_id ||
        segment.first_frame != sought->first_frame || segment.frame_count != sought->frame_count ||
        segment.first_tick != sought->first_tick)
      return fail(ErrorCode::kCorrupt,
                  "segment " + std::to_string(segment.index) + " is not what the index says of it");
  }
  if (next_segment_index_ && segment.index < *next_segment_index_)
    return fail(ErrorCode::kCorrupt, "segment " + std::to_string(segment.index) + " where " +
                                         std::to_string(*next_segment_index_) + " was due");
  if (next_segment_index_) missing_segments_ += segment.index - *next_segment_index_;
  next_segment_index_ = segment.index + 1;
  segment_ = segment;
  chunk_ = 0;
  return {};
}

Status Reader::accept_end(const EndRecord& end, std::uint64_t offset) const {
  const std::uint64_t bytes = offset + record_bytes(kEndPayloadBytes);
  if (end.file_bytes != bytes)
    return fail(ErrorCode::kCorrupt, "the file should have " + std::to_string(end.file_bytes) +
                                         " bytes, " + std::to_string(bytes) + " were read");
  if (index_offset_ != end.index_offset && !(jumped_ && index_offset_ == 0))
    return fail(ErrorCode::kCorrupt,
                "the index should be at byte " + std::to_string(end.index_offset));
  if (copies_offset_ != end.copies_offset && !(jumped_ && copies_offset_ == 0))
    return fail(ErrorCode::kCorrupt,
                "the copies should be at byte " + std::to_string(end.copies_offset));
  return {};
}

Result<bool> Reader::static_part_ended() {
  return catch_out_of_memory("looking for the next record", [&]() -> Result<bool> {
    RELIT_ASSIGN(const auto header, peek_known());
    return !header || order_of(header->type) >= kSegmentOrder;
  });
}

void Reader::set_wanted_tracks(std::optional<std::vector<std::uint32_t>> tracks) {
  wanted_ = std::move(tracks);
  if (wanted_) std::ranges::sort(*wanted_);
}

void Reader::skip_segment() {
  if (!segment_ || !can_continue()) return;
  for (; chunk_ < segment_->chunks.size(); ++chunk_)
    input_.skip_bytes(segment_->chunks[chunk_].chunk_bytes);
  segment_.reset();
}

void Reader::enter_segments() {
  segment_.reset();
  sought_.reset();
  order_ = kSegmentOrder;
  announced_end_ = 0;
  copies_offset_ = 0;
  jumped_ = true;
  finished_ = false;
}

Result<bool> Reader::resync() {
  return catch_out_of_memory("looking for the next segment", [&]() -> Result<bool> {
    if (fatal_) return Unexpected{*fatal_};
    RELIT_ASSIGN(const bool found, input_.resync());
    enter_segments();
    return found;
  });
}

ReaderLoss Reader::loss() const {
  return {damaged_records_, input_.dropped_bytes(), missing_segments_};
}

namespace {

/// Reads the record of the given type at the input's place, alone.
Result<RecordBody> read_alone(RecordInput& input, RecordType type) {
  const std::uint64_t offset = input.offset_bytes();
  const auto read = [&]() -> Result<RecordBody> {
    RELIT_ASSIGN(const auto header, input.peek());
    if (!header || header->type != type) return fail(ErrorCode::kNotFound, "there is none");
    RELIT_ASSIGN(const auto payload, input.payload());
    return parse_body(type, payload);
  };
  auto body = read();
  if (body) return body;
  return fail(body.error().code, place(type, offset) + ": " + body.error().message);
}

Result<EndRecord> read_end(RecordInput& input, std::uint64_t size) {
  constexpr std::uint64_t kEndBytes = record_bytes(kEndPayloadBytes);
  if (size % kRecordAlignment != 0 || size < kSignature.size() + kEndBytes)
    return fail(ErrorCode::kNotFound,
                "the file does not end with an end record, so there is no "
                "index to find");
  RELIT_TRY(input.seek(size - kEndBytes));
  input.expect(size - kEndBytes, size);
  auto end_body = read_alone(input, types::kEnd);
  if (!end_body) {
    const auto code = end_body.error().code;
    const bool absent = code == ErrorCode::kCorrupt || code == ErrorCode::kLimit;
    return fail(absent ? ErrorCode::kNotFound : code, end_body.error().message);
  }
  const auto end = std::get<EndRecord>(*end_body);
  if (end.file_bytes != size)
    return fail(ErrorCode::kCorrupt,
                place(types::kEnd, size - kEndBytes) + ": the file should have " +
                    std::to_string(end.file_bytes) + " bytes, it has " + std::to_string(size));
  return end;
}

Result<IndexRecord> read_index_from_end(RecordInput& input, std::uint64_t size) {
  RELIT_ASSIGN(const EndRecord end, read_end(input, size));
  if (end.index_offset == 0) return fail(ErrorCode::kNotFound, "the file has no index");
  RELIT_TRY(input.seek(end.index_offset));
  input.expect(end.index_offset, size);
  RELIT_ASSIGN(auto index, read_alone(input, types::kIndex));
  return std::get<IndexRecord>(std::move(index));
}

Result<std::vector<std::optional<Record>>> read_copies_from_end(RecordInput& input,
                                                                std::uint64_t size,
                                                                const ReaderOptions& options) {
  RELIT_ASSIGN(const EndRecord end, read_end(input, size));
  if (end.copies_offset == 0) return fail(ErrorCode::kNotFound, "the file has no copies");
  RELIT_TRY(input.seek(end.copies_offset));
  input.expect(end.copies_offset, size);
  std::vector<std::optional<Record>> records;
  std::uint64_t bytes = 0;
  for (;;) {
    const auto header = input.peek();
    // Lost framing costs the copies behind it and no more.
    if (!header || !*header) return records;
    const RecordType type = (*header)->type;
    const int order = order_of(type);
    if (order >= kSegmentOrder) return records;
    if (order < 0 || (*header)->flags != flags::kCopy || type == types::kHeader) {
      input.skip();
      continue;
    }
    if (records.size() == limits::kStaticRecords)
      return fail(ErrorCode::kLimit,
                  "there are more than " + std::to_string(limits::kStaticRecords) + " copies");
    bytes += (*header)->payload_bytes;
    if (bytes > options.max_static_bytes || (*header)->payload_bytes > options.max_record_bytes)
      return fail(ErrorCode::kLimit, "the copies exceed the limit of " +
                                         std::to_string(options.max_static_bytes) + " bytes");
    const std::uint64_t offset = input.offset_bytes();
    auto body = [&]() -> Result<RecordBody> {
      RELIT_ASSIGN(const auto payload, input.payload());
      return parse_body(type, payload);
    }();
    if (body)
      records.emplace_back(Record{type, offset, std::move(*body)});
    else
      records.emplace_back();
  }
}

}  // namespace

/// Runs `read` on an input of its own; the reader then stands where it stood.
template <class Read>
auto Reader::read_aside(Read&& read)
    -> decltype(read(std::declval<RecordInput&>(), std::uint64_t{})) {
  if (!source_->seekable() || !source_->size())
    return fail(ErrorCode::kUnsupported,
                "what stands at the end cannot be read from a source that only goes forward");
  const std::uint64_t resume = input_.source_offset_bytes();
  RecordInput input(*source_, 0, options_.verify_checksums);
  auto found = read(input, *source_->size());
  RELIT_TRY(source_->seek(resume));
  announced_end_ = 0;
  return found;
}

/// Reads the end record, by which the static part is as long as its copies; where there are none,
/// the source finds its way in steps.
Status Reader::learn_layout() {
  if (!source_->seekable() || !source_->size()) return {};
  const auto end =
      read_aside([](RecordInput& input, std::uint64_t size) { return read_end(input, size); });
  if (!end) {
    const bool source_failed =
        end.error().code == ErrorCode::kIo || end.error().code == ErrorCode::kCancelled;
    if (source_failed) return Unexpected{end.error()};
    return {};
  }
  end_ = *end;
  segments_end_ = end->file_bytes - record_bytes(kEndPayloadBytes);
  if (end->index_offset != 0) segments_end_ = end->index_offset;
  if (end->copies_offset != 0) segments_end_ = end->copies_offset;
  if (end->copies_offset != 0 && end->index_offset > end->copies_offset)
    static_end_ = kSignature.size() + (end->index_offset - end->copies_offset);
  return {};
}

Result<IndexRecord> Reader::read_index() {
  return catch_out_of_memory("reading the index", [&] {
    return read_aside(
        [](RecordInput& input, std::uint64_t size) { return read_index_from_end(input, size); });
  });
}

Result<std::vector<std::optional<Record>>> Reader::read_copies() {
  return catch_out_of_memory("reading the copies of the static records", [&] {
    return read_aside([this](RecordInput& input, std::uint64_t size) {
      return read_copies_from_end(input, size, options_);
    });
  });
}

Status Reader::seek_to_segment(const IndexRecord::Entry& entry) {
  return catch_out_of_memory("going to a segment", [&]() -> Status {
    if (fatal_) return Unexpected{*fatal_};
    RELIT_TRY(input_.seek(entry.offset));
    enter_segments();
    next_segment_index_.reset();
    sought_ = entry;
    RELIT_ASSIGN(const auto header, peek_known());
    if (header && header->type == types::kSegment) return {};
    Error error{ErrorCode::kCorrupt,
                "the index says that a segment starts at byte " + std::to_string(entry.offset)};
    input_.lose_framing(error);
    return Unexpected{std::move(error)};
  });
}

}  // namespace relit::container
