// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numeric>

#include "bake_minimal/bake.hpp"

namespace relit::bake {

TraceGeometry trace_geometry(const PackedScene& packed) {
  TraceGeometry geometry;
  for (std::size_t m = 0; m < packed.meshes.size(); ++m) {
    const decoders::Mesh& mesh = packed.meshes[m];
    const auto base = static_cast<std::uint32_t>(geometry.lightmap_uv.size());
    const std::vector<glm::vec2>& albedo_uv =
        mesh.albedo_uv.empty() ? mesh.lightmap_uv : mesh.albedo_uv;
    geometry.lightmap_uv.insert(geometry.lightmap_uv.end(), mesh.lightmap_uv.begin(),
                                mesh.lightmap_uv.end());
    geometry.albedo_uv.insert(geometry.albedo_uv.end(), albedo_uv.begin(), albedo_uv.end());
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      geometry.colors.push_back(mesh.colors.empty() ? glm::vec4(1.0f)
                                                    : glm::vec4(mesh.colors[v]) / 255.0f);
    }
    for (const std::uint16_t i : mesh.indices) geometry.indices.push_back(base + i);
    std::uint32_t material = 0;
    while (packed.materials.materials[material].id != mesh.material_id) ++material;
    geometry.surface.insert(geometry.surface.end(), mesh.indices.size() / 3, material);
  }
  for (const PackedTriangle& triangle : packed.triangles) {
    geometry.other_side.push_back(triangle.other_side == kSingleSided ? kNoOtherSide
                                                                      : triangle.other_side);
  }
  for (const container::MaterialRecord& material : packed.materials.materials) {
    HitSurface surface;
    surface.base_color = {material.base_color[0], material.base_color[1], material.base_color[2],
                          material.base_color[3]};
    for (std::size_t i = 0; i < packed.materials.images.size(); ++i) {
      if (static_cast<std::int64_t>(packed.materials.images[i].id) == material.image_id)
        surface.image = &packed.materials.texels[i];
    }
    surface.wrap_u = material.wrap_u, surface.wrap_v = material.wrap_v;
    surface.linear_filter = material.linear_filter;
    surface.masked = material.alpha_mode == container::AlphaMode::kMask;
    surface.alpha_cutoff = material.alpha_cutoff;
    geometry.surfaces.push_back(surface);
  }
  return geometry;
}

namespace {

Result<decoders::PoseTrack> pose_track(const PackedScene& packed, const PoseEncoding& pose,
                                       std::uint64_t frames, std::uint32_t segment_frames,
                                       std::span<const decoders::Mesh> meshes) {
  RELIT_ASSIGN(decoders::PoseTrack track,
               decoders::PoseTrack::create(packed.skeleton, pose.track, meshes));
  for (std::size_t s = 0; s < pose.packets.size(); ++s) {
    const std::uint64_t first = s * std::uint64_t{segment_frames};
    const std::uint64_t count = std::min<std::uint64_t>(segment_frames, frames - first);
    RELIT_TRY(track.add_packet(pose.packets[s], first, static_cast<std::uint32_t>(count)));
  }
  return track;
}

Result<decoders::PoseTrack> pose_track(const PreparedBake& prepared) {
  return pose_track(prepared.packed, prepared.pose, prepared.frames, prepared.segment_frames,
                    prepared.packed.meshes);
}

// Compares what a player makes of the frames that are kept with the frames that are not.
Result<double> blended_pose_error(const PreparedBake& prepared, const KeptFrames& kept) {
  const std::vector<decoders::Mesh>& meshes = prepared.packed.meshes;
  RELIT_ASSIGN(const decoders::PoseTrack track, pose_track(prepared));
  RELIT_ASSIGN(const decoders::PoseTrack coarse,
               pose_track(prepared.packed, kept.pose, kept.count, kept.segment_frames, meshes));
  decoders::Pose true_pose, blended_pose;
  std::vector<glm::vec3> truth, blended;
  glm::vec3 low(std::numeric_limits<float>::infinity()), high(-low);
  double squares = 0, points = 0;
  const std::uint64_t last = (kept.count - 1) * static_cast<std::uint64_t>(kept.step);
  for (std::uint64_t k = 0; k <= last; ++k) {
    RELIT_TRY(track.sample(static_cast<double>(k), true_pose));
    RELIT_TRY(coarse.sample(static_cast<double>(k) / kept.step, blended_pose));
    for (std::size_t m = 0; m < meshes.size(); ++m) {
      truth.resize(meshes[m].positions.size()), blended.resize(truth.size());
      decoders::pose_mesh(meshes[m], m, true_pose, truth, {});
      decoders::pose_mesh(meshes[m], m, blended_pose, blended, {});
      for (std::size_t v = 0; v < truth.size(); ++v) {
        low = glm::min(low, truth[v]), high = glm::max(high, truth[v]);
        if (k % static_cast<std::uint64_t>(kept.step) == 0) continue;
        const glm::dvec3 off = glm::dvec3(blended[v]) - glm::dvec3(truth[v]);
        squares += glm::dot(off, off), points += 1;
      }
    }
  }
  const glm::vec3 size = high - low;
  const double longest = std::max({static_cast<double>(size.x), static_cast<double>(size.y),
                                   static_cast<double>(size.z), 1e-30});
  return points > 0 ? std::sqrt(squares / points) / longest : 0;
}

}  // namespace

Result<BakePoser> BakePoser::create(const PreparedBake& prepared) {
  const PackedScene& packed = prepared.packed;
  RELIT_ASSIGN(decoders::PoseTrack track, pose_track(prepared));
  BakePoser poser(prepared, std::move(track));
  std::size_t vertices = 0;
  for (const decoders::Mesh& mesh : packed.meshes) vertices += mesh.positions.size();
  poser.positions_.resize(vertices), poser.normals_.resize(vertices);
  return poser;
}

Status BakePoser::pose(std::uint64_t frame) {
  const PackedScene& packed = prepared_->packed;
  const Scene& scene = prepared_->scene;
  RELIT_TRY(track_.sample(static_cast<double>(frame), pose_));
  scene.sample(prepared_->clip, prepared_->time_s(frame), scene_pose_);
  scene.world_matrices(scene_pose_, world_);
  std::size_t first = 0;
  std::uint32_t posed_primitive = std::numeric_limits<std::uint32_t>::max();
  for (std::size_t m = 0; m < packed.meshes.size(); ++m) {
    const decoders::Mesh& mesh = packed.meshes[m];
    const PackedMeshSource& source = packed.sources[m];
    const std::span<glm::vec3> positions(positions_.data() + first, mesh.positions.size());
    decoders::pose_mesh(mesh, m, pose_, positions, {});
    const Primitive& primitive = scene.primitives[source.primitive];
    if (source.primitive != posed_primitive) {
      primitive_positions_.resize(primitive.positions.size());
      primitive_normals_.resize(primitive.positions.size());
      scene.pose_primitive(primitive, scene_pose_, world_, primitive_positions_,
                           primitive_normals_);
      posed_primitive = source.primitive;
    }
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      normals_[first + v] = primitive_normals_[source.source_vertex[v]];
    }
    first += mesh.positions.size();
  }
  return {};
}

Result<KeptFrames> keep_frames(const PreparedBake& prepared, int step) {
  KeptFrames kept;
  kept.step = step;
  kept.rate = prepared.frame_rate, kept.count = prepared.frames;
  kept.segment_frames = prepared.segment_frames;
  if (step == 1) {
    kept.pose = prepared.pose;
    return kept;
  }
  const auto every = static_cast<std::uint64_t>(std::max(step, 1));
  if (step < 1 || prepared.frames % every != 0) {
    return fail(ErrorCode::kInvalid, "--frame-step " + std::to_string(step) +
                                         ": it must divide the clip's " +
                                         std::to_string(prepared.frames) + " frames");
  }
  kept.count = prepared.frames / every;
  const std::int64_t common = std::gcd(prepared.frame_rate.num, std::int64_t{step});
  kept.rate = {prepared.frame_rate.num / common, prepared.frame_rate.den * (step / common)};
  kept.segment_frames = std::max(prepared.segment_frames / static_cast<std::uint32_t>(step), 1u);
  std::vector<double> times(kept.count);
  for (std::uint64_t j = 0; j < kept.count; ++j) times[j] = prepared.time_s(j * every);
  PoseOptions options;
  // The meshes are packed for this kind.
  options.choice = prepared.pose.track.kind == container::PoseKind::kVertices
                       ? PoseChoice::kVertices
                       : PoseChoice::kJoints;
  options.clip = prepared.clip;
  options.track_id = prepared.pose.track.track_id, options.clip_id = prepared.pose.track.clip_id;
  options.segment_frames = kept.segment_frames;
  RELIT_ASSIGN(kept.pose, encode_pose(prepared.scene, times, prepared.packed, options));
  RELIT_ASSIGN(kept.pose_error, blended_pose_error(prepared, kept));
  return kept;
}

Result<std::unique_ptr<BakeNormals>> BakeNormals::create(const PreparedBake& prepared,
                                                         const KeptFrames& kept, int width,
                                                         int height) {
  const container::SkeletonRecord& skeleton = prepared.packed.skeleton;
  std::vector<decoders::Mesh> meshes;
  for (const container::MeshRecord& record : prepared.packed.mesh_records) {
    RELIT_ASSIGN(decoders::Mesh mesh, decoders::decode_mesh(record, skeleton.palette.size(),
                                                            skeleton.morph_weight_count));
    meshes.push_back(std::move(mesh));
  }
  RELIT_ASSIGN(decoders::PoseTrack track,
               pose_track(prepared.packed, kept.pose, kept.count, kept.segment_frames, meshes));
  const auto texels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::unique_ptr<BakeNormals> normals(
      new BakeNormals(std::move(meshes), std::move(track), texels));
  RELIT_ASSIGN(normals->normals_, decoders::TexelNormals::create(normals->meshes_, width, height));
  return normals;
}

Result<std::span<const glm::vec3>> BakeNormals::at(std::uint64_t frame) {
  RELIT_TRY(track_.sample(static_cast<double>(frame), pose_));
  normals_->compute(pose_, out_);
  return std::span<const glm::vec3>(out_);
}

std::vector<std::uint8_t> BakeNormals::mask() const {
  std::vector<std::uint8_t> mask(out_.size(), 0);
  normals_->mark(mask);
  return mask;
}

}  // namespace relit::bake
