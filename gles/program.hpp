// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "gles/objects.hpp"

namespace relit::gles {

/// Which dialect and precision shaders are compiled for.
enum class Profile {
  kEs3,  ///< #version 300 es, highp
  kEs2,  ///< #version 100, highp fragments; ES 2 entry points, formats and named extensions only
  kEs2Mediump,  ///< #version 100, mediump fragments: for GPUs without highp there, as Mali-400
};

/// The parts of a program. Bodies are concatenated after `defines` ("NAME value\n" lines become
/// #defines) and the prelude, which gives ES 2 and ES 3 one vocabulary.
struct ProgramSource {
  std::string_view name;  ///< for messages
  std::string defines;    ///< shared by both stages
  std::span<const std::string_view> vertex;
  std::span<const std::string_view> fragment;
  std::span<const std::string_view> attributes;  ///< bound to locations 0, 1, …
};

/// Compiles and links. Errors: kEnvironment with the driver's log.
[[nodiscard]] Result<Program> build_program(const Functions& gl, Profile profile,
                                            const ProgramSource& source);

}  // namespace relit::gles
