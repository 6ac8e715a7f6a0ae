// SPDX-License-Identifier: MIT
#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>

#include "tests/test.hpp"

/// Where tests find things; test_main.cpp sets what the environment leaves open.
namespace relit::test {

inline std::filesystem::path source_dir() { return std::getenv("RELIT_SOURCE_DIR"); }
inline std::filesystem::path binary_dir() { return std::getenv("RELIT_BINARY_DIR"); }

/// A file of the shared characters, which are not part of the repository; nothing, with a warning
/// in the test's output, where they are absent.
inline std::optional<std::filesystem::path> shared_asset(const std::filesystem::path& name) {
  const std::filesystem::path path = std::filesystem::path(std::getenv("RELIT_ASSETS")) / name;
  if (std::filesystem::exists(path)) return path;
  WARN("skipped: no " << path.string() << "; set RELIT_ASSETS to the folder of the shared assets");
  return std::nullopt;
}

}  // namespace relit::test
