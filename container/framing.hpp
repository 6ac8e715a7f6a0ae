// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "container/base/limits.hpp"
#include "container/base/result.hpp"

/// The outermost layer of a .relit file: signature, record headers, checksums (FORMAT.md, section
/// 2).
namespace relit::container {

inline constexpr std::uint16_t kVersionMajor = 0;
inline constexpr std::uint16_t kVersionMinor = 2;

inline constexpr std::array<std::uint8_t, 8> kSignature{0x89, 'R',  'L',  'T',
                                                        0x0D, 0x0A, 0x1A, 0x0A};
/// First bytes of every segment record's payload, by which a reader finds its way back.
inline constexpr std::array<std::uint8_t, 16> kSegmentMarker{
    0xF3, 0x52, 0x9C, 0x0B, 0xE6, 0xD1, 0x7A, 0x38, 0xC4, 0x1F, 0xA9, 0x65, 0x0E, 0xB2, 0x87, 0x5D};
inline constexpr std::size_t kRecordHeaderBytes = 24;
inline constexpr std::size_t kRecordAlignment = 8;
inline constexpr std::size_t kEndPayloadBytes = 24;
/// A reader gives a payload buffer beyond this back after use.
inline constexpr std::size_t kKeptPayloadBytes = std::size_t{1} << 24;
/// A segment record of limits::kChunksPerSegment chunks and limits::kFramesPerSegment durations.
inline constexpr std::size_t kMostSegmentPayloadBytes =
    52 + 16 * limits::kChunksPerSegment + 4 * limits::kFramesPerSegment;

/// Four ASCII letters, the first in the lowest byte. Any value can come out of a file; the
/// enumerators are those that this version knows.
enum class RecordType : std::uint32_t {};

[[nodiscard]] constexpr RecordType record_type(const char (&letters)[5]) {
  std::uint32_t v = 0;
  for (int i = 3; i >= 0; --i) v = (v << 8) | static_cast<std::uint8_t>(letters[i]);
  return RecordType{v};
}

namespace types {
inline constexpr RecordType kHeader = record_type("HEAD");
inline constexpr RecordType kClip = record_type("CLIP");
inline constexpr RecordType kImage = record_type("IMAG");
inline constexpr RecordType kMaterial = record_type("MATL");
inline constexpr RecordType kMesh = record_type("MESH");
inline constexpr RecordType kSkeleton = record_type("SKEL");
inline constexpr RecordType kPoseTrack = record_type("POSE");
inline constexpr RecordType kModel = record_type("MODL");
inline constexpr RecordType kLayer = record_type("LAYR");
inline constexpr RecordType kSegment = record_type("SEGM");
inline constexpr RecordType kChunk = record_type("CHNK");
inline constexpr RecordType kIndex = record_type("INDX");
inline constexpr RecordType kEnd = record_type("FEND");
}  // namespace types

/// The type's letters; bytes that are not letters appear as \xNN.
[[nodiscard]] std::string type_name(RecordType type);
/// Four ASCII letters of which the third is upper case (a lower-case third letter is reserved).
[[nodiscard]] bool is_well_formed(RecordType type);
/// First letter upper case: a reader that does not know the record must refuse the file.
[[nodiscard]] bool is_critical(RecordType type);
/// Second letter lower case: nobody's standard; two writers may mean different things by it.
[[nodiscard]] bool is_private(RecordType type);
/// The place of a known type in a file: 0 for HEAD, rising to that of FEND; SEGM and CHNK share
/// one. -1: unknown type.
[[nodiscard]] int order_of(RecordType type);

namespace flags {
/// The record repeats an earlier one, byte for byte in its payload. A reader that has that one
/// skips it.
inline constexpr std::uint32_t kCopy = 1u << 0;
/// A record with an unknown flag among these counts as a record of unknown type.
inline constexpr std::uint32_t kCriticalMask = 0x0000FFFFu;
inline constexpr std::uint32_t kKnownCritical = kCopy;
}  // namespace flags

struct RecordHeader {
  RecordType type{};
  std::uint32_t flags = 0;
  std::uint64_t payload_bytes = 0;  ///< without padding
  std::uint32_t payload_crc = 0;
  bool operator==(const RecordHeader&) const = default;
};

/// CRC-32 as in ISO 3309, zlib and PNG: the CRC of "123456789" is 0xCBF43926.
[[nodiscard]] std::uint32_t crc32(std::span<const std::uint8_t> bytes);

/// Zero bytes that follow a payload of this length.
[[nodiscard]] constexpr std::size_t padding_after(std::uint64_t payload_bytes) {
  return static_cast<std::size_t>((kRecordAlignment - payload_bytes % kRecordAlignment) %
                                  kRecordAlignment);
}
/// Length of a whole record: header, payload, padding. `payload_bytes` at most
/// limits::kRecordBytes.
[[nodiscard]] constexpr std::uint64_t record_bytes(std::uint64_t payload_bytes) {
  return kRecordHeaderBytes + payload_bytes + padding_after(payload_bytes);
}

[[nodiscard]] std::array<std::uint8_t, kRecordHeaderBytes> encode_header(
    const RecordHeader& header);

/// Decodes a record header. Errors: kCorrupt for a wrong checksum (only with `verify_checksum`) or
/// a type that is not four letters, kLimit for a payload beyond limits::kRecordBytes or, of a
/// segment, kMostSegmentPayloadBytes.
[[nodiscard]] Result<RecordHeader> decode_header(
    std::span<const std::uint8_t, kRecordHeaderBytes> bytes, bool verify_checksum = true);

/// The whole record around a payload.
[[nodiscard]] std::vector<std::uint8_t> frame_record(RecordType type,
                                                     std::span<const std::uint8_t> payload,
                                                     std::uint32_t record_flags = 0);

}  // namespace relit::container
