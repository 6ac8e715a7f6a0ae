// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "container/reader.hpp"
#include "container/record_scan.hpp"

/// The first half of recover(): what can be found in a damaged file, and its static part.
namespace relit::player {

/// What one walk through a damaged file finds. Holds no payloads but those of small records.
struct Survey {
  std::vector<container::FoundRecord> originals;  ///< static records, by offset
  std::vector<container::FoundRecord> copies;     ///< likewise, without repetitions
  std::vector<container::FoundRecord> others;     ///< unknown records before the segments
  std::optional<container::IndexRecord> index;
  /// Tracks in the order of declaration, by clip, as its first intact segment lists them.
  std::map<std::uint32_t, std::vector<std::uint32_t>> tracks;
  std::optional<std::uint64_t> static_end;  ///< offset of the first segment
  std::uint64_t end_bytes = 0;  ///< where the file ends: at its end record, if it has one
  bool finished = false;        ///< with an end record
  std::uint64_t damaged_bytes = 0;
};

/// Walks through the file. Errors: the scan's, kUnsupported for critical records of a later
/// version, kLimit for more static records than a file may have.
Result<Survey> survey(container::RecordScan& scan);

/// The static part as far as it is left.
struct StaticPart {
  container::FileContents contents;
  std::vector<std::string> repaired;
  std::vector<std::string> lost;
};

/// Puts the static part together from originals and copies, and drops what depends on what is
/// missing: a lost image costs the texture, a lost material the colour, a lost skeleton what has
/// joints, a lost pose its clip, a lost first layer its model. Errors: the scan's; kUnsupported for
/// a header of another version, kCorrupt when no clip is left.
Result<StaticPart> recover_static(container::RecordScan& scan, const Survey& found);

}  // namespace relit::player
