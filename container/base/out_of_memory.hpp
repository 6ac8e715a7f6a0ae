// SPDX-License-Identifier: MIT
#pragma once

#include <new>
#include <string>

#include "container/base/result.hpp"

namespace relit {

/// The Error of an allocation that failed in the middle of `doing` ("reading a record"). Never
/// throws: where not even the message can be allocated, it is only "out of memory".
[[nodiscard]] inline Error out_of_memory(const char* doing) noexcept {
  Error error{ErrorCode::kOutOfMemory, {}};
  try {
    error.message = std::string("out of memory while ") + doing;
  } catch (const std::bad_alloc&) {
    error.message = "out of memory";  // short enough for a string's own storage
  }
  return error;
}

/// What `work` returns, a Result or Status; kOutOfMemory where it throws std::bad_alloc. Public
/// functions that allocate by the measure of a file do it in here.
template <class Work>
[[nodiscard]] auto catch_out_of_memory(const char* doing, Work&& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return Unexpected{out_of_memory(doing)};
  }
}

}  // namespace relit
