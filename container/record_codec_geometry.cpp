// SPDX-License-Identifier: MIT
// MESH, SKEL, POSE.
#include <algorithm>
#include <cmath>

#include "container/base/bytes.hpp"
#include "container/record_checks.hpp"
#include "container/record_codec.hpp"

namespace relit::container {

using namespace checks;

namespace {

constexpr std::size_t kStreamLeastBytes = 1 + 1 + 12 + 12 + 4;
constexpr std::size_t kMorphLeastBytes = 12 + 4;
constexpr std::size_t kNodeBytes = 4 + 48;
constexpr std::size_t kPaletteBytes = 4 + 48;
constexpr std::size_t kChannelBytes = 1 + 4 + 12 + 12;
constexpr std::size_t kRestBytes = 4 + 12 + 16 + 12;
constexpr std::size_t kRangeBytes = 4 + 12 + 12;

std::uint32_t size32(std::size_t size) { return static_cast<std::uint32_t>(size); }

/// Bytes per vertex of a decoded stream.
std::uint8_t stride_of(Semantic semantic) {
  switch (semantic) {
    case Semantic::kPosition:
    case Semantic::kJoints:
      return 8;
    case Semantic::kNormal:
    case Semantic::kLightMapUv:
    case Semantic::kAlbedoUv:
    case Semantic::kColor:
    case Semantic::kWeights:
      return 4;
    case Semantic::kTwin:
      return 2;
  }
  return 0;
}

template <class T>
bool has_duplicates(std::vector<T> keys) {
  std::ranges::sort(keys);
  return std::ranges::adjacent_find(keys) != keys.end();
}

}  // namespace

std::vector<std::uint8_t> serialize(const MeshRecord& record) {
  ByteWriter w;
  w.u32(record.id);
  w.string(record.name);
  w.u32(record.material_id);
  w.u32(record.vertex_count);
  w.u32(record.index_count);
  w.u32(size32(record.streams.size()));
  for (const VertexStream& s : record.streams) {
    w.u8(static_cast<std::uint8_t>(s.semantic));
    w.u8(s.stride);
    w.f32s(s.offset);
    w.f32s(s.scale);
    w.bytes(s.bytes);
  }
  w.bytes(record.indices);
  w.u32(record.first_morph_weight);
  w.u32(size32(record.morph_targets.size()));
  for (const MorphTarget& t : record.morph_targets) {
    w.f32s(t.scale);
    w.bytes(t.bytes);
  }
  return w.take();
}

Result<MeshRecord> parse_mesh(std::span<const std::uint8_t> payload) {
  ByteReader r(payload);
  MeshRecord record;
  record.id = r.u32("id");
  record.name = r.string("name", limits::kStringBytes);
  record.material_id = r.u32("material_id");
  record.vertex_count = r.u32("vertex_count");
  record.index_count = r.u32("index_count");
  record.streams.resize(r.count("streams", limits::kVertexStreams, kStreamLeastBytes));
  for (VertexStream& s : record.streams) {
    s.semantic = r.enumeration("stream.semantic", Semantic::kTwin);
    s.stride = r.u8("stream.stride");
    s.offset = r.f32s<3>("stream.offset");
    s.scale = r.f32s<3>("stream.scale");
    s.bytes = r.bytes("stream.bytes", limits::kRecordBytes);
  }
  record.indices = r.bytes("indices", limits::kRecordBytes);
  record.first_morph_weight = r.u32("first_morph_weight");
  record.morph_targets.resize(r.count("morph_targets", limits::kMorphTargets, kMorphLeastBytes));
  for (MorphTarget& t : record.morph_targets) {
    t.scale = r.f32s<3>("morph_target.scale");
    t.bytes = r.bytes("morph_target.bytes", limits::kRecordBytes);
  }
  RELIT_TRY(r.finish());
  RELIT_TRY(validate(record));
  return record;
}

namespace {

Status validate_streams(const std::vector<VertexStream>& streams) {
  RELIT_TRY(at_most(streams.size(), limits::kVertexStreams, "number of vertex streams"));
  std::array<int, 8> count{};
  for (const VertexStream& s : streams) {
    RELIT_TRY(known(s.semantic, Semantic::kTwin, "stream.semantic"));
    ++count[static_cast<std::size_t>(s.semantic)];
    RELIT_REQUIRE(s.stride == stride_of(s.semantic),
                  "stream.stride " + std::to_string(s.stride) + " should be " +
                      std::to_string(stride_of(s.semantic)) + " for semantic " +
                      std::to_string(static_cast<int>(s.semantic)));
    RELIT_TRY(finite(s.offset, "stream.offset"));
    RELIT_TRY(not_negative(s.scale, "stream.scale"));
    RELIT_REQUIRE(!s.bytes.empty(), "stream.bytes is empty");
  }
  const auto of = [&](Semantic s) { return count[static_cast<std::size_t>(s)]; };
  RELIT_REQUIRE(of(Semantic::kPosition) == 1, "a mesh needs exactly one position stream");
  RELIT_REQUIRE(of(Semantic::kLightMapUv) == 1, "a mesh needs exactly one light-map UV stream");
  RELIT_REQUIRE(of(Semantic::kNormal) <= 1 && of(Semantic::kAlbedoUv) <= 1 &&
                    of(Semantic::kColor) <= 1 && of(Semantic::kTwin) <= 1,
                "normals, albedo UVs, colours and twins have at most one stream each");
  RELIT_REQUIRE(of(Semantic::kJoints) <= 2 && of(Semantic::kJoints) == of(Semantic::kWeights),
                "joints and weights need as many streams, at most two of each");
  return {};
}

}  // namespace

Status validate(const MeshRecord& record) {
  RELIT_TRY(text(record.name, "name"));
  RELIT_TRY(one_to(record.vertex_count, limits::kVerticesPerMesh, "vertex_count"));
  RELIT_TRY(one_to(record.index_count, limits::kIndicesPerMesh, "index_count"));
  RELIT_REQUIRE(record.index_count % 3 == 0, "index_count is not a multiple of 3");
  RELIT_TRY(validate_streams(record.streams));
  RELIT_REQUIRE(!record.indices.empty(), "indices is empty");
  RELIT_TRY(at_most(record.morph_targets.size(), limits::kMorphTargets, "number of morph targets"));
  RELIT_TRY(at_most(std::uint64_t{record.first_morph_weight} + record.morph_targets.size(),
                    limits::kMorphWeights, "last morph weight"));
  for (const MorphTarget& t : record.morph_targets) {
    RELIT_TRY(not_negative(t.scale, "morph_target.scale"));
    RELIT_REQUIRE(!t.bytes.empty(), "morph_target.bytes is empty");
  }
  return {};
}

std::vector<std::uint8_t> serialize(const SkeletonRecord& record) {
  ByteWriter w;
  w.u32(record.morph_weight_count);
  w.u32(size32(record.nodes.size()));
  for (const NodeRecord& n : record.nodes) {
    w.i32(n.parent);
    w.f32s(n.local);
  }
  w.u32(size32(record.palette.size()));
  for (const PaletteEntry& p : record.palette) {
    w.u32(p.node);
    w.f32s(p.inverse_bind);
  }
  return w.take();
}

Result<SkeletonRecord> parse_skeleton(std::span<const std::uint8_t> payload) {
  ByteReader r(payload);
  SkeletonRecord record;
  record.morph_weight_count = r.u32("morph_weight_count");
  record.nodes.resize(r.count("nodes", limits::kNodes, kNodeBytes));
  for (NodeRecord& n : record.nodes) {
    n.parent = r.i32("node.parent");
    n.local = r.f32s<12>("node.local");
  }
  record.palette.resize(r.count("palette", limits::kPalette, kPaletteBytes));
  for (PaletteEntry& p : record.palette) {
    p.node = r.u32("palette.node");
    p.inverse_bind = r.f32s<12>("palette.inverse_bind");
  }
  RELIT_TRY(r.finish());
  RELIT_TRY(validate(record));
  return record;
}

Status validate(const SkeletonRecord& record) {
  RELIT_TRY(at_most(record.morph_weight_count, limits::kMorphWeights, "morph_weight_count"));
  RELIT_TRY(at_most(record.nodes.size(), limits::kNodes, "number of nodes"));
  RELIT_TRY(at_most(record.palette.size(), limits::kPalette, "number of palette entries"));
  for (std::size_t i = 0; i < record.nodes.size(); ++i) {
    const NodeRecord& n = record.nodes[i];
    RELIT_REQUIRE(n.parent >= -1 && n.parent < static_cast<std::int64_t>(i),
                  "node " + std::to_string(i) + " has parent " + std::to_string(n.parent) +
                      ": parents come before their children, roots have -1");
    RELIT_TRY(finite(n.local, "node.local"));
  }
  for (const PaletteEntry& p : record.palette) {
    RELIT_REQUIRE(p.node < record.nodes.size(), "palette entry refers to node " +
                                                    std::to_string(p.node) + " of " +
                                                    std::to_string(record.nodes.size()));
    RELIT_TRY(finite(p.inverse_bind, "palette.inverse_bind"));
  }
  return {};
}

std::vector<std::uint8_t> serialize(const PoseTrackRecord& record) {
  ByteWriter w;
  w.u32(record.track_id);
  w.u32(record.clip_id);
  w.u8(static_cast<std::uint8_t>(record.kind));
  w.u32(size32(record.rest.size()));
  for (const RestTrs& t : record.rest) {
    w.u32(t.node);
    w.f32s(t.translation);
    w.f32s(t.rotation);
    w.f32s(t.scale);
  }
  w.u32(size32(record.channels.size()));
  for (const PoseChannel& c : record.channels) {
    w.u8(static_cast<std::uint8_t>(c.target));
    w.u32(c.index);
    w.f32s(c.offset);
    w.f32s(c.step);
  }
  w.u32(size32(record.vertex_ranges.size()));
  for (const VertexRange& v : record.vertex_ranges) {
    w.u32(v.mesh_id);
    w.f32s(v.offset);
    w.f32s(v.step);
  }
  return w.take();
}

Result<PoseTrackRecord> parse_pose_track(std::span<const std::uint8_t> payload) {
  ByteReader r(payload);
  PoseTrackRecord record;
  record.track_id = r.u32("track_id");
  record.clip_id = r.u32("clip_id");
  record.kind = r.enumeration("kind", PoseKind::kVertices);
  record.rest.resize(r.count("rest", limits::kNodes, kRestBytes));
  for (RestTrs& t : record.rest) {
    t.node = r.u32("rest.node");
    t.translation = r.f32s<3>("rest.translation");
    t.rotation = r.f32s<4>("rest.rotation");
    t.scale = r.f32s<3>("rest.scale");
  }
  record.channels.resize(r.count("channels", limits::kPoseChannels, kChannelBytes));
  for (PoseChannel& c : record.channels) {
    c.target = r.enumeration("channel.target", ChannelTarget::kMorphWeight);
    c.index = r.u32("channel.index");
    c.offset = r.f32s<3>("channel.offset");
    c.step = r.f32s<3>("channel.step");
  }
  record.vertex_ranges.resize(r.count("vertex_ranges", limits::kMeshes, kRangeBytes));
  for (VertexRange& v : record.vertex_ranges) {
    v.mesh_id = r.u32("vertex_range.mesh_id");
    v.offset = r.f32s<3>("vertex_range.offset");
    v.step = r.f32s<3>("vertex_range.step");
  }
  RELIT_TRY(r.finish());
  RELIT_TRY(validate(record));
  return record;
}

namespace {

Status validate_joints(const PoseTrackRecord& record) {
  std::vector<std::uint64_t> keys;
  for (const RestTrs& t : record.rest) {
    RELIT_TRY(finite(t.translation, "rest.translation"));
    RELIT_TRY(finite(t.rotation, "rest.rotation"));
    RELIT_TRY(finite(t.scale, "rest.scale"));
    double square = 0;
    for (const float q : t.rotation) square += double{q} * double{q};
    // Normalised in single precision a quaternion is off by some 1e-7; 1e-3 forgives sloppy
    // exporters.
    RELIT_REQUIRE(std::abs(std::sqrt(square) - 1) < 1e-3, "rest.rotation is not of unit length");
    keys.push_back(t.node);
  }
  RELIT_REQUIRE(!has_duplicates(std::move(keys)), "two rest entries for the same node");
  keys.clear();
  for (const PoseChannel& c : record.channels) {
    RELIT_TRY(known(c.target, ChannelTarget::kMorphWeight, "channel.target"));
    const bool morph = c.target == ChannelTarget::kMorphWeight;
    RELIT_REQUIRE(c.index < (morph ? limits::kMorphWeights : limits::kNodes),
                  "channel.index " + std::to_string(c.index) + " is out of range");
    RELIT_TRY(finite(c.offset, "channel.offset"));
    RELIT_TRY(not_negative(c.step, "channel.step"));
    keys.push_back((std::uint64_t{c.index} << 8) | static_cast<std::uint8_t>(c.target));
  }
  RELIT_REQUIRE(!has_duplicates(std::move(keys)), "two channels animate the same quantity");
  return {};
}

}  // namespace

Status validate(const PoseTrackRecord& record) {
  RELIT_TRY(known(record.kind, PoseKind::kVertices, "kind"));
  RELIT_TRY(at_most(record.rest.size(), limits::kNodes, "number of rest entries"));
  RELIT_TRY(at_most(record.channels.size(), limits::kPoseChannels, "number of channels"));
  RELIT_TRY(at_most(record.vertex_ranges.size(), limits::kMeshes, "number of vertex ranges"));
  if (record.kind == PoseKind::kJoints) {
    RELIT_REQUIRE(record.vertex_ranges.empty(), "vertex ranges in a track of joints");
    return validate_joints(record);
  }
  RELIT_REQUIRE(record.rest.empty() && record.channels.empty(),
                "joint channels in a track of vertices");
  RELIT_REQUIRE(!record.vertex_ranges.empty(), "a track of vertices needs vertex ranges");
  std::vector<std::uint32_t> meshes;
  for (const VertexRange& v : record.vertex_ranges) {
    RELIT_TRY(finite(v.offset, "vertex_range.offset"));
    RELIT_TRY(not_negative(v.step, "vertex_range.step"));
    meshes.push_back(v.mesh_id);
  }
  RELIT_REQUIRE(!has_duplicates(std::move(meshes)), "two vertex ranges for the same mesh");
  return {};
}

}  // namespace relit::container
