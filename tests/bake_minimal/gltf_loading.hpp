// SPDX-License-Identifier: MIT
#pragma once

#include <initializer_list>
#include <string>

#include "bake_minimal/gltf_load.hpp"
#include "tests/bake_minimal/gltf_builder.hpp"
#include "tests/test.hpp"

namespace relit::test {

inline Result<bake::Scene> load(const GltfBuilder& builder) {
  return bake::gltf::load_bytes(builder.glb(), "test.glb");
}

/// Loads what must load.
inline bake::Scene loaded(const GltfBuilder& builder) {
  auto scene = load(builder);
  INFO((scene ? std::string() : scene.error().message));
  REQUIRE(scene.has_value());
  return std::move(*scene);
}

/// Checks an error's code, that its message names the file, and that it says all of `words`.
inline void check_error(const Result<bake::Scene>& scene, ErrorCode code,
                        std::initializer_list<const char*> words) {
  REQUIRE(!scene.has_value());
  INFO(scene.error().message);
  CHECK(scene.error().code == code);
  CHECK(scene.error().message.find("test.gl") != std::string::npos);
  for (const char* word : words) {
    INFO(word);
    CHECK(scene.error().message.find(word) != std::string::npos);
  }
}

inline bool has_warning(const bake::Scene& scene, const std::string& words) {
  for (const std::string& warning : scene.warnings) {
    if (warning.find(words) != std::string::npos) return true;
  }
  return false;
}

}  // namespace relit::test
