// SPDX-License-Identifier: MIT
#include <algorithm>
#include <utility>

#include "player/player_state.hpp"

namespace relit::player {

// By which find_clip() finds it.
std::string Player::State::name_of(std::size_t clip) const {
  const std::string& name = statics->contents.clips[clip].name;
  return name.empty() ? std::to_string(clip) : name;
}

// Only the first voice may interrupt the source, which they share: it would stop the others' reads
// as well.
Result<std::unique_ptr<ClipVoice>> Player::State::make_voice(std::size_t clip, bool round) {
  DemuxOptions demux{name_of(clip), options.sparing || layers >= 0, nullptr};
  RELIT_ASSIGN(ClipDemuxer demuxer, root->another(shared->cursor(), demux));
  const PrefetchOptions prefetch = prefetch_options(demuxer.layers().size(), round);
  RELIT_ASSIGN(auto voice, ClipVoice::create(clip, std::move(demuxer), pool, prefetch));
  RELIT_TRY(attach_voice(*voice));
  return voice;
}

// One that is shown stays until another one is. One that goes has raised the interrupt to stop its
// own read.
void Player::State::drop(std::unique_ptr<ClipVoice>& voice) {
  if (!voice) return;
  if (voice.get() == lit) voice.swap(leaving);
  if (!voice) return;
  voice.reset();
  if (options.interrupt && !cancelled.load()) options.interrupt->clear();
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

Status Player::State::assign_voices(const Moment& now) {
  const std::lock_guard lock(roles);
  if (primary_item != std::pair(program, now.item)) RELIT_TRY(change_item(now));
  if (now.secondary && (!secondary || secondary->clip() != now.secondary->clip)) {
    drop(secondary);
    RELIT_ASSIGN(secondary, make_voice(now.secondary->clip, false));
  }
  if (!now.secondary) drop(secondary);
  return prepare_next(now);
}

// What was primary becomes secondary where a fade begins, and what has been prepared primary.
Status Player::State::change_item(const Moment& now) {
  if (now.secondary && primary && primary->clip() == now.secondary->clip) {
    drop(secondary);
    secondary = std::move(primary);
  }
  if (prepared && prepared->clip() == now.primary.clip) {
    drop(primary);
    primary = std::move(prepared);
  }
  if (!primary || primary->clip() != now.primary.clip) {
    if (!shared)
      return fail(ErrorCode::kUnsupported,
                  options.name + ": another clip needs a source that can seek");
    RELIT_ASSIGN(auto voice, make_voice(now.primary.clip, goes_round(now.item)));
    drop(primary);
    primary = std::move(voice);
  }
  drop(prepared);
  primary_item = {program, now.item};
  return set_loops();
}

// What playing these clips takes, one after another, within the budget. Where there is none, or a
// clip is not there, which Playback says, it is as it was.
Result<MemoryPlan> Player::State::plan_for(std::span<const std::size_t> clips) const {
  const std::size_t count = statics->contents.clips.size();
  const bool known = std::ranges::all_of(clips, [&](std::size_t clip) { return clip < count; });
  if (!options.memory_budget_bytes || clips.empty() || !known) return plan;
  MemoryWishes wanted = wishes();
  wanted.clip = name_of(clips.front());
  for (const std::size_t clip : clips.subspan(1)) wanted.others.push_back(name_of(clip));
  return plan_memory(statics->contents, SegmentScale{}, wanted, options.memory_budget_bytes);
}

// Brings what plays within another plan. Decoders keep their threads: where those are others,
// voices are made anew, and what is shown stays until its place is taken.
Status Player::State::follow(MemoryPlan planned) {
  if (!options.memory_budget_bytes) return {};
  const MemoryPlan before = std::exchange(plan, std::move(planned));
  for (const std::string& sentence : plan.given_up) say(LogLevel::kInfo, sentence);
  const bool redraw = plan.path != before.path || plan.light_map != before.light_map;
  const std::lock_guard lock(roles);
  if (plan.decoder_threads != before.decoder_threads && shared) {
    drop(secondary);
    drop(prepared);
    RELIT_ASSIGN(auto anew, make_voice(primary->clip(), false));
    drop(primary);
    primary = std::move(anew);
    primary_item.reset();
    primary_frames = {};
  }
  for (ClipVoice* voice : voices()) {
    if (voice == nullptr) continue;
    voice->prefetcher().set_limits(static_cast<std::size_t>(plan.ring_bytes),
                                   static_cast<std::size_t>(plan.packet_bytes));
    voice->allow(allowed_layers(voice->prefetcher().layers().size()));
    if (redraw) RELIT_TRY(attach_voice(*voice));
  }
  if (redraw) lit = nullptr;
  light_stale = true;
  return {};
}

// Of a sequence, the item after the one that plays has its first frames decoded when its turn
// comes.
Status Player::State::prepare_next(const Moment& now) {
  if (sequence.size() < 2 || secondary || prepared || leaving) return {};
  std::size_t next = now.item + 1;
  if (next >= sequence.size()) {
    if (!playback->loops()) return {};
    next = 0;
  }
  const bool same = sequence[next].clip == now.primary.clip && !(sequence[next].cross_fade_s > 0);
  if (same) return {};
  RELIT_ASSIGN(prepared, make_voice(sequence[next].clip, goes_round(next)));
  return {};
}

bool Player::State::goes_round(std::size_t item) const {
  if (sequence.empty()) return playback->loops();
  return item < sequence.size() && sequence[item].repeats > 1;
}

// Frames are fetched around the end of what goes round.
Status Player::State::set_loops() {
  if (!primary || !shared || !primary_item) return {};
  return primary->prefetcher().set_loop(goes_round(primary_item->second));
}

}  // namespace relit::player
