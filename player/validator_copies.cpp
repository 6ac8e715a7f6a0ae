// SPDX-License-Identifier: MIT
#include "player/validator_copies.hpp"

#include <algorithm>
#include <functional>
#include <string_view>

namespace relit::player {

using namespace container;

CopyChecker::Original CopyChecker::describe(const RecordHeader& header,
                                            std::optional<std::span<const std::uint8_t>> payload) {
  Original described{header.type, header.payload_bytes, header.payload_crc, {}};
  if (payload)
    described.hash = std::hash<std::string_view>{}(
        {reinterpret_cast<const char*>(payload->data()), payload->size()});
  return described;
}

bool CopyChecker::same(const Original& a, const Original& b) {
  return a.type == b.type && a.payload_bytes == b.payload_bytes && a.payload_crc == b.payload_crc &&
         (!a.hash || !b.hash || *a.hash == *b.hash);
}

void CopyChecker::original(const RecordHeader& header,
                           std::optional<std::span<const std::uint8_t>> payload) {
  originals_.push_back(describe(header, payload));
}

void CopyChecker::copy(const FindingPlace& place, const RecordHeader& header,
                       std::optional<std::span<const std::uint8_t>> payload) {
  const Original described = describe(header, payload);
  const bool is_index = header.type == types::kIndex;
  if (!is_index && tail_.empty()) offset_ = place.offset_bytes;
  if (!is_index) tail_.push_back(described);
  const auto of_type = [&](const Original& o) { return o.type == header.type; };
  const auto equal = [&](const Original& o) { return same(o, described); };
  if (lost_ || std::ranges::any_of(originals_, equal)) return;
  if (std::ranges::any_of(originals_, of_type))
    log_.add("COPY_DIFFERENT", place,
             "the copy is not identical to any '" + type_name(header.type) + "' before it");
  else
    log_.add("COPY_WITHOUT_ORIGINAL", place,
             "no '" + type_name(header.type) + "' stands before its copy");
}

void CopyChecker::segment() {
  tail_.clear();
  offset_ = 0;
}

void CopyChecker::finish(const FindingPlace& end) {
  if (lost_) return;
  if (tail_.empty()) {
    log_.add("COPY_MISSING", end, "no static record is stored a second time behind the segments");
    return;
  }
  std::vector<Original> statics;
  std::ranges::copy_if(originals_, std::back_inserter(statics),
                       [](const Original& o) { return o.type != types::kIndex; });
  if (!std::ranges::equal(statics, tail_, same))
    log_.add("COPY_ORDER", {offset_},
             "there are " + std::to_string(tail_.size()) + " copies of " +
                 std::to_string(statics.size()) + " static records, or their order is another");
}

}  // namespace relit::player
