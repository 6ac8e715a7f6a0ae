// SPDX-License-Identifier: MIT
#include "container/record_codec.hpp"

#include <functional>
#include <limits>

#include "container/base/bytes.hpp"
#include "container/base/limits.hpp"
#include "container/framing.hpp"
#include "tests/container/sample.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::container;
using sample::Bytes;

namespace {

constexpr float kHuge = std::numeric_limits<float>::max();
constexpr float kTiny = std::numeric_limits<float>::denorm_min();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// Round trip, every truncation, a trailing byte, and every single bit: what is still accepted must
/// be written back as it was read.
template <class R, class Parse>
void check_codec(const R& record, Parse parse) {
  REQUIRE(validate(record));
  const Bytes bytes = serialize(record);
  const auto parsed = parse(bytes);
  if (!parsed) FAIL(parsed.error().message);
  CHECK(*parsed == record);
  CHECK(serialize(*parsed) == bytes);
  if (bytes.size() > 4096) return;

  for (std::size_t size = 0; size < bytes.size(); ++size)
    REQUIRE_FALSE(parse(std::span(bytes).first(size)));
  Bytes longer = bytes;
  longer.push_back(0);
  REQUIRE_FALSE(parse(longer));
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    Bytes changed = bytes;
    changed[bit / 8] = static_cast<std::uint8_t>(changed[bit / 8] ^ (1u << (bit % 8)));
    const auto result = parse(changed);
    if (result) REQUIRE(serialize(*result) == changed);
  }
}

/// A chunk's last field runs to the end of the record, so other lengths are told by the packets.
void check_chunk_codec(const ChunkRecord& record) { check_codec(record, parse_chunk); }

template <class R>
ErrorCode refusal(R record, const std::function<void(R&)>& spoil) {
  REQUIRE(validate(record));
  spoil(record);
  const auto status = validate(record);
  if (status) FAIL("the spoiled record was accepted");
  CHECK_FALSE(status.error().message.empty());
  return status.error().code;
}

}  // namespace

#define REFUSED(code_, record_, statement_)                                               \
  CHECK(refusal<std::decay_t<decltype(record_)>>(record_, [](auto& r) { statement_; }) == \
        ErrorCode::code_)

TEST_CASE("every record survives serialisation, and no other length of it does") {
  check_codec(HeaderRecord{0, 2, "relit-bake 0.1"}, parse_header);
  check_codec(sample::clip(), parse_clip);
  check_codec(sample::image(), parse_image);
  check_codec(sample::material(), parse_material);
  check_codec(sample::mesh(), parse_mesh);
  check_codec(sample::skeleton(), parse_skeleton);
  check_codec(sample::pose_track(), parse_pose_track);
  check_codec(sample::vertex_track(), parse_pose_track);
  check_codec(sample::model(), parse_model);
  check_codec(sample::layer(), parse_layer);
  check_codec(sample::second_layer(), parse_layer);
  check_codec(SegmentRecord{3, 7, 100, 25, {{1, 32}, {9, 1024}}, 90, {}}, parse_segment);
  check_codec(SegmentRecord{3, 7, 100, 3, {{1, 32}}, 5000, {1, 40, 0xFFFF}}, parse_segment);
  check_codec(IndexRecord{{{0, 7, 0, 25, 1000, 0}, {2, 8, 25, 25, 2000, 31}}}, parse_index);
  check_codec(EndRecord{64, 1024, 128}, parse_end);
  check_chunk_codec(sample::chunk(5, 100, 4));
}

TEST_CASE("records survive with extreme values") {
  check_codec(HeaderRecord{0, 0xFFFF, std::string(limits::kStringBytes, 'x')}, parse_header);
  ClipRecord clip = sample::clip(0xFFFFFFFF, limits::kFrames);
  clip.tick_rate = {0x7FFFFFFF, 1};
  clip.bounds_min = {-kHuge, -0.0f, kTiny};
  clip.bounds_max = {kHuge, 0, kTiny};
  check_codec(clip, parse_clip);
  clip.tick_rate = {1, 0x7FFFFFFF};
  clip.name = "";
  check_codec(clip, parse_clip);
  check_codec(MaterialRecord{}, parse_material);
  check_codec(SkeletonRecord{}, parse_skeleton);
  check_codec(PoseTrackRecord{}, parse_pose_track);

  MeshRecord mesh = sample::mesh();
  mesh.vertex_count = limits::kVerticesPerMesh;
  mesh.index_count = limits::kIndicesPerMesh;
  mesh.first_morph_weight = limits::kMorphWeights - 1;
  mesh.streams[3].bytes.assign(100000, 5);
  check_codec(mesh, parse_mesh);

  ModelRecord model;
  model.order = 3;
  model.width = model.height = static_cast<std::uint16_t>(limits::kLightMapSide);
  model.mean.assign(16, {kHuge, -kHuge, kTiny});
  model.prediction_plane = limits::kPlanes - 1;
  check_codec(model, parse_model);

  LayerRecord layer = sample::second_layer();
  layer.coded_width = layer.coded_height = static_cast<std::uint16_t>(limits::kVideoSide);
  layer.planes.clear();
  for (std::uint16_t i = 0; i < limits::kPlanes; ++i) {
    PlaneRecord plane{0, {static_cast<std::uint16_t>(16 * i), 0, 16, 4096}, {}, kTiny, {}};
    for (std::uint8_t n = 0; n < 16; ++n)
      for (std::uint8_t c = 0; c < 3; ++c) plane.matrix.push_back({n, c, -kHuge});
    layer.planes.push_back(plane);
  }
  check_codec(layer, parse_layer);
}

TEST_CASE("chunks survive with packets out of display order, empty packets and late times") {
  ChunkRecord chunk;
  chunk.track_id = 0xFFFFFFFF;
  chunk.segment_index = limits::kSegments - 1;
  chunk.data.assign(300, 0xAB);
  const auto last = static_cast<std::int64_t>(limits::kFrames - 1);
  chunk.packets = {{last - 4, true, 0, 200},
                   {last, false, 200, 0},
                   {last - 2, true, 200, 100},
                   {last - 3, false, 300, 0}};
  check_chunk_codec(chunk);
}

TEST_CASE("a segment of many packets takes two or three bytes a packet") {
  ChunkRecord chunk;
  for (std::uint32_t i = 0; i < limits::kPacketsPerChunk; ++i)
    chunk.packets.push_back({i, i == 0, std::uint64_t{100} * i, 100});
  chunk.data.resize(std::size_t{100} * limits::kPacketsPerChunk);
  REQUIRE(validate(chunk));
  const auto bytes = serialize(chunk);
  CHECK(bytes.size() <= chunk.data.size() + 24 + 3 * chunk.packets.size());
  const auto parsed = parse_chunk(bytes);
  REQUIRE(parsed);
  CHECK(*parsed == chunk);
  chunk.packets.push_back({limits::kPacketsPerChunk, false, chunk.data.size(), 0});
  CHECK(validate(chunk).error().code == ErrorCode::kLimit);
  CHECK(parse_chunk(serialize(chunk)).error().code == ErrorCode::kLimit);
}

TEST_CASE("headers of newer major versions are refused, newer minor ones are read") {
  HeaderRecord header{kVersionMajor, kVersionMinor + 1, "future"};
  CHECK(parse_header(serialize(header)));
  header.version_major = kVersionMajor + 1;
  auto bytes = serialize(header);
  bytes.push_back(42);  // whatever a later version may add
  const auto result = parse_header(bytes);
  REQUIRE_FALSE(result);
  CHECK(result.error().code == ErrorCode::kUnsupported);
  CHECK(result.error().message.find("newer relit") != std::string::npos);
}

TEST_CASE("clips, images and materials that make no sense are refused") {
  const auto clip = sample::clip();
  REFUSED(kCorrupt, clip, r.tick_rate.num = 0);
  REFUSED(kCorrupt, clip, r.tick_rate.den = 0);
  REFUSED(kCorrupt, clip, r.tick_rate.num = -1);
  REFUSED(kCorrupt, clip, r.tick_rate.num = 0x80000000);
  REFUSED(kCorrupt, clip, r.frame_count = 0);
  REFUSED(kLimit, clip, r.frame_count = limits::kFrames + 1);
  REFUSED(kCorrupt, clip, r.bounds_min[1] = kNan);
  REFUSED(kCorrupt, clip, r.bounds_min[1] = r.bounds_max[1] + 1);
  REFUSED(kCorrupt, clip, r.name = "\xFF");
  REFUSED(kLimit, clip, r.name = std::string(limits::kStringBytes + 1, 'n'));
  const auto image = sample::image();
  REFUSED(kUnsupported, image, r.media_type = "image/webp");
  REFUSED(kCorrupt, image, r.bytes.clear());
  const auto material = sample::material();
  REFUSED(kCorrupt, material, r.base_color[3] = 1.5f);
  REFUSED(kCorrupt, material, r.base_color[0] = -0.1f);
  REFUSED(kCorrupt, material, r.image_id = -2);
  REFUSED(kCorrupt, material, r.alpha_cutoff = kNan);
  REFUSED(kUnsupported, material, r.wrap_u = static_cast<Wrap>(3));
  REFUSED(kUnsupported, material, r.alpha_mode = static_cast<AlphaMode>(3));
}

TEST_CASE("meshes that make no sense are refused") {
  const auto mesh = sample::mesh();
  REFUSED(kCorrupt, mesh, r.vertex_count = 0);
  REFUSED(kLimit, mesh, r.vertex_count = limits::kVerticesPerMesh + 1);
  REFUSED(kCorrupt, mesh, r.index_count = 4);
  REFUSED(kCorrupt, mesh, r.index_count = 0);
  REFUSED(kLimit, mesh, r.index_count = limits::kIndicesPerMesh + 3);
  REFUSED(kCorrupt, mesh, r.streams.erase(r.streams.begin()));
  REFUSED(kCorrupt, mesh, r.streams.erase(r.streams.begin() + 2));
  REFUSED(kCorrupt, mesh, r.streams.erase(r.streams.begin() + 4));
  REFUSED(kCorrupt, mesh, r.streams.push_back(r.streams[0]));
  REFUSED(kCorrupt, mesh, r.streams[0].stride = 4);
  REFUSED(kCorrupt, mesh, r.streams[0].offset[0] = kNan);
  REFUSED(kCorrupt, mesh, r.streams[0].scale[0] = -1);
  REFUSED(kCorrupt, mesh, r.streams[0].bytes.clear());
  REFUSED(kUnsupported, mesh, r.streams[1].semantic = static_cast<Semantic>(8));
  REFUSED(kLimit, mesh, r.streams.resize(limits::kVertexStreams + 1, r.streams[0]));
  REFUSED(kCorrupt, mesh, r.indices.clear());
  REFUSED(kLimit, mesh, r.first_morph_weight = limits::kMorphWeights);
  REFUSED(kLimit, mesh, r.morph_targets.resize(limits::kMorphTargets + 1, r.morph_targets[0]));
  REFUSED(kCorrupt, mesh, r.morph_targets[0].scale[0] = -1);
  REFUSED(kCorrupt, mesh, r.morph_targets[0].bytes.clear());
}

TEST_CASE("skeletons and pose tracks that make no sense are refused") {
  const auto skeleton = sample::skeleton();
  REFUSED(kCorrupt, skeleton, r.nodes[1].parent = 1);
  REFUSED(kCorrupt, skeleton, r.nodes[0].parent = -2);
  REFUSED(kCorrupt, skeleton, r.nodes[0].local[5] = kNan);
  REFUSED(kCorrupt, skeleton, r.palette[0].node = 2);
  REFUSED(kLimit, skeleton, r.morph_weight_count = limits::kMorphWeights + 1);
  REFUSED(kLimit, skeleton, r.nodes.resize(limits::kNodes + 1));
  REFUSED(kLimit, skeleton, r.palette.resize(limits::kPalette + 1));
  const auto pose = sample::pose_track();
  REFUSED(kCorrupt, pose, r.channels.push_back(r.channels[0]));
  REFUSED(kCorrupt, pose, r.channels[1].step[0] = -1);
  REFUSED(kCorrupt, pose, r.channels[1].offset[0] = kNan);
  REFUSED(kCorrupt, pose, r.channels[1].index = limits::kNodes);
  REFUSED(kUnsupported, pose, r.channels[1].target = static_cast<ChannelTarget>(4));
  REFUSED(kCorrupt, pose, r.rest.push_back(r.rest[0]));
  REFUSED(kCorrupt, pose, r.rest[0].rotation[3] = 0.9f);
  REFUSED(kCorrupt, pose, r.vertex_ranges.emplace_back());
  REFUSED(kUnsupported, pose, r.kind = static_cast<PoseKind>(2));
  const auto vertices = sample::vertex_track();
  REFUSED(kCorrupt, vertices, r.vertex_ranges.clear());
  REFUSED(kCorrupt, vertices, r.vertex_ranges.push_back(r.vertex_ranges[0]));
  REFUSED(kCorrupt, vertices, r.vertex_ranges[0].step[2] = kNan);
  REFUSED(kCorrupt, vertices, r.channels.emplace_back());
}

TEST_CASE("models and layers that make no sense are refused") {
  const auto model = sample::model();
  REFUSED(kLimit, model, r.order = 4);
  REFUSED(kCorrupt, model, r.order = 2);
  REFUSED(kCorrupt, model, r.width = 0);
  REFUSED(kLimit, model, r.height = limits::kLightMapSide + 1);
  REFUSED(kCorrupt, model, r.prediction_plane = -2);
  REFUSED(kCorrupt, model, r.prediction_plane = limits::kPlanes);
  REFUSED(kCorrupt, model, r.mean[3][2] = kNan);
  REFUSED(kUnsupported, model, r.kind = static_cast<ModelKind>(1));
  const auto layer = sample::layer();
  REFUSED(kCorrupt, layer, r.codec = "");
  REFUSED(kCorrupt, layer, r.codec = "h264;rm");
  REFUSED(kLimit, layer, r.codec = std::string(limits::kCodecNameBytes + 1, 'c'));
  REFUSED(kLimit, layer, r.codec_private.resize(limits::kCodecPrivateBytes + 1));
  REFUSED(kCorrupt, layer, r.coded_width = 0);
  REFUSED(kLimit, layer, r.coded_height = limits::kVideoSide + 1);
  REFUSED(kCorrupt, layer, r.bit_depth = 9);
  REFUSED(kUnsupported, layer, r.chroma = static_cast<Chroma>(3));
  REFUSED(kCorrupt, layer, r.chroma = Chroma::kLuma);  // components 1 and 2 vanish
  REFUSED(kCorrupt, layer, r.exponent_track = r.mantissa_track);
  REFUSED(kCorrupt, layer, r.exponent_codec = "");
  REFUSED(kCorrupt, layer, r.exponent_block = 0);
  REFUSED(kCorrupt, layer, r.exponent_block = 3);
  REFUSED(kCorrupt, layer, r.exponent_block = 64);
  REFUSED(kCorrupt, layer, r.exponent_block = 8);  // the rectangles are those of 4
  REFUSED(kCorrupt, layer, r.exponent_width = 3);
  REFUSED(kCorrupt, layer, r.planes.clear());
  REFUSED(kLimit, layer, r.planes.resize(limits::kPlanes + 1));
  REFUSED(kCorrupt, layer, r.planes.push_back(r.planes[0]));
  REFUSED(kCorrupt, layer, r.planes[0].component = 3);
  REFUSED(kCorrupt, layer, r.planes[0].scale = 0);
  REFUSED(kCorrupt, layer, r.planes[0].scale = -1);
  REFUSED(kCorrupt, layer, r.planes[0].scale = kNan);
  REFUSED(kCorrupt, layer, r.planes[0].mantissa_rect.x = 21);
  REFUSED(kCorrupt, layer, r.planes[0].mantissa_rect.y = 65535);
  REFUSED(kCorrupt, layer, r.planes[0].mantissa_rect.width = 0);
  REFUSED(kCorrupt, layer, r.planes[1].mantissa_rect.x = 15);  // odd, in 4:2:0 chroma
  REFUSED(kCorrupt, layer, r.planes[0].exponent_rect.x = 2);
  REFUSED(kCorrupt, layer, r.planes[0].matrix[0].coefficient = 16);
  REFUSED(kCorrupt, layer, r.planes[0].matrix[0].channel = 3);
  REFUSED(kCorrupt, layer, r.planes[0].matrix[0].value = kNan);
  REFUSED(kCorrupt, layer, r.planes[0].matrix.push_back(r.planes[0].matrix[0]));
}

TEST_CASE("segments, chunks and indices that make no sense are refused") {
  const SegmentRecord segment{3, 7, 100, 25, {{1, 32}, {9, 1024}}, 90, {}};
  REFUSED(kCorrupt, segment, r.index = limits::kSegments);
  REFUSED(kCorrupt, segment, r.frame_count = 0);
  REFUSED(kLimit, segment, r.frame_count = limits::kFramesPerSegment + 1);
  REFUSED(kLimit, segment, r.first_frame = limits::kFrames - 24);
  REFUSED(kLimit, segment, r.first_frame = ~std::uint64_t{0});
  REFUSED(kCorrupt, segment, r.chunks[0].chunk_bytes = 24);
  REFUSED(kCorrupt, segment, r.chunks[0].chunk_bytes = 33);
  REFUSED(kLimit, segment, r.chunks[0].chunk_bytes = ~std::uint64_t{7});
  REFUSED(kCorrupt, segment, r.chunks[1].track_id = 1);
  REFUSED(kLimit, segment, r.chunks.resize(limits::kChunksPerSegment + 1, r.chunks[0]));
  const auto chunk = sample::chunk(5, 100, 4);
  REFUSED(kCorrupt, chunk, r.packets.clear());
  REFUSED(kCorrupt, chunk, r.packets[1].pts = 100);
  REFUSED(kCorrupt, chunk, r.packets[1].pts = -1);
  REFUSED(kCorrupt, chunk, r.packets[1].offset += 1);
  REFUSED(kCorrupt, chunk, r.packets[3].size += 1);
  REFUSED(kCorrupt, chunk, r.segment_index = limits::kSegments);
  const IndexRecord index{{{0, 7, 0, 25, 1000}, {2, 8, 25, 25, 2000}}};
  REFUSED(kCorrupt, index, r.segments[1].segment_index = 0);
  REFUSED(kCorrupt, index, r.segments[1].offset = 1000);
  REFUSED(kCorrupt, index, r.segments[1].offset = 2001);
  REFUSED(kCorrupt, index, r.segments[0].offset = 0);
  REFUSED(kCorrupt, index, r.segments[0].frame_count = 0);
  const EndRecord end{64, 1024};
  REFUSED(kCorrupt, end, r.index_offset = 1025);
  REFUSED(kCorrupt, end, r.index_offset = 1016);
  REFUSED(kCorrupt, end, r.file_bytes = 1023);
  REFUSED(kCorrupt, end, r.file_bytes = 8);
}

TEST_CASE("counts that promise more than the payload holds cost no memory") {
  // A segment, an index, a skeleton and a pose track that claim the largest counts allowed.
  ByteWriter w;
  w.u32(limits::kSegments);
  w.u32(0);
  CHECK_FALSE(parse_index(w.take()));
  w.u32(0);
  w.u32(limits::kNodes);
  CHECK_FALSE(parse_skeleton(w.take()));
  w.u32(1);
  w.u32(2);
  w.u64(0);
  w.u32(limits::kPacketsPerChunk);
  w.u32(2);
  w.u16(0);
  const auto chunk = parse_chunk(w.take());
  REQUIRE_FALSE(chunk);
  CHECK(chunk.error().message.find("table_bytes") != std::string::npos);
}
