// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "container/base/result.hpp"

/// What all fuzzers share: how they read their input, and what must hold whatever it is.
namespace relit::fuzz {

using Input = std::span<const std::uint8_t>;
using Bytes = std::vector<std::uint8_t>;

/// A false condition is a finding.
inline void require(bool condition) {
  if (!condition) std::abort();
}

/// Hostile bytes are refused with a code of the list and a message, and are never blamed on the
/// caller's arguments, the disk or the machine.
inline void check(const Error& error) {
  require(!error.message.empty());
  require(error.code >= ErrorCode::kTruncated && error.code <= ErrorCode::kOutOfMemory);
  require(error.code != ErrorCode::kInvalid);
}

/// Whether there is a value; the error is checked where there is none.
template <class R>
bool check(const Result<R>& result) {
  if (!result) check(result.error());
  return result.has_value();
}

inline bool finite(float v) { return std::isfinite(v); }
inline bool finite(const glm::vec2& v) { return finite(v.x) && finite(v.y); }
inline bool finite(const glm::vec3& v) { return finite(v.x) && finite(v.y) && finite(v.z); }
inline bool finite(const glm::mat4x3& m) {
  return finite(m[0]) && finite(m[1]) && finite(m[2]) && finite(m[3]);
}

template <class Values>
void require_finite(const Values& values) {
  for (const auto& v : values) require(finite(v));
}

/// Takes numbers and pieces from the front of the input; zeros and short pieces at its end.
class Cursor {
 public:
  explicit Cursor(Input input) : input_(input) {}

  std::uint8_t u8() {
    const Input byte = take(1);
    return byte.empty() ? std::uint8_t{0} : byte[0];
  }
  std::uint16_t u16() {
    const unsigned low = u8();
    return static_cast<std::uint16_t>(low | unsigned{u8()} << 8);
  }
  Input take(std::size_t bytes) {
    const Input piece = input_.first(std::min(bytes, input_.size()));
    input_ = input_.subspan(piece.size());
    return piece;
  }
  /// A piece with its length in front, in 16 bits.
  Input piece() { return take(u16()); }
  Input rest() { return take(input_.size()); }
  [[nodiscard]] bool empty() const { return input_.empty(); }

 private:
  Input input_;
};

inline Bytes copy(Input input) { return {input.begin(), input.end()}; }

}  // namespace relit::fuzz
