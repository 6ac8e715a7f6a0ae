// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "bake_minimal/bake.hpp"
#include "bake_minimal/vertex_quantizer.hpp"

namespace relit::bake {
namespace {

constexpr std::uint32_t kClipId = 0;
constexpr std::uint32_t kPoseTrackId = 0;
constexpr std::uint64_t kMaxFrames =
    1u << 20;  // beyond it the temporary file alone would be terabytes

double fps_of(const container::Rational& rate) {
  return static_cast<double>(rate.num) / static_cast<double>(rate.den);
}

Status check(const BakeOptions& options) {
  const TransferOptions& transfer = options.transfer;
  if (std::min(transfer.width, transfer.height) < 1 ||
      std::max(transfer.width, transfer.height) > 4096) {
    return fail(ErrorCode::kInvalid, "--size " + std::to_string(transfer.width) + " " +
                                         std::to_string(transfer.height) +
                                         ": a light map has 1 to 4096 texels a side");
  }
  if (!(options.segment_s > 0) || options.segment_s > 600) {
    return fail(ErrorCode::kInvalid,
                "--segment: a segment lasts more than 0 and at most 600 seconds");
  }
  RELIT_TRY(resolve(options.coding));
  return {};
}

Status load(const BakeOptions& options, PreparedBake& out) {
  RELIT_ASSIGN(out.scene, load_gltf(options.input));
  out.clip = out.scene.clips.empty() ? -1 : 0;
  if (options.clip) {
    RELIT_ASSIGN(out.clip, find_clip(out.scene, *options.clip));
  }
  const double duration_s =
      out.clip < 0 ? 0 : out.scene.clips[static_cast<std::size_t>(out.clip)].duration_s;
  out.frame_rate = options.frame_rate;
  out.frames = frame_count(duration_s, options.frame_rate);
  if (options.max_frames > 0) out.frames = std::min(out.frames, options.max_frames);
  if (out.frames > kMaxFrames) {
    return fail(ErrorCode::kLimit,
                options.input.string() + ": the clip has " + std::to_string(out.frames) +
                    " frames; bake it in parts or at a lower --fps (at most 1048576)");
  }
  const double fps = fps_of(options.frame_rate);
  out.segment_frames =
      static_cast<std::uint32_t>(std::clamp(std::round(options.segment_s * fps), 1.0, 65536.0));
  if (!options.ground) return {};
  RELIT_ASSIGN(const Bounds bounds, clip_bounds(out.scene, out.clip, fps));
  RELIT_ASSIGN(const std::uint32_t disc,
               add_ground(out.scene, bounds.min, bounds.max, *options.ground));
  out.added.push_back(disc);
  return {};
}

Status unwrap(const BakeOptions& options, PreparedBake& out) {
  Scene& scene = out.scene;
  ScenePose pose;
  std::vector<glm::mat4> world;
  scene.sample(out.clip, 0, pose);
  scene.world_matrices(pose, world);
  std::vector<std::vector<glm::vec3>> posed(scene.primitives.size());
  for (std::size_t p = 0; p < posed.size(); ++p) {
    posed[p].resize(scene.primitives[p].positions.size());
    scene.pose_primitive(scene.primitives[p], pose, world, posed[p], {});
  }
  AtlasOptions atlas = options.atlas;
  atlas.added = out.added;
  atlas.width = options.transfer.width, atlas.height = options.transfer.height;
  RELIT_ASSIGN(out.atlas, assign_lightmap_uvs(scene, posed, atlas));
  return {};
}

Status pack(const BakeOptions& options, PreparedBake& out) {
  PackOptions pack_options;
  pack_options.clip = out.clip;
  pack_options.lightmap_uv_bits =
      uv_bits(kLightMapSteps * std::max(options.transfer.width, options.transfer.height));
  // What is predicted from normals is predicted from those in the file. A twentieth of a mesh, they
  // save a fifth of the planes over what the triangles alone tell.
  pack_options.normals = options.write_normals;
  for (const BakeOutput& output : outputs_of(options)) {
    for (const CodingVariant& each : output.candidates) {
      RELIT_ASSIGN(const CodingOptions coding, resolve(each.coding));
      pack_options.normals |= coding.planes == Planes::kPrincipal && coding.predict;
    }
  }
  RELIT_ASSIGN(out.packed, pack_scene(out.scene, pack_options));
  std::vector<double> times(out.frames);
  for (std::uint64_t k = 0; k < out.frames; ++k) times[k] = out.time_s(k);
  PoseOptions pose_options;
  pose_options.choice = options.pose;
  pose_options.clip = out.clip;
  pose_options.track_id = kPoseTrackId, pose_options.clip_id = kClipId;
  pose_options.segment_frames = out.segment_frames;
  RELIT_ASSIGN(out.pose, encode_pose(out.scene, times, out.packed, pose_options));
  if (out.pose.track.kind == container::PoseKind::kVertices) drop_rig(out.packed);
  return {};
}

Status rasterize(const BakeOptions& options, PreparedBake& out) {
  const TraceGeometry geometry = trace_geometry(out.packed);
  RELIT_ASSIGN(out.samples,
               decoders::rasterize_atlas(geometry.lightmap_uv, geometry.indices,
                                         options.transfer.width, options.transfer.height));
  if (!out.samples.empty()) return {};
  return fail(ErrorCode::kInvalid, options.input.string() +
                                       ": no texel of the light map lies on the surface; raise "
                                       "--size or take --lightmap-uv unwrap");
}

}  // namespace

std::vector<BakeOutput> outputs_of(const BakeOptions& options) {
  if (options.sweep.empty()) {
    BakeOutput output{options.output, options.candidates};
    if (!options.goal || output.candidates.empty())
      output.candidates = {{options.coding.codec, options.coding}};
    return {std::move(output)};
  }
  std::vector<BakeOutput> outputs;
  for (const CodingVariant& variant : options.sweep) {
    std::filesystem::path path = options.output;
    path.replace_filename(path.stem().string() + "-" + variant.name + path.extension().string());
    outputs.push_back({std::move(path), {variant}});
  }
  return outputs;
}

double PreparedBake::time_s(std::uint64_t frame) const {
  return static_cast<double>(frame) / fps_of(frame_rate);
}

std::uint64_t frame_count(double duration_s, const container::Rational& rate) {
  const double frames = duration_s * fps_of(rate);
  // Key times are floats: a ten-thousandth of a frame beyond a whole number is rounding, not a
  // frame.
  return static_cast<std::uint64_t>(std::max(1.0, std::ceil(std::min(frames, 1e12) - 1e-4)));
}

Result<PreparedBake> prepare_bake(const BakeOptions& options) {
  PreparedBake prepared;
  RELIT_TRY(check(options));
  RELIT_TRY(load(options, prepared));
  RELIT_TRY(unwrap(options, prepared));
  RELIT_TRY(pack(options, prepared));
  RELIT_TRY(rasterize(options, prepared));
  return prepared;
}

}  // namespace relit::bake
