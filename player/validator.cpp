// SPDX-License-Identifier: MIT
#include "player/validator.hpp"

#include <algorithm>
#include <functional>
#include <new>
#include <utility>

#include "container/record_codec.hpp"
#include "container/record_input.hpp"
#include "player/validator_copies.hpp"
#include "player/validator_segments.hpp"

namespace relit::player {

using namespace container;

namespace {

const int kSegmentOrder = order_of(types::kSegment);

bool is_static(RecordType type) {
  const int order = order_of(type);
  return order >= 0 && order < kSegmentOrder;
}

/// Types of which a file has at most one.
bool is_single(RecordType type) {
  return type == types::kHeader || type == types::kSkeleton || type == types::kIndex ||
         type == types::kEnd;
}

FindingId finding_of(FramingDamage damage) {
  switch (damage) {
    case FramingDamage::kType:
      return "FRAMING_TYPE";
    case FramingDamage::kLength:
      return "FRAMING_LENGTH";
    case FramingDamage::kPayloadChecksum:
      return "FRAMING_PAYLOAD_CRC";
    case FramingDamage::kPadding:
      return "FRAMING_PADDING";
    case FramingDamage::kTruncated:
      return "FRAMING_TRUNCATED";
    case FramingDamage::kNone:
    case FramingDamage::kSource:
    case FramingDamage::kHeaderChecksum:
      break;
  }
  return "FRAMING_HEADER_CRC";
}

/// Walks through the records of a file and hands their payloads to those who know them.
class Walk {
 public:
  Walk(ByteSource& source, const ValidationOptions& options)
      : source_(source),
        input_(source, 0, true),
        log_(options.findings_per_kind),
        statics_(log_, options.decode),
        tracks_(log_, options.threads),
        segments_(log_, statics_, options.decode ? &tracks_ : nullptr),
        copies_(log_),
        decode_(options.decode) {}

  Result<ValidationReport> run();

 private:
  Result<bool> read_signature();
  Result<bool> step();
  Result<bool> lose_framing(const Error& error, std::uint64_t offset);
  Result<bool> resume_at_end(std::uint64_t lost_at);
  Status take(const RecordHeader& header);
  bool check_flags(const FindingPlace& place, const RecordHeader& header);
  void check_place(const FindingPlace& place);
  void dispatch(const FindingPlace& place, const RecordHeader& header,
                std::optional<std::span<const std::uint8_t>> payload);
  void take_header(const FindingPlace& place, std::span<const std::uint8_t> payload);
  void take_static(const FindingPlace& place, const RecordHeader& header,
                   std::optional<std::span<const std::uint8_t>> payload);
  void take_index(const FindingPlace& place, std::span<const std::uint8_t> payload);
  void take_end(const FindingPlace& place, std::span<const std::uint8_t> payload);
  void take_unknown(const FindingPlace& place);
  void end_static_part(const FindingPlace& place);
  void finish();

  ByteSource& source_;
  RecordInput input_;
  FindingLog log_;
  StaticChecker statics_;
  TrackChecker tracks_;
  SegmentChecker segments_;
  CopyChecker copies_;
  bool decode_;

  int order_ = -1;
  bool framing_only_ = false;  ///< of another version: payloads mean nothing
  bool give_up_ = false;
  bool static_part_ended_ = false;
  bool finished_ = false;  ///< FEND was met
  bool lost_end_ = false;  ///< the framing was lost up to the end
  bool lost_index_ = false;
  std::uint64_t static_bytes_ = 0;
  std::uint64_t index_offset_ = 0;
};

Result<ValidationReport> Walk::run() {
  RELIT_ASSIGN(bool more, read_signature());
  while (more) {
    RELIT_ASSIGN(more, step());
  }
  if (!give_up_) finish();
  return log_.take();
}

Result<bool> Walk::read_signature() {
  std::array<std::uint8_t, kSignature.size()> signature{};
  const Status read = input_.read_raw(signature);
  if (!read && read.error().code != ErrorCode::kTruncated) return Unexpected{read.error()};
  if (read && signature == kSignature) return true;
  log_.add("FRAMING_SIGNATURE", {}, "the signature 89 52 4C 54 0D 0A 1A 0A is missing");
  // What only lost its first bytes goes on with a record; anything else is another kind of file.
  const auto header = read ? input_.peek() : Result<std::optional<RecordHeader>>(std::nullopt);
  give_up_ = !header || !*header;
  return !give_up_;
}

Result<bool> Walk::step() {
  const std::uint64_t offset = input_.offset_bytes();
  const auto header = input_.peek();
  if (header && !*header) return false;
  if (finished_) {
    log_.add("ORDER_BEHIND_END", {offset}, "there is something behind FEND");
    return false;
  }
  if (!header) return lose_framing(header.error(), offset);
  const Status taken = take(**header);
  if (taken) return !give_up_;
  return lose_framing(taken.error(), offset);
}

/// Says what was lost, and finds the next record behind it; false: there is none.
Result<bool> Walk::lose_framing(const Error& error, std::uint64_t offset) {
  const FramingDamage damage = input_.damage();
  if (damage == FramingDamage::kSource) return Unexpected{error};
  const FindingPlace place{offset};
  segments_.abandon();
  if (order_ < kSegmentOrder) statics_.note_loss();
  RELIT_ASSIGN(const bool found, input_.resync());
  const std::uint64_t resumed = input_.offset_bytes();
  log_.add(finding_of(damage), place,
           error.message + (found ? "; the next segment is at byte " + std::to_string(resumed)
                                  : "; no segment follows"));
  segments_.note_loss(place.offset_bytes, resumed);
  copies_.note_loss();
  lost_index_ = true;
  if (found) {
    order_ = kSegmentOrder;
    return true;
  }
  // What was cut has no end; otherwise the damage may have hit it.
  if (damage == FramingDamage::kTruncated) return false;
  return resume_at_end(place.offset_bytes);
}

/// Behind the last segment only the end record says where a record starts.
Result<bool> Walk::resume_at_end(std::uint64_t lost_at) {
  lost_end_ = true;
  constexpr std::uint64_t kEndBytes = record_bytes(kEndPayloadBytes);
  const auto size = source_.size();
  if (!source_.seekable() || !size || *size % kRecordAlignment != 0 ||
      *size < lost_at + kEndBytes || order_ > kSegmentOrder)
    return false;
  const std::uint64_t at = *size - kEndBytes;
  RELIT_TRY(input_.seek(at));
  const auto header = input_.peek();
  if (!header || !*header || (*header)->type != types::kEnd) return false;
  const auto payload = input_.payload();
  const auto end = payload ? parse_end(*payload) : Result<EndRecord>(Unexpected{payload.error()});
  if (!end) return false;
  std::uint64_t target = at;
  for (const std::uint64_t offset : {end->index_offset, end->copies_offset})
    if (offset > lost_at) target = std::min(target, offset);
  RELIT_TRY(input_.seek(target));
  lost_end_ = false;
  order_ = kSegmentOrder;
  return true;
}

/// Errors: those that lose the framing.
Status Walk::take(const RecordHeader& header) {
  const FindingPlace place{input_.offset_bytes(), header.type};
  const bool known = check_flags(place, header);
  if (order_ < 0 && header.type != types::kHeader) {
    log_.add("ORDER_HEAD", place, "the first record is '" + type_name(header.type) + "'");
    order_ = 0;
  }
  if (is_static(header.type) && !static_part_ended_) {
    static_bytes_ += header.payload_bytes;
    if (static_bytes_ > limits::kStaticBytes) {
      log_.add("FRAMING_LENGTH", place,
               "the records before the first segment exceed " +
                   std::to_string(limits::kStaticBytes) + " bytes");
      give_up_ = true;
      return {};
    }
  }
  const auto payload = input_.payload();
  if (!payload) {
    if (input_.framing_lost()) return Unexpected{payload.error()};
    log_.add(finding_of(input_.damage()), place, payload.error().message);
  }
  std::optional<std::span<const std::uint8_t>> bytes;
  if (payload) bytes = *payload;
  if (framing_only_) return {};
  if (known)
    dispatch(place, header, bytes);
  else
    take_unknown(place);
  return {};
}

/// Whether the record's flags leave it known.
bool Walk::check_flags(const FindingPlace& place, const RecordHeader& header) {
  const bool may_be_copy = is_static(header.type) || header.type == types::kIndex;
  const std::uint32_t undefined = header.flags & ~(may_be_copy ? flags::kCopy : 0u);
  const std::string message = "flags " + std::to_string(header.flags) + " of '" +
                              type_name(header.type) + "': bits that are not defined for it";
  const bool critical = (undefined & flags::kCriticalMask) != 0;
  if (critical && is_critical(header.type))
    log_.add("FRAMING_CRITICAL_FLAG", place, message);
  else if (undefined != 0)
    log_.add("FRAMING_UNDEFINED_FLAG", place, message);
  return order_of(header.type) >= 0 && !critical;
}

void Walk::take_unknown(const FindingPlace& place) {
  const std::string name = type_name(place.type);
  if (order_of(place.type) >= 0) {
    // Unknown by its flags alone: what it holds is lost to this version.
    if (is_static(place.type)) statics_.note_loss();
    if (place.type == types::kSegment) segments_.note_lost_segment(place, kRecordHeaderBytes);
    lost_index_ |= place.type == types::kIndex;
    return;
  }
  if (is_critical(place.type))
    log_.add("FRAMING_CRITICAL_TYPE", place, "no critical type '" + name + "' is known");
  else if (is_private(place.type))
    log_.add("FRAMING_PRIVATE_RECORD", place, "record '" + name + "' is private");
  else
    log_.add("FRAMING_UNKNOWN_RECORD", place, "record '" + name + "' is unknown");
  if (segments_.inside()) segments_.expect_chunk(place, 0);
}

void Walk::dispatch(const FindingPlace& place, const RecordHeader& header,
                    std::optional<std::span<const std::uint8_t>> payload) {
  const std::uint64_t bytes = record_bytes(header.payload_bytes);
  const bool copy = (header.flags & flags::kCopy) != 0;
  if (segments_.inside()) {
    const bool chunk = segments_.expect_chunk(place, bytes);
    if (chunk) return segments_.chunk(place, payload);
    if (!copy) segments_.abandon();
  } else if (place.type == types::kChunk) {
    if (!segments_.behind_lost_segment())
      log_.add("CHNK_STRAY", place, "no segment announces this chunk");
    return;
  }
  if (copy) return copies_.copy(place, header, payload);
  check_place(place);
  if (order_of(place.type) >= kSegmentOrder) end_static_part(place);
  if (is_static(place.type)) return take_static(place, header, payload);
  if (place.type == types::kSegment) {
    copies_.segment();
    if (!payload || !segments_.segment(place, *payload)) segments_.note_lost_segment(place, bytes);
  } else if (place.type == types::kIndex) {
    index_offset_ = place.offset_bytes;
    copies_.original(header, payload);
    lost_index_ |= !payload;
    if (payload) take_index(place, *payload);
  } else {
    finished_ = true;
    if (payload) take_end(place, *payload);
  }
}

void Walk::check_place(const FindingPlace& place) {
  const int order = order_of(place.type);
  if (order < order_ || (order == order_ && is_single(place.type)))
    log_.add("ORDER_RECORD", place,
             "'" + type_name(place.type) +
                 "' stands out of its place: records come in the order HEAD CLIP IMAG MATL MESH " +
                 "SKEL POSE MODL LAYR SEGM INDX FEND");
  order_ = std::max(order, order_);
}

void Walk::take_static(const FindingPlace& place, const RecordHeader& header,
                       std::optional<std::span<const std::uint8_t>> payload) {
  copies_.original(header, payload);
  if (!payload) {
    statics_.note_loss();
  } else if (place.type == types::kHeader) {
    take_header(place, *payload);
  } else if (static_part_ended_) {
    statics_.check_fields(place, *payload);
  } else {
    statics_.add(place, *payload);
  }
}

void Walk::take_header(const FindingPlace& place, std::span<const std::uint8_t> payload) {
  const auto header = parse_header(payload);
  if (!header && header.error().code == ErrorCode::kUnsupported) {
    log_.add("HEAD_VERSION", place, header.error().message);
    // A newer major version may frame its records otherwise; an older draft does not.
    const bool older = payload[0] == 0 && payload[1] == 0;
    framing_only_ = older;
    give_up_ = !older;
  } else if (!header) {
    log_.add_parse_error(place, header.error());
  } else if (header->version_minor > kVersionMinor) {
    log_.add("HEAD_NEWER_MINOR", place,
             "the file has version " + std::to_string(header->version_major) + "." +
                 std::to_string(header->version_minor) + ", known is " +
                 std::to_string(kVersionMajor) + "." + std::to_string(kVersionMinor));
  }
}

void Walk::end_static_part(const FindingPlace& place) {
  if (std::exchange(static_part_ended_, true)) return;
  statics_.finish(place);
  if (decode_) tracks_.open(statics_);
}

void Walk::take_index(const FindingPlace& place, std::span<const std::uint8_t> payload) {
  const auto record = parse_index(payload);
  if (record)
    segments_.index(place, *record);
  else
    log_.add_parse_error(place, record.error());
}

void Walk::take_end(const FindingPlace& place, std::span<const std::uint8_t> payload) {
  const auto end = parse_end(payload);
  if (!end) return log_.add_parse_error(place, end.error());
  const auto compare = [&](FindingId id, const char* field, std::uint64_t says,
                           std::uint64_t found) {
    if (says != found)
      log_.add(id, place,
               std::string(field) + " is " + std::to_string(says) + ", found was " +
                   std::to_string(found));
  };
  compare("FEND_FILE_BYTES", "file_bytes", end->file_bytes, input_.offset_bytes());
  if (index_offset_ != 0 || !lost_index_)
    compare("FEND_INDEX_OFFSET", "index_offset", end->index_offset, index_offset_);
  if (!copies_.lost())
    compare("FEND_COPIES_OFFSET", "copies_offset", end->copies_offset, copies_.offset_bytes());
}

void Walk::finish() {
  const FindingPlace end{input_.offset_bytes()};
  if (framing_only_) return;
  end_static_part(end);
  segments_.finish(end, finished_);
  if (finished_) {
    copies_.finish(end);
    if (index_offset_ == 0 && !lost_index_ && segments_.any())
      log_.add("INDX_MISSING", end, "the file has segments, but no index of them");
  } else if (!lost_end_) {
    log_.add("FEND_MISSING", end, "the file was cut, or is still being written");
  }
}

}  // namespace

Result<ValidationReport> validate(std::unique_ptr<ByteSource> source,
                                  const ValidationOptions& options) {
  try {
    return Walk(*source, options).run();
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kOutOfMemory, "out of memory while validating");
  }
}

}  // namespace relit::player
