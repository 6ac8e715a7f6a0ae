// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "container/base/result.hpp"
#include "container/byte_source.hpp"
#include "container/framing.hpp"

namespace relit::container {

/// A record whose header is right, wherever it was found.
struct FoundRecord {
  RecordHeader header;
  std::uint64_t offset_bytes = 0;  ///< of its header
  bool intact = false;             ///< the payload is there and matches its checksum
};

/// Finds every record of a damaged file: follows the framing while it holds, and looks for a header
/// at each byte where it does not, so that it finds what a Reader must give up: static records
/// behind a hit, chunks without their segment, a file without its first bytes, records that no
/// longer stand at multiples of 8. Knows no record, and trusts nothing but checksums.
///
/// The work is linear in the source's size: inside damaged payloads it looks for records only up to
/// a few times the file's bytes in all, and passes over them after that. One thread at a time.
class RecordScan {
 public:
  /// `source` outlives the scan, can seek, and is used by nobody else meanwhile. Errors:
  /// kUnsupported for a source that cannot seek or whose size is unknown.
  static Result<RecordScan> create(ByteSource& source);

  /// The next record; nothing at the end. Errors: the source's, kOutOfMemory.
  Result<std::optional<FoundRecord>> next();
  /// The payload of the record that next() gave, whether intact or not (then perhaps shorter);
  /// valid until the next call.
  [[nodiscard]] std::span<const std::uint8_t> payload() const { return payload_; }

  /// Bytes that belong to no intact record, so far. The signature counts as one.
  [[nodiscard]] std::uint64_t damaged_bytes() const { return damaged_bytes_; }
  [[nodiscard]] std::uint64_t size_bytes() const { return size_; }
  [[nodiscard]] bool signature_intact() const { return signature_intact_; }

  /// Reads a record that was found before, and its payload as above. Does not change where next()
  /// goes on. Errors: the source's; kCorrupt if the source has changed meanwhile.
  Status read_again(const FoundRecord& record);

 private:
  RecordScan(ByteSource& source, std::uint64_t size) : source_(&source), size_(size) {}
  Status read_signature();
  Result<std::span<const std::uint8_t>> window(std::uint64_t offset, std::size_t bytes);
  Result<std::optional<RecordHeader>> header_at(std::uint64_t offset);
  Result<std::optional<FoundRecord>> search();
  Result<bool> read_payload(const FoundRecord& record);
  Status choose_next(const FoundRecord& record);

  ByteSource* source_;
  std::uint64_t size_;
  std::uint64_t at_ = 0;  ///< where next() goes on
  std::vector<std::uint8_t> window_;
  std::uint64_t window_offset_ = 0;
  std::vector<std::uint8_t> payload_;
  std::uint64_t searched_again_ = 0;  ///< bytes of damaged payloads that were searched
  std::uint64_t damaged_bytes_ = 0;
  bool signature_intact_ = false;
};

}  // namespace relit::container
