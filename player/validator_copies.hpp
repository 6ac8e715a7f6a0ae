// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "container/framing.hpp"
#include "player/validator_findings.hpp"

/// Copies of records against their originals. Remembers lengths and hashes, not the records.
namespace relit::player {

class CopyChecker {
 public:
  explicit CopyChecker(FindingLog& log) : log_(log) {}

  /// An original that may be repeated; no payload: it is damaged.
  void original(const container::RecordHeader& header,
                std::optional<std::span<const std::uint8_t>> payload);
  void copy(const FindingPlace& place, const container::RecordHeader& header,
            std::optional<std::span<const std::uint8_t>> payload);
  /// A segment: copies before it are not those behind the last one.
  void segment();
  /// Records were lost, originals or copies.
  void note_loss() { lost_ = true; }
  [[nodiscard]] bool lost() const { return lost_; }
  /// Of the first copy of a static record behind the last segment; 0: there is none.
  [[nodiscard]] std::uint64_t offset_bytes() const { return offset_; }
  /// At the end of a complete file.
  void finish(const FindingPlace& end);

 private:
  struct Original {
    container::RecordType type{};
    std::uint64_t payload_bytes = 0;
    std::uint32_t payload_crc = 0;
    std::optional<std::size_t> hash;  ///< CRCs are easily made equal; nothing: damaged
  };
  static Original describe(const container::RecordHeader& header,
                           std::optional<std::span<const std::uint8_t>> payload);
  static bool same(const Original& a, const Original& b);

  FindingLog& log_;
  std::vector<Original> originals_;
  std::vector<Original> tail_;  ///< static copies behind the last segment
  std::uint64_t offset_ = 0;
  bool lost_ = false;
};

}  // namespace relit::player
