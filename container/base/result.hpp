// SPDX-License-Identifier: MIT
#pragma once

#include <cassert>
#include <string>
#include <utility>
#include <variant>

namespace relit {

/// What kind of failure an Error reports. The numbers are part of the C ABI and never change.
enum class ErrorCode : int {
  kIo = 1,           ///< reading or writing failed: missing file, full disk, lost connection
  kTruncated = 2,    ///< the data end before they should
  kCorrupt = 3,      ///< the data contradict themselves or their checksum
  kUnsupported = 4,  ///< well formed, but needs something this build does not have
  kLimit = 5,        ///< a size or count beyond container/base/limits.hpp
  kInvalid = 6,      ///< an argument or an input value that makes no sense
  kNotFound = 7,     ///< a name, frame, clip or track that the file does not hold
  kOutOfMemory = 8,  ///< an allocation failed, or a budget does not suffice
  kEnvironment = 9,  ///< the machine lacks something: no GL, no display, no encoder
  kCancelled = 10,   ///< the caller asked to stop
};

/// A failure: what happened, where (file, byte offset, track, frame), and what would be right.
struct Error {
  ErrorCode code;
  std::string message;
};

/// Wraps an Error for returning it from a function with a Result; named after std::unexpected.
struct Unexpected {
  Error error;
};

/// Makes the failure branch of a Result: `return fail(ErrorCode::kLimit, "…")`.
[[nodiscard]] inline Unexpected fail(ErrorCode code, std::string message) {
  return {Error{code, std::move(message)}};
}

/// Either a value or an Error. The members are named as in C++23's std::expected, by which it can
/// be replaced one day. value(), * and -> require has_value(); error() requires !has_value().
template <class T>
class [[nodiscard]] Result {
 public:
  using value_type = T;

  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Result(Unexpected failure) : state_(std::in_place_index<1>, std::move(failure.error)) {}

  [[nodiscard]] bool has_value() const { return state_.index() == 0; }
  explicit operator bool() const { return has_value(); }

  T& value() & { return *get(); }
  const T& value() const& { return *get(); }
  T&& value() && { return std::move(*get()); }
  T& operator*() & { return *get(); }
  const T& operator*() const& { return *get(); }
  T&& operator*() && { return std::move(*get()); }
  T* operator->() { return get(); }
  const T* operator->() const { return get(); }

  const Error& error() const& {
    assert(!has_value());
    return *std::get_if<1>(&state_);
  }
  Error&& error() && {
    assert(!has_value());
    return std::move(*std::get_if<1>(&state_));
  }

 private:
  T* get() {
    assert(has_value());
    return std::get_if<0>(&state_);
  }
  const T* get() const {
    assert(has_value());
    return std::get_if<0>(&state_);
  }

  std::variant<T, Error> state_;
};

/// Success without a value, or an Error.
template <>
class [[nodiscard]] Result<void> {
 public:
  using value_type = void;

  Result() = default;
  Result(Unexpected failure) : error_(std::move(failure.error)), ok_(false) {}

  [[nodiscard]] bool has_value() const { return ok_; }
  explicit operator bool() const { return ok_; }

  const Error& error() const& {
    assert(!ok_);
    return error_;
  }
  Error&& error() && {
    assert(!ok_);
    return std::move(error_);
  }

 private:
  Error error_{};
  bool ok_ = true;
};

using Status = Result<void>;

}  // namespace relit

#define RELIT_CONCAT_INNER(a, b) a##b
#define RELIT_CONCAT(a, b) RELIT_CONCAT_INNER(a, b)

/// Returns the Error of `expression` (a Status or any Result) from the enclosing function.
#define RELIT_TRY(expression)                                   \
  do {                                                          \
    if (auto relit_try = (expression); !relit_try)              \
      return ::relit::Unexpected{std::move(relit_try).error()}; \
  } while (false)

/// `RELIT_ASSIGN(auto x, f())`: x is f()'s value, or the enclosing function returns f()'s Error.
#define RELIT_ASSIGN(declaration, expression)                                             \
  auto RELIT_CONCAT(relit_assign_, __LINE__) = (expression);                              \
  if (!RELIT_CONCAT(relit_assign_, __LINE__))                                             \
    return ::relit::Unexpected{std::move(RELIT_CONCAT(relit_assign_, __LINE__)).error()}; \
  declaration = std::move(*RELIT_CONCAT(relit_assign_, __LINE__))
