// SPDX-License-Identifier: MIT
#include "decoders/codec_private.hpp"

#include <algorithm>
#include <string>

#include "decoders/nal_units.hpp"
#include "decoders/sequence_header.hpp"
#include "decoders/video_decoder.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::decoders;

namespace {

Bytes join(const std::vector<Bytes>& parts) {
  Bytes all;
  for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

const Bytes kLong = {0, 0, 0, 1}, kShort = {0, 0, 1};

/// Writes fields of bits, as the syntax tables list them.
class BitWriter {
 public:
  BitWriter& bits(int count, std::uint64_t value) {
    for (int i = count - 1; i >= 0; --i) put((value >> i) & 1);
    return *this;
  }
  BitWriter& golomb(std::uint32_t value) {
    int length = 0;
    while (((value + 1) >> (length + 1)) != 0) ++length;
    bits(length, 0);
    return bits(length + 1, value + 1);
  }
  /// With the stop bit, and protected against start codes.
  Bytes unit() {
    put(1);
    while (count_ % 8 != 0) put(0);
    Bytes protected_bytes;
    int zeros = 0;
    for (const std::uint8_t byte : bytes_) {
      if (zeros >= 2 && byte <= 3) {
        protected_bytes.push_back(3);
        zeros = 0;
      }
      zeros = byte == 0 ? zeros + 1 : 0;
      protected_bytes.push_back(byte);
    }
    return protected_bytes;
  }

 private:
  void put(std::uint64_t bit) {
    if (count_++ % 8 == 0) bytes_.push_back(0);
    bytes_.back() = static_cast<std::uint8_t>(bytes_.back() | (bit << ((8 - count_ % 8) % 8)));
  }
  Bytes bytes_;
  std::size_t count_ = 0;
};

/// ISO/IEC 14496-10, 7.3.2.1.1. `told` is max_dec_frame_buffering, -1: no VUI.
Bytes h264_sps(std::uint8_t profile, std::uint32_t chroma, std::uint32_t bits, int told) {
  BitWriter w;
  w.bits(8, 0x67).bits(8, profile).bits(8, 0).bits(8, 30).golomb(0);
  if (profile >= 100) w.golomb(chroma).bits(chroma == 3 ? 1 : 0, 0);
  if (profile >= 100) w.golomb(bits - 8).golomb(bits - 8).bits(2, 0);
  w.golomb(0).golomb(0).golomb(2).golomb(3).bits(1, 0);
  w.golomb(3).golomb(2).bits(1, 1).bits(1, 1).bits(1, 0);
  w.bits(1, told >= 0 ? 1 : 0);
  if (told >= 0) {
    // A sample aspect ratio, full range, timing: what lies before the restriction.
    w.bits(1, 1).bits(8, 255).bits(32, 0x00010001).bits(1, 0);
    w.bits(1, 1).bits(3, 5).bits(1, 1).bits(1, 0).bits(1, 0);
    w.bits(1, 1).bits(32, 1).bits(32, 50).bits(1, 1).bits(2, 0).bits(1, 0);
    w.bits(1, 1).bits(1, 1).golomb(0).golomb(0).golomb(10).golomb(10).golomb(2);
    w.golomb(static_cast<std::uint32_t>(told));
  }
  return w.unit();
}

const Bytes kH264Pps = {0x68, 0xee, 0x3c, 0x80};
const Bytes kIdr = {0x65, 0x88, 0x00, 0x00, 0x03, 0x01, 0x7f};
const Bytes kNonIdr = {0x41, 0x9a, 0x24};

}  // namespace

TEST_CASE("a byte stream is split at start codes of both lengths") {
  const Bytes stream =
      join({{0xaa}, kLong, kIdr, kShort, kNonIdr, {0, 0, 0}, kLong, kH264Pps, {0}});
  const std::vector<Unit> units = split_annex_b(stream);
  REQUIRE(units.size() == 3);
  CHECK(std::ranges::equal(units[0], kIdr));
  CHECK(std::ranges::equal(units[1], kNonIdr));
  CHECK(std::ranges::equal(units[2], kH264Pps));
  CHECK(split_annex_b({}).empty());
  CHECK(split_annex_b(kIdr).empty());
  CHECK(split_annex_b(kLong).empty());
  CHECK(split_annex_b(join({kLong, kShort, kLong})).empty());
}

TEST_CASE("H.264 packets keep their slices, after their lengths, and nothing else") {
  const Bytes delimiter = {0x09, 0xf0}, remark = {0x06, 0x05, 0x01, 0x80}, filler = {0x0c, 0xff};
  const Bytes packet = join({kLong,
                             delimiter,
                             kLong,
                             h264_sps(100, 1, 8, 4),
                             kLong,
                             kH264Pps,
                             kShort,
                             remark,
                             kShort,
                             kIdr,
                             {0, 0},
                             kLong,
                             kIdr,
                             kShort,
                             filler});
  const auto stored = stored_packet("h264", packet);
  REQUIRE(stored);
  // Emulation prevention stays: its three bytes are the decoder's business.
  CHECK(*stored == join({{0, 0, 0, 7}, kIdr, {0, 0, 0, 7}, kIdr}));
  CHECK(check_packet("h264", *stored));
  CHECK(!stored_packet("h264", join({kLong, delimiter, kLong, kH264Pps})));
  CHECK(!stored_packet("h264", *stored));
  CHECK(!stored_packet("h264", {}));
}

TEST_CASE("HEVC packets keep their slices, after their lengths, and nothing else") {
  const Bytes slice = {0x26, 0x01, 0xaf, 0x00, 0x00, 0x03, 0x00}, kept = {0x26, 0x01, 0xaf};
  const Bytes vps = {0x40, 0x01, 0x0c}, remark = {0x4e, 0x01, 0x80}, delimiter = {0x46, 0x01, 0x10};
  const auto stored = stored_packet(
      "hevc", join({kLong, delimiter, kLong, vps, kShort, remark, kShort, kept, kShort, slice}));
  REQUIRE(stored);
  CHECK(*stored == join({{0, 0, 0, 3}, kept, {0, 0, 0, 6}, {0x26, 0x01, 0xaf, 0, 0, 3}}));
  CHECK(!stored_packet("hevc", join({kLong, {0x26}})));
}

TEST_CASE("an empty packet is stored for no codec") {
  for (const char* codec : {"h264", "hevc", "av1", "vp9", "mpeg4", "ffv1"})
    CHECK(!stored_packet(codec, {}));
}

TEST_CASE("AV1 packets lose their delimiters and gain sizes") {
  const Bytes delimiter = {0x12, 0x00}, frame = {0x32, 0x02, 0xab, 0xcd};
  const auto stored = stored_packet("av1", join({delimiter, frame, {0x36, 0x08, 0x05, 0x02}}));
  // Type 6 with an extension and size, but of more bytes than there are.
  CHECK(!stored);
  const auto open = stored_packet("av1", join({delimiter, frame, {0x30, 0x05}}));
  REQUIRE(open);
  CHECK(*open == join({frame, {0x32, 0x01, 0x05}}));
  CHECK(check_packet("av1", *open));
  CHECK(!check_packet("av1", join({delimiter, frame})));
  CHECK(!check_packet("av1", Bytes{0x30, 0x05}));
  CHECK(!stored_packet("av1", delimiter));
  Bytes large(300, 7);
  large[0] = 0x30;
  const auto sized = stored_packet("av1", large);
  REQUIRE(sized);
  CHECK(sized->size() == 302);
  CHECK((*sized)[1] == (0x80 | (299 & 127)));
  CHECK((*sized)[2] == 299 >> 7);
}

TEST_CASE("H.264 parameter sets become a configuration record, and say how many pictures") {
  for (const int told : {0, 4, 16}) {
    const Bytes sps = h264_sps(110, 1, 10, told);
    const auto record = stored_private("h264", join({kLong, sps, kShort, kH264Pps}));
    REQUIRE(record);
    const auto length = static_cast<std::uint8_t>(sps.size());
    CHECK(*record == join({{1, 110, 0, 30, 0xff, 0xe1, 0, length},
                           sps,
                           {1, 0, 4},
                           kH264Pps,
                           {0xfd, 0xfa, 0xfa, 0}}));
    // Three references are kept whatever the VUI says.
    CHECK(*decoder_pictures("h264", *record) == std::max(told, 3) + 1);
    CHECK(*stored_private("h264", *record) == *record);
  }
  // Main has no fields for its samples; without a VUI level 3 allows 8100 macroblocks, 12 a
  // picture.
  const auto main = stored_private("h264", join({kLong, h264_sps(77, 1, 8, -1), kLong, kH264Pps}));
  REQUIRE(main);
  CHECK(main->back() == kH264Pps.back());
  CHECK(*decoder_pictures("h264", *main) == 17);
  const auto lossless = parse_h264_sps(h264_sps(244, 3, 8, 2));
  REQUIRE(lossless);
  CHECK(lossless->chroma_format == 3);
}

TEST_CASE("HEVC parameter sets become a configuration record, whoever wrote the first one") {
  const Bytes vps = {0x40, 1, 0x0c}, pps = {0x44, 1, 0xc1};
  BitWriter w;
  // Two temporal layers, the lower with profile and level of its own; 4:4:4 of ten bits.
  w.bits(16, 0x4201).bits(4, 0).bits(3, 1).bits(1, 1);
  w.bits(8, 0x24).bits(32, 0x08000000).bits(32, 0x9d080000).bits(16, 0).bits(8, 93);
  w.bits(2, 3).bits(14, 0).bits(32, 0).bits(32, 0).bits(24, 0).bits(8, 90);
  w.golomb(0).golomb(3).bits(1, 0).golomb(64).golomb(48).bits(1, 0).golomb(2).golomb(2).golomb(4);
  w.bits(1, 1).golomb(2).golomb(1).golomb(0).golomb(4).golomb(2).golomb(0);
  const Bytes sps = w.unit();
  const auto record = stored_private("hevc", join({kLong, vps, kLong, sps, kShort, pps}));
  REQUIRE(record);
  const auto length = static_cast<std::uint8_t>(sps.size());
  CHECK(*record == join({{1, 0x24, 8, 0, 0, 0, 0x9d, 8, 0, 0, 0, 0, 93, 0xf0, 0, 0xfc},
                         {0xff, 0xfa, 0xfa, 0, 0, (2 << 3) | 4 | 3, 3},
                         {0xa0, 0, 1, 0, 3},
                         vps,
                         {0xa1, 0, 1, 0, length},
                         sps,
                         {0xa2, 0, 1, 0, 3},
                         pps}));
  CHECK(*decoder_pictures("hevc", *record) == 5);
  Bytes incomplete = *record;
  incomplete[23] = 0x20;
  CHECK(*stored_private("hevc", incomplete) == *record);
  for (std::size_t size = 0; size < record->size(); ++size) {
    CHECK(!check_private("hevc", std::span(*record).first(size)));
  }
}

TEST_CASE("headers without what a decoder needs are refused") {
  const Bytes sps = h264_sps(100, 1, 8, 4);
  CHECK(!stored_private("h264", join({kLong, sps})));
  CHECK(!stored_private("h264", join({kLong, kH264Pps})));
  CHECK(!stored_private("h264", join({kLong, {0x67, 100}, kLong, kH264Pps})));
  CHECK(!stored_private("h264", {}));
  CHECK(!stored_private("hevc", join({kLong, {0x40, 1, 2}})));
  CHECK(!stored_private("av1", Bytes{0x12, 0}));
  CHECK(stored_private("vp9", Bytes{1, 2, 3})->empty());
  CHECK(!check_private("vp9", Bytes{1}));
  CHECK(!check_private("ffv1", {}));
  CHECK(!check_private("mpeg4", {}));
  CHECK(!decoder_pictures("theora", Bytes{1}));
  CHECK(*decoder_pictures("mpeg4", Bytes{1}) == 3);
  CHECK(*decoder_pictures("ffv1", Bytes{1}) == 1);
  CHECK(*decoder_pictures("vp9", {}) == 9);
}

TEST_CASE("every truncation and every changed byte of a record is read without harm") {
  const Bytes good =
      *stored_private("h264", join({kLong, h264_sps(244, 3, 10, 4), kLong, kH264Pps}));
  VideoFormat format;
  format.codec = "h264";
  format.width = 64, format.height = 48;
  for (std::size_t size = 0; size < good.size(); ++size) {
    format.codec_private.assign(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size));
    // What follows the picture parameter sets may be missing.
    const bool whole = size + 4 >= good.size();
    INFO(size);
    CHECK(check_private("h264", format.codec_private).has_value() == whole);
    if (!whole) CHECK(VideoDecoder::open(format).error().code == ErrorCode::kCorrupt);
  }
  for (std::size_t at = 0; at < good.size(); ++at) {
    for (const int value : {0x00, 0x01, 0x7f, 0x80, 0xff}) {
      format.codec_private = good;
      format.codec_private[at] = static_cast<std::uint8_t>(value);
      const auto pictures = decoder_pictures("h264", format.codec_private);
      if (pictures) CHECK(*pictures <= 17);
      auto decoder = VideoDecoder::open(format);
      if (!decoder) continue;
      CHECK(check_private("h264", format.codec_private));
      static_cast<void>(decoder->send(join({{0, 0, 0, 7}, kIdr}), 0, true));
    }
  }
}

TEST_CASE("stored packets are whole units without parameter sets") {
  CHECK(check_packet("h264", join({{0, 0, 0, 7}, kIdr})));
  CHECK(!check_packet("h264", join({{0, 0, 0, 8}, kIdr})));
  CHECK(!check_packet("h264", join({{0, 0, 0, 6}, kIdr})));
  CHECK(!check_packet("h264", join({{0xff, 0xff, 0xff, 0xff}, kIdr})));
  CHECK(!check_packet("h264", join({{0, 0, 0, 7}, kIdr, {0, 0, 0, 0}})));
  CHECK(!check_packet("h264", join({{0, 0, 0, 4}, kH264Pps, {0, 0, 0, 7}, kIdr})));
  CHECK(!check_packet("h264", join({kLong, kIdr})));
  CHECK(!check_packet("hevc", join({{0, 0, 0, 3}, {0x40, 1, 2}})));
  CHECK(check_packet("hevc", join({{0, 0, 0, 3}, {0x26, 1, 2}})));
  CHECK(!check_packet("ffv1", {}));
  CHECK(check_packet("ffv1", Bytes{1}));
}
