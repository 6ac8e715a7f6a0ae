// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "container/base/result.hpp"

namespace relit::bake::gltf {

/// The bytes behind a glTF "uri": a base64 data URI, or a file relative to `directory`
/// (percent-decoded,
/// ".." allowed; absolute paths and other schemes are not). Messages do not name the file that
/// holds the URI. Errors: kCorrupt (bad base64), kUnsupported (other schemes), kIo.
[[nodiscard]] Result<std::vector<std::uint8_t>> resolve_uri(std::string_view uri,
                                                            const std::filesystem::path& directory);

/// The media type in a data URI; empty for other URIs.
[[nodiscard]] std::string_view data_uri_media_type(std::string_view uri);

/// Strict base64 (RFC 4648, the padding may be missing). Errors: kCorrupt, with the offset.
[[nodiscard]] Result<std::vector<std::uint8_t>> decode_base64(std::string_view text);

}  // namespace relit::bake::gltf
