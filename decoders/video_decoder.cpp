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

const AVCodec* find_software(std::string_view name) {
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

std::size_t VideoFrame::buffer_bytes() const {
  std::size_t bytes = 0;
  for (const AVBufferRef* buffer : frame_->buf) bytes += buffer != nullptr ? buffer->size : 0;
  return bytes;
}

bool VideoFrame::same_picture(const VideoFrame& other) const {
  return !empty() && !other.empty() && frame_->data[0] == other.frame_->data[0];
}

struct VideoDecoder::Hooks {
  int bit_depth = 8;
  container::Chroma chroma = container::Chroma::kLuma;
  std::shared_ptr<PicturePool> pool;

  static AVPixelFormat choose_format(AVCodecContext* context, const AVPixelFormat* offered) {
    const auto* hooks = static_cast<const Hooks*>(context->opaque);
    VideoFormat format;
    format.bit_depth = hooks->bit_depth;
    format.chroma = hooks->chroma;
    for (; *offered != AV_PIX_FMT_NONE; ++offered) {
      if (acceptable(format, *offered)) return *offered;
    }
    return AV_PIX_FMT_NONE;
  }

  static int get_buffer(AVCodecContext* context, AVFrame* frame, int flags) {
    return static_cast<Hooks*>(context->opaque)->pool->get_buffer(*context, *frame, flags);
  }
};

VideoDecoder::VideoDecoder() = default;
VideoDecoder::VideoDecoder(VideoDecoder&&) noexcept = default;
VideoDecoder::~VideoDecoder() = default;

VideoDecoder& VideoDecoder::operator=(VideoDecoder&& other) noexcept {
  // libavcodec's threads may call the hooks until their context is gone.
  context_ = std::move(other.context_);
  hooks_ = std::move(other.hooks_);
  packet_ = std::move(other.packet_);
  format_ = std::move(other.format_);
  options_ = std::move(other.options_);
  named_ = other.named_;
  proven_ = other.proven_;
  note_ = std::move(other.note_);
  return *this;
}

const PicturePool& VideoDecoder::pool() const { return *hooks_->pool; }

Result<VideoDecoder> VideoDecoder::open(const VideoFormat& format,
                                        const VideoDecoderOptions& options) {
  RELIT_TRY(check_format(format));
  const AVCodec* software = find_software(format.codec);
  if (software == nullptr) {
    return fail(ErrorCode::kUnsupported, track_name(format) +
                                             ": no such decoder here; known are h264, hevc, mpeg4, "
                                             "ffv1, vp9 and av1, as far as libavcodec has them");
  }
  if (options.name.empty()) return open_codec(format, options, *software);
  const AVCodec* named = avcodec_find_decoder_by_name(options.name.c_str());
  if (named != nullptr && named->id != software->id) return open_codec(format, options, *software);
  std::string why = "libavcodec here has no such decoder";
  if (named != nullptr) {
    auto decoder = open_codec(format, options, *named);
    if (decoder) {
      decoder->named_ = true;
      return decoder;
    }
    why = decoder.error().message;
  }
  RELIT_ASSIGN(VideoDecoder decoder, open_codec(format, options, *software));
  decoder.note_ = track_name(format) + ": " + options.name + " is not used, software is: " + why;
  return decoder;
}

Status VideoDecoder::copy_private() {
  AVCodecContext& context = *context_;
  const auto& bytes = format_.codec_private;
  if (bytes.empty()) return {};
  context.extradata =
      static_cast<std::uint8_t*>(av_mallocz(bytes.size() + AV_INPUT_BUFFER_PADDING_SIZE));
  if (context.extradata == nullptr) {
    return fail(ErrorCode::kOutOfMemory, track_name(format_) + ": no memory for codec_private");
  }
  std::copy(bytes.begin(), bytes.end(), context.extradata);
  context.extradata_size = static_cast<int>(bytes.size());
  return {};
}

Result<VideoDecoder> VideoDecoder::open_codec(const VideoFormat& format,
                                              const VideoDecoderOptions& options,
                                              const AVCodec& codec) {
  VideoDecoder decoder;
  decoder.format_ = format;
  decoder.options_ = options;
  decoder.context_.reset(avcodec_alloc_context3(&codec));
  decoder.packet_.reset(av_packet_alloc());
  if (!decoder.context_ || !decoder.packet_) {
    return fail(ErrorCode::kOutOfMemory, track_name(format) + ": no memory for a decoder");
  }
  RELIT_TRY(decoder.copy_private());
  decoder.hooks_ = std::make_unique<Hooks>();
  decoder.hooks_->bit_depth = format.bit_depth;
  decoder.hooks_->chroma = format.chroma;
  decoder.hooks_->pool = std::make_shared<PicturePool>(options.memory);
  AVCodecContext& context = *decoder.context_;
  context.width = format.width;
  context.height = format.height;
  // Codecs hold more than the picture against this: it is rounded up to their largest block, and
  // the edge buffer of the MPEG family has 280 rows of any width.
  context.max_pixels = std::int64_t{((format.width + 127) & ~127) + 256} *
                       std::max((format.height + 127) & ~127, 512);
  context.thread_count = std::clamp(options.threads, 1, 64);
  context.thread_type = FF_THREAD_FRAME | FF_THREAD_SLICE;
  context.idct_algo = FF_IDCT_SIMPLE;
  // Without it x86 takes approximations of MPEG-4's rounded half samples.
  context.flags |= AV_CODEC_FLAG_BITEXACT;
  context.error_concealment = 0;
  context.err_recognition = AV_EF_CRCCHECK | AV_EF_BITSTREAM | AV_EF_BUFFER | AV_EF_EXPLODE;
  context.workaround_bugs = 0;
  context.log_level_offset = ffmpeg::kQuiet;
  context.opaque = decoder.hooks_.get();
  context.get_format = Hooks::choose_format;
  if ((codec.capabilities & AV_CODEC_CAP_DR1) != 0) context.get_buffer2 = Hooks::get_buffer;
#if FF_API_THREAD_SAFE_CALLBACKS
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
  // Else frame threads would wait for the thread that sends packets whenever they need a buffer.
  context.thread_safe_callbacks = 1;
#pragma GCC diagnostic pop
#endif
  const int error = avcodec_open2(&context, &codec, nullptr);
  if (error < 0) {
    return fail(ErrorCode::kCorrupt, track_name(format) +
                                         ": the decoder does not open: " + ffmpeg::reason(error) +
                                         "; its codec_private may be damaged");
  }
  return decoder;
}

Status VideoDecoder::reopen() {
  const AVCodec* codec = context_->codec;
  RELIT_ASSIGN(VideoDecoder fresh, open_codec(format_, options_, *codec));
  fresh.named_ = named_;
  fresh.proven_ = proven_;
  fresh.note_ = std::move(note_);
  *this = std::move(fresh);
  return {};
}

bool VideoDecoder::fell_back() {
  if (!named_ || proven_) return false;
  auto software = open_codec(format_, options_, *find_software(format_.codec));
  if (!software) return false;
  software->note_ = track_name(format_) + ": " + options_.name +
                    " failed before its first picture, software takes its place";
  *this = std::move(*software);
  return true;
}

Status VideoDecoder::send(std::span<const std::uint8_t> packet, std::int64_t pts, bool key,
                          bool shown) {
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
  // Whatever was sent before has been taken in: receive() has said kAgain.
  context_->skip_frame = shown ? AVDISCARD_DEFAULT : AVDISCARD_NONREF;
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
  proven_ = true;
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

namespace {

/// What the software decoders make of the streams that relit-bake writes.
AVPixelFormat decoded_pixels(const VideoFormat& format) {
  const bool deep = format.bit_depth > 8;
  if (format.chroma == container::Chroma::k444) {
    return deep ? AV_PIX_FMT_YUV444P10 : AV_PIX_FMT_YUV444P;
  }
  // Gray comes with chroma that nobody reads, 4:2:0 from H.264 and MPEG-4.
  const bool gray = format.chroma == container::Chroma::kLuma && format.codec != "h264" &&
                    format.codec != "mpeg4";
  if (gray && format.codec == "vp9") return deep ? AV_PIX_FMT_GBRP10 : AV_PIX_FMT_GBRP;
  if (gray) return deep ? AV_PIX_FMT_GRAY10 : AV_PIX_FMT_GRAY8;
  return deep ? AV_PIX_FMT_YUV420P10 : AV_PIX_FMT_YUV420P;
}

}  // namespace

Result<std::uint64_t> picture_buffer_bytes(const VideoFormat& format) {
  RELIT_TRY(check_format(format));
  const AVCodec* codec = find_software(format.codec);
  const ffmpeg::Codec context(codec != nullptr ? avcodec_alloc_context3(codec) : nullptr);
  if (!context) {
    return fail(ErrorCode::kUnsupported, track_name(format) + ": no such decoder here");
  }
  context->pix_fmt = decoded_pixels(format);
  // Coded sizes are whole blocks, also where the stream crops them.
  const int block = format.codec == "h264" ? 16 : format.codec == "hevc" ? 8 : 1;
  const auto coded = [block](int side) { return (side + block - 1) / block * block; };
  const auto layout = picture_layout(*context, coded(format.width), coded(format.height));
  return static_cast<std::uint64_t>(layout.bytes);
}

std::uint64_t picture_bytes(int width, int height, container::Chroma chroma, int bit_depth) {
  const auto w = static_cast<std::uint64_t>(width), h = static_cast<std::uint64_t>(height);
  const std::uint64_t half = ((w + 1) / 2) * ((h + 1) / 2);
  std::uint64_t samples = w * h;
  if (chroma == container::Chroma::k420) samples += 2 * half;
  if (chroma == container::Chroma::k444) samples *= 3;
  return samples * (bit_depth > 8 ? 2 : 1);
}

}  // namespace relit::decoders
