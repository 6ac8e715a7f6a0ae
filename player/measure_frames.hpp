// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "player/clip_reader.hpp"
#include "player/relighter.hpp"

namespace relit::player {

/// A clip at its ticks, one after the other, of which only some frames are decoded: what is shown
/// in between is blended, as a player does that was told to. Going back needs another object.
class TickFrames {
 public:
  struct Options {
    std::string clip;
    int layers = -1;          ///< the first so many; -1: all
    std::uint64_t every = 1;  ///< of the frames only those that this divides
  };
  /// Errors: those of open_source() and ClipReader::open().
  static Result<TickFrames> open(const std::string& path, const Options& options);

  /// What is shown at `tick`, which is not before the one of the last call; valid until the next.
  /// Between the last frame that is decoded and the end, a clip that loops blends into its first
  /// frame, another holds. Errors: those of ClipReader::frame().
  Result<FrameMix> at(std::uint64_t tick);

  [[nodiscard]] ClipReader& reader() { return reader_; }
  [[nodiscard]] const ClipReader& reader() const { return reader_; }

 private:
  struct Slot {
    std::optional<std::uint64_t> index;
    ClipFrame frame;
  };
  TickFrames(ClipReader reader, std::uint64_t every) : reader_(std::move(reader)), every_(every) {}
  Status fill(Slot& slot, std::uint64_t index);
  Status go_to(std::uint64_t tick);

  ClipReader reader_;
  std::uint64_t every_;
  Slot from_, to_, first_;
};

}  // namespace relit::player
