// SPDX-License-Identifier: MIT
extern "C" {
#include <libavutil/crc.h>
}

#include <array>
#include <cstdint>
#include <string>
#include <utility>

#include "decoders/codec_private.hpp"
#include "decoders/video_decoder.hpp"
#include "tests/fuzz/fuzz.hpp"

/// Hostile video streams: codec, width, height, flags (chroma, bit depth, checksums made right, as
/// encoders give them, a decoder by name), codec_private and packets behind their lengths. What an
/// encoder, or a Matroska file, gives is brought into the stored form first. A picture that comes
/// out has the size and depth that were promised, and all its samples can be read.
namespace {

using namespace relit;
using namespace relit::fuzz;
using decoders::VideoDecoder;

constexpr std::array<const char*, 6> kCodecs{"h264", "hevc", "mpeg4", "ffv1", "vp9", "av1"};
constexpr int kMostPackets = 16;
constexpr int kMostPictures = 64;

void put_crc(std::span<std::uint8_t> bytes) {
  if (bytes.size() < 4) return;
  const std::size_t body = bytes.size() - 4;
  const std::uint32_t crc = av_crc(av_crc_get_table(AV_CRC_32_IEEE), 0, bytes.data(), body);
  for (std::size_t i = 0; i < 4; ++i) bytes[body + i] = static_cast<std::uint8_t>(crc >> (8 * i));
}

/// Makes the checksums of FFV1 slices right, from the last to the first; one slice where their
/// sizes do not fit.
void mend_ffv1(std::span<std::uint8_t> packet) {
  constexpr std::size_t kFooter = 8;
  while (packet.size() >= kFooter) {
    std::uint8_t* f = packet.data() + packet.size() - kFooter;
    std::size_t size = ((std::size_t{f[0]} << 16) | (std::size_t{f[1]} << 8) | f[2]) + kFooter;
    if (size > packet.size()) {
      size = packet.size();
      for (int i = 0; i < 3; ++i)
        f[i] = static_cast<std::uint8_t>((size - kFooter) >> (16 - 8 * i));
    }
    put_crc(packet.last(size));
    packet = packet.first(packet.size() - size);
  }
}

void check_picture(const decoders::VideoFormat& format, const decoders::VideoFrame& frame) {
  unsigned sum = 0;
  const int components = format.chroma == container::Chroma::kLuma ? 1 : 3;
  for (int c = 0; c < components; ++c) {
    const SampleView view = frame.component(c);
    if (c == 0) require(view.width == format.width && view.height == format.height);
    require(view.bytes_per_sample == (format.bit_depth + 7) / 8);
    for (int y = 0; y < view.height; ++y)
      for (int x = 0; x < view.width * view.bytes_per_sample; ++x)
        sum += view.data[y * view.stride_bytes + x];
  }
  volatile unsigned read = sum;
  (void)read;
}

void receive_all(VideoDecoder& decoder, const decoders::VideoFormat& format) {
  decoders::VideoFrame frame;
  for (int i = 0; i < kMostPictures; ++i) {
    const auto received = decoder.receive(frame);
    if (!check(received)) continue;
    if (*received != VideoDecoder::Received::kFrame) return;
    check_picture(format, frame);
  }
}

/// What the reader asks of packets before it decodes them holds for all that are made here.
Bytes stored(const std::string& codec, Input packet) {
  const auto bytes = decoders::stored_packet(codec, packet);
  if (!check(bytes)) return {};
  require(decoders::check_packet(codec, *bytes).has_value());
  return *bytes;
}

/// How many pictures the stream says that it needs, and what one takes.
void check_needs(const decoders::VideoFormat& format) {
  const auto pictures = decoders::decoder_pictures(format.codec, format.codec_private);
  if (check(pictures)) require(*pictures >= 1 && *pictures <= 17);
  const auto bytes = decoders::picture_buffer_bytes(format);
  if (!check(bytes)) return;
  require(*bytes >=
          decoders::picture_bytes(format.width, format.height, format.chroma, format.bit_depth));
}

struct Stream {
  decoders::VideoFormat format;
  decoders::VideoDecoderOptions options;
  bool mend = false;
  bool encoders = false;  ///< in the form in which encoders give streams
};

Stream read_stream(Cursor& input) {
  Stream stream;
  decoders::VideoFormat& format = stream.format;
  const std::size_t codec = input.u8();
  format.codec = kCodecs[codec % kCodecs.size()];
  format.width = 1 + input.u8() % 128;
  format.height = 1 + input.u8() % 128;
  const unsigned flags = input.u8();
  format.chroma = static_cast<container::Chroma>((flags & 3) % 3);
  format.bit_depth = (flags & 4) != 0 ? 10 : 8;
  stream.mend = (flags & 8) != 0 && format.codec == "ffv1";
  stream.encoders = (flags & 16) != 0;
  if ((flags & 32) != 0) stream.options.name = kCodecs[codec / kCodecs.size() % kCodecs.size()];
  format.codec_private = copy(input.piece());
  if (stream.mend) put_crc(format.codec_private);
  return stream;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Cursor input({data, size});
  Stream stream = read_stream(input);
  decoders::VideoFormat& format = stream.format;
  if (stream.encoders) {
    auto codec_private = decoders::stored_private(format.codec, format.codec_private);
    if (!check(codec_private)) return 0;
    require(decoders::check_private(format.codec, *codec_private).has_value());
    format.codec_private = std::move(*codec_private);
  }
  check_needs(format);
  auto decoder = VideoDecoder::open(format, stream.options);
  if (!check(decoder)) return 0;
  for (int pts = 0; pts < kMostPackets && !input.empty(); ++pts) {
    Bytes packet = copy(input.piece());
    if (stream.mend) mend_ffv1(packet);
    if (stream.encoders) packet = stored(format.codec, packet);
    if (!check(decoder->send(packet, pts, pts == 0)) && pts % 4 == 3) check(decoder->reopen());
    receive_all(*decoder, format);
  }
  if (!check(decoder->drain())) return 0;
  receive_all(*decoder, format);
  decoder->flush();
  receive_all(*decoder, format);
  return 0;
}
