// SPDX-License-Identifier: MIT
#pragma once

#include <utility>

namespace relit {

/// An optional value that keeps its storage while it is empty: assigning again allocates nothing
/// where T's own assignment does not.
template <class T>
class Kept {
 public:
  Kept& operator=(const T& value) {
    value_ = value;
    present_ = true;
    return *this;
  }
  /// Takes the value and leaves the old one, for its storage, in `value`.
  void swap_in(T& value) {
    std::swap(value_, value);
    present_ = true;
  }
  void reset() { present_ = false; }

  explicit operator bool() const { return present_; }
  const T& operator*() const { return value_; }
  const T* operator->() const { return &value_; }

 private:
  T value_{};
  bool present_ = false;
};

}  // namespace relit
