// SPDX-License-Identifier: MIT
#include "player/player.hpp"

#include <algorithm>
#include <thread>

#include "container/base/out_of_memory.hpp"
#include "player/player_state.hpp"

namespace relit::player {

Player::Player(std::unique_ptr<State> state) : state_(std::move(state)) {}
Player::~Player() = default;

// Whatever is being read stops first, so that voices need not wait for it.
Player::State::~State() {
  if (options.interrupt) options.interrupt->raise();
}

Result<std::unique_ptr<Player>> Player::open(std::unique_ptr<container::ByteSource> source,
                                             const PlayerOptions& options) {
  return catch_out_of_memory("opening a player", [&]() -> Result<std::unique_ptr<Player>> {
    auto state = std::make_unique<State>();
    state->options = options;
    RELIT_TRY(state->open(std::move(source)));
    return std::unique_ptr<Player>(new Player(std::move(state)));
  });
}

Status Player::State::open(std::unique_ptr<container::ByteSource> source) {
  layers = options.layers;
  RELIT_ASSIGN(governor, Governor::create(options.governor));
  RELIT_ASSIGN(light, PlayerLight::create());
  DemuxOptions demux{options.clip, options.sparing || layers >= 0, options.interrupt};
  if (!source->seekable()) {
    RELIT_ASSIGN(ClipDemuxer demuxer, ClipDemuxer::open(std::move(source), options.name, demux));
    return plan_and_start(std::move(demuxer));
  }
  RELIT_ASSIGN(shared, SharedSource::create(std::move(source)));
  RELIT_ASSIGN(root, ClipDemuxer::open(shared->cursor(), options.name, demux));
  RELIT_ASSIGN(ClipDemuxer demuxer, root->another(shared->cursor(), demux));
  return plan_and_start(std::move(demuxer));
}

std::vector<std::uint8_t> Player::State::allowed_layers(std::size_t count) const {
  std::vector<std::uint8_t> allowed(count, 1);
  const auto planned = static_cast<std::size_t>(plan.layer_count());
  const std::size_t most =
      layers < 0 ? planned : std::min(planned, static_cast<std::size_t>(layers));
  for (std::size_t l = most; l < count; ++l) allowed[l] = 0;
  return allowed;
}

PrefetchOptions Player::State::prefetch_options(std::size_t layer_count, bool round) const {
  PrefetchOptions prefetch;
  prefetch.ring_bytes = static_cast<std::size_t>(plan.ring_bytes);
  if (plan.packet_bytes > 0) prefetch.packet_bytes = static_cast<std::size_t>(plan.packet_bytes);
  prefetch.threads = plan.decoder_threads;
  prefetch.layers = allowed_layers(layer_count);
  prefetch.decoder = options.decoder;
  prefetch.memory = options.pictures;
  prefetch.loop = round;
  prefetch.every = static_cast<std::uint64_t>(governor->quality().frames_every);
  if (options.sparing) prefetch.ring_bytes = 0, prefetch.packet_bytes = 1;
  return prefetch;
}

MemoryWishes Player::State::wishes() const {
  MemoryWishes wishes;
  wishes.clip = options.clip;
  // What set_layers() leaves out may come back.
  wishes.layers = options.layers;
  wishes.path = options.path;
  wishes.drawing = options.drawing;
  wishes.threads = options.pool          ? options.pool->threads()
                   : options.threads > 0 ? options.threads
                                         : WorkerPool::default_threads();
  return wishes;
}

Status Player::State::plan_and_start(ClipDemuxer demuxer) {
  statics = demuxer.statics();
  RELIT_ASSIGN(
      plan, plan_memory(statics->contents, SegmentScale{}, wishes(), options.memory_budget_bytes));
  for (const std::string& sentence : plan.given_up) say(LogLevel::kInfo, sentence);
  pool = options.pool;
  if (!pool) {
    RELIT_ASSIGN(pool, WorkerPool::create(plan.threads));
  }

  std::vector<PlaybackClip> clips;
  std::size_t wanted = 0;
  for (const container::ClipRecord& clip : statics->contents.clips) {
    if (clip.id == demuxer.clip().id) wanted = clips.size();
    clips.push_back(playback_clip(clip));
  }
  RELIT_ASSIGN(playback, Playback::create(clips, this));
  RELIT_TRY(playback->play_clip(wanted));
  posed.emplace(statics->meshes);

  // What only goes forward does not come round.
  const auto choose = std::exchange(options.frames, nullptr);
  if (!shared || choose) playback->set_loop(LoopMode::kOff);
  PrefetchOptions prefetch = prefetch_options(demuxer.layers().size(), playback->loops());
  if (choose) {
    RELIT_ASSIGN(const PlayerFrames frames, choose(demuxer.clip()));
    prefetch.first_frame = frames.first, prefetch.end_frame = frames.last + 1;
  }
  RELIT_ASSIGN(primary, ClipVoice::create(wanted, std::move(demuxer), pool, prefetch));
  primary_item = {program, std::size_t{0}};
  RELIT_TRY(attach_voice(*primary));
  moment.clip = wanted;
  counted.open_ms = 1e3 * seconds_since(opened);
  return {};
}

const container::FileContents& Player::contents() const { return state_->statics->contents; }
const std::vector<decoders::Mesh>& Player::meshes() const { return state_->statics->meshes; }
const MemoryPlan& Player::plan() const { return state_->plan; }
bool Player::seekable() const { return state_->shared != nullptr; }
const PlayerMoment& Player::moment() const { return state_->moment; }
const Playback& Player::playback() const { return *state_->playback; }

const container::ModelRecord* Player::model_of(std::size_t clip) const {
  const container::FileContents& file = contents();
  if (clip >= file.clips.size()) return nullptr;
  for (const container::ModelRecord& model : file.models)
    if (model.clip_id == file.clips[clip].id) return &model;
  return nullptr;
}

Status Player::set_light(LightField field, std::shared_ptr<const decoders::Environment> environment,
                         double environment_rotation_rad) {
  state_->light->set(std::move(field), std::move(environment), environment_rotation_rad);
  return {};
}

Status Player::set_light(const LoadedLight& light) {
  if (light.field)
    return set_light(*light.field, light.environment, light.environment_rotation_rad);
  RELIT_ASSIGN(LightField field, LightField::steady(light.light));
  return set_light(std::move(field), light.environment, light.environment_rotation_rad);
}

Status Player::turn_light(double angle_rad) { return state_->light->turn(angle_rad); }

void Player::set_position(const glm::vec3& position) { state_->light->set_position(position); }

float Player::auto_exposure() const { return state_->light->auto_exposure(); }

// Where playback is now has nothing to do with where it was.
void Player::State::jumped() {
  late_since_ns.reset();
  reported_error.clear();
  seeking = true;
}

// Within what plays, whose light goes with it.
void Player::State::jumped_within() {
  light_time_s = playback->now().time_s;
  jumped();
}

Status Player::play_clip(std::size_t clip, double cross_fade_s) {
  if (!seekable() && clip < contents().clips.size() && clip != state_->primary->clip())
    return fail(ErrorCode::kUnsupported,
                state_->options.name + ": another clip needs a source that can seek");
  // The clip that goes plays on while it fades.
  const std::size_t both[2] = {clip, state_->moment.clip};
  const bool fades = seekable() && cross_fade_s > 0;
  RELIT_ASSIGN(MemoryPlan planned, state_->plan_for(std::span(both).first(fades ? 2 : 1)));
  RELIT_TRY(state_->playback->play_clip(clip, seekable() ? cross_fade_s : 0));
  RELIT_TRY(state_->follow(std::move(planned)));
  state_->sequence.clear();
  ++state_->program;
  state_->jumped();
  return state_->set_loops();
}

Status Player::play_sequence(std::span<const SequenceItem> items, bool loop) {
  if (!seekable())
    return fail(ErrorCode::kUnsupported,
                state_->options.name + ": a sequence needs a source that can seek");
  std::vector<std::size_t> clips;
  for (const SequenceItem& item : items) clips.push_back(item.clip);
  RELIT_ASSIGN(MemoryPlan planned, state_->plan_for(clips));
  RELIT_TRY(state_->playback->play_sequence(items, loop));
  RELIT_TRY(state_->follow(std::move(planned)));
  state_->sequence.assign(items.begin(), items.end());
  state_->sequence_loops = loop;
  ++state_->program;
  state_->jumped();
  return state_->set_loops();
}

void Player::set_paused(bool paused) { state_->playback->set_paused(paused); }
Status Player::set_speed(double speed) { return state_->playback->set_speed(speed); }

void Player::set_loop(LoopMode mode) {
  state_->playback->set_loop(mode);
  // Which frames are fetched ahead changes; where that fails, playback goes back by seeking.
  if (const Status status = state_->set_loops(); !status)
    state_->say(LogLevel::kWarning, status.error().message);
}

Status Player::seek(double time_s) {
  RELIT_TRY(state_->playback->seek(time_s));
  state_->jumped_within();
  return {};
}

Status Player::seek_frame(std::uint64_t frame) {
  RELIT_TRY(state_->playback->seek_frame(frame));
  state_->jumped_within();
  return {};
}

Status Player::step(std::int64_t frames) {
  RELIT_TRY(state_->playback->step(frames));
  state_->jumped_within();
  return {};
}

Status Player::set_layers(int layers) {
  state_->layers = layers;
  for (ClipVoice* voice : state_->voices()) {
    if (voice == nullptr) continue;
    voice->allow(state_->allowed_layers(voice->prefetcher().layers().size()));
  }
  state_->light_stale = true;
  return {};
}

void Player::set_planes(int planes) {
  state_->planes = planes;
  state_->recomposite = true;
}

void Player::set_interpolation(bool on) { state_->options.interpolate = on; }

Status Player::set_path(CompositePath path) {
  state_->options.path = path;
  for (ClipVoice* voice : state_->voices())
    if (voice != nullptr && state_->device) RELIT_TRY(voice->relighter()->set_path(path));
  state_->recomposite = true;
  return {};
}

Status Player::set_quality(std::optional<double> quality) {
  return state_->governor->set_quality(quality);
}

Status Player::set_target_fps(double fps) { return state_->governor->set_target_fps(fps); }

Status Player::update(std::int64_t now_ns) { return state_->update(now_ns); }
Result<bool> Player::wait(double timeout_s) { return state_->wait(timeout_s); }
Result<bool> Player::show_frame(std::uint64_t frame, double timeout_s) {
  return state_->show_frame(frame, timeout_s);
}
std::uint32_t Player::ticks_of(std::uint64_t frame) const {
  return state_->primary->prefetcher().ticks_of(frame);
}

void Player::cancel() {
  state_->cancelled.store(true);
  if (state_->options.interrupt) state_->options.interrupt->raise();
  const std::lock_guard lock(state_->roles);
  for (ClipVoice* voice : state_->voices())
    if (voice != nullptr) voice->prefetcher().cancel();
}

}  // namespace relit::player
