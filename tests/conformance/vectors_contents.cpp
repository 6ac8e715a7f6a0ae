// SPDX-License-Identifier: MIT
// Records that are fine by themselves, but whose coded bytes do not decode.
#include <algorithm>
#include <stdexcept>

#include "bake_minimal/stream_encoder.hpp"
#include "bake_minimal/vertex_quantizer.hpp"
#include "bake_minimal/video_encoder.hpp"
#include "tests/conformance/making.hpp"

namespace relit::conformance {

using namespace container;

namespace {

constexpr std::uint16_t kNone = decoders::kNoTwin;

std::vector<std::uint8_t> words(const std::vector<unsigned>& values) {
  std::vector<std::uint8_t> bytes;
  for (const unsigned v : values) bake::append_u16(bytes, v);
  return bytes;
}

/// A zstd frame header that promises `content` bytes, and one empty raw block.
std::vector<std::uint8_t> bomb(std::uint64_t content) {
  std::vector<std::uint8_t> bytes{0x28, 0xB5, 0x2F, 0xFD, 0xE0};
  for (int i = 0; i < 8; ++i) bytes.push_back(static_cast<std::uint8_t>(content >> (8 * i)));
  bytes.insert(bytes.end(), {1, 0, 0});
  return bytes;
}

void mesh(Vectors& vectors, const char* name, const char* description,
          std::function<void(MeshRecord&)> change) {
  from_draft(vectors, name, description, undecodable({"DECODE_MESH"}),
             [change](Draft& d) { change(d.meshes[0]); });
}

void add_meshes(Vectors& vectors) {
  using M = MeshRecord;
  mesh(vectors, "mesh-garbage", "a stream that is no zstd", [](M& m) {
    m.streams[0].bytes = {1, 2, 3, 4, 5};
  });
  mesh(vectors, "mesh-bomb", "a stream that says it becomes 2^40 bytes",
       [](M& m) { m.streams[0].bytes = bomb(std::uint64_t{1} << 40); });
  mesh(vectors, "mesh-bomb-filled", "a stream of 16 KiB that becomes 2^26 bytes of zeros",
       [](M& m) { m.streams[0].bytes = bake::deflate(std::vector<std::uint8_t>(1u << 26)); });
  mesh(vectors, "mesh-stream-cut", "a stream that ends early",
       [](M& m) { m.streams[0].bytes.resize(m.streams[0].bytes.size() / 2); });
  mesh(vectors, "mesh-stream-behind", "bytes behind a stream's end",
       [](M& m) { m.streams[0].bytes.push_back(0); });
  mesh(vectors, "mesh-vertices-other", "a stream of another number of vertices",
       [](M& m) { m.vertex_count = 300; });
  mesh(vectors, "mesh-indices-other", "a stream of another number of indices",
       [](M& m) { m.index_count = 9; });
  mesh(vectors, "mesh-index-beyond", "an index beyond the vertices", [](M& m) {
    const std::vector<std::uint32_t> indices{0, 1, 2, 0, 2, 4};
    m.indices = bake::encode_index_stream(indices, 5);
  });
  mesh(vectors, "mesh-joint-beyond", "a joint beyond the palette", [](M& m) {
    m.streams[2].bytes =
        quad_stream(Semantic::kJoints, words({2, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}));
  });
  mesh(vectors, "mesh-weights-sum", "weights that sum to 254", [](M& m) {
    std::vector<std::uint8_t> weights(16, 0);
    for (std::size_t v = 0; v < 4; ++v) weights[4 * v] = 254;
    m.streams[3].bytes = quad_stream(Semantic::kWeights, weights);
  });
  mesh(vectors, "mesh-twin-later", "a twin that does not come before its vertex", [](M& m) {
    // Folded 4 is 2 more than 0, of vertex 2.
    m.streams.push_back({Semantic::kTwin,
                         2,
                         {},
                         {1, 1, 1},
                         bake::deflate(std::vector<std::uint8_t>{0, 0, 5, 0, 0, 0, 0, 0})});
  });
  mesh(vectors, "mesh-twin-unused", "streams of four points beside a stream of twins for three",
       [](M& m) {
         m.streams.push_back(
             {Semantic::kTwin,
              2,
              {},
              {1, 1, 1},
              bake::encode_twins(std::vector<std::uint16_t>{kNone, kNone, kNone, 2})});
       });
  mesh(vectors, "mesh-beyond-bounds", "a scale that leads beyond 10^9",
       [](M& m) { m.streams[0].scale[0] = 1e6f; });
  from_draft(vectors, "image-garbage", "an image that is no PNG", faulty({"DECODE_IMAGE"}),
             [](Draft& d) { d.images[0].bytes.resize(20); });
}

void pose(Vectors& vectors, const char* name, const char* description,
          std::function<void(ChunkRecord&)> change) {
  from_draft(vectors, name, description, faulty({"DECODE_POSE_PACKET"}), [change](Draft& d) {
    ChunkRecord& chunk = d.segments[1].chunks[0];
    change(chunk);
    chunk.packets[0].size = chunk.data.size();
  });
}

void add_poses(Vectors& vectors) {
  using C = ChunkRecord;
  pose(vectors, "pose-garbage", "a pose packet that is no zstd", [](C& c) {
    c.data = {1, 2, 3, 4};
  });
  pose(vectors, "pose-bomb", "a pose packet that says it becomes 2^40 bytes",
       [](C& c) { c.data = bomb(std::uint64_t{1} << 40); });
  pose(vectors, "pose-short", "a pose packet that lacks a byte",
       [](C& c) { c.data = bake::deflate(std::vector<std::uint8_t>(6)); });
  pose(vectors, "pose-long", "a pose packet with a byte too many",
       [](C& c) { c.data = bake::deflate(std::vector<std::uint8_t>(8)); });
  pose(vectors, "pose-mode-order", "a prediction of order 3", [](C& c) {
    std::vector<std::uint8_t> bytes(7);
    bytes[0] = 3;
    c.data = bake::deflate(bytes);
  });
  pose(vectors, "pose-mode-along", "prediction along vertices in a track of joints", [](C& c) {
    std::vector<std::uint8_t> bytes(7);
    bytes[0] = 4;
    c.data = bake::deflate(bytes);
  });
  from_draft(vectors, "pose-beyond-bounds", "a channel that leads beyond 10^9",
             undecodable({"DECODE_POSE_TRACK"}), [](Draft& d) {
               PoseChannel& channel = d.poses[0].channels[0];
               channel.target = ChannelTarget::kTranslation;
               channel.step[0] = 1e9f;
             });
  from_draft(vectors, "pose-matrix-infinite", "matrices whose product overflows",
             faulty({"DECODE_POSE_MATRIX"}), [](Draft& d) {
               d.skeleton->nodes[0].local[0] = 1e8f;
               d.skeleton->palette[1].inverse_bind[0] = 1e8f;
             });
}

/// Exponents of 3 everywhere, in every segment.
void set_tiny_exponents(Draft& draft) {
  LayerRecord& layer = draft.layers[0];
  for (DraftSegment& segment : draft.segments) {
    bake::VideoSettings settings;
    settings.codec = "ffv1";
    settings.width = layer.exponent_width, settings.height = layer.exponent_height;
    settings.lossless = true;
    auto encoder = bake::VideoEncoder::open(settings);
    if (!encoder || !encoder->begin_picture()) throw std::runtime_error("no encoder for FFV1");
    const bake::SampleTarget picture = encoder->target(0);
    for (int y = 0; y < picture.height; ++y)
      std::fill_n(picture.data + y * picture.stride_bytes, picture.width, std::uint8_t{3});
    std::vector<bake::CodedPacket> packets;
    const auto first = static_cast<std::int64_t>(segment.record.first_frame);
    if (!encoder->encode(first, true, packets) || !encoder->finish(packets))
      throw std::runtime_error("FFV1 does not encode");
    layer.exponent_private = encoder->codec_private();
    ChunkRecord& chunk = segment.chunks[2];
    chunk.data = packets.at(0).bytes;
    chunk.packets = {{first, true, 0, chunk.data.size()}};
  }
}

void add_video(Vectors& vectors) {
  FigureOptions exponents = plain_figure();
  exponents.coding.exponent_block = 4;
  from_draft(vectors, "exponent-tiny", "exponents smaller than writers emit",
             noted({"VIDEO_EXPONENT"}), set_tiny_exponents, exponents);
  FigureOptions h264 = plain_figure();
  h264.coding.codec = "h264";
  h264.coding.preset = "medium";
  h264.frames = 12;
  h264.coding.segment_frames = 8;
  from_draft(vectors, "codec-unknown", "a codec that no decoder knows",
             {Outcome::kWhole, {"VIDEO_CODEC"}, true, false}, [](Draft& d) {
               d.layers[0].codec = "relit-test";
               d.layers[0].mantissa_pictures = 2;
             });
  from_draft(vectors, "codec-private", "a codec_private that the decoder refuses",
             undecodable({"VIDEO_OPEN"}), [](Draft& d) {
               d.layers[0].codec_private = {9, 9, 9};
             });
  from_draft(vectors, "packet-garbage", "a packet that is no picture", faulty({"VIDEO_PICTURE"}),
             [](Draft& d) {
               ChunkRecord& chunk = d.segments[0].chunks[1];
               const auto size = static_cast<std::size_t>(chunk.packets[0].size);
               for (std::size_t i = 0; i < size; ++i) chunk.data[i] ^= 0x5A;
             });
  from_draft(vectors, "packet-empty", "a packet without bytes", faulty({"VIDEO_PICTURE"}),
             [](Draft& d) {
               ChunkRecord& chunk = d.segments[1].chunks[1];
               chunk.data.clear();
               chunk.packets[0].size = 0;
             });
  from_draft(
      vectors, "pictures-too-few", "a decoder of one picture for B-frames",
      faulty({"VIDEO_PICTURES"}), [](Draft& d) { d.layers[0].mantissa_pictures = 1; }, h264);
  from_draft(vectors, "transfer-beyond-passive", "more light than a passive surface has",
             noted({"VIDEO_TRANSFER"}), [](Draft& d) {
               d.models[0].mean[0] = {3, 3, 3};
             });
  FigureOptions mpeg4 = plain_figure();
  mpeg4.coding.codec = "mpeg4";
  mpeg4.coding.chroma = Chroma::k420;
  from_draft(
      vectors, "picture-other-size", "pictures of another size than promised",
      faulty({"VIDEO_PICTURE"}), [](Draft& d) { d.layers[0].coded_height = 32; }, mpeg4);
  from_draft(vectors, "picture-repeated", "frames without a packet repeat the one before", whole(),
             [](Draft& d) {
               ChunkRecord& chunk = d.segments[0].chunks[1];
               chunk.packets.resize(1);
               chunk.data.resize(static_cast<std::size_t>(chunk.packets[0].size));
             });
}

}  // namespace

void add_contents(Vectors& vectors) {
  add_meshes(vectors);
  add_poses(vectors);
  add_video(vectors);
}

}  // namespace relit::conformance
