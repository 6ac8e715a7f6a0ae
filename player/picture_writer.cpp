// SPDX-License-Identifier: MIT
#include "player/picture_writer.hpp"

#include <unistd.h>

#include <array>
#include <cstring>
#include <map>
#include <string>
#include <vector>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/mem.h>
#include <libavutil/opt.h>
#include <libswscale/swscale.h>
}

#include "container/byte_sink.hpp"
#include "decoders/ffmpeg.hpp"

namespace relit::player {
namespace {

namespace ffmpeg = decoders::ffmpeg;

// What an extension stands for.
struct Format {
  const char* extension;
  const char* muxer;  // null: the packet is the file
  const char* encoder;
  AVPixelFormat pixels;
};
constexpr std::array<Format, 4> kFormats{{
    {".png", nullptr, "png", AV_PIX_FMT_RGB24},
    {".mp4", "mp4", "libx264", AV_PIX_FMT_YUV420P},
    {".webp", "webp", "libwebp_anim", AV_PIX_FMT_BGRA},
    {".gif", "gif", "gif", AV_PIX_FMT_PAL8},
}};

// Where "%d" or "%04d" stands in a name.
struct Pattern {
  std::size_t begin = std::string::npos, end = 0;
  int digits = 0;
};

Pattern find_pattern(const std::string& name) {
  for (std::size_t at = name.find('%'); at != std::string::npos; at = name.find('%', at + 1)) {
    std::size_t i = at + 1;
    int digits = 0;
    while (i < name.size() && name[i] >= '0' && name[i] <= '9' && digits < 100)
      digits = digits * 10 + (name[i++] - '0');
    if (i < name.size() && name[i] == 'd' && digits <= 20) return {at, i + 1, digits};
  }
  return {};
}

// The encoder and the colour conversion that all formats share.
class Encoder {
 public:
  Status open(const Format& format, const PictureWriter::Options& options, bool global_header);
  Result<AVFrame*> convert(std::span<const std::uint8_t> rgba);
  [[nodiscard]] AVCodecContext* context() { return context_.get(); }
  [[nodiscard]] AVPacket* packet() { return packet_.get(); }

 private:
  ffmpeg::Codec context_;
  ffmpeg::Frame frame_;
  ffmpeg::Packet packet_;
  ffmpeg::Scaler scaler_;
};

Status Encoder::open(const Format& format, const PictureWriter::Options& options,
                     bool global_header) {
  const std::string where = options.path.string();
  const AVCodec* codec = avcodec_find_encoder_by_name(format.encoder);
  if (codec == nullptr) {
    return fail(ErrorCode::kEnvironment, where + ": this FFmpeg has no encoder " + format.encoder);
  }
  context_.reset(avcodec_alloc_context3(codec));
  frame_.reset(av_frame_alloc());
  packet_.reset(av_packet_alloc());
  if (!context_ || !frame_ || !packet_)
    return fail(ErrorCode::kOutOfMemory, where + ": out of memory");
  AVCodecContext& c = *context_;
  c.width = options.width;
  c.height = options.height;
  c.pix_fmt = format.pixels;
  c.time_base = {static_cast<int>(options.tick_rate.den), static_cast<int>(options.tick_rate.num)};
  c.framerate = av_inv_q(c.time_base);
  c.thread_count = 1;
  if (global_header) c.flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  if (std::strcmp(format.encoder, "libx264") == 0) {
    c.colorspace = AVCOL_SPC_BT709;
    c.color_primaries = AVCOL_PRI_BT709;
    c.color_trc = AVCOL_TRC_IEC61966_2_1;
    c.color_range = AVCOL_RANGE_MPEG;
    av_opt_set(c.priv_data, "crf", "17", 0);
    av_opt_set(c.priv_data, "preset", "medium", 0);
  }
  if (std::strcmp(format.encoder, "libwebp_anim") == 0) {
    av_opt_set(c.priv_data, "quality", "88", 0);
  }
  if (const int code = avcodec_open2(&c, codec, nullptr); code < 0) {
    return fail(ErrorCode::kInvalid, where + ": " + format.encoder + " refuses " +
                                         std::to_string(c.width) + "x" + std::to_string(c.height) +
                                         " pictures: " + ffmpeg::reason(code));
  }
  frame_->format = c.pix_fmt;
  frame_->width = c.width;
  frame_->height = c.height;
  if (av_frame_get_buffer(frame_.get(), 0) < 0)
    return fail(ErrorCode::kOutOfMemory, where + ": out of memory");
  if (c.pix_fmt == AV_PIX_FMT_PAL8) return {};
  scaler_.reset(sws_getContext(c.width, c.height, AV_PIX_FMT_RGBA, c.width, c.height, c.pix_fmt,
                               SWS_BICUBIC | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT, nullptr,
                               nullptr, nullptr));
  if (!scaler_)
    return fail(ErrorCode::kEnvironment, where + ": libswscale cannot convert the pictures");
  const int* bt709 = sws_getCoefficients(SWS_CS_ITU709);
  sws_setColorspaceDetails(scaler_.get(), bt709, 1, bt709, 0, 0, 1 << 16, 1 << 16);
  return {};
}

Result<AVFrame*> Encoder::convert(std::span<const std::uint8_t> rgba) {
  if (const int code = av_frame_make_writable(frame_.get()); code < 0) {
    return fail(ErrorCode::kOutOfMemory, "picture: " + ffmpeg::reason(code));
  }
  AVCodecContext& c = *context_;
  if (c.pix_fmt == AV_PIX_FMT_PAL8) {
    std::vector<std::uint8_t> indices(rgba.size() / 4);
    PalettePicture picture;
    picture.indices = indices;
    quantize_to_palette(rgba, c.width, picture);
    for (int y = 0; y < c.height; ++y) {
      std::memcpy(frame_->data[0] + y * frame_->linesize[0],
                  &indices[static_cast<std::size_t>(y) * static_cast<std::size_t>(c.width)],
                  static_cast<std::size_t>(c.width));
    }
    std::memcpy(frame_->data[1], picture.palette.data(), sizeof picture.palette);
    return frame_.get();
  }
  const std::uint8_t* rows[4] = {rgba.data(), nullptr, nullptr, nullptr};
  const int strides[4] = {4 * c.width, 0, 0, 0};
  sws_scale(scaler_.get(), rows, strides, 0, c.height, frame_->data, frame_->linesize);
  return frame_.get();
}

Status check_size(const PictureWriter::Options& options, std::span<const std::uint8_t> rgba) {
  if (rgba.size() ==
      4 * static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height))
    return {};
  return fail(ErrorCode::kInvalid, options.path.string() + ": a picture of another size");
}

// One file per picture.
class StillWriter final : public PictureWriter {
 public:
  Status open(const Format& format, const Options& options) {
    options_ = options;
    format_ = &format;
    pattern_ = find_pattern(options.path.filename().string());
    if (options.pictures > 1 && pattern_.begin == std::string::npos) {
      return fail(ErrorCode::kInvalid,
                  options.path.string() +
                      ": one .png holds one picture; take .mp4, .webp or .gif for several, a "
                      "name with %04d for numbered files, or --sheet for a contact sheet");
    }
    Encoder probe;
    return probe.open(format, options, false);
  }

  Status add(std::span<const std::uint8_t> rgba, std::uint32_t /*ticks*/) override {
    RELIT_TRY(check_size(options_, rgba));
    // FFmpeg's still encoders take one picture each.
    Encoder encoder;
    RELIT_TRY(encoder.open(*format_, options_, false));
    RELIT_ASSIGN(AVFrame * frame, encoder.convert(rgba));
    frame->pts = 0;
    int code = avcodec_send_frame(encoder.context(), frame);
    if (code >= 0) code = avcodec_send_frame(encoder.context(), nullptr);
    if (code >= 0) code = avcodec_receive_packet(encoder.context(), encoder.packet());
    const std::filesystem::path path = numbered_path();
    if (code < 0)
      return fail(ErrorCode::kEnvironment,
                  path.string() + ": cannot encode: " + ffmpeg::reason(code));
    ++written_;
    return write(path, {encoder.packet()->data, static_cast<std::size_t>(encoder.packet()->size)});
  }

  Status finish() override { return {}; }

 private:
  [[nodiscard]] std::filesystem::path numbered_path() const {
    if (pattern_.begin == std::string::npos) return options_.path;
    std::string name = options_.path.filename().string();
    std::string number = std::to_string(written_);
    const auto digits = static_cast<std::size_t>(pattern_.digits);
    if (number.size() < digits) number.insert(0, digits - number.size(), '0');
    name.replace(pattern_.begin, pattern_.end - pattern_.begin, number);
    return options_.path.parent_path() / name;
  }

  static Status write(const std::filesystem::path& path, std::span<const std::uint8_t> bytes) {
    RELIT_ASSIGN(const auto sink, container::FileSink::create(path.string()));
    RELIT_TRY(sink->write(bytes));
    return sink->commit();
  }

  Options options_;
  const Format* format_ = nullptr;
  Pattern pattern_;
  std::uint64_t written_ = 0;
};

// All pictures in one file. Not through FileSink: the MP4 muxer reads what it wrote, to move the
// index to the front.
class MovieWriter final : public PictureWriter {
 public:
  ~MovieWriter() override {
    if (muxer_ != nullptr && muxer_->pb != nullptr) avio_closep(&muxer_->pb);
    avformat_free_context(muxer_);
    std::error_code ignored;
    if (!part_.empty()) std::filesystem::remove(part_, ignored);
  }

  Status open(const Format& format, const Options& options) {
    options_ = options;
    const std::string where = options.path.string();
    if (format.pixels == AV_PIX_FMT_YUV420P &&
        (options.width % 2 != 0 || options.height % 2 != 0)) {
      return fail(ErrorCode::kInvalid, where + ": .mp4 needs an even width and height");
    }
    if (avformat_alloc_output_context2(&muxer_, nullptr, format.muxer, nullptr) < 0) {
      return fail(ErrorCode::kEnvironment, where + ": this FFmpeg has no muxer " + format.muxer);
    }
    RELIT_TRY(encoder_.open(format, options, (muxer_->oformat->flags & AVFMT_GLOBALHEADER) != 0));
    stream_ = avformat_new_stream(muxer_, nullptr);
    if (stream_ == nullptr ||
        avcodec_parameters_from_context(stream_->codecpar, encoder_.context()) < 0) {
      return fail(ErrorCode::kOutOfMemory, where + ": out of memory");
    }
    stream_->time_base = encoder_.context()->time_base;
    stream_->avg_frame_rate = encoder_.context()->framerate;
    part_ = options.path;
    part_ += "." + std::to_string(::getpid()) + ".part";
    AVDictionary* settings = nullptr;
    av_dict_set(&settings, "movflags", "+faststart", 0);
    av_dict_set(&settings, "loop", "0", 0);
    const std::string address = "file:" + part_.string();
    muxer_->url = av_strdup(address.c_str());
    int code = avio_open(&muxer_->pb, address.c_str(), AVIO_FLAG_WRITE);
    if (code >= 0) code = avformat_write_header(muxer_, &settings);
    av_dict_free(&settings);
    if (code < 0)
      return fail(ErrorCode::kIo, where + ": cannot be written: " + ffmpeg::reason(code));
    return {};
  }

  Status add(std::span<const std::uint8_t> rgba, std::uint32_t ticks) override {
    RELIT_TRY(check_size(options_, rgba));
    RELIT_ASSIGN(AVFrame * frame, encoder_.convert(rgba));
    frame->pts = next_pts_;
    ticks_[next_pts_] = ticks;
    next_pts_ += ticks;
    return encode(frame);
  }

  Status finish() override {
    RELIT_TRY(encode(nullptr));
    int code = av_write_trailer(muxer_);
    const int closed = avio_closep(&muxer_->pb);
    if (code >= 0) code = closed;
    if (code < 0)
      return fail(ErrorCode::kIo,
                  options_.path.string() + ": cannot be written: " + ffmpeg::reason(code));
    std::error_code error;
    std::filesystem::rename(part_, options_.path, error);
    if (error)
      return fail(ErrorCode::kIo,
                  options_.path.string() + ": cannot be written: " + error.message());
    part_.clear();
    return {};
  }

 private:
  Status encode(AVFrame* frame) {
    const std::string where = options_.path.string();
    int code = avcodec_send_frame(encoder_.context(), frame);
    if (code < 0)
      return fail(ErrorCode::kEnvironment, where + ": cannot encode: " + ffmpeg::reason(code));
    AVPacket* packet = encoder_.packet();
    while ((code = avcodec_receive_packet(encoder_.context(), packet)) >= 0) {
      const auto shown = ticks_.find(packet->pts);
      packet->duration = shown == ticks_.end() ? 1 : shown->second;
      if (shown != ticks_.end()) ticks_.erase(shown);
      av_packet_rescale_ts(packet, encoder_.context()->time_base, stream_->time_base);
      packet->stream_index = stream_->index;
      if (const int written = av_interleaved_write_frame(muxer_, packet); written < 0) {
        return fail(ErrorCode::kIo, where + ": cannot be written: " + ffmpeg::reason(written));
      }
    }
    if (code != AVERROR(EAGAIN) && code != AVERROR_EOF) {
      return fail(ErrorCode::kEnvironment, where + ": cannot encode: " + ffmpeg::reason(code));
    }
    return {};
  }

  Options options_;
  Encoder encoder_;
  AVFormatContext* muxer_ = nullptr;
  AVStream* stream_ = nullptr;
  std::filesystem::path part_;
  std::int64_t next_pts_ = 0;
  std::map<std::int64_t, std::int64_t> ticks_;  // of the pictures inside the encoder, by pts
};

template <class Writer>
Result<std::unique_ptr<PictureWriter>> opened(const Format& format,
                                              const PictureWriter::Options& options) {
  auto writer = std::make_unique<Writer>();
  RELIT_TRY(writer->open(format, options));
  return std::unique_ptr<PictureWriter>(std::move(writer));
}

}  // namespace

Result<std::unique_ptr<PictureWriter>> PictureWriter::create(const Options& options) {
  const std::string extension = options.path.extension().string();
  for (const Format& format : kFormats) {
    if (extension != format.extension) continue;
    if (options.width < 1 || options.height < 1 || options.width > 16384 ||
        options.height > 16384) {
      return fail(ErrorCode::kInvalid,
                  options.path.string() + ": pictures must be 1 to 16384 pixels wide and high");
    }
    return format.muxer == nullptr ? opened<StillWriter>(format, options)
                                   : opened<MovieWriter>(format, options);
  }
  return fail(ErrorCode::kInvalid,
              options.path.string() + ": the extension must be .png, .mp4, .webp or .gif");
}

}  // namespace relit::player
