// SPDX-License-Identifier: MIT
#include "player/prefetcher.hpp"

#include <atomic>
#include <map>
namespace relit::player {
struct Prefetcher::State {
  std::shared_ptr<ClipReader> r;
  bool seek = false;
  std::map<std::uint64_t, ClipFrame> ring;
  std::uint64_t wanted = 0;
  const ClipFrame* shown = nullptr;
  std::uint64_t shown_index = 0;
  std::atomic<bool> cancelled{false};
  Status err;
  PrefetchStats st;
  std::shared_ptr<const ClipDemuxer::Statics> statics;
};
Prefetcher::Prefetcher(std::unique_ptr<State> s) : state_(std::move(s)) {}
Prefetcher::~Prefetcher() = default;
Result<std::unique_ptr<Prefetcher>> Prefetcher::create(ClipDemuxer d, std::shared_ptr<WorkerPool>,
                                                       const PrefetchOptions&) {
  auto s = std::make_unique<State>();
  s->r = d.reader;
  s->seek = d.can_seek;
  s->statics = d.statics();
  s->st.tracks.resize(1);
  return std::unique_ptr<Prefetcher>(new Prefetcher(std::move(s)));
}
const container::FileContents& Prefetcher::contents() const { return state_->statics->contents; }
const container::ClipRecord& Prefetcher::clip() const { return state_->r->clip(); }
const container::ModelRecord& Prefetcher::model() const { return state_->r->model(); }
const std::vector<container::LayerRecord>& Prefetcher::layers() const {
  return state_->r->layers();
}
const std::vector<decoders::Mesh>& Prefetcher::meshes() const { return state_->statics->meshes; }
bool Prefetcher::seekable() const { return state_->seek; }
void Prefetcher::want(std::uint64_t f) {
  state_->wanted = f;
  for (auto it = state_->ring.begin(); it != state_->ring.end();) {
    if (&it->second != state_->shown && (it->first < f || it->first > f + 8))
      it = state_->ring.erase(it);
    else
      ++it;
  }
}
const ClipFrame* Prefetcher::frame(std::uint64_t i) {
  auto it = state_->ring.find(i);
  if (it == state_->ring.end()) {
    ClipFrame f;
    state_->err = state_->r->frame(i, f);
    if (!state_->err) return nullptr;
    it = state_->ring.emplace(i, std::move(f)).first;
    ++state_->st.decoded_frames;
    state_->st.tracks[0].bytes += 100;
  }
  if (i == state_->wanted) state_->shown = &it->second;
  return &it->second;
}
const ClipFrame* Prefetcher::shown() const { return state_->shown; }
Result<bool> Prefetcher::wait(std::uint64_t i, double) {
  if (state_->cancelled) return fail(ErrorCode::kCancelled, "cancelled");
  if (frame(i)) return true;
  return Unexpected{state_->err.error()};
}
Status Prefetcher::error() const { return state_->err; }
void Prefetcher::cancel() { state_->cancelled = true; }
Result<std::uint64_t> Prefetcher::frame_at(std::uint64_t t) { return state_->r->frame_at(t); }
std::uint64_t Prefetcher::first_tick(std::uint64_t i) const { return state_->r->first_tick(i); }
std::uint32_t Prefetcher::ticks_of(std::uint64_t i) const { return state_->r->ticks_of(i); }
std::optional<FrameSpan> Prefetcher::span_at_tick(std::uint64_t t) const {
  auto f = state_->r->frame_at(t);
  if (!f) return std::nullopt;
  return span_of_frame(*f);
}
std::optional<FrameSpan> Prefetcher::span_of_frame(std::uint64_t f) const {
  return FrameSpan{f, state_->r->first_tick(f), state_->r->ticks_of(f)};
}
Status Prefetcher::set_layers(std::span<const std::uint8_t>, bool) { return {}; }
Status Prefetcher::set_loop(bool, std::uint64_t, std::uint64_t) { return {}; }
PrefetchStats Prefetcher::stats() const { return state_->st; }
PlaybackLoss Prefetcher::loss() const { return state_->r->loss(); }
}  // namespace relit::player
