// SPDX-License-Identifier: MIT
#include "container/base/bytes.hpp"

#include <array>
#include <limits>

#include "tests/test.hpp"

using namespace relit;

namespace {

std::uint64_t varint_of(std::vector<std::uint8_t> bytes, bool& ok) {
  ByteReader r(bytes);
  const auto v = r.varint("v");
  ok = r.finish().has_value();
  return v;
}

}  // namespace

TEST_CASE("integers and floats are written least significant byte first") {
  ByteWriter w;
  w.u16(0x0102);
  w.u32(0x03040506);
  w.u64(0x0708090A0B0C0D0Eull);
  w.i32(-2);
  w.f32(1.0f);
  const std::vector<std::uint8_t> expected{2, 1, 6, 5,    4,    3,    0xE,  0xD, 0xC, 0xB,  0xA,
                                           9, 8, 7, 0xFE, 0xFF, 0xFF, 0xFF, 0,   0,   0x80, 0x3F};
  CHECK(w.take() == expected);
}

TEST_CASE("variable-length integers survive and are as short as they can be") {
  for (const std::uint64_t v :
       {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{127}, std::uint64_t{128},
        std::uint64_t{16383}, std::uint64_t{16384}, std::uint64_t{1} << 63,
        std::numeric_limits<std::uint64_t>::max()}) {
    ByteWriter w;
    w.varint(v);
    std::size_t expected = 1;
    for (auto rest = v >> 7; rest != 0; rest >>= 7) ++expected;
    CHECK(w.size() == expected);
    const auto bytes = w.take();
    bool ok = false;
    CHECK(varint_of(bytes, ok) == v);
    CHECK(ok);
  }
  for (const std::int64_t v :
       {std::int64_t{0}, std::int64_t{-1}, std::int64_t{1}, std::int64_t{-64}, std::int64_t{64},
        std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()}) {
    ByteWriter w;
    w.zigzag(v);
    const auto bytes = w.take();
    ByteReader r(bytes);
    CHECK(r.zigzag("v") == v);
    CHECK(r.finish());
  }
}

TEST_CASE("variable-length integers that are longer than need be are refused") {
  bool ok = true;
  varint_of({0x80, 0x00}, ok);
  CHECK_FALSE(ok);
  varint_of({0xFF, 0x80, 0x00}, ok);
  CHECK_FALSE(ok);
  const std::vector<std::uint8_t> nines(9, 0xFF);
  auto bytes = nines;
  bytes.push_back(0x02);  // bit 64
  varint_of(bytes, ok);
  CHECK_FALSE(ok);
  bytes = nines;
  bytes.push_back(0x81);  // an eleventh byte
  bytes.push_back(0x00);
  varint_of(bytes, ok);
  CHECK_FALSE(ok);
  varint_of({0x80}, ok);  // cut
  CHECK_FALSE(ok);
}

TEST_CASE("the first error of a byte reader sticks") {
  const std::array<std::uint8_t, 3> bytes{1, 2, 3};
  ByteReader r(bytes);
  CHECK(r.u16("a") == 0x0201);
  CHECK(r.u32("second") == 0);
  CHECK(r.u8("c") == 0);  // a byte is left, but the reader has failed
  CHECK_FALSE(r.ok());
  const auto status = r.finish();
  REQUIRE_FALSE(status);
  CHECK(status.error().code == ErrorCode::kTruncated);
  CHECK(status.error().message.find("second at payload byte 2") != std::string::npos);
}

TEST_CASE("left-over bytes are an error") {
  const std::array<std::uint8_t, 3> bytes{1, 2, 3};
  ByteReader r(bytes);
  (void)r.u16("a");
  const auto status = r.finish();
  REQUIRE_FALSE(status);
  CHECK(status.error().code == ErrorCode::kCorrupt);
}

TEST_CASE("counts that cannot be true are refused before anything is allocated") {
  ByteWriter w;
  w.u32(1000);
  w.u64(0);
  const auto bytes = w.take();
  ByteReader over_limit(bytes);
  CHECK(over_limit.count("n", 999, 1) == 0);
  CHECK(over_limit.status().error().code == ErrorCode::kLimit);
  ByteReader too_short(bytes);
  CHECK(too_short.count("n", 1000, 1) == 0);
  CHECK(too_short.status().error().code == ErrorCode::kTruncated);
}

TEST_CASE("strings and blobs have limits") {
  ByteWriter w;
  w.string("abc");
  w.bytes(std::array<std::uint8_t, 4>{1, 2, 3, 4});
  const auto bytes = w.take();
  ByteReader good(bytes);
  CHECK(good.string("s", 3) == "abc");
  CHECK(good.bytes("b", 4) == std::vector<std::uint8_t>{1, 2, 3, 4});
  CHECK(good.finish());
  ByteReader long_string(bytes);
  CHECK(long_string.string("s", 2).empty());
  CHECK(long_string.status().error().code == ErrorCode::kLimit);
  ByteReader long_blob(bytes);
  (void)long_blob.string("s", 3);
  CHECK(long_blob.bytes("b", 3).empty());
  CHECK(long_blob.status().error().code == ErrorCode::kLimit);
}

TEST_CASE("floats that are not finite, odd booleans and unknown enumerators are refused") {
  for (const float v :
       {std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
        std::numeric_limits<float>::quiet_NaN()}) {
    ByteWriter w;
    w.f32(v);
    const auto bytes = w.take();
    ByteReader r(bytes);
    CHECK(r.f32("v") == 0);
    CHECK_FALSE(r.ok());
  }
  const std::array<std::uint8_t, 1> two{2};
  ByteReader b(two);
  CHECK_FALSE(b.boolean("b"));
  CHECK_FALSE(b.ok());
  enum class Small : std::uint8_t { kA, kB };
  ByteReader e(two);
  CHECK(e.enumeration("e", Small::kB) == Small::kA);
  CHECK(e.status().error().code == ErrorCode::kUnsupported);
}

TEST_CASE("UTF-8 is told from what resembles it") {
  CHECK(is_valid_utf8(""));
  CHECK(is_valid_utf8("plain"));
  CHECK(is_valid_utf8("\xC3\xA4\xE2\x82\xAC\xF0\x9F\x92\xA1"));
  CHECK(is_valid_utf8("\xF4\x8F\xBF\xBF"));
  for (const char* bad :
       {"\x80", "\xC0\x80", "\xC1\xBF", "\xC3", "\xE0\x80\x80", "\xED\xA0\x80", "\xF0\x80\x80\x80",
        "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xFF", "\xC3("})
    CHECK_FALSE(is_valid_utf8(bad));
  CHECK_FALSE(is_valid_utf8(std::string_view("a\0b", 3)));
}
