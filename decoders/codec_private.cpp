// SPDX-License-Identifier: MIT
#include "decoders/codec_private.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "decoders/nal_units.hpp"
#include "decoders/sequence_header.hpp"

namespace relit::decoders {
namespace {

constexpr unsigned kSequenceHeaderObu = 1;
constexpr unsigned kTemporalDelimiterObu = 2;
constexpr std::size_t kAv1Header = 4;

Unexpected corrupt(const std::string& what) { return fail(ErrorCode::kCorrupt, what); }

/// An open bitstream unit of AV1, 5.3.
struct Obu {
  unsigned type = 0;
  std::span<const std::uint8_t> header;  ///< one byte, or two with an extension
  bool has_size = false;
  std::span<const std::uint8_t> payload;
};

/// Takes the first OBU off the front of `bytes`, which are not empty.
Result<Obu> take_obu(std::span<const std::uint8_t>& bytes) {
  Obu obu;
  obu.type = (bytes[0] >> 3) & 15u;
  obu.has_size = (bytes[0] & 2u) != 0;
  const std::size_t header = (bytes[0] & 4u) != 0 ? 2 : 1;
  if ((bytes[0] & 0x80u) != 0 || bytes.size() < header) return corrupt("not an AV1 OBU");
  obu.header = bytes.first(header);
  bytes = bytes.subspan(header);
  std::uint64_t size = bytes.size();
  if (obu.has_size) {
    size = 0;
    std::size_t i = 0;
    for (bool more = true; more; ++i) {
      if (i == 8 || i == bytes.size()) return corrupt("the size of an AV1 OBU does not end");
      size |= std::uint64_t{bytes[i] & 0x7fu} << (7 * i);
      more = (bytes[i] & 0x80u) != 0;
    }
    bytes = bytes.subspan(i);
  }
  if (size > bytes.size()) return corrupt("an AV1 OBU reaches beyond its packet");
  obu.payload = bytes.first(static_cast<std::size_t>(size));
  bytes = bytes.subspan(static_cast<std::size_t>(size));
  return obu;
}

Result<std::vector<Obu>> split_obus(std::span<const std::uint8_t> bytes) {
  std::vector<Obu> obus;
  while (!bytes.empty()) {
    RELIT_ASSIGN(const Obu obu, take_obu(bytes));
    obus.push_back(obu);
  }
  return obus;
}

void append_obu(const Obu& obu, Bytes& out) {
  out.push_back(obu.header[0] | 2u);
  out.insert(out.end(), obu.header.begin() + 1, obu.header.end());
  std::size_t rest = obu.payload.size();
  do {
    out.push_back(static_cast<std::uint8_t>((rest & 0x7f) | (rest > 0x7f ? 0x80 : 0)));
    rest >>= 7;
  } while (rest > 0);
  out.insert(out.end(), obu.payload.begin(), obu.payload.end());
}

Result<Bytes> make_av1c(std::span<const std::uint8_t> extradata) {
  RELIT_ASSIGN(const std::vector<Obu> obus, split_obus(extradata));
  const auto header = std::find_if(obus.begin(), obus.end(),
                                   [](const Obu& o) { return o.type == kSequenceHeaderObu; });
  if (header == obus.end()) return corrupt("there is no AV1 sequence header");
  RELIT_ASSIGN(const auto configuration, av1_configuration(header->payload));
  Bytes record(configuration.begin(), configuration.end());
  append_obu(*header, record);
  return record;
}

Status check_av1c(std::span<const std::uint8_t> record) {
  if (record.size() <= kAv1Header || record[0] != 0x81) {
    return corrupt("it is no AV1CodecConfigurationRecord of version 1");
  }
  RELIT_ASSIGN(const std::vector<Obu> obus, split_obus(record.subspan(kAv1Header)));
  if (obus.front().type != kSequenceHeaderObu) {
    return corrupt("the AV1CodecConfigurationRecord has no sequence header");
  }
  return av1_configuration(obus.front().payload).has_value()
             ? Status{}
             : corrupt("the AV1 sequence header ends early");
}

bool is_remark_or_parameters(UnitKind kind) {
  return kind != UnitKind::kSlice && kind != UnitKind::kOther;
}

Result<Bytes> packet_of_units(std::string_view codec, std::span<const std::uint8_t> packet) {
  const NalSyntax syntax(codec);
  Bytes stored;
  bool picture = false;
  for (const Unit unit : split_annex_b(packet)) {
    if (unit.size() < syntax.header_bytes()) return corrupt("a NAL unit shorter than its header");
    const UnitKind kind = syntax.kind(unit);
    if (is_remark_or_parameters(kind)) continue;
    picture = picture || kind == UnitKind::kSlice;
    for (int shift = 24; shift >= 0; shift -= 8) {
      stored.push_back(static_cast<std::uint8_t>(unit.size() >> shift));
    }
    stored.insert(stored.end(), unit.begin(), unit.end());
  }
  if (!picture) return corrupt("the packet has no slice after a start code");
  return stored;
}

Result<Bytes> packet_of_obus(std::span<const std::uint8_t> packet) {
  RELIT_ASSIGN(const std::vector<Obu> obus, split_obus(packet));
  Bytes stored;
  for (const Obu& obu : obus) {
    if (obu.type != kTemporalDelimiterObu) append_obu(obu, stored);
  }
  if (stored.empty()) return corrupt("the packet has no OBU but delimiters");
  return stored;
}

Result<std::vector<Unit>> parameter_sets(std::string_view codec,
                                         std::span<const std::uint8_t> codec_private) {
  return codec == "hevc" ? split_hvcc(codec_private) : split_avcc(codec_private);
}

/// The most that any of the stream's parameter sets asks for.
Result<std::uint8_t> pictures_of_sets(std::string_view codec,
                                      std::span<const std::uint8_t> codec_private) {
  RELIT_ASSIGN(const std::vector<Unit> units, parameter_sets(codec, codec_private));
  const NalSyntax syntax(codec);
  std::uint8_t most = 1;
  for (const Unit unit : units) {
    if (syntax.kind(unit) != UnitKind::kSequenceParameters) continue;
    RELIT_ASSIGN(const SequenceHeader header,
                 codec == "hevc" ? parse_hevc_sps(unit) : parse_h264_sps(unit));
    most = std::max(most, header.pictures);
  }
  return most;
}

}  // namespace

Result<Bytes> stored_private(std::string_view codec, std::span<const std::uint8_t> extradata) {
  if (codec == "vp9") return Bytes{};
  const bool units = NalSyntax::knows(codec);
  // Start codes begin with a zero, OBUs with a clear bit; configuration records do not.
  const bool raw = !extradata.empty() && (units ? extradata[0] == 0 : extradata[0] < 0x80);
  if (raw && codec == "av1") return make_av1c(extradata);
  if (raw && units) {
    const std::vector<Unit> sets = split_annex_b(extradata);
    return codec == "hevc" ? make_hvcc(sets) : make_avcc(sets);
  }
  if (codec == "hevc") {
    // Others say of the arrays that more may follow in the packets.
    RELIT_ASSIGN(const std::vector<Unit> sets, split_hvcc(extradata));
    return make_hvcc(sets);
  }
  RELIT_TRY(check_private(codec, extradata));
  return Bytes(extradata.begin(), extradata.end());
}

Result<Bytes> stored_packet(std::string_view codec, std::span<const std::uint8_t> packet) {
  if (packet.empty()) return corrupt("an empty packet");
  if (NalSyntax::knows(codec)) return packet_of_units(codec, packet);
  if (codec == "av1") return packet_of_obus(packet);
  return Bytes(packet.begin(), packet.end());
}

Status check_private(std::string_view codec, std::span<const std::uint8_t> codec_private) {
  if (NalSyntax::knows(codec)) {
    RELIT_TRY(parameter_sets(codec, codec_private));
  } else if (codec == "av1") {
    RELIT_TRY(check_av1c(codec_private));
  } else if (codec == "vp9" && !codec_private.empty()) {
    return corrupt("vp9 has none, here are " + std::to_string(codec_private.size()) + " bytes");
  } else if ((codec == "ffv1" || codec == "mpeg4") && codec_private.empty()) {
    return corrupt(std::string(codec) + " needs its headers, here are none");
  }
  return {};
}

Status check_packet(std::string_view codec, std::span<const std::uint8_t> packet) {
  if (packet.empty()) return corrupt("an empty packet");
  if (NalSyntax::knows(codec)) {
    const NalSyntax syntax(codec);
    for (std::size_t at = 0; at < packet.size();) {
      RELIT_ASSIGN(const Unit unit, unit_at(syntax, packet, at));
      at = behind(unit, at);
      const UnitKind kind = syntax.kind(unit);
      if (kind != UnitKind::kRemark && is_remark_or_parameters(kind)) {
        return corrupt("parameter sets inside a packet; they belong into codec_private");
      }
    }
  } else if (codec == "av1") {
    // One by one: a list of them could take many times the packet's bytes.
    for (auto rest = packet; !rest.empty();) {
      RELIT_ASSIGN(const Obu obu, take_obu(rest));
      if (!obu.has_size) return corrupt("an AV1 OBU without a size");
      if (obu.type == kTemporalDelimiterObu) return corrupt("a temporal delimiter in a packet");
    }
  }
  return {};
}

Result<std::uint8_t> decoder_pictures(std::string_view codec,
                                      std::span<const std::uint8_t> codec_private) {
  if (NalSyntax::knows(codec)) return pictures_of_sets(codec, codec_private);
  struct Known {
    std::string_view codec;
    std::uint8_t pictures;
  };
  // mpeg4: two that B-VOPs lie between; vp9, av1: eight slots. And the one being decoded.
  constexpr std::array<Known, 4> kKnown = {{{"mpeg4", 3}, {"ffv1", 1}, {"vp9", 9}, {"av1", 9}}};
  for (const Known& known : kKnown) {
    if (known.codec == codec) return known.pictures;
  }
  return fail(ErrorCode::kUnsupported,
              "how many pictures a decoder of " + std::string(codec) + " holds is not known");
}

}  // namespace relit::decoders
