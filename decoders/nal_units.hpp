// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "container/base/result.hpp"

/// The units that H.264 and HEVC streams consist of, and the decoder configuration records of
/// ISO/IEC 14496-15.
namespace relit::decoders {

using Unit = std::span<const std::uint8_t>;

enum class UnitKind : std::uint8_t {
  kSlice,
  kVideoParameters,
  kSequenceParameters,
  kPictureParameters,
  kExtension,  ///< parameter sets of scalable and multiview streams
  kRemark,     ///< delimiters, supplemental information, filler: nothing that samples depend on
  kOther,
};

/// The kinds of units of "h264" or "hevc".
class NalSyntax {
 public:
  /// Whether `codec` is made of NAL units at all.
  [[nodiscard]] static bool knows(std::string_view codec) {
    return codec == "h264" || codec == "hevc";
  }
  explicit NalSyntax(std::string_view codec) : hevc_(codec == "hevc") {}

  [[nodiscard]] std::size_t header_bytes() const { return hevc_ ? 2 : 1; }
  /// Requires unit.size() >= header_bytes().
  [[nodiscard]] UnitKind kind(Unit unit) const;

 private:
  bool hevc_;
};

/// Splits a byte stream (Annex B) at its start codes, which are left out with the zeros around
/// them. Bytes before the first start code count as nothing.
[[nodiscard]] std::vector<Unit> split_annex_b(std::span<const std::uint8_t> stream);

/// Splits a stored packet. Errors: kCorrupt where a length leads out of the packet or a unit is
/// shorter than its header.
[[nodiscard]] Result<std::vector<Unit>> split_lengths(const NalSyntax& syntax,
                                                      std::span<const std::uint8_t> packet);

/// The unit of a stored packet that begins at byte `at`. Errors: as split_lengths().
[[nodiscard]] Result<Unit> unit_at(const NalSyntax& syntax, std::span<const std::uint8_t> packet,
                                   std::size_t at);
/// Where the unit behind one that begins at `at` does.
[[nodiscard]] std::size_t behind(const Unit& unit, std::size_t at);

/// Parameter sets -> the record, with lengths of 4 bytes. Errors: kCorrupt where a kind is missing,
/// more numerous or longer than the record can say, or does not parse.
[[nodiscard]] Result<std::vector<std::uint8_t>> make_avcc(std::span<const Unit> units);
[[nodiscard]] Result<std::vector<std::uint8_t>> make_hvcc(std::span<const Unit> units);

/// The parameter sets of a record. Errors: kCorrupt: not version 1, lengths of other than 4 bytes,
/// lists that end early, a kind that is missing or out of place.
[[nodiscard]] Result<std::vector<Unit>> split_avcc(std::span<const std::uint8_t> record);
[[nodiscard]] Result<std::vector<Unit>> split_hvcc(std::span<const std::uint8_t> record);

}  // namespace relit::decoders
