// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "container/records.hpp"
#include "decoders/composite.hpp"
#include "decoders/plane_decoder.hpp"
#include "decoders/pose.hpp"
#include "gles/character_renderer.hpp"
#include "gles/compositor.hpp"
#include "gles/light_map.hpp"
#include "gles/light_map_mixer.hpp"
#include "player/frame_normals.hpp"
#include "player/path_chooser.hpp"
#include "player/plane_needs.hpp"

namespace relit::player {

/// Two frames of a clip, and how far time has moved from one to the other.
struct FrameMix {
  const decoders::FrameView* from = nullptr;
  const decoders::FrameView* to = nullptr;  ///< null: `from` alone
  float blend = 0;  ///< 0..1: light map = (1 - blend)·from's + blend·to's; 0: `from` alone
  /// Of the same frames; needed where the model predicts from the meshes' normals.
  const decoders::Pose* from_pose = nullptr;
  const decoders::Pose* to_pose = nullptr;
};

struct RelightOptions {
  const gles::Device* device = nullptr;  ///< null: the CPU composites, and read() gives the result
  CompositePath path = CompositePath::kAuto;
  gles::LightMapFormat format = gles::LightMapFormat::kAuto;
  std::span<const decoders::Mesh> meshes{};  ///< the clip's; borrowed, for models that predict
};

/// The planes of a model as the compositor sees them.
[[nodiscard]] gles::PlaneSetDescription describe_planes(
    const container::ModelRecord& model, std::span<const container::LayerRecord> layers);

struct RelightStats {
  std::uint64_t composites = 0;       ///< light maps made, or fused sums set up
  std::uint64_t skipped = 0;          ///< calls of composite() that found nothing changed
  std::uint64_t uploads = 0;          ///< frames whose planes went to the GPU, in whole or in part
  std::uint64_t planes_uploaded = 0;  ///< of those frames
  std::uint64_t planes_missing = 0;   ///< had a weight, but the frame was without them
};

/// Planes and a light -> a light map: Σ_n L_n T_n (design, section 2), by the path that was asked
/// for or that measured cheapest. All give the same picture.
///
/// A blend of two frames is one composite of both frames' planes; each frame is uploaded once while
/// time moves from one to the next. Nothing happens when neither frames, blend, light nor quality
/// changed, and a light that changes while the frame rests uploads only planes that it needs and
/// that are not there yet. Frames are known by their number and by where their samples lie, see
/// forget(); they are borrowed for the call only. One thread, the GL context's.
class Relighter {
 public:
  /// Records are borrowed; the device outlives this object. kAuto without a device is kCpu; with
  /// one it begins in texture space, or on the CPU where that cannot be, and measure() settles it.
  /// Errors: those of gles::Compositor for paths that were asked for by name; kInvalid for a path
  /// on the GPU without a device, or a model that predicts without meshes; those of TexelNormals.
  static Result<std::unique_ptr<Relighter>> create(const container::ModelRecord& model,
                                                   std::span<const container::LayerRecord> layers,
                                                   const RelightOptions& options);

  /// Folds a light into the model. Planes of layers that `decoded` says are not there weigh
  /// nothing; empty: all are. Errors: kInvalid; the light is black then.
  Status set_light(const decoders::Light& light, std::span<const std::uint8_t> decoded = {});
  /// Whether it is another one: other planes may be needed then.
  bool set_quality(const RelightQuality& quality);
  /// Radiance × exposure is what is displayed; 0: unknown. See PlaneNeeds.
  void set_exposure(float exposure);

  /// By layer and by plane, 1: needed for the light and quality of the moment. Valid until the next
  /// set_…().
  [[nodiscard]] std::span<const std::uint8_t> needed_layers() const { return needs_.layers(); }
  [[nodiscard]] std::span<const std::uint8_t> needed_planes() const { return needs_.planes(); }

  /// Brings the light map up to the moment. Steady state allocates nothing. Planes with a weight
  /// that a frame does not hold count as zero. Errors: kInvalid (no light yet, no frame, a blend
  /// outside 0..1, no pose where the model predicts), kEnvironment.
  Status composite(const FrameMix& mix);

  /// Cross-fades to another clip's light map, `to`'s, whose composite() has been called: (1 -
  /// weight)·this + weight·to, until the next composite(). Both are maps of one atlas, as the clips
  /// of a file are; where sizes differ `to`'s is filtered bilinearly. Both are drawn on the same
  /// device, or without any. Errors: kInvalid, kUnsupported, kEnvironment.
  Status fade(Relighter& to, float weight);

  /// Draws the meshes with the light of the last composite() and fade().
  Status draw(gles::CharacterRenderer& renderer, const gles::View& view);

  /// The light map as a texture, for hosts that draw themselves: name, size, encoding. Where the
  /// sum is fused it is composited here. Valid until the next composite(). Errors: kInvalid without
  /// a device or before the first composite.
  Result<gles::LightMap> texture();

  /// The light map itself, radiance for unit albedo, [3][height()][width()], never clamped (but
  /// where it is kept in 8-bit square roots). Waits for the GPU. Errors: kInvalid.
  Status read(std::span<float> out);
  /// The size of the light map for the quality of the moment.
  [[nodiscard]] int width() const;
  [[nodiscard]] int height() const;

  /// The path that runs; never kAuto.
  [[nodiscard]] CompositePath path() const { return path_; }
  /// Why, in words for the user.
  [[nodiscard]] std::string why() const;
  /// Takes another path, or kAuto. Errors: as create(); the old one stays.
  Status set_path(CompositePath path);

  /// Whether measure() should be called in place of draw(): with kAuto, when nothing has been
  /// measured yet, or since then the character has come to cover much more or less of the screen.
  /// Once a picture. `covered_pixels` is an estimate, such as the area of the character's box.
  [[nodiscard]] bool wants_measuring(double covered_pixels);
  /// Composites and draws `mix` as draw() does, by the next of the paths that there are, and takes
  /// the time, waiting for the GPU before and after. One picture a call, so that no picture takes
  /// much longer than others. True: each path has been drawn a few times now, and the one that
  /// PathChooser takes runs from here on; until then path() changes with every call. Errors: those
  /// of drawing by the path that ran before; others that fail are left out of account.
  Result<bool> measure(const FrameMix& mix, gles::CharacterRenderer& renderer,
                       const gles::View& view);

  /// Forgets which frames it has. Needed when frames may come with the numbers and memory of
  /// others, as those of another clip of the same model would.
  void forget();

  [[nodiscard]] const RelightStats& stats() const { return stats_; }
  /// Textures on the GPU, and buffers on the CPU, for the memory plan.
  [[nodiscard]] std::size_t gpu_bytes() const;
  [[nodiscard]] std::size_t cpu_bytes() const;

 private:
  // What a frame is known by.
  struct FrameKey {
    bool valid = false;
    std::uint64_t frame = 0;
    std::vector<const std::uint8_t*> samples;  // mantissas and exponents by plane; null: not there
    void set(const decoders::FrameView& view);
    [[nodiscard]] bool matches(const decoders::FrameView& view) const;
  };
  // How far measuring has come: rounds of all paths, one after the other. Begins with zeros; Clang
  // 14 finds no initializers of its own here for std::optional.
  struct Measuring {
    std::size_t step;
    CompositePath before;  // that ran
    std::array<bool, kCompositePaths> failed;
    std::array<double, kCompositePaths> least_s;  // 0: none yet
  };
  // What the last composite was made of.
  struct Moment {
    bool valid = false;
    FrameKey from, to;
    float blend = 0;
    std::uint64_t light = 0;  // light_serial_
    CompositePath path = CompositePath::kAuto;
  };

  Relighter() = default;
  Status prepare(CompositePath path);
  Status prepare_cpu();
  Status prepare_uploader(std::size_t half);
  Status prepare_gpu();
  void change_light();
  static Result<FrameMix> simplify(const FrameMix& mix);
  [[nodiscard]] bool is_done(const FrameMix& mix) const;
  void note_done(const FrameMix& mix);
  void count_missing(const decoders::FrameView& frame);
  [[nodiscard]] FoldedLight gpu_light() const;
  Status check_poses(const FrameMix& mix) const;
  Status composite_on_cpu(const FrameMix& mix);
  Status composite_on_gpu(const FrameMix& mix);
  Result<int> upload(const decoders::FrameView& frame, const decoders::Pose* pose, int other_slot);
  [[nodiscard]] int slot_of(const decoders::FrameView& frame) const;
  Result<gles::LightMap> upload_map(std::span<const float> values);
  Status fade_on_cpu(Relighter& to, float weight);
  Result<double> time_path(CompositePath path, const FrameMix& mix,
                           gles::CharacterRenderer& renderer, const gles::View& view);
  Status end_measuring(const FrameMix& mix);

  const container::ModelRecord* model_ = nullptr;
  std::span<const container::LayerRecord> layers_;
  RelightOptions options_;
  CompositePath path_ = CompositePath::kCpu;
  PathChooser chooser_;
  std::optional<Measuring> measuring_;

  decoders::FoldedWeights folded_;  // as the light is
  bool has_light_ = false;
  RelightQuality quality_;
  float exposure_ = 0;
  PlaneNeeds needs_;
  std::vector<Rgb> weights_;  // folded_'s, but zero where a plane is not needed
  FoldedLight light_;         // with those
  bool predicts_ = false;     // whether s is needed for it
  bool half_size_ = false;
  std::uint64_t light_serial_ = 0;  // of light_ and half_size_

  Moment done_;
  RelightStats stats_;
  std::optional<FrameNormals> normals_;  // of models that predict

  // On the CPU.
  std::vector<float> composite_;  // [3][height()][width()], divided by the magnitude
  std::vector<PlaneView> job_planes_;
  std::vector<Rgb> job_weights_;
  std::array<std::unique_ptr<gles::LightMapUploader>, 2> uploaders_;  // full size, half size
  // On the GPU.
  std::unique_ptr<gles::Compositor> compositor_;
  std::array<FrameKey, 2> slots_;
  std::vector<PlaneView> gpu_planes_;    // a frame's, then those of its normals
  std::vector<std::uint8_t> gpu_needs_;  // by plane as well
  std::vector<Rgb> gpu_weights_;
  gles::FrameSlots frames_;
  gles::FusedLight* fused_ = nullptr;
  std::optional<gles::LightMap> map_;  // of the last composite, once there is one
  // Of a fade.
  std::unique_ptr<gles::LightMapMixer> mixer_;
  std::optional<gles::LightMap> faded_;
  std::vector<float> faded_on_cpu_;
  bool has_faded_ = false;  // whether that is the light map of the moment
};

}  // namespace relit::player
