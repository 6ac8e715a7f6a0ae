// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "container/base/result.hpp"

/// Little-endian bytes, written to a vector and read from a span.
namespace relit {

/// Whether `text` is well-formed UTF-8 (no overlong forms, surrogates or values above U+10FFFF)
/// without U+0000.
[[nodiscard]] inline bool is_valid_utf8(std::string_view text) {
  std::size_t i = 0;
  while (i < text.size()) {
    const auto lead = static_cast<std::uint8_t>(text[i++]);
    if (lead == 0) return false;
    if (lead < 0x80) continue;
    const int more = lead >= 0xF0 ? 3 : lead >= 0xE0 ? 2 : 1;
    if (lead < 0xC2 || lead > 0xF4 || text.size() - i < static_cast<std::size_t>(more))
      return false;
    std::uint32_t code = lead & (0x3Fu >> more);
    for (int k = 0; k < more; ++k) {
      const auto next = static_cast<std::uint8_t>(text[i++]);
      if ((next & 0xC0) != 0x80) return false;
      code = (code << 6) | (next & 0x3Fu);
    }
    constexpr std::array<std::uint32_t, 4> kLeast{0, 0x80, 0x800, 0x10000};
    if (code < kLeast[static_cast<std::size_t>(more)] || code > 0x10FFFF) return false;
    if (code >= 0xD800 && code <= 0xDFFF) return false;
  }
  return true;
}

/// Appends little-endian values to a vector that it owns. Writes whatever it is given: checks
/// belong to the caller.
class ByteWriter {
 public:
  void u8(std::uint8_t v) { out_.push_back(v); }
  void u16(std::uint16_t v) { put(v); }
  void u32(std::uint32_t v) { put(v); }
  void u64(std::uint64_t v) { put(v); }
  void i32(std::int32_t v) { put(static_cast<std::uint32_t>(v)); }
  void f32(float v) { put(std::bit_cast<std::uint32_t>(v)); }
  void boolean(bool v) { u8(v ? 1 : 0); }
  template <std::size_t N>
  void f32s(const std::array<float, N>& values) {
    for (const float v : values) f32(v);
  }

  /// Unsigned LEB128 in its shortest form: 1 to 10 bytes.
  void varint(std::uint64_t v) {
    for (; v >= 0x80; v >>= 7) u8(static_cast<std::uint8_t>(v | 0x80));
    u8(static_cast<std::uint8_t>(v));
  }
  /// Signed values as varints: 0, -1, 1, -2, … become 0, 1, 2, 3, …
  void zigzag(std::int64_t v) {
    varint((static_cast<std::uint64_t>(v) << 1) ^ static_cast<std::uint64_t>(v >> 63));
  }

  void raw(std::span<const std::uint8_t> bytes) {
    out_.insert(out_.end(), bytes.begin(), bytes.end());
  }
  /// u32 length, then the bytes.
  void bytes(std::span<const std::uint8_t> v) {
    u32(static_cast<std::uint32_t>(v.size()));
    raw(v);
  }
  /// u16 length in bytes, then UTF-8.
  void string(std::string_view v) {
    u16(static_cast<std::uint16_t>(v.size()));
    for (const char c : v) u8(static_cast<std::uint8_t>(c));
  }

  [[nodiscard]] std::size_t size() const { return out_.size(); }
  void reserve(std::size_t bytes) { out_.reserve(bytes); }
  /// Gives the bytes away and leaves the writer empty.
  [[nodiscard]] std::vector<std::uint8_t> take() { return std::move(out_); }

 private:
  template <std::unsigned_integral T>
  void put(T v) {
    for (std::size_t i = 0; i < sizeof(T); ++i)
      out_.push_back(static_cast<std::uint8_t>(v >> (8 * i)));
  }

  std::vector<std::uint8_t> out_;
};

/// Reads little-endian values from bytes that somebody else owns. The first failure sticks: every
/// later read gives zero or nothing, so read freely and check finish() (or ok()) once. `what` names
/// the field for the message. Never allocates more than a small multiple of the bytes that are
/// really there.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t position() const { return position_; }
  [[nodiscard]] std::size_t remaining() const { return bytes_.size() - position_; }

  /// Records a failure unless there is one already.
  void fail(ErrorCode code, const char* what, const std::string& why) {
    if (!ok_) return;
    ok_ = false;
    error_ = {code,
              std::string(what) + " at payload byte " + std::to_string(position_) + ": " + why};
  }
  /// The first failure, if any.
  [[nodiscard]] Status status() const {
    if (ok_) return {};
    return Unexpected{error_};
  }
  /// The first failure; else kCorrupt if bytes are left over.
  [[nodiscard]] Status finish() {
    if (ok_ && remaining() != 0)
      fail(ErrorCode::kCorrupt, "end",
           std::to_string(remaining()) + " bytes more than the fields need");
    return status();
  }

  std::uint8_t u8(const char* what) { return get<std::uint8_t>(what); }
  std::uint16_t u16(const char* what) { return get<std::uint16_t>(what); }
  std::uint32_t u32(const char* what) { return get<std::uint32_t>(what); }
  std::uint64_t u64(const char* what) { return get<std::uint64_t>(what); }
  std::int32_t i32(const char* what) { return static_cast<std::int32_t>(get<std::uint32_t>(what)); }
  /// A finite float; infinities and NaN fail.
  float f32(const char* what) {
    const auto v = std::bit_cast<float>(get<std::uint32_t>(what));
    if (std::isfinite(v)) return v;
    fail(ErrorCode::kCorrupt, what, "not a finite number");
    return 0;
  }
  template <std::size_t N>
  std::array<float, N> f32s(const char* what) {
    std::array<float, N> values{};
    for (float& v : values) v = f32(what);
    return values;
  }
  /// A byte that must be 0 or 1.
  bool boolean(const char* what) {
    const auto v = u8(what);
    if (v > 1) fail(ErrorCode::kCorrupt, what, std::to_string(v) + " is neither 0 nor 1");
    return v == 1;
  }
  /// A byte that must be one of the enumerators 0..last.
  template <class Enum>
  Enum enumeration(const char* what, Enum last) {
    const auto v = u8(what);
    if (v <= static_cast<std::uint8_t>(last)) return static_cast<Enum>(v);
    fail(ErrorCode::kUnsupported, what,
         "value " + std::to_string(v) + " is unknown to this version");
    return Enum{};
  }
  /// A field that must be zero.
  void zero_u16(const char* what) { zero(u16(what), what); }
  void zero_u32(const char* what) { zero(u32(what), what); }

  /// Unsigned LEB128; longer forms than the shortest and values of more than 64 bits fail.
  std::uint64_t varint(const char* what) {
    std::uint64_t v = 0;
    for (unsigned shift = 0; shift < 70 && ok_; shift += 7) {
      const auto byte = u8(what);
      if (shift == 63 && byte > 1) break;
      v |= std::uint64_t{byte & 0x7Fu} << shift;
      if ((byte & 0x80) != 0) continue;
      if (byte == 0 && shift != 0) break;
      return ok_ ? v : 0;
    }
    fail(ErrorCode::kCorrupt, what, "not a variable-length integer in its shortest form");
    return 0;
  }
  std::int64_t zigzag(const char* what) {
    const auto v = varint(what);
    return static_cast<std::int64_t>((v >> 1) ^ (~(v & 1) + 1));
  }

  /// `size` bytes as they are, still owned by whoever owns the input.
  std::span<const std::uint8_t> raw(const char* what, std::uint64_t size) {
    if (!need(what, size)) return {};
    const auto view = bytes_.subspan(position_, static_cast<std::size_t>(size));
    position_ += view.size();
    return view;
  }
  /// u32 length of at most `limit`, then the bytes.
  std::vector<std::uint8_t> bytes(const char* what, std::uint64_t limit) {
    const std::uint64_t size = u32(what);
    if (size > limit) fail(ErrorCode::kLimit, what, over(size, "bytes", limit));
    const auto view = raw(what, ok_ ? size : 0);
    return {view.begin(), view.end()};
  }
  /// u16 length of at most `limit` bytes, then UTF-8.
  std::string string(const char* what, std::uint32_t limit) {
    const std::uint32_t size = u16(what);
    if (size > limit) fail(ErrorCode::kLimit, what, over(size, "bytes", limit));
    const auto view = raw(what, ok_ ? size : 0);
    std::string text(view.begin(), view.end());
    if (!is_valid_utf8(text)) fail(ErrorCode::kCorrupt, what, "not valid UTF-8");
    return text;
  }
  /// u32 number of elements that follow, each of at least `element_bytes` (> 0). Fails above
  /// `limit` and when so many cannot follow, so the result may be allocated.
  std::uint32_t count(const char* what, std::uint64_t limit, std::size_t element_bytes) {
    const auto n = u32(what);
    if (n > limit) {
      fail(ErrorCode::kLimit, what, over(n, "elements", limit));
    } else if (n > remaining() / element_bytes) {
      fail(ErrorCode::kTruncated, what,
           std::to_string(n) + " elements do not fit into the " + std::to_string(remaining()) +
               " bytes left");
    }
    return ok_ ? n : 0;
  }

 private:
  static std::string over(std::uint64_t value, const char* unit, std::uint64_t limit) {
    return std::to_string(value) + " " + unit + " exceed the limit of " + std::to_string(limit);
  }
  bool need(const char* what, std::uint64_t size) {
    if (ok_ && size > remaining())
      fail(
          ErrorCode::kTruncated, what,
          "needs " + std::to_string(size) + " bytes, " + std::to_string(remaining()) + " are left");
    return ok_;
  }
  void zero(std::uint32_t v, const char* what) {
    if (v != 0) fail(ErrorCode::kCorrupt, what, "reserved, must be 0, is " + std::to_string(v));
  }
  template <std::unsigned_integral T>
  T get(const char* what) {
    if (!need(what, sizeof(T))) return 0;
    T v = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i)
      v = static_cast<T>(v | static_cast<T>(static_cast<T>(bytes_[position_ + i]) << (8 * i)));
    position_ += sizeof(T);
    return v;
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t position_ = 0;
  bool ok_ = true;
  Error error_{};
};

}  // namespace relit
