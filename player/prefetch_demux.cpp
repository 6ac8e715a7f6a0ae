// SPDX-License-Identifier: MIT
// The demux thread of a Prefetcher.
#include <algorithm>

#include "container/base/out_of_memory.hpp"
#include "player/prefetch_state.hpp"

namespace relit::player {

using State = Prefetcher::State;

std::uint64_t State::lap_end() const {
  return loop && lap_start < loop_end ? loop_end : end_after(lap_start);
}

// Where going on from a frame ends that does not go round.
std::uint64_t State::end_after(std::uint64_t frame) const {
  const std::uint64_t count = demuxer.clip().frame_count;
  return frame < end_frame && end_frame < count ? end_frame : count;
}

/// Back-pressure: chunks may wait up to their limit, and beyond it only where a decoder or the ring
/// has nothing without the next ones.
bool State::may_read() const {
  if (error || cancelled) return false;
  if (start_tick) return true;
  const bool lap_over = ended || come_end >= lap_end();
  if (lap_over && (!loop || !demuxer.seekable())) return false;
  if (starving || (segments.empty() && next_index.has_value())) return true;
  // See go_on().
  if (!eager && come_end > start + 1) return false;
  constexpr std::size_t kMostSegments = 64;
  return packet_bytes < packet_limit && segments.size() < kMostSegments;
}

void State::run() {
  for (bool on = true; on;) {
    try {
      fetch();
      on = false;
    } catch (const std::bad_alloc&) {
      const std::lock_guard lock(mutex);
      fail_with(out_of_memory("fetching"));
    }
  }
}

void State::fetch() {
  std::unique_lock lock(mutex);
  for (;;) {
    work.wait(lock, [&] { return closing || demux_epoch != epoch || may_read(); });
    if (closing) return;
    if (demux_epoch != epoch)
      go_to_start(lock);
    else if (ended || come_end >= lap_end())
      begin_lap(lock);
    else
      read_one(lock);
  }
}

void State::fail_with(Error failure) {
  error = std::move(failure);
  changed.notify_all();
}

void State::go_to_start(std::unique_lock<std::mutex>& lock) {
  const std::uint64_t mine = epoch, index = start;
  const std::optional<std::uint64_t> tick = start_tick;
  const bool at_beginning =
      demux_epoch == 0 && demuxer.complete_end() == 0 && index == 0 && tick.value_or(0) == 0;
  if (demuxer.interrupt() && !closing && !cancelled) demuxer.interrupt()->clear();
  for (const auto& track : tracks) {
    for (const auto& lane : track->lanes) drop_chunks(*lane, last_no + 1);
  }
  lock.unlock();
  Result<bool> jumped = at_beginning ? Result<bool>(false)
                        : tick       ? demuxer.jump_to_tick(*tick)
                                     : demuxer.jump(index);
  lock.lock();
  if (closing || epoch != mine) return;
  demux_epoch = mine;
  closed_no = last_no;
  demux_lap = admit_lap = 0;
  admit_first = true;
  lap_start = index;
  ended = demuxer.ended();
  starving = false;
  // A segment that was being read, and is not read anew, has lost its first chunks.
  if (jumped && !*jumped) demuxer.skip_segment();
  come_end = tick ? 0 : demuxer.complete_end();
  near_end = come_end;
  come_ticks = 0;
  near_end_tick = !tick && index == 0 ? 1 : 0;
  next_index = tick ? std::nullopt : std::optional(index);
  if (!jumped) return fail_with(jumped.error());
  if (!tick && !*jumped && index < come_end) return fail_with(demuxer.gone_by(index).error);
  admit();
  wake();
}

void State::begin_lap(std::unique_lock<std::mutex>& lock) {
  if (start_tick) return fail_with(demuxer.missing_tick(*start_tick).error);
  const std::uint64_t mine = epoch, index = loop_begin;
  lock.unlock();
  const Result<bool> jumped = demuxer.jump(index);
  lock.lock();
  if (closing || epoch != mine) return;
  if (!jumped) return fail_with(jumped.error());
  if (!*jumped) return fail_with(demuxer.gone_by(index).error);
  ++demux_lap;
  closed_no = last_no;
  lap_start = index;
  ended = demuxer.ended();
  come_end = demuxer.complete_end();
  after_event();
}

void State::read_one(std::unique_lock<std::mutex>& lock) {
  const std::uint64_t mine = epoch;
  const std::uint64_t target = start_tick               ? 0
                               : demux_lap == admit_lap ? next_index.value_or(0)
                                                        : lap_start;
  for (auto& chunk : returned) demuxer.recycle(std::move(chunk));
  returned.clear();
  starving = false;
  lock.unlock();
  container::ChunkRecord chunk;
  const auto event = demuxer.step(target, chunk);
  lock.lock();
  demux_loss = demuxer.loss();
  if (epoch != mine || closing) {
    if (chunk.data.capacity() > 0) returned.push_back(std::move(chunk));
    return;
  }
  if (!event) return fail_with(event.error());
  if (*event == ClipDemuxer::Event::kSegment) take_segment();
  if (*event == ClipDemuxer::Event::kChunk) take_chunk(chunk);
  if (start_tick) {
    ended = demuxer.ended();
    if (ended) fail_with(demuxer.missing_tick(*start_tick).error);
    return;
  }
  spare_bytes = demuxer.spare_bytes();
  come_end = demuxer.complete_end();
  ended = demuxer.ended();
  after_event();
}

void State::after_event() {
  const container::SegmentRecord* segment = demuxer.segment();
  const bool whole =
      segment == nullptr || come_end >= segment->first_frame + segment->frame_count || ended;
  if (whole) closed_no = last_no;
  admit();
  note_peaks();
  wake();
}

/// Tells the demuxer which layers are wanted, where that has changed.
void State::pass_choice_on() {
  if (!std::exchange(wanted_changed, false)) return;
  if (planes)
    demuxer.want_layers(wanted_layers);
  else
    demuxer.want_poses_alone();
}

void State::take_segment() {
  closed_no = last_no;
  pass_choice_on();
  const container::SegmentRecord* segment = demuxer.segment();
  if (segment == nullptr) return;
  timeline.add(*segment);
  if (start_tick) resolve_tick();
  if (start_tick) {
    demuxer.skip_segment();
    return;
  }
  const std::uint64_t end = segment->first_frame + segment->frame_count;
  segments.push_back({++last_no, demux_lap, segment->first_frame, end, wanted});
  near_end = end + segment->frame_count;
  come_ticks = segment->first_tick;
  const auto last = player::span_of_frame(timeline, end - 1);
  if (last) near_end_tick = 2 * (last->first_tick + last->ticks) - come_ticks;
}

/// The segment of the tick tells which frame playback starts with.
void State::resolve_tick() {
  const auto index = timeline.frame_at(*start_tick);
  if (!index) return;
  start_tick.reset();
  start = lap_start = wanted_index = *index;
  next_index = *index;
  come_end = demuxer.complete_end();
  changed.notify_all();
}

void State::take_chunk(container::ChunkRecord& chunk) {
  const auto found = std::ranges::find_if(
      tracks, [&](const auto& t) { return t->about.track_id == chunk.track_id; });
  const container::SegmentRecord* segment = demuxer.segment();
  if (found == tracks.end() || segment == nullptr || last_no == 0) {
    returned.push_back(std::move(chunk));
    return;
  }
  Track& track = **found;
  track.about.bytes += chunk.data.size();
  packet_bytes += container::storage_bytes(chunk);
  track.lanes[last_no % track.lanes.size()]->inbox.push_back(
      {last_no, segment->index, segment->first_frame, segment->frame_count, std::move(chunk)});
}

}  // namespace relit::player
