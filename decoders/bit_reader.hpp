// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace relit::decoders {

/// Reads fields of bits, most significant bit first. Reading beyond the end gives zeros and makes
/// failed() true for good, so that a header can be read through and checked once.
class BitReader {
 public:
  /// The caller keeps the bytes alive.
  explicit BitReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  /// `count` is 0 to 32.
  std::uint32_t bits(int count) {
    std::uint32_t value = 0;
    for (; count > 0; --count) value = (value << 1) | next();
    return value;
  }
  bool flag() { return next() != 0; }
  void skip(int count) { bits(count); }

  /// Exponential Golomb code, ue(v): at most 2^32 - 2, anything longer fails.
  std::uint32_t golomb() {
    int zeros = 0;
    while (!failed_ && !flag()) {
      if (++zeros > 31) failed_ = true;
    }
    return failed_ ? 0 : (1u << zeros) - 1 + bits(zeros);
  }
  /// se(v).
  std::int64_t signed_golomb() {
    const std::int64_t code = golomb();
    return code % 2 != 0 ? (code + 1) / 2 : -(code / 2);
  }

  [[nodiscard]] bool failed() const { return failed_; }

 private:
  std::uint32_t next() {
    if (at_ >= bytes_.size() * 8) {
      failed_ = true;
      return 0;
    }
    const std::uint32_t bit = (bytes_[at_ / 8] >> (7 - at_ % 8)) & 1u;
    ++at_;
    return bit;
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  bool failed_ = false;
};

}  // namespace relit::decoders
