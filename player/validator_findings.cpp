// SPDX-License-Identifier: MIT
#include "player/validator_findings.hpp"

#include <cassert>
#include <utility>

namespace relit::player {

std::string_view severity_name(Severity severity) {
  switch (severity) {
    case Severity::kError:
      return "error";
    case Severity::kWarning:
      return "warning";
    case Severity::kInfo:
      return "info";
  }
  return "error";
}

std::span<const FindingKind> finding_kinds() { return kFindingKinds; }

FindingId::FindingId(std::string_view prefix, std::string_view suffix)
    : kind_(find(std::string(prefix) + "_" + std::string(suffix))) {
  // Every known record has CORRUPT; a parser that takes up another error code needs a new entry.
  if (kind_ == nullptr) kind_ = find(std::string(prefix) + "_CORRUPT");
  assert(kind_ != nullptr);
}

void FindingLog::add(FindingId id, const FindingPlace& place, std::string message) {
  const FindingKind* kind = id.kind();
  switch (kind->severity) {
    case Severity::kError:
      ++report_.errors;
      break;
    case Severity::kWarning:
      ++report_.warnings;
      break;
    case Severity::kInfo:
      ++report_.infos;
      break;
  }
  const auto number = static_cast<std::size_t>(kind - kFindingKinds);
  if (++counts_[number] > per_kind_) return;
  const bool has_record = place.type != container::RecordType{};
  report_.findings.push_back({kind, place.offset_bytes,
                              has_record ? container::type_name(place.type) : std::string(),
                              std::move(message)});
}

void FindingLog::add_parse_error(const FindingPlace& place, const Error& error) {
  const char* suffix = error.code == ErrorCode::kLimit         ? "LIMIT"
                       : error.code == ErrorCode::kUnsupported ? "UNSUPPORTED"
                                                               : "CORRUPT";
  add(FindingId(container::type_name(place.type), suffix), place, error.message);
}

}  // namespace relit::player
