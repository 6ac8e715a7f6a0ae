// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>

struct AVCodecContext;
struct AVFrame;
struct AVPacket;
struct SwsContext;

/// Ownership and messages of FFmpeg's C interfaces.
namespace relit::decoders::ffmpeg {

struct Free {
  void operator()(AVCodecContext* context) const;
  void operator()(AVFrame* frame) const;
  void operator()(AVPacket* packet) const;
  void operator()(SwsContext* scaler) const;
};

using Codec = std::unique_ptr<AVCodecContext, Free>;
using Frame = std::unique_ptr<AVFrame, Free>;
using Packet = std::unique_ptr<AVPacket, Free>;
using Scaler = std::unique_ptr<SwsContext, Free>;

/// FFmpeg's own words for one of its negative codes.
[[nodiscard]] std::string reason(int code);

/// For AVCodecContext::log_level_offset. av_log() adds it to the level of each message, which
/// silences one context without touching the process-wide level: errors are returned instead.
inline constexpr int kQuiet = 128;

}  // namespace relit::decoders::ffmpeg
