// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>

#include "player/validator.hpp"
#include "tests/fuzz/file_mutator.hpp"
#include "tests/fuzz/playing.hpp"

/// Hostile files, validated: the first byte says whether everything is decoded, the rest is the
/// file. Bad files are no error but findings, each of a known kind, with a sentence, inside the
/// file; and what is found valid is not called damaged when played.

using namespace relit;
using namespace relit::fuzz;

namespace {

void check_report(const player::ValidationReport& report, std::uint64_t file_bytes) {
  const auto kinds = player::finding_kinds();
  std::uint64_t errors = 0;
  for (const player::Finding& finding : report.findings) {
    require(finding.kind != nullptr && !finding.message.empty());
    require(finding.kind >= kinds.data() && finding.kind < kinds.data() + kinds.size());
    require(finding.offset_bytes <= file_bytes);
    if (finding.kind->severity == player::Severity::kError) ++errors;
  }
  require(errors <= report.errors && (errors > 0) == (report.errors > 0));
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  return mutate_file(data, size, max_size, seed, 1);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Cursor input({data, size});
  player::ValidationOptions options;
  options.decode = (input.u8() & 1) != 0;
  const Input file = input.rest();
  if (!quick_to_play(file)) return 0;
  const auto report = player::validate(std::make_unique<container::MemorySource>(file), options);
  require(report.has_value());
  check_report(*report, file.size());
  if (!options.decode || !report->valid() || report->warnings != 0) return 0;
  // A valid file may have nothing to play, but nothing in it is damaged.
  const Status played = play(file, {});
  require(played || played.error().code == ErrorCode::kNotFound ||
          played.error().code == ErrorCode::kUnsupported);
  return 0;
}
