// SPDX-License-Identifier: MIT
#include "container/record_input.hpp"

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

namespace relit::container {
namespace {

/// A header's length is believed only as far as bytes really come.
constexpr std::size_t kFirstReadBytes = std::size_t{1} << 20;
constexpr std::size_t kScanBytes = std::size_t{1} << 16;
/// How often, on the average, a byte may be gone over again.
constexpr std::uint64_t kMostRewound = 8;
constexpr std::size_t kCandidateBytes = kRecordHeaderBytes + kSegmentMarker.size();

Error truncated(std::uint64_t wanted, std::uint64_t got) {
  return {ErrorCode::kTruncated,
          "the data end after " + std::to_string(got) + " of " + std::to_string(wanted) + " bytes"};
}

FramingDamage source_damage(const Error& error) {
  return error.code == ErrorCode::kTruncated ? FramingDamage::kTruncated : FramingDamage::kSource;
}

/// Why decode_header() refused the bytes.
FramingDamage header_damage(std::span<const std::uint8_t, kRecordHeaderBytes> bytes,
                            const Error& error) {
  if (error.code == ErrorCode::kLimit) return FramingDamage::kLength;
  std::uint32_t stored = 0;
  for (std::size_t i = 0; i < 4; ++i) stored |= std::uint32_t{bytes[20 + i]} << (8 * i);
  return stored == crc32(bytes.first<20>()) ? FramingDamage::kType : FramingDamage::kHeaderChecksum;
}

}  // namespace

Result<std::size_t> RecordInput::read_source(std::span<std::uint8_t> out) {
  auto got = source_->read(out);
  if (got) source_offset_ += *got;
  return got;
}

void RecordInput::consume_replay(std::size_t bytes) {
  replay_at_ += bytes;
  if (replay_at_ < replay_.size()) return;
  replay_ = {};
  replay_at_ = 0;
}

/// Reads until `out` is full or the source ends.
Result<std::size_t> RecordInput::read_fully(std::span<std::uint8_t> out) {
  std::size_t done = std::min(out.size(), replay_.size() - replay_at_);
  if (done > 0) std::memcpy(out.data(), replay_.data() + replay_at_, done);
  consume_replay(done);
  while (done < out.size()) {
    RELIT_ASSIGN(const std::size_t got, read_source(out.subspan(done)));
    if (got == 0) break;
    done += got;
  }
  return done;
}

Status RecordInput::read_raw(std::span<std::uint8_t> out) {
  RELIT_ASSIGN(const std::size_t got, read_fully(out));
  if (got < out.size()) return Unexpected{truncated(out.size(), got)};
  return {};
}

Unexpected RecordInput::lose(Error error) {
  damage_ = source_damage(error);
  lost_ = error;
  return Unexpected{std::move(error)};
}

void RecordInput::drop_suspect() {
  dropped_bytes_ += suspect_.size();
  suspect_.clear();
}

Status RecordInput::perform_skip() {
  const std::size_t replayed =
      static_cast<std::size_t>(std::min<std::uint64_t>(pending_skip_, replay_.size() - replay_at_));
  consume_replay(replayed);
  std::uint64_t left = std::exchange(pending_skip_, 0) - replayed;
  if (left >= kLeastSeekBytes && source_->seekable()) {
    // Beyond the end a seek would succeed, and hide that the data are incomplete.
    const auto size = source_->size();
    if (size && *size - std::min(*size, source_offset_) < left)
      return lose(truncated(left, *size - std::min(*size, source_offset_)));
    if (auto status = source_->seek(source_offset_ + left); !status)
      return lose(std::move(status).error());
    source_offset_ += left;
    return {};
  }
  std::array<std::uint8_t, 16384> scratch;
  while (left > 0) {
    const auto step = static_cast<std::size_t>(std::min<std::uint64_t>(left, scratch.size()));
    auto got = read_source(std::span(scratch).first(step));
    if (!got) return lose(std::move(got).error());
    if (*got == 0) return lose(truncated(left, 0));
    left -= *got;
  }
  return {};
}

Result<std::optional<RecordHeader>> RecordInput::peek() {
  if (lost_) return Unexpected{*lost_};
  if (header_) return header_;
  if (pending_skip_ > 0) {
    drop_suspect();
    RELIT_TRY(perform_skip());
  }
  auto got = read_fully(header_bytes_);
  if (!got) {
    drop_suspect();
    return lose(std::move(got).error());
  }
  if (*got == 0) return std::optional<RecordHeader>();
  auto header = *got < kRecordHeaderBytes ? Result<RecordHeader>(Unexpected{truncated(24, *got)})
                                          : decode_header(header_bytes_, verify_);
  if (!header) {
    suspect_.insert(suspect_.end(), header_bytes_.begin(),
                    header_bytes_.begin() + static_cast<std::ptrdiff_t>(*got));
    const FramingDamage damage = *got < kRecordHeaderBytes
                                     ? FramingDamage::kTruncated
                                     : header_damage(header_bytes_, header.error());
    auto failure = lose(std::move(header).error());
    damage_ = damage;
    return failure;
  }
  drop_suspect();
  header_ = *header;
  return header_;
}

Result<std::span<const std::uint8_t>> RecordInput::payload() {
  const RecordHeader header = *header_;
  header_.reset();
  const auto size = static_cast<std::size_t>(header.payload_bytes);
  const std::size_t total = size + padding_after(size);
  if (payload_.size() > kKeptPayloadBytes) payload_ = {};
  std::size_t done = 0;
  const auto suspect = [&] {
    suspect_.assign(header_bytes_.begin(), header_bytes_.end());
    suspect_.insert(suspect_.end(), payload_.begin(),
                    payload_.begin() + static_cast<std::ptrdiff_t>(done));
  };
  // A length is believed where the source can hold it; else memory follows what arrives.
  const auto source_bytes = source_->size();
  const bool believed =
      source_bytes && total <= *source_bytes - std::min(*source_bytes, offset_bytes());
  while (done < total) {
    const std::size_t goal =
        believed ? total : std::min(total, std::max(kFirstReadBytes, 2 * done));
    // Only growth is paid for: what a longer record left behind is overwritten.
    if (payload_.size() < goal) payload_.resize(goal);
    auto got = read_fully(std::span(payload_).subspan(done, goal - done));
    // How much arrived before the source failed is unknown, so there is nothing to search later.
    if (!got) return lose(std::move(got).error());
    done += *got;
    if (done == goal) continue;
    suspect();
    return lose(truncated(total, done));
  }
  const auto bytes = std::span<const std::uint8_t>(payload_).first(total);
  if (!verify_) return bytes.first(size);
  const bool intact = crc32(bytes.first(size)) == header.payload_crc;
  const bool padded = std::ranges::all_of(bytes.subspan(size), [](auto b) { return b == 0; });
  if (!intact || !padded) {
    suspect();
    damage_ = intact ? FramingDamage::kPadding : FramingDamage::kPayloadChecksum;
    return fail(ErrorCode::kCorrupt,
                intact ? "the padding is not zero" : "the payload does not match its checksum");
  }
  return bytes.first(size);
}

void RecordInput::skip() {
  const std::uint64_t size = header_->payload_bytes;
  header_.reset();
  skip_bytes(size + padding_after(size));
}

std::uint64_t RecordInput::offset_bytes() const {
  const std::uint64_t next = source_offset_ - (replay_.size() - replay_at_) + pending_skip_;
  return header_ ? next - kRecordHeaderBytes : next;
}

Status RecordInput::seek(std::uint64_t offset_bytes) {
  RELIT_TRY(source_->seek(offset_bytes));
  source_offset_ = offset_bytes;
  replay_ = {};
  replay_at_ = 0;
  pending_skip_ = 0;
  header_.reset();
  drop_suspect();
  lost_.reset();
  return {};
}

/// Appends some of the source to replay_; false at the end.
Result<bool> RecordInput::grow_window() {
  std::array<std::uint8_t, 16384> bytes;
  RELIT_ASSIGN(const std::size_t got, read_source(bytes));
  replay_.insert(replay_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(got));
  return got > 0;
}

/// Puts what was read of the damaged record back in front of what comes; false if there was
/// nothing.
bool RecordInput::rewind() {
  if (header_) suspect_.assign(header_bytes_.begin(), header_bytes_.end());
  header_.reset();
  rewound_bytes_ += suspect_.size();
  // Records inside records inside records could make this quadratic; honest damage never comes
  // near.
  if (rewound_bytes_ > kMostRewound * source_offset_ + kFirstReadBytes) drop_suspect();
  if (suspect_.empty()) return false;
  // replay_ is let go when it has been read to its end: until then the suspect bytes are its own.
  if (!replay_.empty()) {
    replay_at_ -= suspect_.size();
    suspect_.clear();
  } else {
    replay_ = std::exchange(suspect_, {});
  }
  return true;
}

Result<bool> RecordInput::resync() {
  if (!header_ && !lost_ && pending_skip_ > 0) RELIT_TRY(perform_skip());
  pending_skip_ = 0;
  const bool intact = header_.has_value();
  const bool rewound = rewind();
  std::size_t begin = replay_at_;
  // Records start at multiples of 8 in the file; the scan may start elsewhere.
  const std::uint64_t offset = source_offset_ - (replay_.size() - replay_at_);
  replay_at_ += static_cast<std::size_t>(-offset % kRecordAlignment);
  if (rewound && !intact && replay_at_ == begin) replay_at_ += kRecordAlignment;

  for (;; replay_at_ += kRecordAlignment) {
    while (replay_.size() < replay_at_ + kCandidateBytes) {
      if (replay_at_ > kScanBytes) {
        dropped_bytes_ += replay_at_ - std::exchange(begin, 0);
        replay_.erase(replay_.begin(), replay_.begin() + static_cast<std::ptrdiff_t>(replay_at_));
        replay_at_ = 0;
      }
      auto more = grow_window();
      if (!more) return lose(std::move(more).error());
      if (*more) continue;
      dropped_bytes_ += replay_.size() - begin;
      replay_ = {};
      replay_at_ = 0;
      lost_.reset();
      return false;
    }
    const auto* candidate = replay_.data() + replay_at_;
    if (std::memcmp(candidate + kRecordHeaderBytes, kSegmentMarker.data(), kSegmentMarker.size()))
      continue;
    const auto header =
        decode_header(std::span<const std::uint8_t, kRecordHeaderBytes>(candidate, 24), verify_);
    if (header && header->type == types::kSegment && (header->flags & flags::kCriticalMask) == 0)
      break;
  }
  dropped_bytes_ += replay_at_ - begin;
  lost_.reset();
  return true;
}

}  // namespace relit::container
