// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <thread>

#include "container/base/out_of_memory.hpp"
#include "player/player_state.hpp"

namespace relit::player {
namespace {

// How long a frame may be late before the clock stands: what is only slow is skipped over, what has
// stalled is waited for.
constexpr std::int64_t kPatienceNs = 250'000'000;
constexpr std::uint64_t kRestingUpdates = 120;

}  // namespace

bool Player::State::stands(std::int64_t now_ns) {
  if (!moment.ready) return true;
  if (!moment.late) {
    late_since_ns.reset();
    return false;
  }
  if (!late_since_ns) late_since_ns = now_ns;
  return now_ns - *late_since_ns > kPatienceNs;
}

Status Player::State::update(std::int64_t now_ns) {
  const Clock::time_point begin = Clock::now();
  govern(now_ns);
  ++counted.updates;
  const bool stand = stands(now_ns);
  if (last_ns && now_ns > *last_ns && !stand && !playback->paused())
    light_time_s += 1e-9 * static_cast<double>(now_ns - *last_ns) * playback->speed();
  last_ns = now_ns;
  // The picture that was waited for has been drawn.
  if (moment.ready && !seeking) primary->prefetcher().fetch_ahead();
  if (stand) playback->skip_to(now_ns);
  const Moment now = stand ? playback->now() : playback->at(now_ns);
  const Status shown =
      catch_out_of_memory("showing a frame", [&] { return show(now, seeking || !moment.ready); });
  update_s += seconds_since(begin);
  RELIT_TRY(shown);
  if (!moment.ready) {
    ++counted.waiting;
  } else if (moment.late) {
    ++counted.late;
  } else if (moment.changed) {
    ++counted.shown;
  } else {
    ++counted.repeated;
  }
  return moment.late || !moment.ready ? source_error() : Status();
}

// How the last display frame went.
void Player::State::govern(std::int64_t now_ns) {
  if (counted.updates > 0 && moment.ready) {
    StageTimes times;
    times.now_ns = now_ns;
    times.composite_s = composited_s;
    times.draw_s = drawn_s;
    times.total_s = update_s + drawn_s;
    // Not while the clock stands: giving up quality does not mend a source that stalls.
    const bool stalled = late_since_ns && now_ns - *late_since_ns > kPatienceNs;
    times.missed = moment.late && !seeking && !stalled;
    governor->update(times);
  }
  update_s = drawn_s = composited_s = 0;
}

Status Player::State::show(const Moment& now, bool at_once) {
  RELIT_TRY(assign_voices(now));
  // Before frames are taken: another light may need layers that are fetched anew.
  bool anew = recomposite;
  RELIT_TRY(bring_light(anew));
  const Quality quality = governor->quality();
  const bool blend = options.interpolate && quality.frames_every == 1;
  primary_frames = primary->go_to(now.primary, blend);
  secondary_frames = {};
  if (now.secondary) secondary_frames = secondary->go_to(*now.secondary, blend);
  const bool both = secondary_frames.from != nullptr;
  secondary_weight = both ? static_cast<float>(now.secondary_weight) : 0;

  moment.changed = false;
  moment.ended = now.ended;
  moment.time_s = now.time_s;
  moment.next_s.reset();
  if (now.next_frame_ns) moment.next_s = 1e-9 * static_cast<double>(*now.next_frame_ns);
  if (primary_frames.from == nullptr) {
    moment.late = moment.ready;
    return {};
  }
  moment.late = primary_frames.late;
  bool posed_anew = false;
  RELIT_TRY(pose_meshes(now, posed_anew));
  // The early first picture is completed in place.
  anew |= !shown_complete && primary_frames.from->complete;
  shown_complete = primary_frames.from->complete;
  const bool first = !moment.ready;
  const auto every = static_cast<std::uint64_t>(quality.light_map_every);
  const bool due = counted.updates - composited_at >= every;
  bool composited = false;
  if (first || anew || at_once || ((posed_anew || light_moved) && due)) {
    const std::uint64_t before = primary->relighter()->stats().composites;
    RELIT_TRY(composite());
    composited = primary->relighter()->stats().composites != before;
    composited_at = counted.updates;
    recomposite = light_moved = false;
  }
  moment.changed = first || posed_anew || composited;
  note_shown(now);
  return {};
}

void Player::State::note_shown(const Moment& now) {
  if (!moment.ready) counted.first_frame_ms = 1e3 * seconds_since(opened);
  moment.ready = true;
  if (moment.late) return;
  const bool same_clip = moment.clip == now.primary.clip;
  if (!seeking && same_clip && now.primary.frame > moment.frame + 1)
    counted.skipped_frames += now.primary.frame - moment.frame - 1;
  moment.clip = now.primary.clip;
  moment.frame = now.primary.frame;
  seeking = false;
}

// Folds the light of the moment into what is shown.
Status Player::State::bring_light(bool& changed) {
  const bool moved = light->sample(light_time_s);
  const bool fold = moved || light_stale;
  // A light that varies by itself may be shown as seldom as the governor says, like a pose.
  changed |= light_stale || (moved && !light->varies());
  light_moved |= moved;
  // What a light does not need is fetched no more when it has rested for a while: fetching it again
  // costs a seek, and the next light may need it.
  if (fold) {
    light_changed_at = counted.updates;
    layers_settled = false;
  }
  const bool settle =
      !layers_settled && !light->varies() && counted.updates - light_changed_at >= kRestingUpdates;
  layers_settled |= settle;
  const Quality quality = governor->quality();
  for (ClipVoice* voice : voices()) {
    if (voice == nullptr) continue;
    Relighter& relighter = *voice->relighter();
    const std::size_t of = relighter.needed_planes().size();
    RelightQuality relight;
    if (quality.planes_share < 1)
      relight.planes =
          std::max(1, static_cast<int>(std::ceil(quality.planes_share * static_cast<double>(of))));
    if (planes >= 0)
      relight.planes = relight.planes < 0 ? planes : std::min(relight.planes, planes);
    relight.half_size = quality.half_size;
    relighter.set_quality(relight);
    voice->prefetcher().set_every(static_cast<std::uint64_t>(quality.frames_every));
    RELIT_TRY(fold ? voice->set_light(light->now()) : voice->fetch_needed(settle));
  }
  light_stale = false;
  return {};
}

Status Player::State::pose_meshes(const Moment& now, bool& changed) {
  if (moment.late && moment.ready) return {};  // the last picture stays, blended as it was
  ShownPose wanted;
  wanted.voice = primary.get();
  wanted.frame = primary_frames.from->planes.frame();
  wanted.next = primary_frames.to != nullptr ? now.primary.next_frame : wanted.frame;
  wanted.blend = primary_frames.blend;
  if (secondary_frames.from != nullptr) {
    wanted.other = secondary.get();
    wanted.other_frame = now.secondary->frame;
    wanted.other_blend = secondary_frames.blend;
    wanted.other_weight = secondary_weight;
  }
  if (wanted == shown_pose && !posed->empty()) return {};
  const Clock::time_point begin = Clock::now();
  const decoders::Pose& pose = primary->pose(primary_frames);
  posed->set(pose, wanted.other != nullptr ? &secondary->pose(secondary_frames) : nullptr,
             secondary_weight);
  pose_s.add(seconds_since(begin));
  shown_pose = wanted;
  positions_uploaded = false;
  changed = true;
  return {};
}

Status Player::State::composite() {
  const Clock::time_point begin = Clock::now();
  RELIT_TRY(primary->relighter()->composite(primary_frames.mix()));
  if (secondary_frames.from != nullptr) {
    RELIT_TRY(secondary->relighter()->composite(secondary_frames.mix()));
    RELIT_TRY(primary->relighter()->fade(*secondary->relighter(), secondary_weight));
  }
  if (lit != primary.get()) {  // such as a decoder that is not there
    for (const std::string& note : primary->prefetcher().stats().notes)
      say(LogLevel::kWarning, note);
  }
  lit = primary.get();
  if (leaving) {
    const std::lock_guard lock(roles);
    drop(leaving);
  }
  const double took_s = seconds_since(begin);
  composite_s.add(took_s);
  composited_s += took_s;
  return {};
}

// An error that playback has come to is told once.
Status Player::State::source_error() {
  if (cancelled.load()) return fail(ErrorCode::kCancelled, options.name + ": cancelled");
  Status error = primary->prefetcher().error();
  if (error || error.error().message == reported_error) return {};
  reported_error = error.error().message;
  return error;
}

// Until it is known which frame a position shows.
Result<bool> Player::State::wait_for_place(ClipVoice& voice, const FramePosition& position,
                                           double timeout_s) {
  if (position.known) return true;
  voice.prefetcher().want_tick(position.tick);
  return voice.prefetcher().wait_tick(position.tick, timeout_s);
}

// Until all planes of a position are here, the early first picture's too.
Result<bool> Player::State::wait_for(ClipVoice& voice, const FramePosition& position,
                                     double timeout_s) {
  const Clock::time_point begin = Clock::now();
  const auto left = [&] { return std::max(0.0, timeout_s - seconds_since(begin)); };
  Prefetcher& prefetcher = voice.prefetcher();
  prefetcher.want(position.frame);
  for (;;) {
    RELIT_ASSIGN(const bool here, prefetcher.wait(position.frame, left()));
    if (!here) return false;
    const ClipFrame* frame = prefetcher.frame(position.frame);
    if (frame != nullptr && frame->complete) break;
    if (left() <= 0) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  const bool blend = options.interpolate && position.fraction > 0;
  if (!blend || position.next_frame == position.frame) return true;
  return prefetcher.wait(position.next_frame, left());
}

Result<bool> Player::State::wait(double timeout_s) {
  const Clock::time_point begin = Clock::now();
  const auto left = [&] { return std::max(0.0, timeout_s - seconds_since(begin)); };
  if (cancelled.load()) return fail(ErrorCode::kCancelled, options.name + ": cancelled");
  Moment now = playback->now();
  RELIT_TRY(assign_voices(now));
  // The light may need layers that are fetched anew.
  bool anew = false;
  RELIT_TRY(bring_light(anew));
  recomposite |= anew;
  RELIT_ASSIGN(bool here, wait_for_place(*primary, now.primary, left()));
  if (here && now.secondary) {
    RELIT_ASSIGN(here, wait_for_place(*secondary, *now.secondary, left()));
  }
  now = playback->now();
  if (here) {
    RELIT_ASSIGN(here, wait_for(*primary, now.primary, left()));
  }
  if (here && now.secondary) {
    RELIT_ASSIGN(here, wait_for(*secondary, *now.secondary, left()));
  }
  RELIT_TRY(catch_out_of_memory("showing a frame", [&] { return show(now, true); }));
  return here && !moment.late;
}

// Where frames are unevenly spaced, when this one is shown becomes known as it comes; of one whose
// segment is lost it never does, and what is shown stays.
Result<bool> Player::State::show_frame(std::uint64_t frame, double timeout_s) {
  const Clock::time_point begin = Clock::now();
  Prefetcher& prefetcher = primary->prefetcher();
  // Seeking would go to the last one.
  if (frame >= prefetcher.clip().frame_count) return prefetcher.wait(frame, 0);
  Status sought = playback->seek_frame(frame);
  if (!sought) {
    prefetcher.want(frame);
    RELIT_ASSIGN(const bool here, prefetcher.wait(frame, timeout_s));
    if (!here) return false;
    sought = playback->seek_frame(frame);
    if (!sought && moment.ready) return prefetcher.frame(frame) != nullptr;
  }
  RELIT_TRY(sought);
  jumped_within();
  return wait(std::max(0.0, timeout_s - seconds_since(begin)));
}

}  // namespace relit::player
