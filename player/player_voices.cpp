// SPDX-License-Identifier: MIT
#include <utility>

#include "player/player_state.hpp"

namespace relit::player {

Result<std::unique_ptr<ClipVoice>> Player::State::make_voice(std::size_t clip) {
  DemuxOptions demux{std::to_string(clip), options.sparing || layers >= 0, options.interrupt};
  RELIT_ASSIGN(ClipDemuxer demuxer, root->another(shared->cursor(), demux));
  const PrefetchOptions prefetch = prefetch_options(demuxer.layers(), false);
  RELIT_ASSIGN(auto voice, ClipVoice::create(clip, std::move(demuxer), pool, prefetch));
  RELIT_TRY(attach_voice(*voice));
  return voice;
}

Status Player::State::attach_voice(ClipVoice& voice) {
  RelightOptions relight;
  relight.device = device.get();
  relight.path = !device                                ? CompositePath::kCpu
                 : options.path != CompositePath::kAuto ? options.path
                                                        : plan.path;
  relight.format = plan.light_map;
  RELIT_TRY(voice.attach(relight));
  voice.relighter()->set_exposure(exposure);
  light_stale = true;
  return {};
}

std::optional<FrameSpan> Player::State::at_tick(std::size_t clip, std::uint64_t tick) const {
  for (ClipVoice* voice : voices())
    if (voice != nullptr && voice->clip() == clip) return voice->prefetcher().span_at_tick(tick);
  return std::nullopt;
}

std::optional<FrameSpan> Player::State::of_frame(std::size_t clip, std::uint64_t frame) const {
  for (ClipVoice* voice : voices())
    if (voice != nullptr && voice->clip() == clip) return voice->prefetcher().span_of_frame(frame);
  return std::nullopt;
}

// The clips that are heard: what was primary becomes secondary where a fade begins, and what has
// been prepared becomes primary.
Status Player::State::assign_voices(const Moment& now) {
  const std::pair<unsigned, std::size_t> item{program, now.item};
  if (primary_item != item) {
    const bool fading = now.secondary.has_value();
    if (fading && primary && primary->clip() == now.secondary->clip) {
      secondary = std::move(primary);
    }
    if (prepared && prepared->clip() == now.primary.clip) primary = std::move(prepared);
    if (!primary || primary->clip() != now.primary.clip) {
      if (!shared)
        return fail(ErrorCode::kUnsupported,
                    options.name + ": another clip needs a source that can seek");
      RELIT_ASSIGN(primary, make_voice(now.primary.clip));
    }
    prepared.reset();
    primary_item = item;
    RELIT_TRY(set_loops());
  }
  if (now.secondary && (!secondary || secondary->clip() != now.secondary->clip)) {
    RELIT_ASSIGN(secondary, make_voice(now.secondary->clip));
  }
  if (!now.secondary) secondary.reset();
  return prepare_next(now);
}

// Of a sequence, the item after the one that plays has its first frames decoded when its turn
// comes.
Status Player::State::prepare_next(const Moment& now) {
  if (sequence.size() < 2 || secondary || prepared) return {};
  std::size_t next = now.item + 1;
  if (next >= sequence.size()) {
    if (!playback->loops()) return {};
    next = 0;
  }
  const bool same = sequence[next].clip == now.primary.clip && !(sequence[next].cross_fade_s > 0);
  if (same) return {};
  RELIT_ASSIGN(prepared, make_voice(sequence[next].clip));
  return {};
}

// Frames are fetched around the end of what goes round.
Status Player::State::set_loops() {
  if (!primary || !shared) return {};
  const bool round = sequence.empty() ? playback->loops()
                                      : primary_item && primary_item->second < sequence.size() &&
                                            sequence[primary_item->second].repeats > 1;
  return primary->prefetcher().set_loop(round);
}

}  // namespace relit::player
