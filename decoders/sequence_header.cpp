// SPDX-License-Identifier: MIT
#include "decoders/sequence_header.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include "decoders/bit_reader.hpp"

namespace relit::decoders {
namespace {

/// A NAL unit's payload without the 3 that keeps start codes from appearing in it.
std::vector<std::uint8_t> without_emulation_prevention(std::span<const std::uint8_t> unit) {
  std::vector<std::uint8_t> payload;
  int zeros = 0;
  for (const std::uint8_t byte : unit) {
    if (zeros >= 2 && byte == 3) {
      zeros = 0;
      continue;
    }
    zeros = byte == 0 ? zeros + 1 : 0;
    payload.push_back(byte);
  }
  return payload;
}

Unexpected corrupt(const char* header, const std::string& what) {
  return fail(ErrorCode::kCorrupt, std::string(header) + ": " + what);
}

void skip_scaling_list(BitReader& r, int size) {
  std::int64_t last = 8, next = 8;
  for (int i = 0; i < size && !r.failed(); ++i) {
    if (next != 0) next = (last + r.signed_golomb() + 256) % 256;
    if (next != 0) last = next;
  }
}

bool has_chroma_fields(std::uint32_t profile) {
  constexpr std::array<std::uint32_t, 13> kProfiles = {100, 110, 122, 244, 44,  83, 86,
                                                       118, 128, 138, 139, 134, 135};
  return std::find(kProfiles.begin(), kProfiles.end(), profile) != kProfiles.end();
}

void read_chroma_fields(BitReader& r, SequenceHeader& header) {
  header.chroma_format = static_cast<std::uint8_t>(std::min(r.golomb(), 255u));
  if (header.chroma_format == 3) r.skip(1);  // separate_colour_plane_flag
  header.luma_bits = static_cast<std::uint8_t>(8 + std::min(r.golomb(), 16u));
  header.chroma_bits = static_cast<std::uint8_t>(8 + std::min(r.golomb(), 16u));
  r.skip(1);  // qpprime_y_zero_transform_bypass_flag
  if (!r.flag()) return;
  const int lists = header.chroma_format == 3 ? 12 : 8;
  for (int i = 0; i < lists; ++i) {
    if (r.flag()) skip_scaling_list(r, i < 6 ? 16 : 64);
  }
}

void skip_picture_order(BitReader& r) {
  r.golomb();  // log2_max_frame_num_minus4
  const std::uint32_t type = r.golomb();
  if (type == 0) r.golomb();
  if (type != 1) return;
  r.skip(1);
  r.signed_golomb();
  r.signed_golomb();
  const std::uint32_t cycle = r.golomb();
  for (std::uint32_t i = 0; i < cycle && !r.failed(); ++i) r.signed_golomb();
}

void skip_hrd(BitReader& r) {
  const std::uint32_t count = r.golomb();
  r.skip(8);
  for (std::uint32_t i = 0; i <= count && !r.failed(); ++i) {
    r.golomb();
    r.golomb();
    r.skip(1);
  }
  r.skip(20);
}

/// Reads the VUI up to max_dec_frame_buffering; -1 where it does not say.
std::int64_t read_frame_buffering(BitReader& r) {
  constexpr std::uint32_t kExtendedAspect = 255;
  if (r.flag() && r.bits(8) == kExtendedAspect) r.skip(32);
  if (r.flag()) r.skip(1);  // overscan
  if (r.flag()) {           // video signal type
    r.skip(4);
    if (r.flag()) r.skip(24);
  }
  if (r.flag()) {  // chroma location
    r.golomb();
    r.golomb();
  }
  if (r.flag()) {  // timing: two numbers and a flag
    r.skip(32);
    r.skip(32);
    r.skip(1);
  }
  const bool nal_hrd = r.flag();
  if (nal_hrd) skip_hrd(r);
  const bool vcl_hrd = r.flag();
  if (vcl_hrd) skip_hrd(r);
  if (nal_hrd || vcl_hrd) r.skip(1);
  r.skip(1);  // pic_struct_present_flag
  if (!r.flag()) return -1;
  r.skip(1);
  for (int i = 0; i < 4; ++i) r.golomb();
  r.golomb();  // max_num_reorder_frames
  return r.golomb();
}

/// Table A-1: the picture buffer in macroblocks.
std::uint64_t buffer_macroblocks(int level) {
  struct Buffer {
    int level;
    std::uint64_t macroblocks;
  };
  constexpr std::array<Buffer, 13> kBuffers = {{{10, 396},
                                                {11, 900},
                                                {20, 2376},
                                                {21, 4752},
                                                {30, 8100},
                                                {31, 18000},
                                                {32, 20480},
                                                {41, 32768},
                                                {42, 34816},
                                                {50, 110400},
                                                {52, 184320},
                                                {59, 184320},
                                                {62, 696320}}};
  for (const Buffer& row : kBuffers) {
    if (level <= row.level) return row.macroblocks;
  }
  return kBuffers.back().macroblocks;
}

}  // namespace

Result<SequenceHeader> parse_h264_sps(std::span<const std::uint8_t> unit) {
  constexpr const char* kName = "H.264 sequence parameter set";
  const std::vector<std::uint8_t> bytes = without_emulation_prevention(unit);
  BitReader r(bytes);
  SequenceHeader header;
  r.skip(8);
  const std::uint32_t profile = r.bits(8), constraints = r.bits(8);
  const int level = static_cast<int>(r.bits(8));
  r.golomb();  // seq_parameter_set_id
  if (has_chroma_fields(profile)) read_chroma_fields(r, header);
  skip_picture_order(r);
  const std::uint32_t references = r.golomb();
  r.skip(1);
  const std::uint64_t width = std::uint64_t{r.golomb()} + 1, units = std::uint64_t{r.golomb()} + 1;
  const bool frames_only = r.flag();
  if (!frames_only) r.skip(1);
  r.skip(1);
  if (r.flag()) {  // cropping
    for (int i = 0; i < 4; ++i) r.golomb();
  }
  const std::int64_t told = r.flag() ? read_frame_buffering(r) : -1;
  if (r.failed() || header.chroma_format > 3 || references > 16 || told > 16) {
    return corrupt(kName, "it ends early, or its values are out of range");
  }
  // Without a word, E.2.1: none in intra profiles, else what the level allows.
  constexpr std::uint32_t kConstraint3 = 0x10;
  const bool intra = (constraints & kConstraint3) != 0 && has_chroma_fields(profile);
  const std::uint64_t macroblocks = width * units * (frames_only ? 1 : 2);
  const std::uint64_t allowed =
      intra ? 0 : std::min<std::uint64_t>(buffer_macroblocks(level) / macroblocks, 16);
  const std::uint64_t held =
      std::max<std::uint64_t>(told >= 0 ? static_cast<std::uint64_t>(told) : allowed, references);
  header.pictures = static_cast<std::uint8_t>(held + 1);
  return header;
}

Result<SequenceHeader> parse_hevc_sps(std::span<const std::uint8_t> unit) {
  constexpr const char* kName = "HEVC sequence parameter set";
  const std::vector<std::uint8_t> bytes = without_emulation_prevention(unit);
  BitReader r(bytes);
  SequenceHeader header;
  r.skip(16 + 4);
  const std::uint32_t extra_layers = r.bits(3);
  header.temporal_layers = static_cast<std::uint8_t>(extra_layers + 1);
  header.temporal_nesting = r.flag();
  for (std::uint8_t& byte : header.profile_tier_level) byte = static_cast<std::uint8_t>(r.bits(8));
  std::array<bool, 8> profiles{}, levels{};
  for (std::uint32_t i = 0; i < extra_layers; ++i) {
    profiles[i] = r.flag();
    levels[i] = r.flag();
  }
  if (extra_layers > 0) r.skip(2 * (8 - static_cast<int>(extra_layers)));
  for (std::uint32_t i = 0; i < extra_layers; ++i) {
    for (int byte = 0; profiles[i] && byte < 11; ++byte) r.skip(8);
    if (levels[i]) r.skip(8);
  }
  r.golomb();  // sps_seq_parameter_set_id
  header.chroma_format = static_cast<std::uint8_t>(std::min(r.golomb(), 255u));
  if (header.chroma_format == 3) r.skip(1);
  r.golomb();
  r.golomb();
  if (r.flag()) {  // conformance window
    for (int i = 0; i < 4; ++i) r.golomb();
  }
  header.luma_bits = static_cast<std::uint8_t>(8 + std::min(r.golomb(), 16u));
  header.chroma_bits = static_cast<std::uint8_t>(8 + std::min(r.golomb(), 16u));
  r.golomb();  // log2_max_pic_order_cnt_lsb_minus4
  const bool for_each_layer = r.flag();
  std::uint32_t buffered = 0;
  for (std::uint32_t i = for_each_layer ? 0 : extra_layers; i <= extra_layers; ++i) {
    buffered = std::max(buffered, r.golomb());
    r.golomb();
    r.golomb();
  }
  if (r.failed() || extra_layers > 6 || header.chroma_format > 3 || buffered > 15) {
    return corrupt(kName, "it ends early, or its values are out of range");
  }
  // sps_max_dec_pic_buffering counts the picture being decoded.
  header.pictures = static_cast<std::uint8_t>(buffered + 1);
  return header;
}

}  // namespace relit::decoders
