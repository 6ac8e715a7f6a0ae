// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <system_error>

#include "container/base/result.hpp"

namespace relit {

/// The kIo error of a system call that set errno to `error` in the middle of `doing`.
[[nodiscard]] inline Unexpected system_failure(const std::string& doing, int error) {
  return fail(ErrorCode::kIo, doing + ": " + std::generic_category().message(error));
}

}  // namespace relit
