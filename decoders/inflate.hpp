// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "container/base/result.hpp"

namespace relit::decoders {

/// Decompresses one zstd frame whose header states its size. Returns its bytes; nothing is
/// allocated before the stated size has been checked. `what` names the stream in messages. Errors:
/// kCorrupt (no frame, no stated size, bytes after the frame, damage), kLimit (more than
/// `max_bytes`).
[[nodiscard]] Result<std::vector<std::uint8_t>> inflate(std::span<const std::uint8_t> bytes,
                                                        std::size_t max_bytes,
                                                        std::string_view what);

/// The same where the size is known: kCorrupt unless it is exactly `exact_bytes`.
[[nodiscard]] Result<std::vector<std::uint8_t>> inflate_exact(std::span<const std::uint8_t> bytes,
                                                              std::size_t exact_bytes,
                                                              std::string_view what);
/// The same into a vector whose storage is used again; what it holds after an error is undefined.
[[nodiscard]] Status inflate_exact_into(std::span<const std::uint8_t> bytes,
                                        std::size_t exact_bytes, std::string_view what,
                                        std::vector<std::uint8_t>& out);

}  // namespace relit::decoders
