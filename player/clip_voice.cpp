// SPDX-License-Identifier: MIT
#include "player/clip_voice.hpp"

#include <algorithm>

#include "player/posed_meshes.hpp"

namespace relit::player {

Result<std::unique_ptr<ClipVoice>> ClipVoice::create(std::size_t clip, ClipDemuxer demuxer,
                                                     std::shared_ptr<WorkerPool> pool,
                                                     const PrefetchOptions& options) {
  std::unique_ptr<ClipVoice> voice(new ClipVoice);
  voice->clip_ = clip;
  voice->allowed_.assign(demuxer.layers().size(), 1);
  if (!options.layers.empty()) voice->allowed_ = options.layers;
  voice->fetched_ = voice->allowed_;
  RELIT_ASSIGN(voice->prefetcher_,
               Prefetcher::create(std::move(demuxer), std::move(pool), options));
  return voice;
}

Status ClipVoice::attach(RelightOptions options) {
  options.meshes = prefetcher_->meshes();
  RELIT_ASSIGN(relighter_, Relighter::create(prefetcher_->model(), prefetcher_->layers(), options));
  return {};
}

ClipVoice::Frames ClipVoice::go_to(const FramePosition& position, bool interpolate) {
  Frames frames;
  if (position.known) {
    prefetcher_->want(position.frame);
    frames.from = prefetcher_->frame(position.frame);
  } else {
    prefetcher_->want_tick(position.tick);
  }
  frames.late = frames.from == nullptr;
  if (frames.from == nullptr) frames.from = prefetcher_->shown();
  if (!frames.late && interpolate && position.fraction > 0 &&
      position.next_frame != position.frame) {
    frames.to = prefetcher_->frame(position.next_frame);
    if (frames.to != nullptr) frames.blend = static_cast<float>(position.fraction);
  }
  return frames;
}

Status ClipVoice::set_light(const decoders::Light& light) {
  RELIT_TRY(relighter_->set_light(light, allowed_));
  return fetch_needed(false);
}

void ClipVoice::allow(std::span<const std::uint8_t> layers) {
  allowed_.assign(layers.begin(), layers.end());
}

Status ClipVoice::fetch_needed(bool may_drop) {
  wanted_ = allowed_;
  const std::span<const std::uint8_t> needed = relighter_->needed_layers();
  for (std::size_t l = 0; l < wanted_.size(); ++l) {
    const bool keep = needed[l] != 0 || (!may_drop && fetched_[l] != 0);
    wanted_[l] = static_cast<std::uint8_t>(wanted_[l] != 0 && keep);
  }
  if (wanted_ == fetched_) return {};
  bool more = false;
  for (std::size_t l = 0; l < wanted_.size(); ++l) more |= wanted_[l] != 0 && fetched_[l] == 0;
  RELIT_TRY(prefetcher_->set_layers(wanted_, more));
  fetched_ = wanted_;
  return {};
}

const decoders::Pose& ClipVoice::pose(const Frames& frames) {
  if (frames.to == nullptr || frames.blend == 0) return frames.from->pose;
  blend_poses(frames.from->pose, frames.to->pose, frames.blend, pose_);
  return pose_;
}

}  // namespace relit::player
