// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "container/base/result.hpp"
#include "container/byte_source.hpp"

/// Whether a .relit file keeps every rule of container/FORMAT.md. container/VALIDATION.md lists
/// what can be found.
namespace relit::player {

enum class Severity : std::uint8_t {
  kError,    ///< the file breaks a rule
  kWarning,  ///< it misses what writers should do, or is incomplete
  kInfo,     ///< worth knowing
};
/// "error", "warning" or "info".
[[nodiscard]] std::string_view severity_name(Severity severity);

/// What a finding's id means.
struct FindingKind {
  std::string_view id;  ///< PREFIX_RULE
  Severity severity = Severity::kError;
  std::string_view meaning;  ///< one sentence
};
/// All kinds, in the order of VALIDATION.md.
[[nodiscard]] std::span<const FindingKind> finding_kinds();

struct Finding {
  const FindingKind* kind = nullptr;  ///< one of finding_kinds()
  std::uint64_t offset_bytes = 0;     ///< of the record or of the place, from the start of the file
  std::string record;                 ///< its type's letters; empty: none
  std::string message;                ///< one sentence about this case
};

struct ValidationOptions {
  /// Findings of one kind that are kept; further ones are only counted.
  std::size_t findings_per_kind = 100;
  bool decode = true;  ///< false: framing, fields and references only
  int threads = 1;     ///< of each video decoder
};

struct ValidationReport {
  std::vector<Finding> findings;  ///< in the order in which they were met
  std::uint64_t errors = 0;       ///< all that were met, also those that were not kept
  std::uint64_t warnings = 0;
  std::uint64_t infos = 0;
  [[nodiscard]] bool valid() const { return errors == 0; }
};

/// Reads the whole source once, from front to back, and decodes everything in it. Goes on after
/// damage as far as anything can be said. Memory is bounded by the limits of the format for one
/// segment and the static part. Errors: the source's (kIo, kCancelled), kOutOfMemory; a bad file is
/// none.
[[nodiscard]] Result<ValidationReport> validate(std::unique_ptr<container::ByteSource> source,
                                                const ValidationOptions& options = {});

}  // namespace relit::player
