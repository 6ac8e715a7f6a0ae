// SPDX-License-Identifier: MIT
#include "decoders/image.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/frame.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

#include <array>
#include <climits>
#include <cstring>
#include <memory>
#include <string>

#include "container/base/limits.hpp"
#include "container/base/out_of_memory.hpp"
#include "decoders/ffmpeg.hpp"

namespace relit::decoders {
namespace {

struct Signature {
  std::size_t offset;
  std::string_view bytes;
  std::string_view media_type;
};

using namespace std::string_view_literals;
constexpr std::array kSignatures{
    Signature{0, "\x89PNG\r\n\x1a\n"sv, "image/png"},
    Signature{0, "\xff\xd8\xff"sv, "image/jpeg"},
    Signature{8, "WEBP"sv, "image/webp"},
    Signature{0, "\xabKTX 20\xbb"sv, "image/ktx2"},
    Signature{0, "GIF8"sv, "image/gif"},
    Signature{0, "DDS "sv, "image/vnd-ms.dds"},
    Signature{0, "BM"sv, "image/bmp"},
};

struct StatedSize {
  std::int64_t width = 0;
  std::int64_t height = 0;
};

std::uint32_t big_endian(std::span<const std::uint8_t> bytes, std::size_t count) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value << 8 | bytes[i];
  return value;
}

Unexpected truncated(std::string_view media_type) {
  return fail(ErrorCode::kTruncated, std::string(media_type) +
                                         " picture ends before its last byte; export or "
                                         "download it again");
}

constexpr std::size_t kPngSignature = 8;
constexpr std::size_t kPngChunk = 12;  // length, type, CRC

std::string_view chunk_type(std::span<const std::uint8_t> bytes, std::size_t at) {
  return {reinterpret_cast<const char*>(bytes.data()) + at + 4, 4};
}

// The chunks are walked here because libavcodec returns the rows it has when the rest is missing.
Result<StatedSize> check_png(std::span<const std::uint8_t> bytes) {
  StatedSize size;
  std::size_t at = kPngSignature;
  while (bytes.size() - at >= kPngChunk) {
    const std::uint64_t length = big_endian(bytes.subspan(at), 4);
    const std::string_view type = chunk_type(bytes, at);
    if (length > bytes.size() - at - kPngChunk) break;
    if (type == "IHDR" && length >= 8) {
      size = {big_endian(bytes.subspan(at + 8), 4), big_endian(bytes.subspan(at + 12), 4)};
    }
    if (type == "IEND") return size;
    at += static_cast<std::size_t>(length) + kPngChunk;
  }
  return truncated("image/png");
}

// Walks the markers up to the picture's end; entropy-coded data holds no marker but restarts. Each
// scan goes over the whole picture, whatever it takes: files of many empty ones would keep a
// decoder busy for hours.
Result<StatedSize> check_jpeg(std::span<const std::uint8_t> bytes) {
  StatedSize size;
  std::uint32_t scans = 0;
  std::size_t at = 2;
  while (at + 1 < bytes.size()) {
    if (bytes[at] != 0xff || bytes[at + 1] == 0xff || bytes[at + 1] == 0 ||
        (bytes[at + 1] >= 0xd0 && bytes[at + 1] <= 0xd7) || bytes[at + 1] == 0x01) {
      ++at;
      continue;
    }
    const std::uint8_t marker = bytes[at + 1];
    if (marker == 0xd9) return size;
    if (marker == 0xda && ++scans > limits::kImageScans) {
      return fail(ErrorCode::kLimit, "the picture has more than " +
                                         std::to_string(limits::kImageScans) +
                                         " scans; save it with another program");
    }
    if (bytes.size() - at < 4) break;
    const std::size_t length = big_endian(bytes.subspan(at + 2), 2);
    if (length < 2 || length > bytes.size() - at - 2) break;
    const bool is_frame =
        marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (is_frame && length >= 7) {
      size = {big_endian(bytes.subspan(at + 7), 2), big_endian(bytes.subspan(at + 5), 2)};
    }
    at += 2 + length;
  }
  return truncated("image/jpeg");
}

Status check_size(const StatedSize& size) {
  const auto side = static_cast<std::int64_t>(limits::kImageSide);
  const auto texels = static_cast<std::int64_t>(limits::kImageTexels);
  if (size.width < 1 || size.height < 1) {
    return fail(ErrorCode::kCorrupt, "the picture has no size; export it again");
  }
  if (size.width > side || size.height > side || size.width * size.height > texels) {
    return fail(ErrorCode::kLimit, "the picture has " + std::to_string(size.width) + "×" +
                                       std::to_string(size.height) + " texels; at most " +
                                       std::to_string(side) + " a side and " +
                                       std::to_string(texels) + " in all are taken: scale it down");
  }
  return {};
}

/// Copies the file into `packet` and returns how many bytes it has there. Of PNG the chunks whose
/// contents are compressed and not of the picture are left out: libavcodec would unpack texts and
/// profiles of any size, a thousand times what they take here.
std::size_t copy_picture(std::span<const std::uint8_t> bytes, bool png, std::uint8_t* packet) {
  if (!png) {
    std::memcpy(packet, bytes.data(), bytes.size());
    return bytes.size();
  }
  std::size_t size = 0;
  const auto keep = [&](std::size_t at, std::size_t length) {
    std::memcpy(packet + size, bytes.data() + at, length);
    size += length;
  };
  keep(0, kPngSignature);
  for (std::size_t at = kPngSignature; bytes.size() - at >= kPngChunk;) {
    const std::size_t length = big_endian(bytes.subspan(at), 4) + kPngChunk;
    const std::string_view type = chunk_type(bytes, at);
    if (type != "zTXt" && type != "iTXt" && type != "iCCP") keep(at, length);
    if (type == "IEND") break;
    at += length;
  }
  return size;
}

Result<ffmpeg::Frame> decode_frame(std::span<const std::uint8_t> bytes,
                                   std::string_view media_type) {
  const AVCodec* codec =
      avcodec_find_decoder(media_type == "image/png" ? AV_CODEC_ID_PNG : AV_CODEC_ID_MJPEG);
  if (codec == nullptr) {
    return fail(ErrorCode::kEnvironment, "this libavcodec has no decoder for " +
                                             std::string(media_type) + "; install one that has");
  }
  ffmpeg::Codec context(avcodec_alloc_context3(codec));
  ffmpeg::Frame frame(av_frame_alloc());
  ffmpeg::Packet packet(av_packet_alloc());
  if (!context || !frame || !packet ||
      av_new_packet(packet.get(), static_cast<int>(bytes.size())) < 0) {
    return fail(ErrorCode::kOutOfMemory, "no memory to decode a picture");
  }
  const std::size_t copied = copy_picture(bytes, media_type == "image/png", packet->data);
  av_shrink_packet(packet.get(), static_cast<int>(copied));
  context->thread_count = 1;
  context->max_pixels = static_cast<std::int64_t>(limits::kImageTexels);
  context->err_recognition = AV_EF_CRCCHECK | AV_EF_EXPLODE;
  context->idct_algo = FF_IDCT_SIMPLE;
  context->flags |= AV_CODEC_FLAG_BITEXACT;
  // What goes wrong is told by the returned Error, not by libavcodec's own log.
  context->log_level_offset = 100;
  int status = avcodec_open2(context.get(), codec, nullptr);
  if (status >= 0) status = avcodec_send_packet(context.get(), packet.get());
  if (status >= 0) status = avcodec_send_packet(context.get(), nullptr);
  if (status >= 0) status = avcodec_receive_frame(context.get(), frame.get());
  if (status == AVERROR(ENOMEM)) {
    return fail(ErrorCode::kOutOfMemory, "no memory to decode a picture");
  }
  if (status < 0 || frame->decode_error_flags != 0 || (frame->flags & AV_FRAME_FLAG_CORRUPT) != 0) {
    return fail(ErrorCode::kCorrupt, std::string(media_type) +
                                         " picture does not decode; it is damaged: export or "
                                         "download it again");
  }
  return frame;
}

/// The same samples under their modern name: the range is told to the scaler separately.
AVPixelFormat without_range(AVPixelFormat format) {
  switch (format) {
    case AV_PIX_FMT_YUVJ411P:
      return AV_PIX_FMT_YUV411P;
    case AV_PIX_FMT_YUVJ420P:
      return AV_PIX_FMT_YUV420P;
    case AV_PIX_FMT_YUVJ422P:
      return AV_PIX_FMT_YUV422P;
    case AV_PIX_FMT_YUVJ440P:
      return AV_PIX_FMT_YUV440P;
    case AV_PIX_FMT_YUVJ444P:
      return AV_PIX_FMT_YUV444P;
    default:
      return format;
  }
}

Result<DecodedImage> to_rgba(const AVFrame& frame) {
  const AVPixelFormat format = without_range(static_cast<AVPixelFormat>(frame.format));
  DecodedImage image;
  image.width = frame.width;
  image.height = frame.height;
  image.rgba.resize(static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height) *
                    4);
  ffmpeg::Scaler scaler(sws_getContext(
      frame.width, frame.height, format, frame.width, frame.height, AV_PIX_FMT_RGBA,
      SWS_BILINEAR | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INP | SWS_FULL_CHR_H_INT | SWS_BITEXACT,
      nullptr, nullptr, nullptr));
  if (!scaler) {
    const char* name = av_get_pix_fmt_name(format);
    return fail(ErrorCode::kUnsupported, "pictures of sample format " +
                                             std::string(name == nullptr ? "unknown" : name) +
                                             " cannot be converted; save it as 8-bit RGB");
  }
  // JFIF: full range, BT.601. Left alone, the scaler takes it for limited range.
  const int* bt601 = sws_getCoefficients(SWS_CS_ITU601);
  sws_setColorspaceDetails(scaler.get(), bt601, 1, bt601, 1, 0, 1 << 16, 1 << 16);
  const std::array<std::uint8_t*, 1> out{image.rgba.data()};
  const std::array<int, 1> stride{frame.width * 4};
  if (sws_scale(scaler.get(), frame.data, frame.linesize, 0, frame.height, out.data(),
                stride.data()) != frame.height) {
    return fail(ErrorCode::kCorrupt, "the picture cannot be converted to RGBA; export it again");
  }
  return image;
}

// `media_type`, what the container claims, is for the message alone.
Result<StatedSize> checked_size(std::span<const std::uint8_t> bytes, std::string_view media_type) {
  const std::string_view type = image_media_type(bytes);
  if (type != "image/png" && type != "image/jpeg") {
    const std::string_view told = type.empty() ? media_type : type;
    return fail(ErrorCode::kUnsupported, "the picture is neither PNG nor JPEG" +
                                             (told.empty() ? "" : " but " + std::string(told)) +
                                             "; convert it to one of them");
  }
  if (bytes.size() > INT_MAX - AV_INPUT_BUFFER_PADDING_SIZE) {
    return fail(ErrorCode::kLimit, "the picture has 2 GiB or more; scale it down");
  }
  RELIT_ASSIGN(const StatedSize size, type == "image/png" ? check_png(bytes) : check_jpeg(bytes));
  RELIT_TRY(check_size(size));
  return size;
}

Result<DecodedImage> decode(std::span<const std::uint8_t> bytes, std::string_view media_type) {
  RELIT_TRY(checked_size(bytes, media_type));
  const std::string_view type = image_media_type(bytes);
  RELIT_ASSIGN(const ffmpeg::Frame frame, decode_frame(bytes, type));
  RELIT_TRY(check_size({frame->width, frame->height}));
  const AVPixFmtDescriptor* format = av_pix_fmt_desc_get(static_cast<AVPixelFormat>(frame->format));
  if (format == nullptr || (type == "image/jpeg" && (format->nb_components > 3 ||
                                                     (format->flags & AV_PIX_FMT_FLAG_ALPHA)))) {
    return fail(ErrorCode::kUnsupported, "CMYK JPEG pictures are not supported; save it as RGB");
  }
  return to_rgba(*frame);
}

}  // namespace

std::string_view image_media_type(std::span<const std::uint8_t> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  for (const Signature& signature : kSignatures) {
    if (text.size() >= signature.offset + signature.bytes.size() &&
        text.substr(signature.offset, signature.bytes.size()) == signature.bytes) {
      return signature.media_type;
    }
  }
  return {};
}

Result<ImageSize> image_size(std::span<const std::uint8_t> bytes) {
  RELIT_ASSIGN(const StatedSize size, checked_size(bytes, {}));
  return ImageSize{static_cast<int>(size.width), static_cast<int>(size.height)};
}

Result<DecodedImage> decode_image(std::span<const std::uint8_t> bytes,
                                  std::string_view media_type) {
  return catch_out_of_memory("decoding a picture", [&] { return decode(bytes, media_type); });
}

}  // namespace relit::decoders
