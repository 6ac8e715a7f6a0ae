// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "container/base/result.hpp"
#include "player/playback.hpp"
#include "player/prefetcher.hpp"
#include "player/relighter.hpp"

namespace relit::player {

/// One clip in play: the frames that come, and its light map. A cross-fade has two of them.
class ClipVoice {
 public:
  /// `clip` is its number in the file, `allowed` its layers that may be fetched at all. Errors:
  /// those of Prefetcher::create().
  static Result<std::unique_ptr<ClipVoice>> create(std::size_t clip, ClipDemuxer demuxer,
                                                   std::shared_ptr<WorkerPool> pool,
                                                   const PrefetchOptions& options);

  /// Makes the light map's part for a context, or for none; the meshes are the clip's. The light
  /// has to be set again. Errors: those of Relighter::create().
  Status attach(RelightOptions options);
  /// Drops it; the context is current, or its device was abandoned.
  void detach() { relighter_.reset(); }

  /// What a position shows.
  struct Frames {
    const ClipFrame* from = nullptr;  ///< null: nothing has arrived yet
    const ClipFrame* to = nullptr;    ///< null: `from` alone
    float blend = 0;
    bool late = false;  ///< the frame itself is not here, and `from` is the last picture
    [[nodiscard]] FrameMix mix() const {
      return {&from->planes, to != nullptr ? &to->planes : nullptr, blend, &from->pose,
              to != nullptr ? &to->pose : nullptr};
    }
    bool operator==(const Frames&) const = default;
  };
  /// Goes to a position, or looks for the frame that is shown there; never waits. The frames are
  /// valid until the next call.
  Frames go_to(const FramePosition& position, bool interpolate);

  /// Folds a light, and fetches from then on what it needs besides what is fetched already. Errors:
  /// kInvalid, those of decoders.
  Status set_light(const decoders::Light& light);
  /// Which layers may be fetched at all, by layer; takes effect with the next set_light().
  void allow(std::span<const std::uint8_t> layers);
  /// Sees to it that what the relighter needs is fetched; with `may_drop`, no more than that.
  Status fetch_needed(bool may_drop);

  /// The pose of the frames, blended as they are. Valid until the next call.
  const decoders::Pose& pose(const Frames& frames);

  [[nodiscard]] std::size_t clip() const { return clip_; }
  [[nodiscard]] Prefetcher& prefetcher() { return *prefetcher_; }
  [[nodiscard]] Relighter* relighter() const { return relighter_.get(); }

 private:
  ClipVoice() = default;

  std::size_t clip_ = 0;
  std::unique_ptr<Prefetcher> prefetcher_;
  std::unique_ptr<Relighter> relighter_;
  std::vector<std::uint8_t> allowed_, fetched_, wanted_;
  decoders::Pose pose_;
};

}  // namespace relit::player
