// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bake_minimal/atlas.hpp"
#include "bake_minimal/coding_choice.hpp"
#include "bake_minimal/coding_options.hpp"
#include "bake_minimal/ground.hpp"
#include "bake_minimal/mesh_packer.hpp"
#include "bake_minimal/pose_encoder.hpp"
#include "bake_minimal/progress.hpp"
#include "bake_minimal/scene.hpp"
#include "bake_minimal/sweep.hpp"
#include "bake_minimal/transfer.hpp"
#include "container/base/result.hpp"
#include "decoders/pose.hpp"
#include "decoders/texel_normals.hpp"

/// From a glTF file to a .relit file: the baker as one call.
namespace relit::bake {

struct BakeOptions {
  std::filesystem::path input;
  std::filesystem::path output;
  std::filesystem::path reference;  ///< empty, or where the unquantised bake goes as .npy
  std::optional<std::string> clip;  ///< by name or number; none: the first, or the rest pose
  container::Rational frame_rate{50, 1};
  std::uint64_t max_frames = 0;  ///< 0: the whole clip
  double segment_s = 0.5;
  bool loop = true;
  AtlasOptions atlas;
  std::optional<GroundOptions> ground;
  TransferOptions transfer;  ///< its width and height are the light map's
  CodingOptions coding;      ///< segment_frames comes from segment_s
  /// Where not empty, the clip is coded once for each of them in place of `coding`: into the
  /// output's name with "-" and the variant's before its extension.
  std::vector<CodingVariant> sweep{};
  /// Where given, the rate factor is sought, of each variant of a sweep by itself; without a sweep
  /// also the cheapest of `candidates`, or of `coding` alone where there are none.
  std::optional<Goal> goal{};
  std::vector<CodingVariant> candidates{};
  PoseChoice pose = PoseChoice::kAuto;
  bool write_normals = false;
};

/// A file that a bake writes, and the ways to code it of which it takes one.
struct BakeOutput {
  std::filesystem::path path;
  std::vector<CodingVariant> candidates;
};

/// One, or one for each variant of a sweep.
[[nodiscard]] std::vector<BakeOutput> outputs_of(const BakeOptions& options);

/// What a bake made, for people and for --json.
struct BakeSummary {
  std::filesystem::path output;
  std::string clip;
  std::uint64_t frames = 0;  ///< that the file holds
  container::Rational frame_rate;
  int order = 0, width = 0, height = 0;
  std::size_t vertices = 0, triangles = 0, samples = 0, covered = 0;
  AtlasReport atlas;
  std::uint64_t rays = 0;
  /// Least and largest T_0 of all texels and frames: 0 to 0.2821 where surfaces conserve energy.
  float least_t0 = std::numeric_limits<float>::infinity();
  float largest_t0 = -std::numeric_limits<float>::infinity();
  double trace_s = 0, code_s = 0;
  CodingOptions coding;                  ///< resolved
  std::optional<CodingChoice> choice{};  ///< where there was a goal
  std::uint64_t bytes = 0, image_bytes = 0, mesh_bytes = 0, pose_bytes = 0, video_bytes = 0;
  std::uint64_t decoder_bytes = 0;  ///< of the pictures that the decoders hold
  std::vector<std::string> warnings;
};

/// Everything that a bake knows before it traces the first ray.
struct PreparedBake {
  Scene scene;
  int clip = -1;  ///< into scene.clips; -1: the rest pose
  container::Rational frame_rate;
  std::uint64_t frames = 1;
  std::uint32_t segment_frames = 25;
  std::vector<std::uint32_t> added;  ///< primitives that the baker made: the ground
  AtlasReport atlas;
  PackedScene packed;
  PoseEncoding pose;
  std::vector<TexelSample> samples;  ///< on the packed triangles

  /// Time of a frame, in seconds.
  [[nodiscard]] double time_s(std::uint64_t frame) const;
};

/// Loads, unwraps, packs and quantises: all of a bake but transfer and coding. Errors name the
/// file, the place and the remedy.
[[nodiscard]] Result<PreparedBake> prepare_bake(const BakeOptions& options);

/// The geometry of a packed scene as the tracer takes it. Images are borrowed from `packed`.
[[nodiscard]] TraceGeometry trace_geometry(const PackedScene& packed);

/// Number of frames k/rate < duration, at least 1.
[[nodiscard]] std::uint64_t frame_count(double duration_s, const container::Rational& rate);

/// Poses the meshes of a clip frame by frame: positions as the player will have them, from the
/// packed and quantised pose, normals in full precision from the scene.
class BakePoser {
 public:
  /// `prepared` is borrowed. Errors: those of decoders::PoseTrack.
  static Result<BakePoser> create(const PreparedBake& prepared);
  /// Writes positions() and normals(), of all packed meshes one after another. Errors: those of
  /// decoders::PoseTrack.
  Status pose(std::uint64_t frame);
  [[nodiscard]] std::span<const glm::vec3> positions() const { return positions_; }
  [[nodiscard]] std::span<const glm::vec3> normals() const { return normals_; }

 private:
  BakePoser(const PreparedBake& prepared, decoders::PoseTrack track)
      : prepared_(&prepared), track_(std::move(track)) {}

  const PreparedBake* prepared_;
  decoders::PoseTrack track_;
  decoders::Pose pose_;
  ScenePose scene_pose_;
  std::vector<glm::mat4> world_;
  std::vector<glm::vec3> positions_, normals_, primitive_positions_, primitive_normals_;
};

/// The frames that a file holds of those that were traced: every `step`th.
struct KeptFrames {
  int step = 1;
  std::uint64_t count = 1;
  std::uint32_t segment_frames = 25;
  container::Rational rate;  ///< frames a second
  PoseEncoding pose;
  /// Root mean square of how far vertices of blended poses lie from where the frames that are left
  /// out have them, over the longest side of the box around the clip.
  double pose_error = 0;
};

/// Errors: kInvalid where `step` does not divide the frames of a clip, since its end would move;
/// those of encode_pose().
[[nodiscard]] Result<KeptFrames> keep_frames(const PreparedBake& prepared, int step);

/// The normals of the light map's texels, frame by frame, as the player will have them.
class BakeNormals {
 public:
  /// Errors: those of decoders::PoseTrack and decoders::TexelNormals.
  static Result<std::unique_ptr<BakeNormals>> create(const PreparedBake& prepared,
                                                     const KeptFrames& kept, int width, int height);
  /// [H][W], of one of the frames that are kept; valid until the next call. Errors: those of
  /// decoders::PoseTrack.
  Result<std::span<const glm::vec3>> at(std::uint64_t frame);
  /// [H][W], 1 where a texel has a normal.
  [[nodiscard]] std::vector<std::uint8_t> mask() const;

 private:
  BakeNormals(std::vector<decoders::Mesh> meshes, decoders::PoseTrack track, std::size_t texels)
      : meshes_(std::move(meshes)), track_(std::move(track)), out_(texels) {}

  std::vector<decoders::Mesh> meshes_;  ///< as they are in the file
  decoders::PoseTrack track_;
  decoders::Pose pose_;
  std::optional<decoders::TexelNormals> normals_;
  std::vector<glm::vec3> out_;
};

/// Bakes: one file, or one for each variant of a sweep, of one trace. A file appears under its name
/// when it is complete, and not at all otherwise; the same options give the same bytes for any
/// number of threads. Errors name the file, the place and the remedy.
[[nodiscard]] Result<std::vector<BakeSummary>> bake(const BakeOptions& options, Progress& progress);

}  // namespace relit::bake
