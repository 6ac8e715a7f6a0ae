// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "container/base/plane_view.hpp"

/// The records of a .relit file as plain structures: what FORMAT.md's field tables describe.
/// They own their bytes. Parsing checks every limit, finiteness of every float and every reference
/// inside one record; references between records are checked by the code that joins them.
namespace relit::container {

/// An exact fraction; den > 0.
struct Rational {
  std::int64_t num = 0;
  std::int64_t den = 1;
  bool operator==(const Rational&) const = default;
};

/// Row-major 3×4 affine matrix: x' = m[0]x + m[1]y + m[2]z + m[3], and so on.
using Affine = std::array<float, 12>;

struct HeaderRecord {
  std::uint16_t version_major = 0;
  std::uint16_t version_minor = 2;
  std::string writer;  ///< name and version of the program that wrote the file
  bool operator==(const HeaderRecord&) const = default;
};

/// One animation. Time is counted in ticks, exactly; a frame lasts one tick where its segment does
/// not say otherwise, so that the tick rate of an evenly spaced clip is its frame rate.
struct ClipRecord {
  std::uint32_t id = 0;
  std::string name;
  Rational tick_rate{50, 1};  ///< ticks per second, > 0
  std::uint64_t frame_count = 0;
  bool loop = false;
  std::array<float, 3> bounds_min{};  ///< of the posed meshes over the whole clip, metres
  std::array<float, 3> bounds_max{};
  std::uint64_t duration_ticks = 0;  ///< at least frame_count; more: unevenly spaced
  bool operator==(const ClipRecord&) const = default;
};

[[nodiscard]] inline double duration_s(const ClipRecord& clip) {
  return static_cast<double>(clip.duration_ticks) * static_cast<double>(clip.tick_rate.den) /
         static_cast<double>(clip.tick_rate.num);
}

/// An image as its encoder left it.
struct ImageRecord {
  std::uint32_t id = 0;
  std::string media_type;  ///< "image/png" or "image/jpeg"
  std::vector<std::uint8_t> bytes;
  bool operator==(const ImageRecord&) const = default;
};

enum class Wrap : std::uint8_t { kRepeat = 0, kClamp = 1, kMirror = 2 };
enum class AlphaMode : std::uint8_t { kOpaque = 0, kMask = 1, kBlend = 2 };

/// Albedo = decode_srgb(image) × base_color × vertex colour. The (1 − metallic) of the design's
/// definition is already in base_color or in the image.
struct MaterialRecord {
  std::uint32_t id = 0;
  std::string name;
  std::array<float, 4> base_color{1, 1, 1, 1};  ///< linear, straight alpha
  std::int32_t image_id = -1;                   ///< -1: no image
  Wrap wrap_u = Wrap::kRepeat;
  Wrap wrap_v = Wrap::kRepeat;
  bool linear_filter = true;
  AlphaMode alpha_mode = AlphaMode::kOpaque;
  float alpha_cutoff = 0.5f;
  bool operator==(const MaterialRecord&) const = default;
};

enum class Semantic : std::uint8_t {
  kPosition = 0,    ///< u16×4, xyz, w = 0
  kNormal = 1,      ///< i8×4 octahedral in xy, zw = 0; optional
  kLightMapUv = 2,  ///< u16×2 over [0,1]
  kAlbedoUv = 3,    ///< u16×2; absent: the same as the light map's
  kColor = 4,       ///< u8×4, linear, straight alpha; optional
  kJoints = 5,      ///< u16×4 palette indices; a second stream of the same semantic holds 4..7
  kWeights = 6,     ///< u8×4, all streams of a vertex sum to 255
  kTwin = 7,        ///< u16: the vertex before that all but UVs are shared with; optional
};

/// One vertex attribute: value = offset + scale × integer for the quantised semantics.
/// `bytes` is one zstd frame of what decoders/vertex_prediction.hpp leaves of the values.
struct VertexStream {
  Semantic semantic = Semantic::kPosition;
  std::uint8_t stride = 8;  ///< bytes per vertex, 2, 4 or 8
  std::array<float, 3> offset{};
  std::array<float, 3> scale{1, 1, 1};
  std::vector<std::uint8_t> bytes;
  bool operator==(const VertexStream&) const = default;
};

/// Offsets that a morph weight of 1 adds to the positions: i16×4 per vertex, value = scale ×
/// integer.
struct MorphTarget {
  std::array<float, 3> scale{1, 1, 1};
  std::vector<std::uint8_t> bytes;  ///< coded like a vertex stream, stride 8
  bool operator==(const MorphTarget&) const = default;
};

/// A triangle list of at most 65 535 vertices with one material; front faces counter-clockwise, and
/// only front faces are drawn (double-sided surfaces are two meshes' worth of triangles).
struct MeshRecord {
  std::uint32_t id = 0;
  std::string name;
  std::uint32_t material_id = 0;
  std::uint32_t vertex_count = 0;
  std::uint32_t index_count = 0;
  std::vector<VertexStream> streams;
  std::vector<std::uint8_t> indices;  ///< meshoptimizer's index codec, then zstd
  std::uint32_t first_morph_weight =
      0;  ///< this mesh's targets use weights [first, first + targets)
  std::vector<MorphTarget> morph_targets;
  bool operator==(const MeshRecord&) const = default;
};

/// One node of the joint hierarchy; parents come before their children.
struct NodeRecord {
  std::int32_t parent = -1;
  Affine local{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};  ///< where no channel animates it
  bool operator==(const NodeRecord&) const = default;
};

/// A joint as the meshes' kJoints see it: world(node) × inverse_bind.
struct PaletteEntry {
  std::uint32_t node = 0;
  Affine inverse_bind{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  bool operator==(const PaletteEntry&) const = default;
};

struct SkeletonRecord {
  std::vector<NodeRecord> nodes;
  std::vector<PaletteEntry> palette;
  std::uint32_t morph_weight_count = 0;
  bool operator==(const SkeletonRecord&) const = default;
};

enum class PoseKind : std::uint8_t {
  kJoints = 0,    ///< quantised TRS of nodes and morph weights
  kVertices = 1,  ///< quantised positions of every vertex; skeleton and morph targets unused
};
enum class ChannelTarget : std::uint8_t {
  kTranslation = 0,
  kRotation = 1,
  kScale = 2,
  kMorphWeight = 3
};

/// One animated quantity. A node that a channel or a RestTrs names gets each of T, R and S from its
/// channel, else from its RestTrs, else the identity; any other node keeps the skeleton's matrix.
struct PoseChannel {
  ChannelTarget target = ChannelTarget::kTranslation;
  std::uint32_t index = 0;  ///< node, or morph weight
  std::array<float, 3>
      offset{};  ///< value = offset + step × integer, u16; rotations: see FORMAT.md
  std::array<float, 3> step{1, 1, 1};
  bool operator==(const PoseChannel&) const = default;
};

/// The unanimated parts of a node of a pose track. Rotation is x, y, z, w, of unit length.
struct RestTrs {
  std::uint32_t node = 0;
  std::array<float, 3> translation{};
  std::array<float, 4> rotation{0, 0, 0, 1};
  std::array<float, 3> scale{1, 1, 1};
  bool operator==(const RestTrs&) const = default;
};

/// Quantisation of the vertices of one mesh (kVertices).
struct VertexRange {
  std::uint32_t mesh_id = 0;
  std::array<float, 3> offset{};
  std::array<float, 3> step{1, 1, 1};
  bool operator==(const VertexRange&) const = default;
};

/// Describes the pose packets of a clip. One packet per segment holds all its frames.
struct PoseTrackRecord {
  std::uint32_t track_id = 0;
  std::uint32_t clip_id = 0;
  PoseKind kind = PoseKind::kJoints;
  std::vector<RestTrs> rest;
  std::vector<PoseChannel> channels;
  std::vector<VertexRange> vertex_ranges;
  bool operator==(const PoseTrackRecord&) const = default;
};

enum class ModelKind : std::uint8_t { kShLightMap = 0 };

/// An appearance model: what its planes mean. Planes are numbered through its layers in order.
struct ModelRecord {
  std::uint32_t id = 0;
  std::uint32_t clip_id = 0;
  ModelKind kind = ModelKind::kShLightMap;
  std::uint8_t order = 2;     ///< SH order N; (N+1)² coefficients
  std::uint16_t width = 128;  ///< of the light map, texels
  std::uint16_t height = 128;
  std::vector<Rgb> mean;               ///< μ[n], one per coefficient
  std::int32_t prediction_plane = -1;  ///< index of s among the planes; -1: no prediction
  bool operator==(const ModelRecord&) const = default;
};

enum class Chroma : std::uint8_t {
  kLuma = 0,  ///< one plane per picture, component 0
  k420 = 1,   ///< three, of which 1 and 2 have half the width and height
  k444 = 2,
};

/// value_k contributes `value` to transfer coefficient n, channel c: the entry M[n,c,k].
struct MatrixEntry {
  std::uint8_t coefficient = 0;
  std::uint8_t channel = 0;
  float value = 0;
  bool operator==(const MatrixEntry&) const = default;
};

struct Rect {
  std::uint16_t x = 0, y = 0, width = 0, height = 0;
  bool operator==(const Rect&) const = default;
};

/// Where a plane lies in its layer's pictures, and its column of M.
struct PlaneRecord {
  std::uint8_t component = 0;  ///< component of the mantissa picture, 0..2
  Rect mantissa_rect;          ///< in samples of component 0; equal to the light map's size
  Rect exponent_rect;          ///< in samples of the exponent picture; ignored without exponents
  float scale = 1;
  std::vector<MatrixEntry> matrix;
  bool operator==(const PlaneRecord&) const = default;
};

/// A group of planes with video streams of its own. Layers are in order of importance.
struct LayerRecord {
  std::uint32_t id = 0;
  std::uint32_t model_id = 0;

  std::uint32_t mantissa_track = 0;
  std::string codec;  ///< FFmpeg's name of the codec: "h264", "mpeg4", "ffv1", "hevc", …
  std::vector<std::uint8_t> codec_private;
  std::uint16_t coded_width = 0;
  std::uint16_t coded_height = 0;
  std::uint8_t bit_depth = 8;  ///< 8 or 10
  Chroma chroma = Chroma::k420;
  bool lossless = false;
  std::uint8_t mantissa_pictures = 1;  ///< that a decoder has to keep at once: FORMAT.md, LAYR

  bool has_exponents = false;  ///< without them the exponent_* fields are ignored and not stored
  std::uint32_t exponent_track = 0;
  std::string exponent_codec;  ///< "ffv1"
  std::vector<std::uint8_t> exponent_private;
  std::uint16_t exponent_width = 0;
  std::uint16_t exponent_height = 0;
  std::uint8_t exponent_block = 1;  ///< side of the exponent block in texels: 1, 2, 4, 8, 16 or 32
  std::uint8_t exponent_pictures = 1;

  std::vector<PlaneRecord> planes;
  bool operator==(const LayerRecord&) const = default;
};

/// A run of frames that can be decoded by itself. Its chunks follow it, one for each track, in the
/// order of importance, and `chunk_bytes` says how long each record is (header and padding
/// included), so that a client can ask for only the ones it wants.
struct SegmentRecord {
  std::uint32_t index = 0;  ///< within the file, from 0
  std::uint32_t clip_id = 0;
  std::uint64_t first_frame = 0;
  std::uint32_t frame_count = 0;
  struct ChunkSize {
    std::uint32_t track_id = 0;
    std::uint64_t chunk_bytes = 0;
    bool operator==(const ChunkSize&) const = default;
  };
  std::vector<ChunkSize> chunks;
  std::uint64_t first_tick = 0;          ///< when the first frame is shown
  std::vector<std::uint32_t> durations;  ///< ticks of each frame; empty: one tick each
  bool operator==(const SegmentRecord&) const = default;
};

/// Ticks from the first frame of the segment to the end of its last.
[[nodiscard]] inline std::uint64_t duration_ticks(const SegmentRecord& segment) {
  std::uint64_t sum = segment.durations.empty() ? segment.frame_count : 0;
  for (const std::uint32_t ticks : segment.durations) sum += ticks;
  return sum;
}

/// One coded packet. Packets stand in decoding order; pts counts frames of the clip.
struct Packet {
  std::int64_t pts = 0;
  bool key = false;
  std::uint64_t offset = 0;  ///< of its bytes in ChunkRecord::data
  std::uint64_t size = 0;
  bool operator==(const Packet&) const = default;
};

/// All packets of one track in one segment.
struct ChunkRecord {
  std::uint32_t track_id = 0;
  std::uint32_t segment_index = 0;
  std::vector<Packet> packets;
  std::vector<std::uint8_t> data;
  bool operator==(const ChunkRecord&) const = default;
};

/// Memory that a chunk's packets take, used or not.
[[nodiscard]] inline std::size_t storage_bytes(const ChunkRecord& chunk) {
  return chunk.data.capacity() + chunk.packets.capacity() * sizeof(Packet);
}

struct IndexRecord {
  struct Entry {
    std::uint32_t segment_index = 0;
    std::uint32_t clip_id = 0;
    std::uint64_t first_frame = 0;
    std::uint32_t frame_count = 0;
    std::uint64_t offset = 0;  ///< of the segment record, from the start of the file
    std::uint64_t first_tick = 0;
    bool operator==(const Entry&) const = default;
  };
  std::vector<Entry> segments;
  bool operator==(const IndexRecord&) const = default;
};

/// The last record of a complete file.
struct EndRecord {
  std::uint64_t index_offset =
      0;  ///< of the index record, from the start of the file; 0: there is none
  std::uint64_t file_bytes = 0;  ///< of the whole file, this record included
  std::uint64_t copies_offset =
      0;  ///< of the first copy of a static record behind the segments; 0: there are none
  bool operator==(const EndRecord&) const = default;
};

}  // namespace relit::container
