// SPDX-License-Identifier: MIT
#include "bake_minimal/bake.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

#include "bake_minimal/frame_store.hpp"
#include "bake_minimal/parallel.hpp"
#include "bake_minimal/plane_encoder.hpp"
#include "bake_minimal/push_pull.hpp"
#include "container/byte_sink.hpp"
#include "container/writer.hpp"
#include "decoders/npy.hpp"
#include "decoders/sh.hpp"

namespace relit::bake {
namespace {

constexpr std::uint32_t kClipId = 0;
constexpr std::uint32_t kPoseTrackId = 0;
constexpr std::uint64_t kMaxFrames =
    1u << 20;  // beyond it the temporary file alone would be terabytes

class Stopwatch {
 public:
  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// One bake from beginning to end, in the order in which the data move.
class Bake {
 public:
  Bake(const BakeOptions& options, Progress& progress) : options_(options), progress_(progress) {}

  Result<BakeSummary> run() {
    RELIT_TRY(check_outputs());
    RELIT_TRY(load());
    RELIT_TRY(unwrap());
    RELIT_TRY(pack());
    RELIT_TRY(trace());
    RELIT_TRY(write());
    summary_.warnings.insert(summary_.warnings.begin(), scene_.warnings.begin(),
                             scene_.warnings.end());
    summary_.warnings.insert(summary_.warnings.end(), packed_.warnings.begin(),
                             packed_.warnings.end());
    summary_.warnings.insert(summary_.warnings.end(), packed_.materials.warnings.begin(),
                             packed_.materials.warnings.end());
    return std::move(summary_);
  }

 private:
  Status check_outputs();
  Status load();
  Status unwrap();
  Status pack();
  Status trace();
  Status write();
  Status write_static(container::Writer& writer, const PlaneEncoder& encoder);
  Status write_segments(container::Writer& writer, PlaneEncoder& encoder, bool last);
  Status write_reference();
  void fill_frame(std::uint64_t frame);

  [[nodiscard]] std::size_t texels() const {
    return static_cast<std::size_t>(options_.transfer.width) *
           static_cast<std::size_t>(options_.transfer.height);
  }
  [[nodiscard]] std::size_t planes() const {
    return 3 * static_cast<std::size_t>(decoders::coefficient_count(options_.transfer.order));
  }

  const BakeOptions& options_;
  Progress& progress_;
  BakeSummary summary_;
  Scene scene_;
  int clip_ = -1;
  std::uint64_t frames_ = 1;
  std::uint32_t segment_frames_ = 25;
  PackedScene packed_;
  PoseEncoding pose_;
  std::vector<TexelSample> samples_;
  std::optional<FrameStore> store_;                // [coefficients][3][samples] by frame
  std::vector<std::vector<std::uint8_t>> buried_;  // by frame; empty where nothing is
  std::optional<PushPull> push_pull_;              // for frames in which nothing is buried
  std::vector<float> filled_;                      // [coefficients][3][H][W] of the frame in hand
  glm::vec3 bounds_min_{0.0f}, bounds_max_{0.0f};
};

// An output that cannot be written should be known before an hour of tracing, not after it.
Status Bake::check_outputs() {
  RELIT_ASSIGN(auto probe, container::FileSink::create(options_.output.string()));
  if (!options_.reference.empty()) {
    RELIT_ASSIGN(auto reference_probe, container::FileSink::create(options_.reference.string()));
  }
  if (options_.transfer.width < 1 || options_.transfer.height < 1 ||
      options_.transfer.width > 4096 || options_.transfer.height > 4096) {
    return fail(ErrorCode::kInvalid, "--size " + std::to_string(options_.transfer.width) + "x" +
                                         std::to_string(options_.transfer.height) +
                                         ": a light map has 1 to 4096 texels a side");
  }
  if (!(options_.segment_s > 0) || options_.segment_s > 600) {
    return fail(ErrorCode::kInvalid,
                "--segment: a segment lasts more than 0 and at most 600 seconds");
  }
  return resolve(options_.coding) ? Status() : Status(Unexpected{resolve(options_.coding).error()});
}

Status Bake::load() {
  RELIT_ASSIGN(scene_, load_gltf(options_.input));
  clip_ = scene_.clips.empty() ? -1 : 0;
  if (options_.clip) {
    RELIT_ASSIGN(clip_, find_clip(scene_, *options_.clip));
  }
  const double duration_s =
      clip_ < 0 ? 0 : scene_.clips[static_cast<std::size_t>(clip_)].duration_s;
  frames_ = frame_count(duration_s, options_.frame_rate);
  if (options_.max_frames > 0) frames_ = std::min(frames_, options_.max_frames);
  if (frames_ > kMaxFrames) {
    return fail(ErrorCode::kLimit,
                options_.input.string() + ": the clip has " + std::to_string(frames_) +
                    " frames; bake it in parts or at a lower --fps (at most 1048576)");
  }
  const double fps =
      static_cast<double>(options_.frame_rate.num) / static_cast<double>(options_.frame_rate.den);
  segment_frames_ =
      static_cast<std::uint32_t>(std::clamp(std::lround(options_.segment_s * fps), 1l, 65536l));
  summary_.clip = clip_ < 0 ? "rest pose" : scene_.clips[static_cast<std::size_t>(clip_)].name;
  summary_.frames = frames_;
  summary_.order = options_.transfer.order;
  summary_.width = options_.transfer.width, summary_.height = options_.transfer.height;
  if (!options_.ground) return {};
  RELIT_ASSIGN(const Bounds bounds, clip_bounds(scene_, clip_, fps));
  return add_ground(scene_, bounds, *options_.ground);
}

Status Bake::unwrap() {
  ScenePose pose;
  std::vector<glm::mat4> world;
  scene_.sample(clip_, 0, pose);
  scene_.world_matrices(pose, world);
  std::vector<std::vector<glm::vec3>> posed(scene_.primitives.size());
  for (std::size_t p = 0; p < posed.size(); ++p) {
    posed[p].resize(scene_.primitives[p].positions.size());
    scene_.pose_primitive(scene_.primitives[p], pose, world, posed[p], {});
  }
  AtlasOptions atlas = options_.atlas;
  atlas.width = options_.transfer.width, atlas.height = options_.transfer.height;
  RELIT_ASSIGN(summary_.atlas, assign_lightmap_uvs(scene_, posed, atlas));
  return {};
}

Status Bake::pack() {
  PackOptions pack_options;
  pack_options.clip = clip_;
  pack_options.normals = options_.write_normals;
  RELIT_ASSIGN(packed_, pack_scene(scene_, pack_options));
  std::vector<double> times(frames_);
  for (std::uint64_t k = 0; k < frames_; ++k) {
    times[k] = static_cast<double>(k) * static_cast<double>(options_.frame_rate.den) /
               static_cast<double>(options_.frame_rate.num);
  }
  PoseOptions pose_options;
  pose_options.choice = options_.pose;
  pose_options.clip = clip_;
  pose_options.track_id = kPoseTrackId, pose_options.clip_id = kClipId;
  pose_options.segment_frames = segment_frames_;
  RELIT_ASSIGN(pose_, encode_pose(scene_, times, packed_, pose_options));
  if (pose_.track.kind == container::PoseKind::kVertices) drop_rig(packed_);
  for (const auto& packet : pose_.packets) summary_.pose_bytes += packet.size();
  for (const decoders::Mesh& mesh : packed_.meshes) {
    summary_.vertices += mesh.positions.size();
    summary_.triangles += mesh.indices.size() / 3;
  }
  return {};
}

Status Bake::trace() {
  const Stopwatch watch;
  TraceGeometry geometry = trace_geometry(packed_);
  samples_ = rasterize_atlas(geometry.lightmap_uv, geometry.indices, options_.transfer.width,
                             options_.transfer.height);
  if (samples_.empty()) {
    return fail(ErrorCode::kInvalid, options_.input.string() +
                                         ": no texel of the light map lies on the surface; "
                                         "raise --size or take --lightmap-uv unwrap");
  }
  summary_.samples = samples_.size();
  summary_.covered = static_cast<std::size_t>(std::count_if(
      samples_.begin(), samples_.end(), [](const TexelSample& s) { return s.covered; }));
  RELIT_ASSIGN(TransferTracer tracer,
               TransferTracer::create(std::move(geometry), samples_, options_.transfer));
  RELIT_ASSIGN(BakePoser poser, BakePoser::create(scene_, clip_, packed_, pose_,
                                                  options_.frame_rate, segment_frames_, frames_));
  RELIT_ASSIGN(store_, FrameStore::create(options_.output.parent_path(), frames_,
                                          planes() * samples_.size()));
  buried_.resize(frames_);
  std::vector<std::uint8_t> flags(samples_.size());
  progress_.start("trace", frames_, "frame");
  bounds_min_ = glm::vec3(std::numeric_limits<float>::infinity()), bounds_max_ = -bounds_min_;
  for (std::uint64_t k = 0; k < frames_; ++k) {
    RELIT_TRY(poser.pose(k));
    for (const glm::vec3& p : poser.positions())
      bounds_min_ = glm::min(bounds_min_, p), bounds_max_ = glm::max(bounds_max_, p);
    RELIT_TRY(tracer.trace(poser.positions(), poser.normals(), store_->frame(k), flags));
    if (std::find(flags.begin(), flags.end(), 1) != flags.end()) buried_[k] = flags;
    summary_.rays += tracer.rays();
    progress_.advance(k + 1);
  }
  progress_.finish();
  summary_.trace_s = watch.seconds();
  return {};
}

// Spreads the samples of a frame over its map and fills the rest.
void Bake::fill_frame(std::uint64_t frame) {
  const std::vector<std::uint8_t>& buried = buried_[frame];
  std::optional<PushPull> own;
  if (!buried.empty() || !push_pull_) {
    std::vector<std::uint8_t> valid(texels(), 0);
    bool any = false;
    for (std::size_t s = 0; s < samples_.size(); ++s) {
      const bool seen = buried.empty() || buried[s] == 0;
      valid[samples_[s].texel] = seen ? 1 : 0;
      any |= seen;
    }
    // All of it inside itself: better the traced values than nothing.
    if (!any) {
      for (const TexelSample& sample : samples_) valid[sample.texel] = 1;
    }
    own.emplace(options_.transfer.width, options_.transfer.height, valid);
    if (buried.empty()) push_pull_ = std::move(own), own.reset();
  }
  const PushPull& push_pull = own ? *own : *push_pull_;
  const std::span<const float> values = std::as_const(*store_).frame(frame);
  filled_.resize(planes() * texels());
  parallel_for(thread_count(options_.transfer.threads), planes(), [&](std::size_t plane) {
    const std::span<float> out(filled_.data() + plane * texels(), texels());
    for (std::size_t s = 0; s < samples_.size(); ++s)
      out[samples_[s].texel] = values[plane * samples_.size() + s];
    push_pull.fill(out);
  });
}

Status Bake::write_static(container::Writer& writer, const PlaneEncoder& encoder) {
  container::ClipRecord clip;
  clip.id = kClipId;
  clip.name = summary_.clip;
  clip.frame_rate = options_.frame_rate;
  clip.frame_count = frames_;
  clip.loop = options_.loop && frames_ > 1;
  for (int a = 0; a < 3; ++a) {
    clip.bounds_min[static_cast<std::size_t>(a)] = bounds_min_[a];
    clip.bounds_max[static_cast<std::size_t>(a)] = bounds_max_[a];
  }
  RELIT_TRY(writer.add(clip));
  const std::uint64_t before_images = writer.bytes_written();
  for (const auto& image : packed_.materials.images) RELIT_TRY(writer.add(image));
  summary_.image_bytes = writer.bytes_written() - before_images;
  for (const auto& material : packed_.materials.materials) RELIT_TRY(writer.add(material));
  const std::uint64_t before_meshes = writer.bytes_written();
  for (const auto& mesh : packed_.mesh_records) RELIT_TRY(writer.add(mesh));
  summary_.mesh_bytes = writer.bytes_written() - before_meshes;
  RELIT_TRY(writer.add(packed_.skeleton));
  const std::uint64_t before_track = writer.bytes_written();
  RELIT_TRY(writer.add(pose_.track));
  summary_.pose_bytes += writer.bytes_written() - before_track;
  RELIT_TRY(writer.add(encoder.model()));
  for (const auto& layer : encoder.layers()) RELIT_TRY(writer.add(layer));
  return {};
}

Status Bake::write_segments(container::Writer& writer, PlaneEncoder& encoder, bool last) {
  if (last) RELIT_TRY(encoder.finish());
  while (std::optional<EncodedSegment> segment = encoder.take_segment()) {
    for (const container::ChunkRecord& chunk : segment->chunks)
      summary_.video_bytes += chunk.data.size();
    container::ChunkRecord pose;
    pose.track_id = kPoseTrackId;
    const auto index = static_cast<std::size_t>(segment->segment.first_frame / segment_frames_);
    pose.data = pose_.packets[index];
    pose.packets.push_back(
        {static_cast<std::int64_t>(segment->segment.first_frame), true, 0, pose.data.size()});
    segment->chunks.insert(segment->chunks.begin(), std::move(pose));
    RELIT_TRY(
        writer.write_segment({kClipId, segment->segment.first_frame, segment->segment.frame_count},
                             std::move(segment->chunks)));
  }
  return {};
}

Status Bake::write() {
  const Stopwatch watch;
  CodingOptions coding = options_.coding;
  coding.segment_frames = static_cast<int>(segment_frames_);
  coding.threads = thread_count(options_.transfer.threads);
  RELIT_ASSIGN(coding, resolve(coding));
  const TransferShape shape{options_.transfer.order, options_.transfer.width,
                            options_.transfer.height};
  RELIT_ASSIGN(RangeScan scan, RangeScan::create(shape, coding));
  progress_.start("measure", frames_, "frame");
  for (std::uint64_t k = 0; k < frames_; ++k) {
    fill_frame(k);
    RELIT_TRY(scan.add_frame(filled_));
    progress_.advance(k + 1);
  }
  progress_.finish();
  ModelIds ids;
  ids.clip_id = kClipId;
  ids.first_track_id = kPoseTrackId + 1;
  RELIT_ASSIGN(PlaneEncoder encoder, PlaneEncoder::begin(std::move(scan), ids));
  RELIT_ASSIGN(auto sink, container::FileSink::create(options_.output.string()));
  RELIT_ASSIGN(container::Writer writer,
               container::Writer::create(*sink, "relit-bake " RELIT_VERSION));
  RELIT_TRY(write_static(writer, encoder));
  progress_.start("code", frames_, "frame");
  for (std::uint64_t k = 0; k < frames_; ++k) {
    fill_frame(k);
    RELIT_TRY(encoder.encode_frame(filled_));
    RELIT_TRY(write_segments(writer, encoder, k + 1 == frames_));
    progress_.advance(k + 1);
  }
  RELIT_TRY(writer.finish());
  progress_.finish();
  if (!options_.reference.empty()) RELIT_TRY(write_reference());
  RELIT_TRY(sink->commit());
  summary_.bytes = writer.bytes_written();
  summary_.code_s = watch.seconds();
  return {};
}

Status Bake::write_reference() {
  const std::uint64_t shape[] = {frames_, planes() / 3, 3,
                                 static_cast<std::uint64_t>(options_.transfer.height),
                                 static_cast<std::uint64_t>(options_.transfer.width)};
  RELIT_ASSIGN(
      decoders::NpyWriter writer,
      decoders::NpyWriter::create(options_.reference, decoders::NpyWriter::Type::kFloat32, shape));
  for (std::uint64_t k = 0; k < frames_; ++k) {
    fill_frame(k);
    RELIT_TRY(writer.write(std::span<const float>(filled_)));
  }
  return writer.commit();
}

}  // namespace

std::uint64_t frame_count(double duration_s, const container::Rational& rate) {
  const double frames = duration_s * static_cast<double>(rate.num) / static_cast<double>(rate.den);
  // Key times are floats: 0.0000001 of a frame more than a whole number is rounding, not another
  // frame.
  return static_cast<std::uint64_t>(std::max(1.0, std::ceil(std::min(frames, 1e12) - 1e-4)));
}

Result<BakeSummary> bake(const BakeOptions& options, Progress& progress) {
  return Bake(options, progress).run();
}

}  // namespace relit::bake
