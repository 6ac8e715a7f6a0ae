// SPDX-License-Identifier: MIT
#include "container/framing.hpp"

extern "C" {
#include <libavutil/crc.h>
}

#include <algorithm>

#include "container/base/bytes.hpp"

namespace relit::container {
namespace {

char letter(RecordType type, int i) {
  return static_cast<char>((static_cast<std::uint32_t>(type) >> (8 * i)) & 0xFF);
}
bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }
bool is_lower(char c) { return c >= 'a' && c <= 'z'; }

}  // namespace

std::string type_name(RecordType type) {
  constexpr char kHex[] = "0123456789ABCDEF";
  std::string name;
  for (int i = 0; i < 4; ++i) {
    const char c = letter(type, i);
    if (is_upper(c) || is_lower(c)) {
      name += c;
    } else {
      const auto byte = static_cast<std::uint8_t>(c);
      name += {'\\', 'x', kHex[byte >> 4], kHex[byte & 15]};
    }
  }
  return name;
}

bool is_well_formed(RecordType type) {
  for (int i = 0; i < 4; ++i)
    if (!is_upper(letter(type, i)) && !is_lower(letter(type, i))) return false;
  return is_upper(letter(type, 2));
}

bool is_critical(RecordType type) { return is_upper(letter(type, 0)); }
bool is_private(RecordType type) { return is_lower(letter(type, 1)); }

int order_of(RecordType type) {
  constexpr std::array kOrder{types::kHeader, types::kClip,     types::kImage,     types::kMaterial,
                              types::kMesh,   types::kSkeleton, types::kPoseTrack, types::kModel,
                              types::kLayer,  types::kSegment,  types::kIndex,     types::kEnd};
  if (type == types::kChunk) type = types::kSegment;
  const auto it = std::find(kOrder.begin(), kOrder.end(), type);
  return it == kOrder.end() ? -1 : static_cast<int>(it - kOrder.begin());
}

std::uint32_t crc32(std::span<const std::uint8_t> bytes) {
  // av_crc steps back from the end of the data, which a null pointer does not survive.
  if (bytes.empty()) return 0;
  static const AVCRC* const table = av_crc_get_table(AV_CRC_32_IEEE_LE);
  return ~av_crc(table, 0xFFFFFFFFu, bytes.data(), bytes.size());
}

std::array<std::uint8_t, kRecordHeaderBytes> encode_header(const RecordHeader& header) {
  ByteWriter w;
  w.u32(static_cast<std::uint32_t>(header.type));
  w.u32(header.flags);
  w.u64(header.payload_bytes);
  w.u32(header.payload_crc);
  std::array<std::uint8_t, kRecordHeaderBytes> bytes{};
  auto out = w.take();
  std::copy(out.begin(), out.end(), bytes.begin());
  w.u32(crc32(out));
  out = w.take();
  std::copy(out.begin(), out.end(), bytes.begin() + 20);
  return bytes;
}

Result<RecordHeader> decode_header(std::span<const std::uint8_t, kRecordHeaderBytes> bytes,
                                   bool verify_checksum) {
  ByteReader r(bytes);
  RecordHeader header;
  header.type = RecordType{r.u32("type")};
  header.flags = r.u32("flags");
  header.payload_bytes = r.u64("payload length");
  header.payload_crc = r.u32("payload checksum");
  const auto stored = r.u32("header checksum");
  if (verify_checksum && stored != crc32(bytes.first<20>()))
    return fail(ErrorCode::kCorrupt, "the record header does not match its checksum");
  if (!is_well_formed(header.type))
    return fail(ErrorCode::kCorrupt, "'" + type_name(header.type) +
                                         "' is no record type: four letters are, the third of them "
                                         "upper case");
  const std::uint64_t limit =
      header.type == types::kSegment ? kMostSegmentPayloadBytes : limits::kRecordBytes;
  if (header.payload_bytes > limit)
    return fail(ErrorCode::kLimit, "record '" + type_name(header.type) + "' announces " +
                                       std::to_string(header.payload_bytes) +
                                       " bytes, the limit is " + std::to_string(limit));
  return header;
}

std::vector<std::uint8_t> frame_record(RecordType type, std::span<const std::uint8_t> payload,
                                       std::uint32_t record_flags) {
  const auto header = encode_header({type, record_flags, payload.size(), crc32(payload)});
  std::vector<std::uint8_t> out(record_bytes(payload.size()));
  std::copy(header.begin(), header.end(), out.begin());
  std::copy(payload.begin(), payload.end(), out.begin() + kRecordHeaderBytes);
  return out;
}

}  // namespace relit::container
