// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>

#include "container/base/bytes.hpp"
#include "container/base/limits.hpp"
#include "container/base/result.hpp"

/// Conditions that the validate() functions of the record codecs share.
namespace relit::container::checks {

/// Returns kCorrupt with `message` from the function it stands in unless `condition` holds. A
/// macro, so that messages are put together only when somebody will read them: parsing would
/// otherwise spend a third of its time on them.
#define RELIT_REQUIRE(condition, message)                                                       \
  do {                                                                                          \
    if (!(condition)) return ::relit::fail(::relit::ErrorCode::kCorrupt, std::string(message)); \
  } while (false)

/// kLimit unless value <= limit.
[[nodiscard]] inline Status at_most(std::uint64_t value, std::uint64_t limit, const char* what) {
  if (value <= limit) return {};
  return fail(ErrorCode::kLimit, std::string(what) + " " + std::to_string(value) +
                                     " exceeds the limit of " + std::to_string(limit));
}

/// kLimit unless 1 <= value <= limit.
[[nodiscard]] inline Status one_to(std::uint64_t value, std::uint64_t limit, const char* what) {
  if (value == 0) return fail(ErrorCode::kCorrupt, std::string(what) + " is 0");
  return at_most(value, limit, what);
}

[[nodiscard]] inline Status finite(float value, const char* what) {
  RELIT_REQUIRE(std::isfinite(value), std::string(what) + " is not a finite number");
  return {};
}
template <class Range>
[[nodiscard]] Status finite(const Range& values, const char* what) {
  for (const float v : values) RELIT_TRY(finite(v, what));
  return {};
}
/// Finite and >= 0.
template <class Range>
[[nodiscard]] Status not_negative(const Range& values, const char* what) {
  RELIT_TRY(finite(values, what));
  for (const float v : values) RELIT_REQUIRE(v >= 0, std::string(what) + " is negative");
  return {};
}

[[nodiscard]] inline Status text(std::string_view value, const char* what,
                                 std::uint32_t limit = limits::kStringBytes) {
  RELIT_TRY(at_most(value.size(), limit, what));
  RELIT_REQUIRE(is_valid_utf8(value), std::string(what) + " is not valid UTF-8");
  return {};
}

/// kUnsupported unless the enumerator lies in 0..last.
template <class Enum>
[[nodiscard]] Status known(Enum value, Enum last, const char* what) {
  if (static_cast<std::uint8_t>(value) <= static_cast<std::uint8_t>(last)) return {};
  return fail(ErrorCode::kUnsupported, std::string(what) + " " +
                                           std::to_string(static_cast<unsigned>(value)) +
                                           " is unknown to this version");
}

}  // namespace relit::container::checks
