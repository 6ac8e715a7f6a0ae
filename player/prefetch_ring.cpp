// SPDX-License-Identifier: MIT
// The ring of a Prefetcher: which frames are decoded next, and which may go.
#include <algorithm>
#include <utility>

#include "player/prefetch_state.hpp"

namespace relit::player {

using State = Prefetcher::State;

void State::wake() {
  for (const auto& track : tracks) {
    for (const auto& lane : track->lanes) lane->strand->wake();
  }
  work.notify_one();
}

void State::note_peaks() {
  counts.ring_bytes_peak = std::max(counts.ring_bytes_peak, ring_bytes);
  counts.packet_bytes_peak = std::max(counts.packet_bytes_peak, packet_bytes + spare_bytes);
}

State::Slot* State::find(std::uint64_t index) {
  for (std::uint64_t seq = head; seq < tail; ++seq) {
    if (at(seq).shows(index)) return &at(seq);
  }
  return nullptr;
}

std::optional<std::uint64_t> State::following(std::uint64_t index) const {
  const std::uint64_t count = demuxer.clip().frame_count;
  const std::uint64_t next = index - index % every + every;
  if (loop && ((index < loop_end && next >= loop_end) || next >= count)) return loop_begin;
  if (next >= end_after(index)) return std::nullopt;
  return next;
}

// Takes as many frames into the ring as their bytes allow, two at least: playback blends between
// two.
void State::admit() {
  while (next_index && tail - head < ring.size() && admit_one()) {
  }
}

// The first picture after the beginning or a jump has the machine to itself, and so has the host
// that draws it: nothing else is fetched or decoded until playback moves on or the host says so.
void State::go_on() {
  if (std::exchange(eager, true)) return;
  admit();
  wake();
}

bool State::admit_one() {
  const std::uint64_t index = *next_index;
  std::erase_if(segments, [&](const Segment& s) {
    return s.lap < admit_lap || (s.lap == admit_lap && s.end_frame <= index);
  });
  const auto found = std::ranges::find_if(segments, [&](const Segment& s) {
    return s.lap == admit_lap && s.first_frame <= index && index < s.end_frame;
  });
  const bool known = found != segments.end();
  // Frames of segments that never came are lost at once.
  const bool passed =
      demux_lap > admit_lap || (demux_lap == admit_lap && (index < come_end || ended));
  if (!known && !passed) return false;
  std::size_t expected = 0;
  for (std::size_t t = 0; known && t < tracks.size(); ++t) {
    if ((*found->wanted)[t] != 0) expected += tracks[t]->picture_bytes;
  }
  constexpr std::uint64_t kLeastFrames = 2;
  const bool full = ring_bytes + pending_bytes + expected > ring_limit;
  if ((full || !eager) && tail - head >= kLeastFrames) return false;
  if (free_slots.empty()) {
    slots.push_back(std::make_unique<Slot>());
    free_slots.reserve(slots.size());
    free_slots.push_back(slots.back().get());
  }
  Slot* slot = free_slots.back();
  free_slots.pop_back();
  slot->index = index;
  lay_out(*slot, known ? &*found : nullptr);
  ring[tail++ % ring.size()] = slot;
  next_index = following(index);
  const bool around = next_index && *next_index <= index;
  if (around) ++admit_lap;
  slot->every = every;
  slot->until = next_index && !around        ? *next_index
                : around && index < loop_end ? loop_end
                                             : end_after(index);
  return true;
}

void State::lay_out(Slot& slot, const Segment* segment) {
  slot.segment_no = segment != nullptr ? segment->no : 0;
  slot.parts.resize(tracks.size());
  slot.missing = 0;
  slot.first = std::exchange(admit_first, false);
  slot.lost = segment == nullptr;
  slot.counted = slot.laid_out = false;
  for (std::size_t t = 0; t < tracks.size(); ++t) {
    Part& part = slot.parts[t];
    part.picture.clear();
    part.wanted = segment != nullptr && (*segment->wanted)[t] != 0;
    part.done = part.taken = part.shares_previous = false;
    part.charged = 0;
    part.expected = part.wanted ? tracks[t]->picture_bytes : 0;
    pending_bytes += part.expected;
    if (part.wanted) ++slot.missing;
  }
  if (slot.lost && !last_damage) {
    note_damage({ErrorCode::kNotFound,
                 "the segment of frame " + std::to_string(slot.index) + " is missing"});
  }
  if (slot.missing == 0) changed.notify_all();
}

void State::free_slot(Slot* slot) {
  for (Part& part : slot->parts) {
    ring_bytes -= std::exchange(part.charged, 0);
    pending_bytes -= std::exchange(part.expected, 0);
    part.picture.clear();
  }
  slot->frame.planes.clear();
  free_slots.push_back(slot);
}

/// Takes the first frame out of the ring. What it shares with the next one is charged there.
void State::detach(std::uint64_t seq) {
  Slot& slot = at(seq);
  for (std::size_t t = 0; seq + 1 < tail && t < slot.parts.size(); ++t) {
    Part& next = at(seq + 1).parts[t];
    if (!next.shares_previous) continue;
    next.charged = std::exchange(slot.parts[t].charged, 0);
    next.shares_previous = false;
  }
  if (&slot == shown)
    shown_detached = true;
  else
    free_slot(&slot);
}

void State::release_before(std::uint64_t seq) {
  while (head < seq) detach(head++);
}

/// Everything that was fetched goes; what is shown stays.
void State::restart(std::uint64_t index, std::optional<std::uint64_t> tick) {
  release_before(tail);
  ++epoch;
  ++counts.restarts;
  start = index;
  start_tick = tick;
  error.reset();
  segments.clear();
  next_index = std::nullopt;
  given = eager = false;
  if (demuxer.interrupt() && demuxer.seekable()) demuxer.interrupt()->raise();
  wake();
}

/// Whether going on comes to this frame soon.
bool State::is_near(std::uint64_t index) const {
  if (demux_epoch != epoch) return false;
  if (!next_index || index < *next_index) return false;
  return index < near_end || demux_lap > admit_lap || !demuxer.seekable();
}

/// Whether going on comes soon to the segment of a tick that is not known yet.
bool State::comes_to(std::uint64_t tick) const {
  if (error || ended || demux_lap != admit_lap) return false;
  // Of a tick that is looked for already: playback has gone on meanwhile.
  const auto& rate = demuxer.clip().tick_rate;
  const auto second = static_cast<std::uint64_t>(rate.num / std::max<std::int64_t>(rate.den, 1));
  if (start_tick) return tick > *start_tick && tick - *start_tick <= second;
  if (demux_epoch != epoch) return tick == 0 && start == 0;
  return tick >= come_ticks && (tick < near_end_tick || !demuxer.seekable());
}

bool State::ready(const Slot& slot) const {
  if (slot.missing == 0) return true;
  if (!impatient || !slot.first || slot.lost || !slot.parts[0].done) return false;
  bool any = false;
  int layer = -1;
  for (std::size_t t = 1; t < slot.parts.size(); ++t) {
    if (!slot.parts[t].wanted) continue;
    const int of = tracks[t]->about.layer;
    if (any && of != layer) break;
    if (!slot.parts[t].done) return false;
    any = true;
    layer = of;
  }
  return any;
}

/// Brings the pictures that have come into the frame's view.
void State::assemble(Slot& slot) {
  ClipFrame& frame = slot.frame;
  const auto& layers = demuxer.layers();
  if (!slot.laid_out) {
    std::size_t plane_count = 0;
    for (const auto& layer : layers) plane_count += layer.planes.size();
    frame.planes.reset(slot.index, planes ? plane_count : 0, layers.size());
    slot.laid_out = true;
  }
  std::size_t first_plane = 0;
  std::size_t t = 1;
  for (std::size_t i = 0; i < layers.size() && t < slot.parts.size(); ++i) {
    Part& mantissas = slot.parts[t++];
    Part* exponents = layers[i].has_exponents ? &slot.parts[t++] : nullptr;
    const bool here = mantissas.wanted && mantissas.done && (!exponents || exponents->done);
    if (here && !mantissas.taken && !mantissas.picture.empty() &&
        (!exponents || !exponents->picture.empty())) {
      mantissas.taken = true;
      frame.planes.show(layers[i], first_plane, i, mantissas.picture,
                        exponents ? &exponents->picture : nullptr);
    }
    first_plane += layers[i].planes.size();
  }
  // What has left the ring will not become any more complete.
  frame.complete = slot.missing == 0 || (&slot == shown && shown_detached);
}

/// What is shown for a frame that damage hit: what is shown anyway. Before that there is the last
/// good one before it.
State::Slot* State::stand_in(Slot& slot) {
  Slot* best = shown;
  for (std::uint64_t seq = head; shown == nullptr && seq < tail && &at(seq) != &slot; ++seq) {
    if (at(seq).good()) best = &at(seq);
  }
  return best;
}

}  // namespace relit::player
