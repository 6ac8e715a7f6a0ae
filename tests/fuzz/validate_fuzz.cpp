// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdint>
#include <memory>
#include <string_view>
#include <utility>

#include "container/byte_sink.hpp"
#include "player/recover.hpp"
#include "player/validator.hpp"
#include "tests/fuzz/file_mutator.hpp"
#include "tests/fuzz/playing.hpp"

/// Hostile files, validated: the first byte says whether everything is decoded, or whether the file
/// is recovered before, the rest is the file. Bad files are no error but findings, each of a known
/// kind, with a sentence, inside the file; what is found valid is not called damaged when played;
/// and what recover() writes has errors only inside payloads, which it copies as they are.

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

/// Whether a finding is about what a payload holds, behind a checksum that was right.
bool is_about_contents(const player::Finding& finding) {
  const std::string_view id = finding.kind->id;
  return id.starts_with("DECODE_") || id.starts_with("VIDEO_") || id == "MODL_UNSUPPORTED" ||
         id == "CHNK_POSE_PACKETS";
}

void recover_file(Input file) {
  container::MemorySource source(file);
  container::MemorySink sink;
  const auto recovered = player::recover(source, sink);
  if (!check(recovered)) return;
  const Bytes whole = sink.take();
  player::ValidationOptions options;
  options.decode = false;
  const auto report =
      player::validate(std::make_unique<container::MemorySource>(Input(whole)), options);
  require(report.has_value());
  check_report(*report, whole.size());
  for (const player::Finding& finding : report->findings)
    require(finding.kind->severity != player::Severity::kError || is_about_contents(finding));
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  return mutate_file(data, size, max_size, seed, 1);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Cursor input({data, size});
  player::ValidationOptions options;
  const unsigned how = input.u8();
  options.decode = (how & 1) != 0;
  const Input file = input.rest();
  if ((how & 2) != 0) {
    recover_file(file);
    return 0;
  }
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
