// SPDX-License-Identifier: MIT
#include "decoders/png_encoder.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
}

#include <cstring>
#include <string>

#include "decoders/ffmpeg.hpp"

namespace relit::decoders {
namespace {

Unexpected png_failure(const char* step, int code) {
  return fail(ErrorCode::kEnvironment,
              std::string("PNG encoder: ") + step + " failed: " + ffmpeg::reason(code));
}

bool opaque(std::span<const std::uint8_t> rgba) {
  for (std::size_t i = 3; i < rgba.size(); i += 4) {
    if (rgba[i] != 255) return false;
  }
  return true;
}

void copy_rows(AVFrame& frame, std::span<const std::uint8_t> rgba, bool with_alpha) {
  const auto width = static_cast<std::size_t>(frame.width);
  for (int y = 0; y < frame.height; ++y) {
    const std::uint8_t* in = rgba.data() + static_cast<std::size_t>(y) * width * 4;
    std::uint8_t* row = frame.data[0] + std::ptrdiff_t{y} * frame.linesize[0];
    if (with_alpha) {
      std::memcpy(row, in, width * 4);
      continue;
    }
    for (std::size_t x = 0; x < width; ++x) std::memcpy(row + 3 * x, in + 4 * x, 3);
  }
}

}  // namespace

Result<std::vector<std::uint8_t>> encode_png(int width, int height,
                                             std::span<const std::uint8_t> rgba) {
  if (width <= 0 || height <= 0 ||
      rgba.size() != 4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    return fail(ErrorCode::kInvalid, "PNG encoder: " + std::to_string(rgba.size()) +
                                         " bytes are no RGBA picture of " + std::to_string(width) +
                                         "×" + std::to_string(height));
  }
  const AVCodec* codec = avcodec_find_encoder(AV_CODEC_ID_PNG);
  if (codec == nullptr) return fail(ErrorCode::kEnvironment, "libavcodec has no PNG encoder");
  const bool with_alpha = !opaque(rgba);
  const ffmpeg::Codec context(avcodec_alloc_context3(codec));
  const ffmpeg::Frame frame(av_frame_alloc());
  const ffmpeg::Packet packet(av_packet_alloc());
  if (!context || !frame || !packet) return fail(ErrorCode::kOutOfMemory, "PNG encoder: no memory");
  context->width = frame->width = width;
  context->height = frame->height = height;
  context->pix_fmt = with_alpha ? AV_PIX_FMT_RGBA : AV_PIX_FMT_RGB24;
  frame->format = context->pix_fmt;
  context->time_base = {1, 1};
  context->thread_count = 1;
  context->compression_level = 9;
  if (const int code = avcodec_open2(context.get(), codec, nullptr); code < 0) {
    return png_failure("opening", code);
  }
  if (const int code = av_frame_get_buffer(frame.get(), 0); code < 0) {
    return png_failure("allocating", code);
  }
  copy_rows(*frame, rgba, with_alpha);
  if (const int code = avcodec_send_frame(context.get(), frame.get()); code < 0) {
    return png_failure("sending", code);
  }
  if (const int code = avcodec_receive_packet(context.get(), packet.get()); code < 0) {
    return png_failure("receiving", code);
  }
  return std::vector<std::uint8_t>(packet->data, packet->data + packet->size);
}

}  // namespace relit::decoders
