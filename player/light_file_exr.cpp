// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/opt.h>
#include <libavutil/pixfmt.h>
}

#include "container/base/limits.hpp"
#include "decoders/ffmpeg.hpp"
#include "player/light_file.hpp"

namespace relit::player {
namespace {

namespace ffmpeg = decoders::ffmpeg;

constexpr std::uint32_t kMagic = 20000630;
constexpr std::uint32_t kDeepFlag = 0x800;
constexpr std::uint8_t kDwaa = 8;

/// Little-endian reading with a sticky error.
class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  [[nodiscard]] bool failed() const { return failed_; }

  std::span<const std::uint8_t> take(std::size_t count) {
    if (failed_ || count > bytes_.size()) {
      failed_ = true;
      return {};
    }
    const auto head = bytes_.first(count);
    bytes_ = bytes_.subspan(count);
    return head;
  }
  std::uint32_t u32() {
    const auto b = take(4);
    if (failed_) return 0;
    return std::uint32_t{b[0]} | std::uint32_t{b[1]} << 8 | std::uint32_t{b[2]} << 16 |
           std::uint32_t{b[3]} << 24;
  }
  std::int32_t i32() { return std::bit_cast<std::int32_t>(u32()); }
  std::string_view text() {
    const auto end = std::find(bytes_.begin(), bytes_.end(), std::uint8_t{0});
    if (end == bytes_.end()) failed_ = true;
    const auto text = take(static_cast<std::size_t>(end - bytes_.begin()));
    take(1);
    return {reinterpret_cast<const char*>(text.data()), text.size()};
  }

 private:
  std::span<const std::uint8_t> bytes_;
  bool failed_ = false;
};

struct Box {
  std::int64_t min_x = 0, min_y = 0, max_x = -1, max_y = -1;  // both inclusive
  bool operator==(const Box&) const = default;
  [[nodiscard]] std::int64_t width() const { return max_x - min_x + 1; }
  [[nodiscard]] std::int64_t height() const { return max_y - min_y + 1; }
  [[nodiscard]] std::string text() const {
    return "(" + std::to_string(min_x) + ", " + std::to_string(min_y) + ") to (" +
           std::to_string(max_x) + ", " + std::to_string(max_y) + ")";
  }
};

Box read_box(Reader& reader) {
  Box box;
  box.min_x = reader.i32();
  box.min_y = reader.i32();
  box.max_x = reader.i32();
  box.max_y = reader.i32();
  return box;
}

struct Header {
  std::uint32_t flags = 0;
  std::uint8_t compression = 0;
  Box data, display;
};

/// The attributes that libavcodec's decoder takes wrongly without saying so.
Result<Header> read_header(std::span<const std::uint8_t> bytes) {
  Reader reader(bytes);
  Header header;
  const bool magic = reader.u32() == kMagic;
  header.flags = reader.u32();
  while (magic && !reader.failed()) {
    const std::string_view name = reader.text();
    if (name.empty()) break;
    const std::string_view type = reader.text();
    Reader value(reader.take(reader.u32()));
    if (name == "dataWindow" && type == "box2i") header.data = read_box(value);
    if (name == "displayWindow" && type == "box2i") header.display = read_box(value);
    if (name == "compression" && type == "compression") {
      const auto byte = value.take(1);
      if (!byte.empty()) header.compression = byte[0];
    }
    if (value.failed()) {
      return fail(ErrorCode::kCorrupt,
                  "the OpenEXR attribute " + std::string(name) + " is too short");
    }
  }
  if (!magic)
    return fail(ErrorCode::kCorrupt, "not an OpenEXR file: it does not begin with 76 2f 31 01");
  if (reader.failed()) return fail(ErrorCode::kTruncated, "the OpenEXR header ends early");
  return header;
}

Status check_header(const Header& header, std::vector<std::string>& warnings) {
  if ((header.flags & kDeepFlag) != 0) {
    return fail(ErrorCode::kUnsupported, "deep OpenEXR pictures are not supported; flatten it");
  }
  if (header.compression >= kDwaa) {
    return fail(ErrorCode::kUnsupported,
                "OpenEXR compression DWAA or DWAB is not supported; convert it, for instance with "
                "\"oiiotool IN.exr --compression zip -o OUT.exr\"");
  }
  RELIT_TRY(check_picture_size(header.display.width(), header.display.height()));
  RELIT_TRY(check_picture_size(header.data.width(), header.data.height()));
  if (header.display.min_x != 0 || header.display.min_y != 0) {
    return fail(
        ErrorCode::kUnsupported,
        "the OpenEXR display window is " + header.display.text() +
            "; it must begin at (0, 0): \"oiiotool IN.exr --origin +0+0 --fullpixels -o OUT.exr\"");
  }
  const Box& data = header.data;
  const Box& display = header.display;
  if (data.min_x > 0 || data.min_y > 0 || data.max_x < display.max_x ||
      data.max_y < display.max_y) {
    warnings.push_back("the OpenEXR data window " + data.text() +
                       " does not fill the display window " + display.text() +
                       "; the rest is black");
  }
  return {};
}

/// What no decoded sample may be: a NaN that the decoder leaves where a block failed, since it
/// reports no failure of single blocks.
constexpr std::uint32_t kUndecoded = 0xFFFFFFFF;

int allocate_undecoded(AVCodecContext* context, AVFrame* frame, int flags) {
  const int status = avcodec_default_get_buffer2(context, frame, flags);
  if (status < 0) return status;
  for (AVBufferRef* buffer : frame->buf) {
    if (buffer != nullptr) std::memset(buffer->data, 0xFF, buffer->size);
  }
  return status;
}

Result<ffmpeg::Frame> decode(std::span<const std::uint8_t> bytes) {
  const AVCodec* codec = avcodec_find_decoder(AV_CODEC_ID_EXR);
  if (codec == nullptr) {
    return fail(ErrorCode::kEnvironment, "this libavcodec has no OpenEXR decoder");
  }
  const ffmpeg::Codec context(avcodec_alloc_context3(codec));
  const ffmpeg::Packet packet(av_packet_alloc());
  ffmpeg::Frame frame(av_frame_alloc());
  if (!context || !packet || !frame ||
      av_new_packet(packet.get(), static_cast<int>(bytes.size())) < 0) {
    return fail(ErrorCode::kOutOfMemory, "not enough memory for the OpenEXR file");
  }
  std::memcpy(packet->data, bytes.data(), bytes.size());
  context->thread_count = 1;
  context->thread_type = FF_THREAD_SLICE;  // frame threads would ask more of the buffer callback
  context->max_pixels = static_cast<std::int64_t>(limits::kImageTexels);
  context->get_buffer2 = allocate_undecoded;
  context->log_level_offset = 64;  // what went wrong is said below, once
  av_opt_set_int(context->priv_data, "apply_trc", AVCOL_TRC_UNSPECIFIED, 0);  // samples as they are
  if (avcodec_open2(context.get(), codec, nullptr) < 0) {
    return fail(ErrorCode::kEnvironment, "libavcodec's OpenEXR decoder does not open");
  }
  int status = avcodec_send_packet(context.get(), packet.get());
  if (status >= 0) status = avcodec_receive_frame(context.get(), frame.get());
  if (status == AVERROR(ENOMEM))
    return fail(ErrorCode::kOutOfMemory, "not enough memory for the picture");
  if (status == AVERROR_PATCHWELCOME) {
    return fail(
        ErrorCode::kUnsupported,
        "the OpenEXR picture has a feature or channels that libavcodec does not read; it needs "
        "R, G and B of half or float");
  }
  if (status < 0) {
    return fail(ErrorCode::kCorrupt,
                "the OpenEXR picture is damaged, ends early or lacks channels R, G and B");
  }
  return frame;
}

/// Planes of the frame in the order R, G, B; libavcodec stores G, B, R.
Result<std::array<int, 3>> channel_planes(const AVFrame& frame) {
  switch (frame.format) {
    case AV_PIX_FMT_GBRPF32:
    case AV_PIX_FMT_GBRAPF32:
      return std::array{2, 0, 1};
    case AV_PIX_FMT_GRAYF32:
      return std::array{0, 0, 0};
    default:
      return fail(ErrorCode::kUnsupported,
                  "the OpenEXR channels must be half or float, not integers");
  }
}

}  // namespace

bool is_exr(std::span<const std::uint8_t> bytes) { return Reader(bytes).u32() == kMagic; }

Result<decoders::Environment> read_exr(std::span<const std::uint8_t> bytes,
                                       std::vector<std::string>& warnings) {
  RELIT_ASSIGN(const Header header, read_header(bytes));
  RELIT_TRY(check_header(header, warnings));
  RELIT_ASSIGN(const ffmpeg::Frame frame, decode(bytes));
  RELIT_ASSIGN(const auto planes, channel_planes(*frame));
  if (frame->width != header.display.width() || frame->height != header.display.height()) {
    return fail(ErrorCode::kCorrupt, "the OpenEXR picture has not the size that its header says");
  }
  decoders::Environment environment{frame->width, frame->height, {}};
  environment.rgb.resize(std::size_t{3} * static_cast<std::size_t>(frame->width) *
                         static_cast<std::size_t>(frame->height));
  float* out = environment.rgb.data();
  for (int y = 0; y < frame->height; ++y) {
    std::array<const std::uint8_t*, 3> rows{};
    for (std::size_t c = 0; c < 3; ++c) {
      const auto plane = static_cast<std::size_t>(planes[c]);
      rows[c] = frame->data[plane] + std::ptrdiff_t{y} * frame->linesize[plane];
    }
    for (int x = 0; x < frame->width; ++x) {
      for (std::size_t c = 0; c < 3; ++c, ++out) {
        std::memcpy(out, rows[c] + std::size_t{4} * static_cast<std::size_t>(x), sizeof *out);
        if (std::bit_cast<std::uint32_t>(*out) == kUndecoded) {
          return fail(ErrorCode::kCorrupt, "the OpenEXR picture is damaged or ends early: pixel (" +
                                               std::to_string(x) + ", " + std::to_string(y) +
                                               ") cannot be decoded");
        }
      }
    }
  }
  return environment;
}

}  // namespace relit::player
