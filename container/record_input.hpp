// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "container/base/result.hpp"
#include "container/byte_source.hpp"
#include "container/framing.hpp"

namespace relit::container {

/// Why RecordInput could not give a header or a payload.
enum class FramingDamage : std::uint8_t {
  kNone,
  kHeaderChecksum,
  kType,    ///< the checksum is right, the type is none
  kLength,  ///< beyond the limits
  kPayloadChecksum,
  kPadding,
  kTruncated,
  kSource,  ///< the source itself failed
};

/// Cuts a byte source into records: the part of the Reader that knows framing and checksums but no
/// record. Keeps the bytes of a record that turned out damaged, so that resync() can look for a
/// segment inside them even where the source cannot go back. One thread at a time.
class RecordInput {
 public:
  /// Fewer bytes than this are read through rather than sought over: over HTTP a seek is a request.
  static constexpr std::uint64_t kLeastSeekBytes = 4096;

  /// `source` outlives the input and is moved by nobody else; it stands at `offset_bytes`.
  RecordInput(ByteSource& source, std::uint64_t offset_bytes, bool verify_checksums)
      : source_(&source), source_offset_(offset_bytes), verify_(verify_checksums) {}

  /// Reads exactly out.size() bytes that belong to no record. Errors: kTruncated, or the source's.
  Status read_raw(std::span<std::uint8_t> out);

  /// The header of the next record, without consuming it; nothing at the end of the source. Errors:
  /// kTruncated, kCorrupt, kLimit, or the source's: then the framing is lost and the same error
  /// returns until resync() or seek().
  Result<std::optional<RecordHeader>> peek();

  /// Consumes the record that peek() gave and returns its payload, valid until the next call.
  /// Errors: kCorrupt for a wrong checksum or padding, which leave the framing intact; kTruncated
  /// and the source's, which lose it.
  Result<std::span<const std::uint8_t>> payload();

  /// Consumes the record that peek() gave without reading it.
  void skip();
  /// Passes over bytes at the next record's place; the source is moved only by the next peek().
  void skip_bytes(std::uint64_t bytes) { pending_skip_ += bytes; }

  /// What the last error of peek() or payload() was about.
  [[nodiscard]] FramingDamage damage() const { return damage_; }

  /// Declares the framing lost at the record that peek() gave.
  void lose_framing(Error error) { lost_ = std::move(error); }
  [[nodiscard]] bool framing_lost() const { return lost_.has_value(); }

  /// Looks for the next intact segment record: from the record that peek() gave, itself included;
  /// else from just behind the start of the damaged one; else from here. False: the source ends
  /// before. Errors: the source's.
  Result<bool> resync();

  /// Goes to a record at `offset_bytes`. Errors: the source's.
  Status seek(std::uint64_t offset_bytes);

  /// ByteSource::expect().
  void expect(std::uint64_t begin_bytes, std::uint64_t end_bytes) {
    source_->expect(begin_bytes, end_bytes);
  }

  /// Where the next record starts, or the one that peek() gave.
  [[nodiscard]] std::uint64_t offset_bytes() const;
  /// Where the source itself stands; seek it back there after using it for something else.
  [[nodiscard]] std::uint64_t source_offset_bytes() const { return source_offset_; }
  /// Bytes of damaged records, and those that resync() passed over.
  [[nodiscard]] std::uint64_t dropped_bytes() const { return dropped_bytes_; }

 private:
  Result<std::size_t> read_source(std::span<std::uint8_t> out);
  Result<std::size_t> read_fully(std::span<std::uint8_t> out);
  Status perform_skip();
  void drop_suspect();
  Result<bool> grow_window();
  bool rewind();
  void consume_replay(std::size_t bytes);
  Unexpected lose(Error error);

  ByteSource* source_;
  std::uint64_t source_offset_;
  bool verify_;

  std::vector<std::uint8_t> replay_;  ///< to be read before the source
  std::size_t replay_at_ = 0;
  std::uint64_t pending_skip_ = 0;

  std::optional<RecordHeader> header_;  ///< peeked
  std::array<std::uint8_t, kRecordHeaderBytes> header_bytes_{};
  std::vector<std::uint8_t> payload_;
  std::vector<std::uint8_t> suspect_;  ///< what was read of the damaged record, up to here
  std::optional<Error> lost_;
  FramingDamage damage_ = FramingDamage::kNone;
  std::uint64_t rewound_bytes_ = 0;
  std::uint64_t dropped_bytes_ = 0;
};

}  // namespace relit::container
