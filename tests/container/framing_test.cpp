// SPDX-License-Identifier: MIT
#include "container/framing.hpp"

#include <string_view>

#include "container/base/limits.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::container;

namespace {

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace

TEST_CASE("the checksum is the CRC-32 of zlib") {
  CHECK(crc32(bytes_of("123456789")) == 0xCBF43926u);
  CHECK(crc32({}) == 0);
}

TEST_CASE("a type's letters say what a reader may do with it") {
  CHECK(type_name(types::kSegment) == "SEGM");
  CHECK(is_critical(types::kSegment));
  CHECK_FALSE(is_critical(record_type("note")));
  CHECK(is_private(record_type("aBCd")) == false);
  CHECK(is_private(record_type("abCd")));
  CHECK(is_well_formed(record_type("abCd")));
  CHECK_FALSE(is_well_formed(record_type("abcd")));
  CHECK_FALSE(is_well_formed(record_type("AB1D")));
  CHECK(type_name(RecordType{0x0A424344}) == "DCB\\x0A");
}

TEST_CASE("known types have the order of the file") {
  CHECK(order_of(types::kHeader) == 0);
  CHECK(order_of(types::kLayer) < order_of(types::kSegment));
  CHECK(order_of(types::kChunk) == order_of(types::kSegment));
  CHECK(order_of(types::kEnd) > order_of(types::kIndex));
  CHECK(order_of(record_type("XXXX")) == -1);
}

TEST_CASE("record headers survive, and every changed bit of them is noticed") {
  const RecordHeader header{types::kChunk, 0x80000000u, 123456789, 0xDEADBEEF};
  const auto bytes = encode_header(header);
  const auto decoded = decode_header(bytes);
  REQUIRE(decoded);
  CHECK(*decoded == header);
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    auto damaged = bytes;
    damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1u << (bit % 8)));
    const auto result = decode_header(damaged);
    REQUIRE_FALSE(result);
    CHECK(result.error().code == ErrorCode::kCorrupt);
  }
}

TEST_CASE("record headers with impossible contents are refused whatever their checksum says") {
  const auto at_limit = encode_header({types::kImage, 0, limits::kRecordBytes, 0});
  CHECK(decode_header(at_limit));
  const auto beyond = decode_header(encode_header({types::kImage, 0, limits::kRecordBytes + 1, 0}));
  REQUIRE_FALSE(beyond);
  CHECK(beyond.error().code == ErrorCode::kLimit);
  CHECK(decode_header(encode_header({types::kSegment, 0, kMostSegmentPayloadBytes, 0})));
  CHECK_FALSE(decode_header(encode_header({types::kSegment, 0, kMostSegmentPayloadBytes + 1, 0})));
  const auto digits = decode_header(encode_header({record_type("AB12"), 0, 0, 0}));
  REQUIRE_FALSE(digits);
  CHECK(digits.error().code == ErrorCode::kCorrupt);
}

TEST_CASE("records are padded to multiples of eight bytes with zeros") {
  for (std::size_t size = 0; size < 20; ++size) {
    const std::vector<std::uint8_t> payload(size, 0xFF);
    const auto record = frame_record(types::kImage, payload);
    CHECK(record.size() % 8 == 0);
    CHECK(record.size() == record_bytes(size));
    CHECK(record.size() < 24 + size + 8);
    for (std::size_t i = 24 + size; i < record.size(); ++i) CHECK(record[i] == 0);
  }
}
