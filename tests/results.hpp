// SPDX-License-Identifier: MIT
#pragma once

#include <utility>

#include "container/base/result.hpp"
#include "tests/test.hpp"

namespace relit::test {

/// The value, or the end of the test with the error's message.
template <class T>
T take(Result<T> result) {
  if (!result) FAIL(result.error().message);
  return std::move(*result);
}
inline void require(const Status& status) {
  if (!status) FAIL(status.error().message);
}

}  // namespace relit::test
