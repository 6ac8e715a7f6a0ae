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

 private:
  friend class VideoDecoder;
  AVFrame* frame_ = nullptr;  ///< null only when moved from, or out of memory
};

/// One video stream. Not thread-safe; different decoders may run on different threads.
/// codec_private and packets have to have the forms of FORMAT.md, section 3.4.
/// MPEG-4 always uses the simple IDCT, so that every machine decodes the same samples. FFV1 has to
/// be of version 3 with slice CRCs, which are checked.
class VideoDecoder {
 public:
  /// Errors: kUnsupported (codec outside the list, or missing from this libavcodec), kLimit,
  /// kInvalid, kCorrupt (codec_private). `threads` > 1 decodes so many frames at once, each of
  /// which adds a packet of delay and a picture of memory; the samples are the same.
  static Result<VideoDecoder> open(const VideoFormat& format, int threads = 1);

  VideoDecoder(VideoDecoder&&) noexcept;
  VideoDecoder& operator=(VideoDecoder&&) noexcept;
  ~VideoDecoder();

  /// Hands over one packet (copied by libavcodec). Call receive() until kAgain first.
  /// Errors: kCorrupt naming track and pts; the next packet to be sent is then a key packet,
  /// after reopen() where pictures inside do not matter.
  Status send(std::span<const std::uint8_t> packet, std::int64_t pts, bool key);
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

 private:
  VideoDecoder() = default;
  [[nodiscard]] Status check(const AVFrame& frame) const;
  ffmpeg::Codec context_;
  ffmpeg::Packet packet_;
  VideoFormat format_;
  int threads_ = 1;
};

/// Bytes of one decoded picture of this shape, without libavcodec's padding.
[[nodiscard]] std::uint64_t picture_bytes(int width, int height, container::Chroma chroma,
                                          int bit_depth);

}  // namespace relit::decoders
