// SPDX-License-Identifier: MIT
#include <set>
#include <tuple>

#include "container/record_codec.hpp"
#include "player/recover_static.hpp"

namespace relit::player {
namespace {

using container::FoundRecord;
using container::RecordType;
namespace types = container::types;
namespace flags = container::flags;

/// More than a file may have: originals and copies of every kind.
constexpr std::size_t kMostStatics = 1u << 16;

class Surveyor {
 public:
  explicit Surveyor(container::RecordScan& scan) : scan_(scan) {}

  Result<Survey> run() {
    while (!found_.finished) {
      RELIT_ASSIGN(const auto record, scan_.next());
      if (!record) break;
      RELIT_TRY(take(*record));
    }
    if (!found_.finished) found_.end_bytes = scan_.size_bytes();
    found_.damaged_bytes = scan_.damaged_bytes();
    return std::move(found_);
  }

 private:
  Status take(const FoundRecord& record) {
    const RecordType type = record.header.type;
    const int order = container::order_of(type);
    const bool copy = (record.header.flags & flags::kCopy) != 0;
    const bool known =
        order >= 0 && (record.header.flags & flags::kCriticalMask & ~flags::kKnownCritical) == 0;
    if (!known) return take_unknown(record);
    if (order < container::order_of(types::kSegment)) return take_static(record, copy);
    if (type == types::kSegment) return take_segment(record);
    if (type == types::kIndex && record.intact && !found_.index) {
      auto index = container::parse_index(scan_.payload());
      if (index) found_.index = std::move(*index);
    }
    if (type == types::kEnd && record.intact) {
      const auto end = container::parse_end(scan_.payload());
      found_.end_bytes = record.offset_bytes + container::record_bytes(container::kEndPayloadBytes);
      // What is glued on behind the end belongs to nobody.
      found_.finished = end && end->file_bytes == found_.end_bytes;
    }
    return {};
  }

  Status take_unknown(const FoundRecord& record) {
    if (!container::is_critical(record.header.type)) {
      if (!found_.static_end) found_.others.push_back(record);
      return check_count(found_.others.size());
    }
    if (!record.intact) return {};
    return fail(ErrorCode::kUnsupported,
                "record '" + container::type_name(record.header.type) + "' at byte " +
                    std::to_string(record.offset_bytes) +
                    " is critical and unknown to this version: a newer relit is needed");
  }

  Status take_static(const FoundRecord& record, bool copy) {
    auto& list = copy ? found_.copies : found_.originals;
    // A stream may repeat its copies for ever.
    const auto& header = record.header;
    const bool first =
        seen_.emplace(header.type, header.payload_bytes, header.payload_crc, copy, record.intact)
            .second;
    if (first) list.push_back(record);
    return check_count(list.size());
  }

  Status take_segment(const FoundRecord& record) {
    if (!found_.static_end) found_.static_end = record.offset_bytes;
    if (!record.intact) return {};
    const auto segment = container::parse_segment(scan_.payload());
    if (!segment || found_.tracks.size() >= limits::kClips) return {};
    auto& tracks = found_.tracks[segment->clip_id];
    if (!tracks.empty()) return {};
    for (const auto& chunk : segment->chunks) tracks.push_back(chunk.track_id);
    return {};
  }

  static Status check_count(std::size_t records) {
    if (records <= kMostStatics) return {};
    return fail(ErrorCode::kLimit, "more than " + std::to_string(kMostStatics) +
                                       " different records outside segments");
  }

  container::RecordScan& scan_;
  Survey found_;
  /// Type, length, checksum, copy, intact.
  std::set<std::tuple<RecordType, std::uint64_t, std::uint32_t, bool, bool>> seen_;
};

}  // namespace

Result<Survey> survey(container::RecordScan& scan) { return Surveyor(scan).run(); }

}  // namespace relit::player
