// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "container/records.hpp"
#include "decoders/ffmpeg.hpp"

/// libavcodec's encoders, fed exact samples: no scaler, no conversion, one thread, so that the same
/// pictures always give the same bytes.
namespace relit::bake {

/// How pictures may be coded out of their order (h264, hevc; mpeg4 with B-VOPs or without).
enum class Reordering {
  kNone,     ///< every picture refers to earlier ones
  kFlat,     ///< some refer to later ones too, and none refers to those
  kPyramid,  ///< some of those are referred to
};

struct VideoSettings {
  std::string codec;  ///< as CodingOptions::codec
  int width = 0;
  int height = 0;
  container::Chroma chroma = container::Chroma::kLuma;
  int bit_depth = 8;
  bool lossless = false;
  double crf = 18;  ///< as CodingOptions::crf
  std::string preset;
  int reference_frames = 3;
  Reordering reordering = Reordering::kPyramid;
  int segment_frames = 25;  ///< pictures a segment: how often there is a key picture
};

/// Samples to be written: row y at data + y·stride_bytes, two bytes in the machine's order above 8
/// bits.
struct SampleTarget {
  std::uint8_t* data = nullptr;
  std::ptrdiff_t stride_bytes = 0;
  int width = 0;
  int height = 0;
  int bytes_per_sample = 1;
};

struct CodedPacket {
  std::int64_t pts = 0;
  bool key = false;
  std::vector<std::uint8_t> bytes;  ///< in the form of FORMAT.md, section 3.4
};

/// One stream. Not thread-safe; different encoders may run on different threads.
class VideoEncoder {
 public:
  /// Errors: kEnvironment when libavcodec lacks the encoder or refuses the settings.
  static Result<VideoEncoder> open(const VideoSettings& settings);

  VideoEncoder(VideoEncoder&&) noexcept;
  VideoEncoder& operator=(VideoEncoder&&) noexcept;
  ~VideoEncoder();

  /// What a decoder needs before the first packet: LayerRecord::codec_private.
  [[nodiscard]] const std::vector<std::uint8_t>& codec_private() const { return codec_private_; }
  /// How many pictures it holds at once: LayerRecord::mantissa_pictures.
  [[nodiscard]] std::uint8_t decoder_pictures() const { return decoder_pictures_; }

  /// Makes the next picture writable. It still holds the previous one's samples; the first starts
  /// at mid-grey. Call before target() for every picture. Errors: kOutOfMemory.
  Status begin_picture();
  [[nodiscard]] SampleTarget target(int component);

  /// Encodes the picture as frame `pts`, greater than any before; `first_of_segment` makes it an
  /// IDR that no later picture reaches across. Appends what packets come out, in decoding order.
  /// Errors: kEnvironment.
  Status encode(std::int64_t pts, bool first_of_segment, std::vector<CodedPacket>& out);
  /// Appends all that is still inside. Nothing can be encoded afterwards.
  Status finish(std::vector<CodedPacket>& out);

 private:
  VideoEncoder() = default;
  /// Everything of open() but describe_stream().
  static Result<VideoEncoder> start(const VideoSettings& settings);
  Status fill_grey();
  /// The encoder's own form of what codec_private() gives.
  [[nodiscard]] Result<std::vector<std::uint8_t>> headers() const;
  Status describe_stream();
  Status receive(std::vector<CodedPacket>& out);
  VideoSettings settings_;
  std::vector<std::uint8_t> codec_private_;
  std::uint8_t decoder_pictures_ = 1;
  decoders::ffmpeg::Codec context_;
  decoders::ffmpeg::Frame picture_;
  decoders::ffmpeg::Packet packet_;
};

}  // namespace relit::bake
