// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "container/records.hpp"

/// Video tracks as the streams of a Matroska file, by libavformat: packets as they are, nothing
/// decoded. The codec_private and packets of FORMAT.md, section 3.4, are Matroska's own.
namespace relit::player {

struct MatroskaTrack {
  std::uint32_t track_id = 0;  ///< in the tag RELIT_TRACK
  std::string title;
  std::string codec;  ///< FFmpeg's name
  std::vector<std::uint8_t> codec_private;
  int width = 0;
  int height = 0;
  /// Of evenly spaced pictures; 0: others. Programs that want a fixed rate would take the one that
  /// the encoder wrote into the stream, which means nothing. Not read back.
  container::Rational frame_rate{0, 1};
};

struct MatroskaPacket {
  std::size_t track = 0;  ///< place in tracks()
  std::int64_t time_ns = 0;
  bool key = false;
  std::vector<std::uint8_t> bytes;
};

/// Writes a file that appears under its name when it is complete. One thread at a time.
class MatroskaWriter {
 public:
  /// Errors: kIo; kEnvironment when this FFmpeg cannot write Matroska; kUnsupported for a codec
  /// that it does not store in Matroska.
  static Result<MatroskaWriter> create(const std::string& path, const std::string& title,
                                       std::vector<MatroskaTrack> tracks);
  MatroskaWriter(MatroskaWriter&&) noexcept;
  MatroskaWriter& operator=(MatroskaWriter&&) noexcept;
  ~MatroskaWriter();  ///< without finish() nothing is left behind

  /// Times that differ by less are the same to Matroska.
  [[nodiscard]] std::int64_t resolution_ns() const;

  struct Timing {
    std::int64_t time_ns = 0;
    /// The earliest time that this packet or a later one of the track is shown: never falling.
    std::int64_t decode_ns = 0;
    std::int64_t duration_ns = 0;
  };
  /// Packets of a track in decoding order; those of different tracks in any order that does not
  /// leave one far behind, for they are kept until they can be interleaved. Errors: kIo.
  Status add(std::size_t track, std::span<const std::uint8_t> packet, bool key,
             const Timing& timing);
  /// Errors: kIo.
  Status finish();

 private:
  struct State;
  explicit MatroskaWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Reads such a file, or what other programs made of it. One thread at a time.
class MatroskaReader {
 public:
  /// Errors: kIo; kCorrupt when it is not Matroska, or names a track twice.
  static Result<MatroskaReader> open(const std::string& path);
  MatroskaReader(MatroskaReader&&) noexcept;
  MatroskaReader& operator=(MatroskaReader&&) noexcept;
  ~MatroskaReader();

  /// The streams that name a track of a .relit file; others are passed over.
  [[nodiscard]] const std::vector<MatroskaTrack>& tracks() const;
  /// How far off a time may be.
  [[nodiscard]] std::int64_t resolution_ns() const;

  /// The next packet, by track in decoding order; nothing at the end. Errors: kIo, kCorrupt.
  Result<std::optional<MatroskaPacket>> next();

 private:
  struct State;
  explicit MatroskaReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace relit::player
