// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "container/base/plane_view.hpp"
#include "container/base/result.hpp"
#include "container/records.hpp"
#include "decoders/ffmpeg.hpp"
#include "decoders/picture_pool.hpp"

struct AVCodec;

/// libavcodec, restricted to what planes need: pictures as they were coded, never scaled, never
/// converted, never concealed.
namespace relit::decoders {

/// What a stream claims to be. Every picture is compared with it before anybody sees the picture.
struct VideoFormat {
  std::string codec;  ///< FFmpeg's name: "h264", "hevc", "mpeg4", "ffv1", "vp9" or "av1"
  std::vector<std::uint8_t> codec_private;
  int width = 0;
  int height = 0;
  container::Chroma chroma = container::Chroma::kLuma;
  int bit_depth = 8;           ///< 8 or 10
  std::uint32_t track_id = 0;  ///< for messages
};

/// Counted reference to a decoded picture. Copies share the samples; clear() and assignment give
/// them back to the decoder's pool. May outlive the decoder and may be read from any thread.
class VideoFrame {
 public:
  VideoFrame();
  VideoFrame(const VideoFrame& other);
  VideoFrame(VideoFrame&& other) noexcept;
  VideoFrame& operator=(const VideoFrame& other);
  VideoFrame& operator=(VideoFrame&& other) noexcept;
  ~VideoFrame();

  [[nodiscard]] bool empty() const;
  void clear();
  /// The packet's pts, in frames of the clip.
  [[nodiscard]] std::int64_t pts() const;
  /// All samples of component 0, 1 or 2. Requires !empty().
  [[nodiscard]] SampleView component(int index) const;
  /// What the picture's buffers take. Requires !empty().
  [[nodiscard]] std::size_t buffer_bytes() const;
  /// Whether both are references to one picture.
  [[nodiscard]] bool same_picture(const VideoFrame& other) const;

 private:
  friend class VideoDecoder;
  AVFrame* frame_ = nullptr;  ///< null only when moved from, or out of memory
};

struct VideoDecoderOptions {
  /// More than 1 decodes so many frames at once, each of which adds a packet of delay and a picture
  /// of memory; the samples are the same.
  int threads = 1;
  /// A decoder of libavcodec by its name, such as "h264_v4l2m2m", that is tried first for streams
  /// of its codec. Hardware is used only so. Where it does not open, or fails before its first
  /// picture, libavcodec's own software takes its place and note() says so. Empty: none.
  std::string name;
  /// Also counts the pictures' buffers, with those of other decoders. May be null.
  std::shared_ptr<PictureMemory> memory;
};

/// One video stream. Not thread-safe; different decoders may run on different threads.
/// codec_private and packets have to have the forms of FORMAT.md, section 3.4.
/// MPEG-4 always uses the simple IDCT, so that every machine decodes the same samples. FFV1 has to
/// be of version 3 with slice CRCs, which are checked.
class VideoDecoder {
 public:
  /// Errors: kUnsupported (codec outside the list, or missing from this libavcodec), kLimit,
  /// kInvalid, kCorrupt (codec_private).
  static Result<VideoDecoder> open(const VideoFormat& format,
                                   const VideoDecoderOptions& options = {});

  VideoDecoder(VideoDecoder&&) noexcept;
  VideoDecoder& operator=(VideoDecoder&&) noexcept;
  ~VideoDecoder();

  /// Hands over one packet (copied by libavcodec). Call receive() until kAgain first. Where
  /// `shown` is false nobody asks for its picture, and the codec leaves it out if no other picture
  /// refers to it.
  /// Errors: kCorrupt naming track and pts; the next packet to be sent is then a key packet,
  /// after reopen() where pictures inside do not matter.
  Status send(std::span<const std::uint8_t> packet, std::int64_t pts, bool key, bool shown = true);
  /// No packets follow until flush(): receive() then yields what is still inside.
  Status drain();

  enum class Received { kFrame, kAgain, kEnd };
  /// The next picture in order of presentation. kAgain: send a packet; kEnd: drained.
  /// Errors: kCorrupt (damaged, or not of the format that was promised).
  Result<Received> receive(VideoFrame& out);

  /// Forgets all packets and pictures inside; the next packet has to be a key packet.
  void flush();
  /// Starts afresh with a new libavcodec decoder: after damage, some of them keep more than flush()
  /// clears. Errors: as open(); the decoder is then as before.
  Status reopen();
  /// Whether a decoder that was asked for by name has failed before its first picture; software has
  /// then been opened in its place, afresh. True once at most.
  [[nodiscard]] bool fell_back();

  /// Why another decoder than the one asked for by name is at work; empty: it is not.
  [[nodiscard]] const std::string& note() const { return note_; }
  /// Of the pictures' buffers, where the codec takes them from outside (all but "av1" do).
  [[nodiscard]] const PicturePool& pool() const;

 private:
  struct Hooks;  ///< what libavcodec calls back for

  VideoDecoder();
  static Result<VideoDecoder> open_codec(const VideoFormat& format,
                                         const VideoDecoderOptions& options, const AVCodec& codec);
  Status copy_private();
  [[nodiscard]] Status check(const AVFrame& frame) const;

  std::unique_ptr<Hooks> hooks_;  ///< outlives the context that points to it
  ffmpeg::Codec context_;
  ffmpeg::Packet packet_;
  VideoFormat format_;
  VideoDecoderOptions options_;
  bool named_ = false;   ///< the decoder asked for by name is at work
  bool proven_ = false;  ///< it has given a picture
  std::string note_;
};

/// Bytes of the buffer that a software decoder asks for, per picture of this stream. Errors: those
/// of VideoDecoder::open() as far as `format` alone is concerned.
[[nodiscard]] Result<std::uint64_t> picture_buffer_bytes(const VideoFormat& format);

/// Bytes of one decoded picture of this shape, without libavcodec's padding.
[[nodiscard]] std::uint64_t picture_bytes(int width, int height, container::Chroma chroma,
                                          int bit_depth);

}  // namespace relit::decoders
