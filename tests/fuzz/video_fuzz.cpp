// SPDX-License-Identifier: MIT
extern "C" {
#include <libavutil/crc.h>
}

#include <array>
#include <cstdint>
#include <string>

#include "decoders/video_decoder.hpp"
#include "tests/fuzz/fuzz.hpp"

/// Hostile video streams: codec, width, height, flags (chroma, bit depth, checksums made right),
/// codec_private and packets behind their lengths. A picture that comes out has the size and depth
/// that were promised, and all its samples can be read.
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

decoders::VideoFormat read_format(Cursor& input, bool& mend) {
  decoders::VideoFormat format;
  format.codec = kCodecs[input.u8() % kCodecs.size()];
  format.width = 1 + input.u8() % 128;
  format.height = 1 + input.u8() % 128;
  const unsigned flags = input.u8();
  format.chroma = static_cast<container::Chroma>((flags & 3) % 3);
  format.bit_depth = (flags & 4) != 0 ? 10 : 8;
  mend = (flags & 8) != 0 && format.codec == "ffv1";
  format.codec_private = copy(input.piece());
  if (mend) put_crc(format.codec_private);
  return format;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Cursor input({data, size});
  bool mend = false;
  const decoders::VideoFormat format = read_format(input, mend);
  auto decoder = VideoDecoder::open(format);
  if (!check(decoder)) return 0;
  for (int pts = 0; pts < kMostPackets && !input.empty(); ++pts) {
    Bytes packet = copy(input.piece());
    if (mend) mend_ffv1(packet);
    if (!check(decoder->send(packet, pts, pts == 0)) && pts % 4 == 3) check(decoder->reopen());
    receive_all(*decoder, format);
  }
  if (!check(decoder->drain())) return 0;
  receive_all(*decoder, format);
  decoder->flush();
  receive_all(*decoder, format);
  return 0;
}
