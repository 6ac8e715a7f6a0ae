// SPDX-License-Identifier: MIT
#include "tests/conformance/figure.hpp"

#include <array>
#include <cmath>
#include <stdexcept>

#include "bake_minimal/plane_encoder.hpp"
#include "bake_minimal/png_encoder.hpp"
#include "bake_minimal/pose_quantizer.hpp"
#include "bake_minimal/stream_encoder.hpp"
#include "bake_minimal/vertex_quantizer.hpp"
#include "decoders/texel_normals.hpp"

namespace relit::conformance {

using namespace container;

namespace {

template <class T>
T must(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}
void must(const Status& status) {
  if (!status) throw std::runtime_error(status.error().message);
}

/// A triangle wave of period 1 between -1 and 1: the same bits everywhere, which sin() is not.
double wave(double phase) {
  const double x = phase - std::floor(phase);
  return 1 - 4 * std::abs(x - 0.5);
}

/// Waves that travel, weaker in higher bands, and exactly zero in a corner. Sixteenths and such
/// keep every product exact enough to be the same on all machines.
std::vector<float> transfer(const FigureOptions& o, int frame) {
  std::vector<float> t;
  for (int n = 0; n < (o.order + 1) * (o.order + 1); ++n) {
    for (int c = 0; c < 3; ++c) {
      for (int y = 0; y < o.height; ++y) {
        for (int x = 0; x < o.width; ++x) {
          const double phase = x / 32.0 + y * (n + 1) / 128.0 + frame / 16.0 + c / 64.0 + n / 8.0;
          const double value = n == 0 ? 0.125 + 0.0625 * wave(phase) : wave(phase) / (4 * n);
          const bool corner = x >= o.width - 2 && y >= o.height - 2;
          t.push_back(corner ? 0 : static_cast<float>(value));
        }
      }
    }
  }
  return t;
}

struct Encoded {
  ModelRecord model;
  std::vector<LayerRecord> layers;
  std::vector<bake::EncodedSegment> segments;
};

void take(bake::PlaneEncoder& encoder, Encoded& encoded) {
  while (auto segment = encoder.take_segment()) encoded.segments.push_back(std::move(*segment));
}

/// The normals of the quad's texels, frame by frame.
std::vector<std::vector<glm::vec3>> quad_normals(const FigureOptions& o) {
  const SkeletonRecord skeleton = two_joints();
  const std::vector<decoders::Mesh> meshes{
      must(decoders::decode_mesh(quad(), skeleton.palette.size(), 0))};
  const PoseTrackRecord record = bending(o.ids);
  auto track = must(decoders::PoseTrack::create(skeleton, record, meshes));
  const auto count = static_cast<std::uint32_t>(o.frames);
  must(track.add_packet(pose_chunk(record, 3, 0, count).data, 0, count));
  auto texels = must(decoders::TexelNormals::create(meshes, o.width, o.height));
  std::vector<std::vector<glm::vec3>> frames;
  decoders::Pose pose;
  for (int f = 0; f < o.frames; ++f) {
    must(track.sample(f, pose));
    frames.emplace_back(static_cast<std::size_t>(o.width) * static_cast<std::size_t>(o.height));
    texels.compute(pose, frames.back());
  }
  return frames;
}

bake::PlaneSplit split(const FigureOptions& o, const bake::CodingOptions& coding,
                       std::span<const std::vector<glm::vec3>> normals) {
  const bake::TransferShape shape{o.order, o.width, o.height};
  if (coding.planes == bake::Planes::kColour) return bake::PlaneSplit::colour(shape, coding);
  const std::vector<std::uint8_t> all(shape.texels(), 1);
  bake::PrincipalAnalysis analysis(shape, coding.predict, all);
  for (int f = 0; f < o.frames; ++f)
    must(analysis.add_frame({transfer(o, f), normals[static_cast<std::size_t>(f)]}));
  return bake::PlaneSplit::principal(shape, analysis.finish(coding.principal_count), all);
}

Encoded encode(const FigureOptions& o) {
  const bake::CodingOptions coding = must(bake::resolve(o.coding));
  const auto normals = quad_normals(o);
  auto scan = must(bake::RangeScan::create(split(o, coding, normals), coding));
  const auto frame = [&](int f) -> std::span<const glm::vec3> {
    return normals[static_cast<std::size_t>(f)];
  };
  for (int f = 0; f < o.frames; ++f) must(scan.add_frame({transfer(o, f), frame(f)}));
  bake::ModelIds ids{o.ids.model, o.ids.clip, o.ids.first_layer, o.ids.first_track, 0};
  auto encoder = must(bake::PlaneEncoder::begin(std::move(scan), ids));
  Encoded encoded;
  for (int f = 0; f < o.frames; ++f) {
    must(encoder.encode_frame({transfer(o, f), frame(f)}));
    take(encoder, encoded);
  }
  must(encoder.finish());
  take(encoder, encoded);
  encoded.model = encoder.model();
  encoded.layers = encoder.layers();
  return encoded;
}

ImageRecord checkers() {
  const std::vector<std::uint8_t> rgba{255, 128, 64, 255, 32, 32, 200, 255,
                                       16,  200, 16, 255, 90, 90, 90,  255};
  return {1, "image/png", must(bake::encode_png(2, 2, rgba))};
}

VertexStream words(Semantic semantic, std::uint8_t stride, std::vector<std::uint16_t> values,
                   std::array<float, 3> scale = {1, 1, 1}) {
  std::vector<std::uint8_t> bytes;
  for (const std::uint16_t v : values) bake::append_u16(bytes, v);
  return {semantic, stride, {}, scale, quad_stream(semantic, bytes)};
}

VertexStream octets(Semantic semantic, const std::vector<std::uint8_t>& bytes) {
  return {semantic, 4, {}, {1, 1, 1}, quad_stream(semantic, bytes)};
}

}  // namespace

std::vector<std::uint8_t> quad_stream(Semantic semantic, std::span<const std::uint8_t> bytes,
                                      std::vector<std::uint16_t> twins) {
  const std::vector<std::uint16_t> indices{0, 1, 2, 0, 2, 3};
  return bake::encode_vertex_stream(bytes, decoders::form_of(semantic),
                                    decoders::link_vertices(indices, 4, std::move(twins)));
}

MeshRecord quad(int influences) {
  MeshRecord mesh;
  mesh.id = 1;
  mesh.name = "quad";
  mesh.material_id = 1;
  mesh.vertex_count = 4;
  mesh.index_count = 6;
  const float grid = 1.0f / 1024, uv = 1.0f / 65535;
  mesh.streams = {
      words(Semantic::kPosition, 8, {0, 0, 0, 0, 1024, 0, 0, 0, 1024, 1024, 0, 0, 0, 1024, 0, 0},
            {grid, grid, grid}),
      words(Semantic::kLightMapUv, 4, {0, 0, 65535, 0, 65535, 65535, 0, 65535}, {uv, uv, 1})};
  if (influences == 4) {
    mesh.streams.push_back(words(Semantic::kJoints, 8,
                                 {0, 0, 0, 0, 0, 0, 0, 0,  //
                                  1, 0, 0, 0, 1, 0, 0, 0}));
    mesh.streams.push_back(octets(Semantic::kWeights, {255, 0, 0, 0, 255, 0, 0, 0,  //
                                                       255, 0, 0, 0, 255, 0, 0, 0}));
  } else if (influences == 8) {
    mesh.streams.push_back(words(Semantic::kJoints, 8, std::vector<std::uint16_t>(16, 0)));
    mesh.streams.push_back(octets(Semantic::kWeights, {100, 20, 5, 2, 100, 20, 5, 2,  //
                                                       100, 20, 5, 2, 100, 20, 5, 2}));
    mesh.streams.push_back(words(Semantic::kJoints, 8, std::vector<std::uint16_t>(16, 1)));
    mesh.streams.push_back(octets(Semantic::kWeights, {64, 32, 16, 16, 64, 32, 16, 16,  //
                                                       64, 32, 16, 16, 64, 32, 16, 16}));
  }
  const std::vector<std::uint32_t> indices{0, 1, 2, 0, 2, 3};
  mesh.indices = bake::encode_index_stream(indices, 4);
  return mesh;
}

SkeletonRecord two_joints() {
  SkeletonRecord skeleton;
  skeleton.nodes = {{}, {0, {1, 0, 0, 0, 0, 1, 0, 0.5f, 0, 0, 1, 0}}};
  skeleton.palette = {{0, {}}, {1, {1, 0, 0, 0, 0, 1, 0, -0.5f, 0, 0, 1, 0}}};
  return skeleton;
}

PoseTrackRecord bending(const ClipIds& ids) {
  PoseTrackRecord pose;
  pose.track_id = ids.pose_track;
  pose.clip_id = ids.clip;
  pose.rest = {{1, {0, 0.5f, 0}, {0, 0, 0, 1}, {1, 1, 1}}};
  // x from -0.5 up in steps of 1/65536; y and z stay 0.
  pose.channels = {{ChannelTarget::kRotation, 1, {-0.5f, 0, 0}, {1.0f / 65536, 0, 0}}};
  return pose;
}

ChunkRecord pose_chunk(const PoseTrackRecord& pose, std::size_t values_per_frame,
                       std::uint64_t first, std::uint32_t frames) {
  std::vector<std::uint16_t> values;
  for (std::uint64_t t = first; t < first + frames; ++t) {
    for (std::size_t v = 0; v < values_per_frame; ++v)
      values.push_back(static_cast<std::uint16_t>((900 * t + 4000 * v) % 32768));
  }
  // The two top bits 1 and 1 say that w, number 3, was left out.
  if (pose.kind == PoseKind::kJoints && !pose.channels.empty() &&
      pose.channels.front().target == ChannelTarget::kRotation) {
    for (std::size_t t = 0; t < frames; ++t) {
      values[t * values_per_frame] |= 0x8000;
      values[t * values_per_frame + 1] |= 0x8000;
    }
  }
  ChunkRecord chunk;
  chunk.track_id = pose.track_id;
  chunk.data = bake::encode_pose_packet(values, {values_per_frame, frames, pose.kind});
  chunk.packets = {{static_cast<std::int64_t>(first), true, 0, chunk.data.size()}};
  return chunk;
}

void set_pose(Draft& draft, const PoseTrackRecord& pose, std::size_t values_per_frame) {
  for (PoseTrackRecord& there : draft.poses) {
    if (there.clip_id == pose.clip_id) there = pose;
  }
  for (DraftSegment& segment : draft.segments) {
    if (segment.record.clip_id != pose.clip_id) continue;
    segment.chunks.front() =
        pose_chunk(pose, values_per_frame, segment.record.first_frame, segment.record.frame_count);
  }
}

void set_durations(Draft& draft, const std::vector<std::uint32_t>& durations) {
  std::uint64_t tick = 0;
  for (DraftSegment& segment : draft.segments) {
    segment.record.first_tick = tick;
    const auto first = durations.begin() + static_cast<std::ptrdiff_t>(segment.record.first_frame);
    segment.record.durations.assign(first, first + segment.record.frame_count);
    for (const std::uint32_t ticks : segment.record.durations) tick += ticks;
  }
  draft.clips.front().duration_ticks = tick;
}

FigureOptions plain_figure() {
  FigureOptions o;
  o.coding.codec = "ffv1";
  o.coding.bit_depth = 8;
  o.coding.chroma = Chroma::kLuma;
  o.coding.segment_frames = 2;
  return o;
}

Draft clip_parts(const FigureOptions& o, std::uint32_t first_segment) {
  Encoded encoded = encode(o);
  Draft draft;
  ClipRecord clip;
  clip.id = o.ids.clip;
  clip.name = "clip " + std::to_string(o.ids.clip);
  clip.frame_count = clip.duration_ticks = static_cast<std::uint64_t>(o.frames);
  clip.bounds_min = {-1, -1, -1};
  clip.bounds_max = {1, 1.5f, 1};
  draft.clips.push_back(clip);
  draft.poses.push_back(bending(o.ids));
  draft.models.push_back(encoded.model);
  draft.layers = encoded.layers;
  for (bake::EncodedSegment& segment : encoded.segments) {
    DraftSegment made;
    made.record.index = first_segment++;
    made.record.clip_id = o.ids.clip;
    made.record.first_frame = made.record.first_tick = segment.segment.first_frame;
    made.record.frame_count = segment.segment.frame_count;
    made.chunks.push_back(
        pose_chunk(draft.poses.front(), 3, made.record.first_frame, made.record.frame_count));
    for (auto& chunk : segment.chunks) made.chunks.push_back(std::move(chunk));
    draft.segments.push_back(std::move(made));
  }
  return draft;
}

Draft figure(const FigureOptions& options) {
  Draft draft = clip_parts(options);
  draft.images = {checkers()};
  MaterialRecord material;
  material.id = 1;
  material.name = "checkers";
  material.image_id = 1;
  draft.materials = {material};
  draft.meshes = {quad()};
  draft.skeleton = two_joints();
  return draft;
}

}  // namespace relit::conformance
