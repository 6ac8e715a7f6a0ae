// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "decoders/plane_decoder.hpp"
#include "decoders/pose.hpp"

namespace relit::player {

/// One frame, decoded. Reuse one object from frame to frame.
struct ClipFrame {
  decoders::FrameView planes;
  decoders::Pose pose;
  /// False where layers that are wanted are still missing: the early first picture (`impatient`).
  bool complete = true;
};

/// What was lost to damage so far.
struct PlaybackLoss {
  std::uint64_t frames = 0;    ///< shown with older planes or poses
  std::uint64_t records = 0;   ///< dropped because they were damaged
  std::uint64_t segments = 0;  ///< that never came, by the gaps in their numbers
  std::string first;           ///< the first reason, for the user
  [[nodiscard]] bool any() const { return frames != 0 || !first.empty(); }
};

}  // namespace relit::player
