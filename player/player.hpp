// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "container/byte_source.hpp"
#include "container/reader.hpp"
#include "decoders/mesh.hpp"
#include "decoders/picture_pool.hpp"
#include "decoders/sh.hpp"
#include "gles/device.hpp"
#include "gles/light_map.hpp"
#include "gles/view.hpp"
#include "player/governor.hpp"
#include "player/interrupt.hpp"
#include "player/light.hpp"
#include "player/light_field.hpp"
#include "player/memory_plan.hpp"
#include "player/path_chooser.hpp"
#include "player/playback.hpp"
#include "player/prefetcher.hpp"
#include "player/worker_pool.hpp"

namespace relit::player {

enum class LogLevel { kError = 0, kWarning = 1, kInfo = 2 };

struct PlayerFrames {
  std::uint64_t first = 0, last = 0;
};

struct PlayerOptions {
  std::string name;         ///< of the source, for messages
  std::string clip;         ///< by name or number; empty: the first
  int layers = -1;          ///< only the first so many; -1: all
  int threads = 0;          ///< of a pool of its own; 0: one a processor
  bool interpolate = true;  ///< light maps and poses are blended between frames
  CompositePath path = CompositePath::kAuto;
  std::optional<std::uint64_t> memory_budget_bytes;
  std::optional<DrawingScale> drawing;  ///< what the plan counts besides: see MemoryWishes
  GovernorOptions governor;
  std::string decoder;  ///< tried first, by libavcodec's name
  /// Not everything will be played: only what is needed is fetched, and the next frame at most.
  bool sparing = false;
  /// Of the clip that is opened, given its record: which frames are shown, the first of them first.
  /// Nothing else is fetched unless playback goes there, and it does not go round. Its errors are
  /// those of open(). Null: all.
  std::function<Result<PlayerFrames>(const container::ClipRecord&)> frames;
  std::shared_ptr<WorkerPool> pool;      ///< null: one of its own
  std::shared_ptr<Interrupt> interrupt;  ///< what the source polls; null: it cannot be stopped
  /// Where the pictures of decoders are; null: in the runtime's memory.
  std::shared_ptr<decoders::PictureMemory> pictures;
  /// Takes a sentence for the user. Called from the threads that call the player.
  std::function<void(LogLevel, const std::string&)> log;
};

/// What is behind the character.
struct Backdrop {
  enum class Kind {
    kKeep,         ///< what the framebuffer holds, colour and depth
    kTransparent,  ///< alpha 0
    kColor,
    kLight,      ///< the environment's picture; where there is none, the harmonics
    kHarmonics,  ///< the light as the character sees it
  };
  Kind kind = Kind::kLight;
  std::array<float, 3> color{};  ///< sRGB display values
  float blur_rad = 0;            ///< of the environment
  bool operator==(const Backdrop&) const = default;
};

/// What a display frame shows.
struct PlayerMoment {
  bool ready = false;    ///< a picture has arrived
  bool changed = false;  ///< there is something to draw that the last update did not show
  bool late = false;     ///< the frame that is due is not here: the last picture stays
  bool ended = false;
  std::size_t clip = 0;
  std::uint64_t frame = 0;
  double time_s = 0;
  std::optional<double> next_s;  ///< until the picture changes by itself; none: it will not
};

struct PlayerStats {
  // Display frames; updates = shown + repeated + late + waiting.
  std::uint64_t updates = 0, shown = 0, repeated = 0, late = 0, waiting = 0;
  std::uint64_t skipped_frames = 0;  ///< of the clip, that were due and never shown
  std::uint64_t composites = 0;
  std::uint64_t planes_uploaded = 0;  ///< to the GPU, of the clip that is playing
  PlaybackLoss loss;
  PrefetchStats prefetch;  ///< of the clip that is playing
  double decode_ms = 0;    ///< of pool threads, for a frame; means since the player was opened
  double composite_ms = 0, pose_ms = 0, draw_ms = 0;
  std::size_t gpu_bytes = 0;
  double quality = 1;
  Quality chosen;
  CompositePath path = CompositePath::kAuto;
  int planes = 0, planes_of = 0;
  // From open() to the first picture, by stage.
  double open_ms = 0, first_frame_ms = 0, attach_ms = 0, first_draw_ms = 0;
};

/// A file being played: prefetch, clock, light, governor and, while a GL context is attached,
/// drawing. Owns no thread but through its pool and prefetchers. One thread at a time, the
/// context's while one is attached.
///
///     open() -> attach() -> { update(), draw() }... -> detach() or abandon() -> destruction
///
/// While attached, everything but abandon() needs the context current, destruction included. GL
/// state: see gles::Device.
class Player {
 public:
  /// Reads what is static and begins to fetch. Errors: those of ClipDemuxer::open(),
  /// plan_memory() and Prefetcher::create().
  static Result<std::unique_ptr<Player>> open(std::unique_ptr<container::ByteSource> source,
                                              const PlayerOptions& options);
  ~Player();
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;

  [[nodiscard]] const container::FileContents& contents() const;
  [[nodiscard]] const std::vector<decoders::Mesh>& meshes() const;
  [[nodiscard]] const MemoryPlan& plan() const;
  [[nodiscard]] bool seekable() const;
  /// The model and the light map's full size of a clip. Requires one (see contents()).
  [[nodiscard]] const container::ModelRecord* model_of(std::size_t clip) const;
  /// Where the clip that plays is now; `clip` counts as contents().clips.
  [[nodiscard]] const PlayerMoment& moment() const;

  // ---- GL

  /// Uploads what is static to the context that is current. `device` outlives the attachment.
  /// Errors: kInvalid where one is attached; kEnvironment, kOutOfMemory.
  Status attach(std::unique_ptr<gles::Device> device);
  void detach();
  /// The context is lost: forgets its objects without calling GL.
  void abandon();
  [[nodiscard]] gles::Device* device() const;

  // ---- light. At first it is white, of radiance 1.

  /// Errors: kInvalid for numbers that are not finite or another count of rows; the old one stays.
  Status set_light(LightField field, std::shared_ptr<const decoders::Environment> environment,
                   double environment_rotation_rad);
  Status set_light(const LoadedLight& light);
  /// Turns light and environment about +Y from how they were set.
  Status turn_light(double angle_rad);
  /// Where the character stands in the light field.
  void set_position(const glm::vec3& position);
  /// Under which a white surface in the mean of the light is a little below white.
  [[nodiscard]] float auto_exposure() const;

  // ---- time: see Playback, whose errors they return

  Status play_clip(std::size_t clip, double cross_fade_s);
  Status play_sequence(std::span<const SequenceItem> items, bool loop);
  void set_paused(bool paused);
  Status set_speed(double speed);
  void set_loop(LoopMode mode);
  Status seek(double time_s);
  Status seek_frame(std::uint64_t frame);
  Status step(std::int64_t frames);
  [[nodiscard]] const Playback& playback() const;

  // ---- what may be traded

  /// The first so many layers; -1: all that the plan allows.
  Status set_layers(int layers);
  /// The first so many planes, of those that the governor leaves; -1: all.
  void set_planes(int planes);
  void set_interpolation(bool on);
  Status set_path(CompositePath path);
  Status set_quality(std::optional<double> quality);
  Status set_target_fps(double fps);

  // ---- a display frame

  /// Moves the clock, takes the frames that are there, poses and composites. Never waits for the
  /// source: a frame that is not here is late, and when it stays so for a quarter of a second the
  /// clock stands until it comes. In the steady state nothing is allocated. Errors: the source's,
  /// once each; those of GL.
  Status update(std::int64_t now_ns);
  /// Waits for the frame of the moment, without moving the clock, and shows it. False: not within
  /// `timeout_s`. Errors: as update(), and those of Prefetcher::wait().
  Result<bool> wait(double timeout_s);
  /// Goes to a frame of the clip that plays and waits for it, wherever it is; one that damage hit
  /// keeps what is shown. As wait().
  Result<bool> show_frame(std::uint64_t frame, double timeout_s);
  /// How many ticks a frame that has been shown lasts.
  [[nodiscard]] std::uint32_t ticks_of(std::uint64_t frame) const;
  /// Makes wait() and the source return, for good. Any thread.
  void cancel();

  /// Draws into the framebuffer that is bound. Before the first picture only the backdrop. Errors:
  /// kInvalid without a context or for a view that makes no sense; kEnvironment.
  Status draw(const gles::View& view, const Backdrop& backdrop);
  /// The light map as a texture, valid until the next update(), wait() or detach(). Errors:
  /// kInvalid without a context, kNotFound before the first picture.
  Result<gles::LightMap> light_map();
  /// [3][height][width] of light_map_size(), radiance for unit albedo. Errors: kInvalid, kNotFound.
  Status read_light_map(std::span<float> out);
  struct Size {
    int width = 0, height = 0;
  };
  [[nodiscard]] Size light_map_size() const;
  /// Of the moment, model space. `normals` may be empty. Errors: kInvalid for another size or mesh,
  /// kNotFound before the first picture.
  Status posed_vertices(std::size_t mesh, std::span<glm::vec3> positions,
                        std::span<glm::vec3> normals);

  [[nodiscard]] PlayerStats stats() const;

 private:
  struct State;
  explicit Player(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace relit::player
