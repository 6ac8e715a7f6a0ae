// SPDX-License-Identifier: MIT
#include "decoders/video_decoder.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/crc.h>
#include <libavutil/frame.h>
#include <libavutil/pixdesc.h>
}

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "container/base/limits.hpp"
#include "decoders/codec_private.hpp"

namespace relit::decoders {
namespace {

constexpr std::array<std::string_view, 6> kCodecs = {"h264", "hevc", "mpeg4", "ffv1", "vp9", "av1"};

std::string track_name(const VideoFormat& format) {
  return "track " + std::to_string(format.track_id) + " (" + format.codec + ")";
}

/// Whether pictures of `pixel` hold the planes of `format` as their components. Luma streams may
/// come with chroma that nobody reads (H.264, VP9); 4:4:4 ones may be labelled as RGB.
bool acceptable(const VideoFormat& format, AVPixelFormat pixel) {
  const AVPixFmtDescriptor* d = av_pix_fmt_desc_get(pixel);
  if (d == nullptr) return false;
  constexpr std::uint64_t kOdd = AV_PIX_FMT_FLAG_PAL | AV_PIX_FMT_FLAG_BITSTREAM |
                                 AV_PIX_FMT_FLAG_HWACCEL | AV_PIX_FMT_FLAG_ALPHA |
                                 AV_PIX_FMT_FLAG_BAYER | AV_PIX_FMT_FLAG_FLOAT;
  if ((d->flags & kOdd) != 0) return false;
  const bool big_endian = (d->flags & AV_PIX_FMT_FLAG_BE) != 0;
  if (format.bit_depth > 8 && big_endian != (AV_NE(1, 0) == 1)) return false;
  for (int c = 0; c < d->nb_components; ++c) {
    if (d->comp[c].depth != format.bit_depth || d->comp[c].shift != 0) return false;
    if (d->comp[c].step != (format.bit_depth + 7) / 8 || d->comp[c].offset != 0) return false;
  }
  if (format.chroma == container::Chroma::kLuma) {
    return d->nb_components == 1 || (d->flags & AV_PIX_FMT_FLAG_PLANAR) != 0;
  }
  const int shift = format.chroma == container::Chroma::k420 ? 1 : 0;
  return d->nb_components == 3 && (d->flags & AV_PIX_FMT_FLAG_PLANAR) != 0 &&
         d->log2_chroma_w == shift && d->log2_chroma_h == shift;
}

AVPixelFormat choose_format(AVCodecContext* context, const AVPixelFormat* offered) {
  VideoFormat format;
  const auto packed = reinterpret_cast<std::intptr_t>(context->opaque);
  format.bit_depth = static_cast<int>(packed >> 8);
  format.chroma = static_cast<container::Chroma>(packed & 0xff);
  for (; *offered != AV_PIX_FMT_NONE; ++offered) {
    if (acceptable(format, *offered)) return *offered;
  }
  return AV_PIX_FMT_NONE;
}

const AVCodec* find_decoder(std::string_view name) {
  if (std::find(kCodecs.begin(), kCodecs.end(), name) == kCodecs.end()) return nullptr;
  const AVCodecDescriptor* descriptor = avcodec_descriptor_get_by_name(std::string(name).c_str());
  if (descriptor == nullptr) return nullptr;
  const AVCodec* codec = avcodec_find_decoder(descriptor->id);
  return codec != nullptr && (codec->capabilities & AV_CODEC_CAP_HARDWARE) == 0 ? codec : nullptr;
}

Status check_format(const VideoFormat& format) {
  const int limit = static_cast<int>(limits::kVideoSide);
  if (format.width < 1 || format.height < 1 || format.width > limit || format.height > limit) {
    return fail(ErrorCode::kLimit, track_name(format) + ": pictures of " +
                                       std::to_string(format.width) + "x" +
                                       std::to_string(format.height) + ", allowed are 1 to " +
                                       std::to_string(limit) + " samples a side");
  }
  // FFmpeg 5.1 breaks its own heap with FFV1 pictures of a few samples.
  if (format.codec == "ffv1" && std::min(format.width, format.height) < 16) {
    return fail(ErrorCode::kUnsupported,
                track_name(format) + ": FFV1 pictures of " + std::to_string(format.width) + "x" +
                    std::to_string(format.height) + ", at least 16x16 is needed");
  }
  if (format.bit_depth != 8 && format.bit_depth != 10) {
    return fail(ErrorCode::kInvalid, track_name(format) + ": " + std::to_string(format.bit_depth) +
                                         " bits a sample, allowed are 8 and 10");
  }
  if (static_cast<int>(format.chroma) > static_cast<int>(container::Chroma::k444)) {
    return fail(ErrorCode::kInvalid, track_name(format) + ": unknown chroma format");
  }
  if (format.codec_private.size() > limits::kCodecPrivateBytes) {
    return fail(ErrorCode::kLimit, track_name(format) + ": codec_private has " +
                                       std::to_string(format.codec_private.size()) +
                                       " bytes, allowed are " +
                                       std::to_string(limits::kCodecPrivateBytes));
  }
  if (const Status checked = check_private(format.codec, format.codec_private); !checked) {
    return fail(checked.error().code,
                track_name(format) + ": codec_private: " + checked.error().message);
  }
  return {};
}

/// Walks the slices of an FFV1 packet (RFC 9043, section 4.8) from the last to the first: 24 bits
/// of size, a status byte and a CRC that makes the whole slice's zero. libavcodec fills a damaged
/// slice from the picture before, and says so only in its log.
bool ffv1_intact(std::span<const std::uint8_t> packet) {
  constexpr std::size_t kFooter = 8;
  const AVCRC* table = av_crc_get_table(AV_CRC_32_IEEE);
  while (!packet.empty()) {
    if (packet.size() < kFooter) return false;
    const std::uint8_t* f = packet.data() + packet.size() - kFooter;
    const std::size_t size =
        ((std::size_t{f[0]} << 16) | (std::size_t{f[1]} << 8) | f[2]) + kFooter;
    if (size > packet.size()) return false;
    const auto slice = packet.last(size);
    if (av_crc(table, 0, slice.data(), slice.size()) != 0) return false;
    packet = packet.first(packet.size() - size);
  }
  return true;
}

}  // namespace

VideoFrame::VideoFrame() : frame_(av_frame_alloc()) {}

VideoFrame::VideoFrame(const VideoFrame& other) : VideoFrame() { *this = other; }

VideoFrame::VideoFrame(VideoFrame&& other) noexcept
    : frame_(std::exchange(other.frame_, nullptr)) {}

VideoFrame& VideoFrame::operator=(const VideoFrame& other) {
  if (this == &other) return *this;
  clear();
  if (frame_ == nullptr) frame_ = av_frame_alloc();
  // Out of memory leaves an empty frame, which the users check for.
  if (frame_ != nullptr && !other.empty() && av_frame_ref(frame_, other.frame_) < 0) clear();
  return *this;
}

VideoFrame& VideoFrame::operator=(VideoFrame&& other) noexcept {
  std::swap(frame_, other.frame_);
  return *this;
}

VideoFrame::~VideoFrame() { av_frame_free(&frame_); }

bool VideoFrame::empty() const { return frame_ == nullptr || frame_->buf[0] == nullptr; }

void VideoFrame::clear() {
  if (frame_ != nullptr) av_frame_unref(frame_);
}

std::int64_t VideoFrame::pts() const { return empty() ? AV_NOPTS_VALUE : frame_->pts; }

SampleView VideoFrame::component(int index) const {
  const AVPixFmtDescriptor* d = av_pix_fmt_desc_get(static_cast<AVPixelFormat>(frame_->format));
  // Planes, not components: AVPixFmtDescriptor lists those of GBR formats as R, G, B, while the
  // bitstream's (and the data pointers') order is G, B, R.
  const bool chroma = index > 0;
  SampleView view;
  view.data = frame_->data[index];
  view.stride_bytes = frame_->linesize[index];
  view.width = chroma ? AV_CEIL_RSHIFT(frame_->width, d->log2_chroma_w) : frame_->width;
  view.height = chroma ? AV_CEIL_RSHIFT(frame_->height, d->log2_chroma_h) : frame_->height;
  view.bytes_per_sample = d->comp[0].step;
  return view;
}

VideoDecoder::VideoDecoder(VideoDecoder&&) noexcept = default;
VideoDecoder& VideoDecoder::operator=(VideoDecoder&&) noexcept = default;
VideoDecoder::~VideoDecoder() = default;

Result<VideoDecoder> VideoDecoder::open(const VideoFormat& format, int threads) {
  RELIT_TRY(check_format(format));
  const AVCodec* codec = find_decoder(format.codec);
  if (codec == nullptr) {
    return fail(ErrorCode::kUnsupported, track_name(format) +
                                             ": no such decoder here; known are h264, hevc, mpeg4, "
                                             "ffv1, vp9 and av1, as far as libavcodec has them");
  }
  VideoDecoder decoder;
  decoder.context_.reset(avcodec_alloc_context3(codec));
  decoder.packet_.reset(av_packet_alloc());
  if (!decoder.context_ || !decoder.packet_) {
    return fail(ErrorCode::kOutOfMemory, track_name(format) + ": no memory for a decoder");
  }
  AVCodecContext& context = *decoder.context_;
  if (!format.codec_private.empty()) {
    context.extradata = static_cast<std::uint8_t*>(
        av_mallocz(format.codec_private.size() + AV_INPUT_BUFFER_PADDING_SIZE));
    if (context.extradata == nullptr) {
      return fail(ErrorCode::kOutOfMemory, track_name(format) + ": no memory for codec_private");
    }
    std::copy(format.codec_private.begin(), format.codec_private.end(), context.extradata);
    context.extradata_size = static_cast<int>(format.codec_private.size());
  }
  context.width = format.width;
  context.height = format.height;
  // Codecs hold more than the picture against this: it is rounded up to their largest block, and
  // the edge buffer of the MPEG family has 280 rows of any width.
  context.max_pixels = std::int64_t{((format.width + 127) & ~127) + 256} *
                       std::max((format.height + 127) & ~127, 512);
  context.thread_count = std::clamp(threads, 1, 64);
  context.thread_type = FF_THREAD_FRAME | FF_THREAD_SLICE;
  context.idct_algo = FF_IDCT_SIMPLE;
  // Without it x86 takes approximations of MPEG-4's rounded half samples.
  context.flags |= AV_CODEC_FLAG_BITEXACT;
  context.error_concealment = 0;
  context.err_recognition = AV_EF_CRCCHECK | AV_EF_BITSTREAM | AV_EF_BUFFER | AV_EF_EXPLODE;
  context.workaround_bugs = 0;
  context.log_level_offset = ffmpeg::kQuiet;
  context.opaque = reinterpret_cast<void*>((std::intptr_t{format.bit_depth} << 8) |
                                           static_cast<std::intptr_t>(format.chroma));
  context.get_format = choose_format;
  const int error = avcodec_open2(&context, codec, nullptr);
  if (error < 0) {
    return fail(ErrorCode::kCorrupt, track_name(format) +
                                         ": the decoder does not open: " + ffmpeg::reason(error) +
                                         "; its codec_private may be damaged");
  }
  decoder.format_ = format;
  decoder.threads_ = threads;
  return decoder;
}

Status VideoDecoder::reopen() {
  RELIT_ASSIGN(VideoDecoder fresh, open(format_, threads_));
  *this = std::move(fresh);
  return {};
}

Status VideoDecoder::send(std::span<const std::uint8_t> packet, std::int64_t pts, bool key) {
  const auto where = [&] { return track_name(format_) + ", frame " + std::to_string(pts); };
  if (packet.size() > limits::kRecordBytes) {
    return fail(ErrorCode::kLimit, where() + ": a packet of " + std::to_string(packet.size()) +
                                       " bytes, allowed are " +
                                       std::to_string(limits::kRecordBytes));
  }
  // Among others an empty packet, which would mean "drain" to libavcodec.
  if (const Status checked = check_packet(format_.codec, packet); !checked) {
    return fail(checked.error().code, where() + ": " + checked.error().message);
  }
  if (format_.codec == "ffv1" && !ffv1_intact(packet)) {
    return fail(ErrorCode::kCorrupt, where() +
                                         ": a slice's CRC is wrong; FFV1 has to be of version 3 "
                                         "with slice CRCs");
  }
  packet_->data = const_cast<std::uint8_t*>(packet.data());
  packet_->size = static_cast<int>(packet.size());
  packet_->pts = pts;
  packet_->dts = AV_NOPTS_VALUE;
  packet_->flags = key ? AV_PKT_FLAG_KEY : 0;
  // Without a buffer of its own the packet is copied, and gets its zero padding, inside.
  const int error = avcodec_send_packet(context_.get(), packet_.get());
  packet_->data = nullptr;
  packet_->size = 0;
  if (error < 0) {
    return fail(error == AVERROR(ENOMEM) ? ErrorCode::kOutOfMemory : ErrorCode::kCorrupt,
                where() + ": the packet does not decode: " + ffmpeg::reason(error));
  }
  return {};
}

Status VideoDecoder::drain() {
  const int error = avcodec_send_packet(context_.get(), nullptr);
  if (error < 0 && error != AVERROR_EOF) {
    return fail(ErrorCode::kCorrupt,
                track_name(format_) + ": draining failed: " + ffmpeg::reason(error));
  }
  return {};
}

Result<VideoDecoder::Received> VideoDecoder::receive(VideoFrame& out) {
  out.clear();
  if (out.frame_ == nullptr) out.frame_ = av_frame_alloc();
  if (out.frame_ == nullptr) {
    return fail(ErrorCode::kOutOfMemory, track_name(format_) + ": no memory for a picture");
  }
  const int error = avcodec_receive_frame(context_.get(), out.frame_);
  if (error == AVERROR(EAGAIN)) return Received::kAgain;
  if (error == AVERROR_EOF) return Received::kEnd;
  if (error < 0) {
    return fail(error == AVERROR(ENOMEM) ? ErrorCode::kOutOfMemory : ErrorCode::kCorrupt,
                track_name(format_) + ": a picture does not decode: " + ffmpeg::reason(error));
  }
  if (auto checked = check(*out.frame_); !checked) {
    out.clear();
    return Unexpected{std::move(checked).error()};
  }
  return Received::kFrame;
}

Status VideoDecoder::check(const AVFrame& frame) const {
  const auto where = [&] { return track_name(format_) + ", frame " + std::to_string(frame.pts); };
  if (frame.width != format_.width || frame.height != format_.height) {
    return fail(ErrorCode::kCorrupt,
                where() + ": a picture of " + std::to_string(frame.width) + "x" +
                    std::to_string(frame.height) + ", the layer's record promises " +
                    std::to_string(format_.width) + "x" + std::to_string(format_.height));
  }
  const auto pixel = static_cast<AVPixelFormat>(frame.format);
  if (!acceptable(format_, pixel)) {
    const char* name = av_get_pix_fmt_name(pixel);
    return fail(ErrorCode::kCorrupt, where() + ": samples are " + (name ? name : "unknown") +
                                         ", not what the layer's record promises");
  }
  if (frame.decode_error_flags != 0 || (frame.flags & AV_FRAME_FLAG_CORRUPT) != 0) {
    return fail(ErrorCode::kCorrupt, where() + ": the picture is damaged");
  }
  return {};
}

void VideoDecoder::flush() { avcodec_flush_buffers(context_.get()); }

std::uint64_t picture_bytes(int width, int height, container::Chroma chroma, int bit_depth) {
  const auto w = static_cast<std::uint64_t>(width), h = static_cast<std::uint64_t>(height);
  const std::uint64_t half = ((w + 1) / 2) * ((h + 1) / 2);
  std::uint64_t samples = w * h;
  if (chroma == container::Chroma::k420) samples += 2 * half;
  if (chroma == container::Chroma::k444) samples *= 3;
  return samples * (bit_depth > 8 ? 2 : 1);
}

}  // namespace relit::decoders
