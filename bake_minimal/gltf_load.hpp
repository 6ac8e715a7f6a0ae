// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "bake_minimal/scene.hpp"
#include "container/base/result.hpp"

namespace relit::bake::gltf {

/// load_gltf() for bytes already in memory; `path` is for messages and relative URIs.
[[nodiscard]] Result<Scene> load_bytes(std::span<const std::uint8_t> bytes,
                                       const std::filesystem::path& path);

}  // namespace relit::bake::gltf
