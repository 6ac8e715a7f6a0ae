// SPDX-License-Identifier: MIT
#include "container/record_scan.hpp"

#include <algorithm>
#include <new>
#include <string>

namespace relit::container {
namespace {

constexpr std::size_t kWindowBytes = std::size_t{1} << 16;
/// How often, on the average, a byte may be gone over again.
constexpr std::uint64_t kMostSearched = 8;

/// Cheap enough for every byte of a file: letters where the type is, and a length below 2^31.
bool may_be_header(const std::uint8_t* bytes) {
  const auto letter = [](std::uint8_t b) { return (b | 0x20) >= 'a' && (b | 0x20) <= 'z'; };
  return letter(bytes[0]) && letter(bytes[1]) && bytes[2] >= 'A' && bytes[2] <= 'Z' &&
         letter(bytes[3]) && bytes[11] < 0x80 && bytes[12] == 0 && bytes[13] == 0 &&
         bytes[14] == 0 && bytes[15] == 0;
}

std::optional<RecordHeader> header_in(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kRecordHeaderBytes || !may_be_header(bytes.data())) return std::nullopt;
  auto header = decode_header(bytes.first<kRecordHeaderBytes>());
  if (!header) return std::nullopt;
  return *header;
}

}  // namespace

Result<RecordScan> RecordScan::create(ByteSource& source) {
  const auto size = source.size();
  if (!source.seekable() || !size)
    return fail(ErrorCode::kUnsupported, "searching for records needs a source that can seek");
  RecordScan scan(source, *size);
  RELIT_TRY(scan.read_signature());
  return scan;
}

Status RecordScan::read_signature() {
  RELIT_ASSIGN(const auto first, window(0, kSignature.size()));
  signature_intact_ = std::ranges::equal(first, kSignature);
  if (signature_intact_) at_ = kSignature.size();
  return {};
}

/// `bytes` of the source from `offset` on; fewer at its end.
Result<std::span<const std::uint8_t>> RecordScan::window(std::uint64_t offset, std::size_t bytes) {
  const std::uint64_t end = window_offset_ + window_.size();
  if (offset < window_offset_ || offset + bytes > end) {
    window_offset_ = offset;
    window_.resize(static_cast<std::size_t>(
        std::min<std::uint64_t>(kWindowBytes, size_ - std::min(size_, offset))));
    std::size_t done = 0;
    RELIT_TRY(source_->seek(offset));
    while (done < window_.size()) {
      RELIT_ASSIGN(const std::size_t got, source_->read(std::span(window_).subspan(done)));
      if (got == 0) break;
      done += got;
    }
    window_.resize(done);
  }
  const auto skip = static_cast<std::size_t>(offset - window_offset_);
  const auto rest = std::span<const std::uint8_t>(window_).subspan(std::min(skip, window_.size()));
  return rest.first(std::min(bytes, rest.size()));
}

Result<std::optional<RecordHeader>> RecordScan::header_at(std::uint64_t offset) {
  if (offset + kRecordHeaderBytes > size_) return std::optional<RecordHeader>();
  RELIT_ASSIGN(const auto bytes, window(offset, kRecordHeaderBytes));
  return header_in(bytes);
}

/// The next header from at_ on.
Result<std::optional<FoundRecord>> RecordScan::search() {
  while (at_ + kRecordHeaderBytes <= size_) {
    RELIT_ASSIGN(auto bytes, window(at_, kRecordHeaderBytes));
    if (bytes.size() < kRecordHeaderBytes) break;
    bytes = std::span<const std::uint8_t>(window_).subspan(
        static_cast<std::size_t>(at_ - window_offset_));
    for (; bytes.size() >= kRecordHeaderBytes; bytes = bytes.subspan(1), ++at_) {
      if (const auto header = header_in(bytes))
        return std::optional<FoundRecord>({*header, at_, false});
      ++damaged_bytes_;
    }
  }
  damaged_bytes_ += size_ - std::min(size_, at_);
  at_ = size_;
  return std::optional<FoundRecord>();
}

/// Whether the payload is there and right. Padding carries nothing that could be lost.
Result<bool> RecordScan::read_payload(const FoundRecord& record) {
  const std::uint64_t begin = record.offset_bytes + kRecordHeaderBytes;
  const auto size = static_cast<std::size_t>(record.header.payload_bytes);
  const std::size_t wanted = size + padding_after(size);
  const auto total = static_cast<std::size_t>(std::min<std::uint64_t>(wanted, size_ - begin));
  if (payload_.capacity() > kKeptPayloadBytes) payload_ = {};
  payload_.resize(total);
  std::size_t done = 0;
  RELIT_ASSIGN(const auto near, window(begin, std::min(total, kWindowBytes)));
  std::ranges::copy(near, payload_.begin());
  done = near.size();
  if (done < total) RELIT_TRY(source_->seek(begin + done));
  while (done < total) {
    RELIT_ASSIGN(const std::size_t got, source_->read(std::span(payload_).subspan(done)));
    if (got == 0) break;
    done += got;
  }
  payload_.resize(std::min(done, size));
  if (done < size) return false;
  return crc32(payload_) == record.header.payload_crc;
}

/// Where the search goes on after a record.
Status RecordScan::choose_next(const FoundRecord& record) {
  const std::uint64_t whole = record_bytes(record.header.payload_bytes);
  const std::uint64_t end = record.offset_bytes + whole;
  at_ = std::min(end, size_);
  if (record.intact) return {};
  RELIT_ASSIGN(const auto following, header_at(end));
  const std::uint64_t inside = at_ - record.offset_bytes - kRecordHeaderBytes;
  // Headers inside payloads inside payloads could make this quadratic; honest damage never comes
  // near.
  const bool trusted = following || searched_again_ + inside > kMostSearched * size_;
  if (trusted) {
    damaged_bytes_ += at_ - record.offset_bytes;
    return {};
  }
  searched_again_ += inside;
  at_ = record.offset_bytes + kRecordHeaderBytes;
  damaged_bytes_ += kRecordHeaderBytes;
  return {};
}

Result<std::optional<FoundRecord>> RecordScan::next() {
  try {
    RELIT_ASSIGN(auto found, search());
    if (!found) return found;
    RELIT_ASSIGN(found->intact, read_payload(*found));
    RELIT_TRY(choose_next(*found));
    return found;
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kOutOfMemory,
                "out of memory for the record at byte " + std::to_string(at_));
  }
}

Status RecordScan::read_again(const FoundRecord& record) {
  try {
    RELIT_ASSIGN(const bool intact, read_payload(record));
    if (intact == record.intact) return {};
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kOutOfMemory, "out of memory for a record");
  }
  return fail(ErrorCode::kCorrupt, "the file changes while it is read: record '" +
                                       type_name(record.header.type) + "' at byte " +
                                       std::to_string(record.offset_bytes));
}

}  // namespace relit::container
