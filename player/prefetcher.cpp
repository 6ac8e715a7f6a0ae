// SPDX-License-Identifier: MIT
#include "player/prefetcher.hpp"

#include <algorithm>

#include "container/base/out_of_memory.hpp"
#include "player/prefetch_state.hpp"

namespace relit::player {

Prefetcher::State::Clock::time_point Prefetcher::State::after(double timeout_s) {
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(
                            std::chrono::duration<double>(std::clamp(timeout_s, 0.0, 1e8)));
}

Prefetcher::State::~State() {
  {
    const std::lock_guard lock(mutex);
    closing = true;
    if (demuxer.interrupt()) demuxer.interrupt()->raise();
  }
  work.notify_all();
  if (thread.joinable()) thread.join();
  for (const auto& track : tracks) {
    for (const auto& lane : track->lanes) lane->strand->close();
  }
}

Prefetcher::Prefetcher(std::unique_ptr<State> state) : state_(std::move(state)) {}
Prefetcher::~Prefetcher() = default;

Result<std::unique_ptr<Prefetcher>> Prefetcher::create(ClipDemuxer demuxer,
                                                       std::shared_ptr<WorkerPool> pool,
                                                       const PrefetchOptions& options) {
  return catch_out_of_memory("starting to fetch", [&]() -> Result<std::unique_ptr<Prefetcher>> {
    RELIT_TRY(demuxer.check_frame(options.first_frame));
    auto state = std::make_unique<State>(std::move(demuxer));
    State& s = *state;
    s.ring_limit = options.ring_bytes;
    s.packet_limit = options.packet_bytes;
    s.planes = options.planes;
    s.impatient = options.impatient;
    s.start = s.wanted_index = options.first_frame;
    s.end_frame = options.end_frame;
    s.every = options.every;
    RELIT_TRY(s.open_tracks(options, std::move(pool)));
    std::unique_ptr<Prefetcher> prefetcher(new Prefetcher(std::move(state)));
    std::vector<std::uint8_t> layers = options.layers;
    if (layers.empty()) layers.assign(s.demuxer.layers().size(), 1);
    RELIT_TRY(prefetcher->set_layers(layers));
    s.pass_choice_on();
    RELIT_TRY(prefetcher->set_loop(options.loop, options.loop_begin, options.loop_end));
    try {
      s.thread = std::thread([&s] { s.run(); });
    } catch (const std::system_error& error) {
      return fail(ErrorCode::kEnvironment,
                  std::string("the system gives no more threads: ") + error.what());
    }
    return prefetcher;
  });
}

const container::FileContents& Prefetcher::contents() const { return state_->demuxer.contents(); }
const container::ClipRecord& Prefetcher::clip() const { return state_->demuxer.clip(); }
const container::ModelRecord& Prefetcher::model() const { return state_->demuxer.model(); }
const std::vector<container::LayerRecord>& Prefetcher::layers() const {
  return state_->demuxer.layers();
}
const std::vector<decoders::Mesh>& Prefetcher::meshes() const { return state_->demuxer.meshes(); }
bool Prefetcher::seekable() const { return state_->demuxer.seekable(); }

void Prefetcher::want(std::uint64_t index) {
  State& s = *state_;
  const std::lock_guard lock(s.mutex);
  if (std::exchange(s.gone_by, false)) {
    s.error.reset();
    s.work.notify_one();
  }
  if (index == s.wanted_index && !s.error && !s.start_tick) return;
  s.wanted_index = index;
  s.underrun = false;
  for (std::uint64_t seq = s.head; seq < s.tail; ++seq) {
    if (!s.at(seq).shows(index)) continue;
    s.release_before(seq);
    s.eager = true;
    s.admit();
    s.wake();
    return;
  }
  if (s.is_near(index)) {
    if (s.error) return;
    s.release_before(s.tail);
    s.next_index = index;
    s.eager = true;
    s.admit();
    s.wake();
    return;
  }
  if (index >= s.demuxer.clip().frame_count) return;
  if (s.demuxer.seekable()) {
    s.restart(index, std::nullopt);
  } else if (!s.error) {
    s.gone_by = true;
    s.fail_with(s.demuxer.gone_by(index).error);
  }
}

void Prefetcher::fetch_ahead() {
  const std::lock_guard lock(state_->mutex);
  state_->go_on();
}

const ClipFrame* Prefetcher::frame(std::uint64_t index) {
  State& s = *state_;
  const std::lock_guard lock(s.mutex);
  State::Slot* slot = s.find(index);
  const bool wanted = index == s.wanted_index;
  if (slot == nullptr || !s.ready(*slot)) {
    if (!wanted) s.go_on();
    if (wanted && s.given && !std::exchange(s.underrun, true)) ++s.counts.underruns;
    return nullptr;
  }
  if (slot->lost) {
    if (wanted && !std::exchange(slot->counted, true)) ++s.lost_frames;
    slot = s.stand_in(*slot);
    if (slot == nullptr) return nullptr;
  }
  s.assemble(*slot);
  if (!wanted) return &slot->frame;
  if (s.counts.first_picture_s == 0) {
    s.counts.first_picture_s =
        std::chrono::duration<double>(State::Clock::now() - s.created).count();
  }
  s.given = true;
  if (slot == s.shown) return &slot->frame;
  if (s.shown != nullptr && s.shown_detached) s.free_slot(s.shown);
  s.shown = slot;
  s.shown_detached = false;
  return &slot->frame;
}

const ClipFrame* Prefetcher::shown() const {
  const std::lock_guard lock(state_->mutex);
  return state_->shown != nullptr ? &state_->shown->frame : nullptr;
}

Result<bool> Prefetcher::wait(std::uint64_t index, double timeout_s) {
  State& s = *state_;
  RELIT_TRY(s.demuxer.check_frame(index));
  std::unique_lock lock(s.mutex);
  if (index != s.wanted_index) s.go_on();
  const auto here = [&] {
    const State::Slot* slot = s.find(index);
    return slot != nullptr && s.ready(*slot);
  };
  s.changed.wait_until(lock, State::after(timeout_s),
                       [&] { return s.cancelled || s.error || here(); });
  if (s.cancelled) return fail(ErrorCode::kCancelled, s.demuxer.name() + ": cancelled");
  if (here()) {
    State::Slot& slot = *s.find(index);
    if (slot.lost && s.stand_in(slot) == nullptr) {
      if (s.last_damage) return s.demuxer.in_file(*s.last_damage);
      return fail(ErrorCode::kCorrupt, s.demuxer.name() + ": frame " + std::to_string(index) +
                                           " is damaged, and nothing came before it");
    }
    return true;
  }
  if (s.error) return Unexpected{*s.error};
  return false;
}

Status Prefetcher::error() const {
  const std::lock_guard lock(state_->mutex);
  const State::Slot* slot = state_->find(state_->wanted_index);
  if (!state_->error || (slot != nullptr && state_->ready(*slot))) return {};
  return Unexpected{*state_->error};
}

void Prefetcher::cancel() {
  State& s = *state_;
  const std::lock_guard lock(s.mutex);
  s.cancelled = true;
  if (s.demuxer.interrupt()) s.demuxer.interrupt()->raise();
  s.changed.notify_all();
}

void Prefetcher::want_tick(std::uint64_t tick) {
  State& s = *state_;
  const std::lock_guard lock(s.mutex);
  if (s.timeline.frame_at(tick) || s.start_tick == tick) return;
  if (s.comes_to(tick)) {
    s.release_before(s.tail);
    s.next_index.reset();
    s.start_tick = tick;
    s.work.notify_one();
  } else if (tick < s.demuxer.clip().duration_ticks) {
    s.restart(0, tick);
  }
}

Result<bool> Prefetcher::wait_tick(std::uint64_t tick, double timeout_s) {
  State& s = *state_;
  RELIT_TRY(s.demuxer.check_tick(tick));
  std::unique_lock lock(s.mutex);
  const auto known = [&] { return s.timeline.frame_at(tick).has_value(); };
  s.changed.wait_until(lock, State::after(timeout_s),
                       [&] { return s.cancelled || s.error || known(); });
  if (s.cancelled) return fail(ErrorCode::kCancelled, s.demuxer.name() + ": cancelled");
  if (known()) return true;
  if (s.error) return Unexpected{*s.error};
  return false;
}

std::optional<FrameSpan> Prefetcher::span_at_tick(std::uint64_t tick) const {
  const std::lock_guard lock(state_->mutex);
  return player::span_at_tick(state_->timeline, tick);
}

std::optional<FrameSpan> Prefetcher::span_of_frame(std::uint64_t index) const {
  const std::lock_guard lock(state_->mutex);
  return player::span_of_frame(state_->timeline, index);
}

std::uint64_t Prefetcher::first_tick(std::uint64_t index) const {
  const std::lock_guard lock(state_->mutex);
  return state_->timeline.first_tick(index).value_or(index);
}

std::uint32_t Prefetcher::ticks_of(std::uint64_t index) const {
  const std::lock_guard lock(state_->mutex);
  return state_->timeline.ticks_of(index).value_or(1);
}

Status Prefetcher::set_layers(std::span<const std::uint8_t> wanted, bool now) {
  State& s = *state_;
  RELIT_TRY(s.check_choice(wanted));
  return catch_out_of_memory("choosing layers", [&]() -> Status {
    const std::lock_guard lock(s.mutex);
    auto by_track = std::make_shared<std::vector<std::uint8_t>>(s.tracks.size(), 1);
    for (std::size_t t = 1; t < s.tracks.size(); ++t) {
      State::Track& track = *s.tracks[t];
      const bool enable = wanted[static_cast<std::size_t>(track.about.layer)] != 0;
      (*by_track)[t] = enable ? 1 : 0;
      if (!enable || track.enabled) continue;
      // Those of the other lanes are opened when their first segment has come.
      RELIT_ASSIGN(track.lanes.front()->incoming, s.open_decoder(track));
    }
    for (std::size_t t = 0; t < s.tracks.size(); ++t) s.tracks[t]->enabled = (*by_track)[t] != 0;
    s.wanted = std::move(by_track);
    // What has been read ahead of layers that go is not decoded any more.
    for (State::Segment& segment : s.segments) {
      auto left = std::make_shared<std::vector<std::uint8_t>>(*segment.wanted);
      for (std::size_t t = 0; t < left->size(); ++t) (*left)[t] &= (*s.wanted)[t];
      segment.wanted = std::move(left);
    }
    s.wanted_layers.assign(wanted.begin(), wanted.end());
    s.wanted_changed = true;
    if (now && s.demuxer.seekable()) s.restart(s.wanted_index, std::nullopt);
    s.wake();
    return {};
  });
}

Status Prefetcher::set_loop(bool loop, std::uint64_t begin, std::uint64_t end) {
  State& s = *state_;
  const std::uint64_t count = s.demuxer.clip().frame_count;
  if (end == 0) end = count;
  if (begin >= end || end > count) {
    return fail(ErrorCode::kInvalid, "a loop of frames " + std::to_string(begin) + " to " +
                                         std::to_string(end) + " does not fit a clip of " +
                                         std::to_string(count));
  }
  const std::lock_guard lock(s.mutex);
  if (loop == s.loop && begin == s.loop_begin && end == s.loop_end) return {};
  s.loop = loop;
  s.loop_begin = begin;
  s.loop_end = end;
  if (s.thread.joinable() && s.demuxer.seekable()) s.restart(s.wanted_index, std::nullopt);
  s.work.notify_one();
  return {};
}

void Prefetcher::set_every(std::uint64_t n) {
  const std::lock_guard lock(state_->mutex);
  state_->every = n;
}

void Prefetcher::set_limits(std::size_t ring_bytes, std::size_t packet_bytes) {
  State& s = *state_;
  const std::lock_guard lock(s.mutex);
  s.ring_limit = ring_bytes;
  s.packet_limit = packet_bytes;
  s.admit();
  s.wake();
}

PrefetchStats Prefetcher::stats() const {
  const State& s = *state_;
  const std::lock_guard lock(s.mutex);
  PrefetchStats stats = s.counts;
  for (const auto& track : s.tracks) stats.tracks.push_back(track->about);
  stats.ring_bytes = s.ring_bytes;
  for (std::uint64_t seq = s.head; seq < s.tail; ++seq) {
    if (state_->at(seq).missing == 0) ++stats.ring_frames;
  }
  stats.packet_bytes = s.packet_bytes + s.spare_bytes;
  stats.picture_bytes = s.memory->bytes();
  stats.picture_bytes_peak = s.memory->peak_bytes();
  return stats;
}

PlaybackLoss Prefetcher::loss() const {
  const std::lock_guard lock(state_->mutex);
  PlaybackLoss loss = state_->demux_loss;
  loss.frames = state_->lost_frames;
  if (loss.first.empty()) loss.first = state_->first_damage;
  return loss;
}

}  // namespace relit::player
