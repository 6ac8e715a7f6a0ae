// SPDX-License-Identifier: MIT
#include "bake_minimal/video_encoder.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/opt.h>
#include <libavutil/pixdesc.h>
}

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <span>

#include "decoders/codec_private.hpp"

namespace relit::bake {
namespace {

using container::Chroma;

/// Rate control weighs frames by their duration. A fixed rate makes quality independent of the
/// clip's.
constexpr int kNominalRate = 25;

const char* encoder_name(const std::string& codec) {
  if (codec == "h264") return "libx264";
  if (codec == "hevc") return "libx265";
  if (codec == "vp9") return "libvpx-vp9";
  if (codec == "av1") return "libaom-av1";
  return codec.c_str();
}

AVPixelFormat pixel_format(const VideoSettings& s) {
  const bool deep = s.bit_depth > 8;
  switch (s.chroma) {
    case Chroma::k420:
      return deep ? AV_PIX_FMT_YUV420P10 : AV_PIX_FMT_YUV420P;
    case Chroma::k444:
      return deep ? AV_PIX_FMT_YUV444P10 : AV_PIX_FMT_YUV444P;
    case Chroma::kLuma:
      break;
  }
  // VP9 has no monochrome: its chroma is constant, and costs next to nothing.
  if (s.codec == "vp9") return deep ? AV_PIX_FMT_YUV420P10 : AV_PIX_FMT_YUV420P;
  return deep ? AV_PIX_FMT_GRAY10 : AV_PIX_FMT_GRAY8;
}

/// Independent of the locale.
std::string number(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), end.ptr};
}

class Options {
 public:
  ~Options() { av_dict_free(&dictionary_); }
  void set(const char* key, const std::string& value) {
    av_dict_set(&dictionary_, key, value.c_str(), 0);
  }
  AVDictionary** get() { return &dictionary_; }
  [[nodiscard]] const char* left_over() const {
    const AVDictionaryEntry* e = av_dict_get(dictionary_, "", nullptr, AV_DICT_IGNORE_SUFFIX);
    return e != nullptr ? e->key : nullptr;
  }

 private:
  AVDictionary* dictionary_ = nullptr;
};

void configure_x264(const VideoSettings& s, AVCodecContext& context, Options& options) {
  context.refs = s.reference_frames;
  if (s.reordering == Reordering::kNone) context.max_b_frames = 0;
  if (s.reordering == Reordering::kFlat) options.set("b-pyramid", "none");
  options.set("preset", s.preset);
  options.set("tune", "psnr");
  options.set("forced-idr", "1");
  // FFmpeg's own crf option stops at 0; 10-bit quantisers go on to -12.
  options.set("x264-params", "scenecut=0:open-gop=0:cpu-independent=1:" +
                                 (s.lossless ? "qp=0" : "crf=" + number(s.crf)));
}

void configure_x265(const VideoSettings& s, Options& options) {
  options.set("preset", s.preset);
  options.set("tune", "psnr");
  options.set("forced-idr", "1");
  std::string p =
      "log-level=none:info=0:pools=none:frame-threads=1:wpp=0:scenecut=0:open-gop=0:keyint=" +
      std::to_string(s.segment_frames) + ":min-keyint=1:ref=" + std::to_string(s.reference_frames);
  if (s.reordering == Reordering::kNone) p += ":bframes=0";
  if (s.reordering == Reordering::kFlat) p += ":b-pyramid=0";
  // Pictures smaller than a coding tree unit are refused.
  if (std::min(s.width, s.height) < 64) p += ":ctu=16";
  // x265 3.5 writes its tree of costs eight blocks of 16 at a time, beyond the end of the heap
  // block where a row has another number.
  if (s.width % 128 != 0) p += ":cutree=0";
  p += s.lossless ? ":lossless=1" : ":crf=" + number(s.crf);
  options.set("x265-params", p);
}

void configure_mpeg4(const VideoSettings& s, AVCodecContext& context, Options& options) {
  const double step = std::exp2((s.crf - 10) / 6);
  const int qscale = std::clamp(static_cast<int>(std::lround(step)), 1, 31);
  context.flags |= AV_CODEC_FLAG_QSCALE | AV_CODEC_FLAG_4MV | AV_CODEC_FLAG_AC_PRED;
  context.global_quality = qscale * FF_QP2LAMBDA;
  context.qmin = 1;
  context.mb_decision = FF_MB_DECISION_RD;
  context.trellis = 2;
  context.max_b_frames = 2;
  // The C transforms: the same bytes on every machine, and the decoder's inverse.
  context.dct_algo = FF_DCT_INT;
  context.idct_algo = FF_IDCT_SIMPLE;
  options.set("lmin", std::to_string(FF_QP2LAMBDA));
  options.set("sc_threshold", "1000000000");
}

void configure_libvpx(const VideoSettings& s, Options& options) {
  options.set("cpu-used", s.preset);
  options.set("row-mt", "0");
  options.set("lag-in-frames", "19");
  if (s.codec == "vp9") options.set("deadline", "good");
  if (s.lossless) {
    options.set("lossless", "1");
  } else {
    options.set("crf", std::to_string(std::lround(s.crf)));
    options.set("b", "0");
  }
}

void configure_ffv1(const VideoSettings& s, AVCodecContext& context, Options& options) {
  context.level = 3;  // CRCs
  // More slices than one only where the codec insists.
  context.slices = s.width <= 352 && s.height <= 288 ? 1 : 0;
  options.set("coder", "rice");
  options.set("slicecrc", "1");
}

void configure(const VideoSettings& s, AVCodecContext& context, Options& options) {
  context.width = s.width;
  context.height = s.height;
  context.pix_fmt = pixel_format(s);
  context.time_base = {1, kNominalRate};
  context.framerate = {kNominalRate, 1};
  context.color_range = AVCOL_RANGE_JPEG;
  context.gop_size = s.segment_frames;
  context.thread_count = 1;
  context.flags |= AV_CODEC_FLAG_GLOBAL_HEADER | AV_CODEC_FLAG_CLOSED_GOP | AV_CODEC_FLAG_BITEXACT;
  context.log_level_offset = decoders::ffmpeg::kQuiet;
  if (s.codec == "h264") configure_x264(s, context, options);
  if (s.codec == "hevc") configure_x265(s, options);
  if (s.codec == "mpeg4") configure_mpeg4(s, context, options);
  if (s.codec == "vp9" || s.codec == "av1") configure_libvpx(s, options);
  if (s.codec == "ffv1") configure_ffv1(s, context, options);
}

}  // namespace

VideoEncoder::VideoEncoder(VideoEncoder&&) noexcept = default;
VideoEncoder& VideoEncoder::operator=(VideoEncoder&&) noexcept = default;
VideoEncoder::~VideoEncoder() = default;

Result<VideoEncoder> VideoEncoder::start(const VideoSettings& settings) {
  const std::string name = encoder_name(settings.codec);
  const AVCodec* codec = avcodec_find_encoder_by_name(name.c_str());
  if (codec == nullptr) {
    return fail(ErrorCode::kEnvironment, "this libavcodec has no encoder " + name +
                                             "; install one with it, or use another --codec");
  }
  VideoEncoder encoder;
  encoder.settings_ = settings;
  encoder.context_.reset(avcodec_alloc_context3(codec));
  encoder.picture_.reset(av_frame_alloc());
  encoder.packet_.reset(av_packet_alloc());
  if (!encoder.context_ || !encoder.picture_ || !encoder.packet_) {
    return fail(ErrorCode::kOutOfMemory, "no memory for an encoder");
  }
  Options options;
  configure(settings, *encoder.context_, options);
  const int error = avcodec_open2(encoder.context_.get(), codec, options.get());
  if (error < 0) {
    return fail(ErrorCode::kEnvironment,
                name + " does not take pictures of " + std::to_string(settings.width) + "x" +
                    std::to_string(settings.height) + " with preset \"" + settings.preset +
                    "\": " + decoders::ffmpeg::reason(error));
  }
  if (const char* unknown = options.left_over()) {
    return fail(ErrorCode::kEnvironment, name + " has no option " + unknown);
  }
  RELIT_TRY(encoder.fill_grey());
  return encoder;
}

Result<VideoEncoder> VideoEncoder::open(const VideoSettings& settings) {
  RELIT_ASSIGN(VideoEncoder encoder, start(settings));
  RELIT_TRY(encoder.describe_stream());
  return encoder;
}

Result<std::vector<std::uint8_t>> VideoEncoder::headers() const {
  if (settings_.codec != "av1" || context_->extradata_size > 0) {
    return std::vector<std::uint8_t>(context_->extradata,
                                     context_->extradata + context_->extradata_size);
  }
  // FFmpeg's libaom tells its sequence header only in key packets. Another encoder with the same
  // settings has the same one.
  RELIT_ASSIGN(VideoEncoder other, start(settings_));
  other.picture_->pts = 0;
  int error = avcodec_send_frame(other.context_.get(), other.picture_.get());
  if (error >= 0) error = avcodec_send_frame(other.context_.get(), nullptr);
  if (error >= 0) error = avcodec_receive_packet(other.context_.get(), other.packet_.get());
  if (error < 0) {
    return fail(ErrorCode::kEnvironment,
                std::string(context_->codec->name) + " fails: " + decoders::ffmpeg::reason(error));
  }
  return std::vector<std::uint8_t>(other.packet_->data, other.packet_->data + other.packet_->size);
}

Status VideoEncoder::describe_stream() {
  RELIT_ASSIGN(const std::vector<std::uint8_t> extradata, headers());
  auto stored = decoders::stored_private(settings_.codec, extradata);
  if (!stored) {
    return fail(ErrorCode::kEnvironment,
                std::string(context_->codec->name) +
                    " gives headers that cannot be stored: " + stored.error().message);
  }
  codec_private_ = std::move(*stored);
  RELIT_ASSIGN(decoder_pictures_, decoders::decoder_pictures(settings_.codec, codec_private_));
  return {};
}

Status VideoEncoder::fill_grey() {
  AVFrame& picture = *picture_;
  picture.format = context_->pix_fmt;
  picture.width = settings_.width;
  picture.height = settings_.height;
  picture.color_range = AVCOL_RANGE_JPEG;
  if (av_frame_get_buffer(&picture, 0) < 0) {
    return fail(ErrorCode::kOutOfMemory, "no memory for a picture");
  }
  const auto grey = static_cast<std::uint16_t>(1 << (settings_.bit_depth - 1));
  for (int c = 0; c < av_pix_fmt_count_planes(context_->pix_fmt); ++c) {
    const SampleTarget plane = target(c);
    for (int y = 0; y < plane.height; ++y) {
      std::uint8_t* row = plane.data + y * plane.stride_bytes;
      for (int x = 0; x < plane.width; ++x) {
        if (plane.bytes_per_sample == 1) row[x] = static_cast<std::uint8_t>(grey);
        if (plane.bytes_per_sample == 2) std::memcpy(row + 2 * x, &grey, sizeof grey);
      }
    }
  }
  return {};
}

Status VideoEncoder::begin_picture() {
  // Encoders may keep a reference to the last picture.
  if (av_frame_make_writable(picture_.get()) < 0) {
    return fail(ErrorCode::kOutOfMemory, "no memory for a picture");
  }
  return {};
}

SampleTarget VideoEncoder::target(int component) {
  const AVPixFmtDescriptor* d = av_pix_fmt_desc_get(context_->pix_fmt);
  SampleTarget target;
  target.data = picture_->data[component];
  target.stride_bytes = picture_->linesize[component];
  target.width =
      component > 0 ? AV_CEIL_RSHIFT(picture_->width, d->log2_chroma_w) : picture_->width;
  target.height =
      component > 0 ? AV_CEIL_RSHIFT(picture_->height, d->log2_chroma_h) : picture_->height;
  target.bytes_per_sample = settings_.bit_depth > 8 ? 2 : 1;
  return target;
}

Status VideoEncoder::encode(std::int64_t pts, bool first_of_segment,
                            std::vector<CodedPacket>& out) {
  picture_->pts = pts;
  picture_->quality = context_->global_quality;
  picture_->pict_type = first_of_segment ? AV_PICTURE_TYPE_I : AV_PICTURE_TYPE_NONE;
  const int error = avcodec_send_frame(context_.get(), picture_.get());
  if (error < 0) {
    return fail(ErrorCode::kEnvironment, std::string(context_->codec->name) + " refuses frame " +
                                             std::to_string(pts) + ": " +
                                             decoders::ffmpeg::reason(error));
  }
  return receive(out);
}

Status VideoEncoder::finish(std::vector<CodedPacket>& out) {
  const int error = avcodec_send_frame(context_.get(), nullptr);
  if (error < 0) {
    return fail(ErrorCode::kEnvironment, std::string(context_->codec->name) + " does not finish: " +
                                             decoders::ffmpeg::reason(error));
  }
  return receive(out);
}

Status VideoEncoder::receive(std::vector<CodedPacket>& out) {
  for (;;) {
    const int error = avcodec_receive_packet(context_.get(), packet_.get());
    if (error == AVERROR(EAGAIN) || error == AVERROR_EOF) return {};
    if (error < 0) {
      return fail(ErrorCode::kEnvironment, std::string(context_->codec->name) +
                                               " fails: " + decoders::ffmpeg::reason(error));
    }
    CodedPacket packet;
    packet.pts = packet_->pts;
    packet.key = (packet_->flags & AV_PKT_FLAG_KEY) != 0;
    const std::span<const std::uint8_t> bytes(packet_->data,
                                              static_cast<std::size_t>(packet_->size));
    auto stored = decoders::stored_packet(settings_.codec, bytes);
    av_packet_unref(packet_.get());
    if (!stored) {
      return fail(ErrorCode::kEnvironment, std::string(context_->codec->name) + ", frame " +
                                               std::to_string(packet.pts) + ": " +
                                               stored.error().message);
    }
    packet.bytes = std::move(*stored);
    out.push_back(std::move(packet));
  }
}

}  // namespace relit::bake
