// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <mutex>

#include "player/character.hpp"
#include "player/clip_voice.hpp"
#include "player/player.hpp"
#include "player/player_light.hpp"
#include "player/posed_meshes.hpp"
#include "player/shared_source.hpp"

/// The inside of Player, which its source files share.
namespace relit::player {

/// The mean of what took some time, where the latest count most.
class RecentMean {
 public:
  void add(double value) {
    mean_ = counted_ ? mean_ + (value - mean_) / 32 : value;
    counted_ = true;
  }
  [[nodiscard]] double value() const { return mean_; }

 private:
  double mean_ = 0;
  bool counted_ = false;
};

struct Player::State final : FrameTimes {
  ~State() override;
  using Clock = std::chrono::steady_clock;
  [[nodiscard]] static double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  }

  // player.cpp
  Status open(std::unique_ptr<container::ByteSource> source);
  Status plan_and_start(ClipDemuxer demuxer);
  [[nodiscard]] MemoryWishes wishes() const;
  [[nodiscard]] PrefetchOptions prefetch_options(std::size_t layer_count, bool round) const;
  [[nodiscard]] std::vector<std::uint8_t> allowed_layers(std::size_t count) const;
  [[nodiscard]] std::optional<FrameSpan> at_tick(std::size_t clip,
                                                 std::uint64_t tick) const override;
  [[nodiscard]] std::optional<FrameSpan> of_frame(std::size_t clip,
                                                  std::uint64_t frame) const override;
  void say(LogLevel level, const std::string& text) const {
    if (options.log) options.log(level, text);
  }
  void jumped();
  void jumped_within();

  // player_voices.cpp
  Status assign_voices(const Moment& now);
  Status change_item(const Moment& now);
  void drop(std::unique_ptr<ClipVoice>& voice);
  [[nodiscard]] std::string name_of(std::size_t clip) const;
  [[nodiscard]] bool goes_round(std::size_t item) const;
  Result<std::unique_ptr<ClipVoice>> make_voice(std::size_t clip, bool round);
  Status attach_voice(ClipVoice& voice);
  Status prepare_next(const Moment& now);
  Status set_loops();
  [[nodiscard]] Result<MemoryPlan> plan_for(std::span<const std::size_t> clips) const;
  Status follow(MemoryPlan planned);
  [[nodiscard]] std::array<ClipVoice*, 4> voices() const {
    return {primary.get(), secondary.get(), prepared.get(), leaving.get()};
  }

  // player_update.cpp
  Status update(std::int64_t now_ns);
  Status show(const Moment& now, bool at_once);
  Status bring_light(bool& changed);
  Status pose_meshes(const Moment& now, bool& changed);
  Status composite();
  void govern(std::int64_t now_ns);
  void note_shown(const Moment& now);
  [[nodiscard]] bool stands(std::int64_t now_ns);
  Result<bool> wait(double timeout_s);
  Result<bool> show_frame(std::uint64_t frame, double timeout_s);
  static Result<bool> wait_for_place(ClipVoice& voice, const FramePosition& position,
                                     double timeout_s);
  Result<bool> wait_for(ClipVoice& voice, const FramePosition& position, double timeout_s);
  Status source_error();

  // player_draw.cpp
  Status attach(std::unique_ptr<gles::Device> context);
  void forget_gl();
  Status set_backdrop(const Backdrop& wanted);
  void use_exposure(float exposure);
  Status freshen();
  Status draw(const gles::View& view, const Backdrop& wanted);
  [[nodiscard]] bool wants_measuring(const gles::View& view);
  Status measure_path(const gles::View& view);
  [[nodiscard]] double covered_pixels(const gles::View& view) const;
  [[nodiscard]] PlayerStats stats() const;

  PlayerOptions options;
  std::shared_ptr<SharedSource> shared;  ///< null: the source cannot seek, and has one reader
  std::optional<ClipDemuxer> root;       ///< from which voices come; none where `shared` is null
  std::shared_ptr<const ClipDemuxer::Statics> statics;
  std::shared_ptr<WorkerPool> pool;
  MemoryPlan plan;
  int layers = -1, planes = -1;

  std::optional<Playback> playback;
  std::optional<Governor> governor;
  std::optional<PlayerLight> light;
  std::vector<SequenceItem> sequence;  ///< empty: one clip
  bool sequence_loops = false;
  unsigned program = 0;  ///< counts what was begun to be played

  std::unique_ptr<gles::Device> device;  ///< destroyed after voices and character, which use it

  // Voices by role, and whose the primary is. The mutex is for cancel(), which comes from anywhere.
  std::mutex roles;
  std::unique_ptr<ClipVoice> primary, secondary;
  std::unique_ptr<ClipVoice> prepared;  ///< of the item that comes next
  std::unique_ptr<ClipVoice> leaving;   ///< shown until the primary has its first frame
  ClipVoice* lit = nullptr;             ///< whose light map is shown: one of these; null: none yet
  std::optional<std::pair<unsigned, std::size_t>> primary_item;  ///< program, item
  ClipVoice::Frames primary_frames, secondary_frames;
  float secondary_weight = 0;

  // What is shown.
  struct ShownPose {
    const ClipVoice* voice = nullptr;
    const ClipVoice* other = nullptr;
    std::uint64_t frame = 0, next = 0, other_frame = 0;
    float blend = 0, other_blend = 0, other_weight = 0;
    bool operator==(const ShownPose&) const = default;
  };
  ShownPose shown_pose;
  std::optional<PosedMeshes> posed;
  PlayerMoment moment;
  std::optional<std::int64_t> last_ns, late_since_ns;
  double light_time_s = 0;
  bool light_stale = true;             ///< a relighter has not got the light yet
  bool light_moved = false;            ///< since the last composite
  std::uint64_t light_changed_at = 0;  ///< the update that folded one last
  bool layers_settled = false;         ///< what that light does not need is not fetched
  bool recomposite = false;            ///< something else than frame and light has changed
  bool shown_complete = false;         ///< all planes of the frame that is shown were here
  std::uint64_t composited_at = 0;     ///< the update that composited last
  std::string reported_error;
  bool seeking = true;  ///< frames passed over were not due
  std::atomic<bool> cancelled{false};

  std::unique_ptr<Character> character;
  std::optional<Backdrop> backdrop;  ///< that the renderer has; none: none yet
  unsigned backdrop_light = 0;       ///< PlayerLight::generation() that it was made of
  unsigned backdrop_harmonics = 0;   ///< likewise unturned_generation()
  bool positions_uploaded = false;
  float exposure = 0;  ///< that relighters know
  std::uint64_t draws = 0;

  // Figures.
  Clock::time_point opened = Clock::now();
  PlayerStats counted;
  RecentMean composite_s, pose_s, draw_s;
  double update_s = 0, drawn_s = 0, composited_s = 0;  ///< of this display frame
};

}  // namespace relit::player
