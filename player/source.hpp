// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>

#include "container/base/result.hpp"
#include "container/byte_source.hpp"

namespace relit::player {

/// Opens what a user names: a path, "-" for standard input, or an http(s):// address (through
/// libavformat, with Range requests where the server answers them and reconnection when it drops
/// out). Errors: kIo with the reason; kEnvironment where this FFmpeg cannot do the protocol.
[[nodiscard]] Result<std::unique_ptr<container::ByteSource>> open_source(const std::string& source);

}  // namespace relit::player
