// SPDX-License-Identifier: MIT
#include "decoders/nal_units.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "decoders/sequence_header.hpp"

namespace relit::decoders {
namespace {

constexpr std::size_t kLengthBytes = 4;
constexpr std::size_t kAvccHeader = 5;
constexpr std::size_t kHvccHeader = 22;

UnitKind h264_kind(unsigned type) {
  if (type >= 1 && type <= 5) return UnitKind::kSlice;
  switch (type) {
    case 6:
    case 9:
    case 12:
      return UnitKind::kRemark;
    case 7:
      return UnitKind::kSequenceParameters;
    case 8:
      return UnitKind::kPictureParameters;
    case 13:
    case 15:
      return UnitKind::kExtension;
    default:
      return UnitKind::kOther;
  }
}

UnitKind hevc_kind(unsigned type) {
  if (type < 32) return UnitKind::kSlice;
  switch (type) {
    case 32:
      return UnitKind::kVideoParameters;
    case 33:
      return UnitKind::kSequenceParameters;
    case 34:
      return UnitKind::kPictureParameters;
    case 35:
    case 38:
    case 39:
    case 40:
      return UnitKind::kRemark;
    default:
      return UnitKind::kOther;
  }
}

Unexpected corrupt(const std::string& what) { return fail(ErrorCode::kCorrupt, what); }

/// Reads a record whose lists tell their own lengths.
class RecordReader {
 public:
  explicit RecordReader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}
  std::size_t number(std::size_t bytes) {
    std::size_t value = 0;
    for (const std::uint8_t byte : take(bytes)) value = (value << 8) | byte;
    return value;
  }
  Unit take(std::size_t bytes) {
    if (bytes > rest_.size()) failed_ = true;
    if (failed_) return {};
    const Unit taken = rest_.first(bytes);
    rest_ = rest_.subspan(bytes);
    return taken;
  }
  [[nodiscard]] bool failed() const { return failed_; }

 private:
  std::span<const std::uint8_t> rest_;
  bool failed_ = false;
};

/// `count` units with lengths of two bytes, all of one kind.
Status read_units(RecordReader& r, std::size_t count, const NalSyntax& syntax, UnitKind kind,
                  std::vector<Unit>& out) {
  for (std::size_t i = 0; i < count; ++i) {
    const Unit unit = r.take(r.number(2));
    if (r.failed() || unit.size() <= syntax.header_bytes()) {
      return corrupt("a parameter set of the configuration record ends early");
    }
    if (syntax.kind(unit) != kind) {
      return corrupt("a unit in the configuration record stands in the list of another kind");
    }
    out.push_back(unit);
  }
  return {};
}

std::vector<Unit> of_kind(std::span<const Unit> units, const NalSyntax& syntax, UnitKind kind) {
  std::vector<Unit> found;
  std::copy_if(units.begin(), units.end(), std::back_inserter(found), [&](Unit unit) {
    return unit.size() > syntax.header_bytes() && syntax.kind(unit) == kind;
  });
  return found;
}

Status check_list(std::span<const Unit> units, const char* name, std::size_t most) {
  if (units.empty() || units.size() > most) {
    return corrupt("the stream has " + std::to_string(units.size()) + " " + name +
                   " parameter sets, 1 to " + std::to_string(most) + " can be stored");
  }
  for (const Unit unit : units) {
    if (unit.size() > 0xffff) return corrupt(std::string(name) + " parameter set beyond 64 KiB");
  }
  return {};
}

void append_units(std::span<const Unit> units, std::vector<std::uint8_t>& record) {
  for (const Unit unit : units) {
    record.push_back(static_cast<std::uint8_t>(unit.size() >> 8));
    record.push_back(static_cast<std::uint8_t>(unit.size()));
    record.insert(record.end(), unit.begin(), unit.end());
  }
}

struct HevcList {
  UnitKind kind;
  std::uint8_t type;
  const char* name;
};
constexpr std::array<HevcList, 3> kHevcLists = {{{UnitKind::kVideoParameters, 32, "video"},
                                                 {UnitKind::kSequenceParameters, 33, "sequence"},
                                                 {UnitKind::kPictureParameters, 34, "picture"}}};

}  // namespace

UnitKind NalSyntax::kind(Unit unit) const {
  return hevc_ ? hevc_kind((unit[0] >> 1) & 63u) : h264_kind(unit[0] & 31u);
}

std::vector<Unit> split_annex_b(std::span<const std::uint8_t> stream) {
  constexpr std::array<std::uint8_t, 3> kStart = {0, 0, 1};
  const auto find = [&](std::size_t from) {
    const auto at = std::search(stream.begin() + static_cast<std::ptrdiff_t>(from), stream.end(),
                                kStart.begin(), kStart.end());
    return static_cast<std::size_t>(at - stream.begin());
  };
  std::vector<Unit> units;
  for (std::size_t at = find(0); at < stream.size();) {
    const std::size_t begin = at + kStart.size();
    at = find(begin);
    // A unit never ends in a zero: those belong to the next start code, or are padding.
    std::size_t end = at;
    while (end > begin && stream[end - 1] == 0) --end;
    if (end > begin) units.push_back(stream.subspan(begin, end - begin));
  }
  return units;
}

Result<std::vector<Unit>> split_lengths(const NalSyntax& syntax,
                                        std::span<const std::uint8_t> packet) {
  std::vector<Unit> units;
  for (std::size_t at = 0; at < packet.size();) {
    RELIT_ASSIGN(const Unit unit, unit_at(syntax, packet, at));
    units.push_back(unit);
    at = behind(unit, at);
  }
  return units;
}

Result<Unit> unit_at(const NalSyntax& syntax, std::span<const std::uint8_t> packet,
                     std::size_t at) {
  RecordReader r(packet.subspan(at));
  const Unit unit = r.take(r.number(kLengthBytes));
  if (r.failed() || unit.size() < syntax.header_bytes()) {
    return corrupt("the NAL unit at byte " + std::to_string(at) +
                   " of the packet has no length of 4 bytes that fits");
  }
  return unit;
}

std::size_t behind(const Unit& unit, std::size_t at) { return at + kLengthBytes + unit.size(); }

Result<std::vector<std::uint8_t>> make_avcc(std::span<const Unit> units) {
  const NalSyntax syntax("h264");
  const std::vector<Unit> sequence = of_kind(units, syntax, UnitKind::kSequenceParameters);
  const std::vector<Unit> picture = of_kind(units, syntax, UnitKind::kPictureParameters);
  RELIT_TRY(check_list(sequence, "sequence", 31));
  RELIT_TRY(check_list(picture, "picture", 255));
  const Unit first = sequence.front();
  RELIT_ASSIGN(const SequenceHeader header, parse_h264_sps(first));
  std::vector<std::uint8_t> record = {1, first[1], first[2], first[3], 0xfc | (kLengthBytes - 1)};
  record.push_back(static_cast<std::uint8_t>(0xe0 | sequence.size()));
  append_units(sequence, record);
  record.push_back(static_cast<std::uint8_t>(picture.size()));
  append_units(picture, record);
  // Baseline, Main and Extended have nothing to say here.
  if (first[1] == 66 || first[1] == 77 || first[1] == 88) return record;
  record.push_back(static_cast<std::uint8_t>(0xfc | header.chroma_format));
  record.push_back(static_cast<std::uint8_t>(0xf8 | (header.luma_bits - 8)));
  record.push_back(static_cast<std::uint8_t>(0xf8 | (header.chroma_bits - 8)));
  record.push_back(0);
  return record;
}

Result<std::vector<std::uint8_t>> make_hvcc(std::span<const Unit> units) {
  const NalSyntax syntax("hevc");
  std::vector<std::uint8_t> lists;
  for (const HevcList& list : kHevcLists) {
    const std::vector<Unit> found = of_kind(units, syntax, list.kind);
    RELIT_TRY(check_list(found, list.name, 0xffff));
    lists.push_back(static_cast<std::uint8_t>(0x80 | list.type));
    lists.push_back(static_cast<std::uint8_t>(found.size() >> 8));
    lists.push_back(static_cast<std::uint8_t>(found.size()));
    append_units(found, lists);
  }
  RELIT_ASSIGN(const SequenceHeader header,
               parse_hevc_sps(of_kind(units, syntax, UnitKind::kSequenceParameters).front()));
  std::vector<std::uint8_t> record = {1};
  record.insert(record.end(), header.profile_tier_level.begin(), header.profile_tier_level.end());
  // Segmentation, parallelism and frame rate are not told: 0.
  record.insert(record.end(), {0xf0, 0, 0xfc});
  record.push_back(static_cast<std::uint8_t>(0xfc | header.chroma_format));
  record.push_back(static_cast<std::uint8_t>(0xf8 | (header.luma_bits - 8)));
  record.push_back(static_cast<std::uint8_t>(0xf8 | (header.chroma_bits - 8)));
  record.insert(record.end(), {0, 0});
  record.push_back(static_cast<std::uint8_t>((header.temporal_layers << 3) |
                                             (header.temporal_nesting ? 4 : 0) |
                                             static_cast<int>(kLengthBytes - 1)));
  record.push_back(static_cast<std::uint8_t>(kHevcLists.size()));
  record.insert(record.end(), lists.begin(), lists.end());
  return record;
}

Result<std::vector<Unit>> split_avcc(std::span<const std::uint8_t> record) {
  const NalSyntax syntax("h264");
  RecordReader r(record);
  const Unit header = r.take(kAvccHeader);
  const std::size_t sequences = r.number(1) & 31u;
  if (r.failed() || header[0] != 1 || (header[4] & 3u) != kLengthBytes - 1) {
    return corrupt("it is no AVCDecoderConfigurationRecord with lengths of 4 bytes");
  }
  std::vector<Unit> units;
  RELIT_TRY(read_units(r, sequences, syntax, UnitKind::kSequenceParameters, units));
  const std::size_t pictures = r.number(1);
  RELIT_TRY(read_units(r, pictures, syntax, UnitKind::kPictureParameters, units));
  if (r.failed() || sequences == 0 || pictures == 0) {
    return corrupt("the AVCDecoderConfigurationRecord lacks parameter sets");
  }
  return units;
}

Result<std::vector<Unit>> split_hvcc(std::span<const std::uint8_t> record) {
  const NalSyntax syntax("hevc");
  RecordReader r(record);
  const Unit header = r.take(kHvccHeader);
  const std::size_t lists = r.number(1);
  if (r.failed() || header[0] != 1 || (header[21] & 3u) != kLengthBytes - 1) {
    return corrupt("it is no HEVCDecoderConfigurationRecord with lengths of 4 bytes");
  }
  std::vector<Unit> units;
  for (std::size_t i = 0; i < lists; ++i) {
    const std::array<std::uint8_t, 2> unit_header = {
        static_cast<std::uint8_t>((r.number(1) & 63u) << 1), 0};
    RELIT_TRY(read_units(r, r.number(2), syntax, syntax.kind(unit_header), units));
  }
  for (const HevcList& list : kHevcLists) {
    if (of_kind(units, syntax, list.kind).empty()) {
      return corrupt(std::string("the HEVCDecoderConfigurationRecord lacks ") + list.name +
                     " parameter sets");
    }
  }
  if (r.failed()) return corrupt("the HEVCDecoderConfigurationRecord ends early");
  return units;
}

}  // namespace relit::decoders
