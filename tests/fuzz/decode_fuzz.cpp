// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>

#include "container/reader.hpp"
#include "decoders/mesh.hpp"
#include "decoders/plane_decoder.hpp"
#include "decoders/pose.hpp"
#include "tests/fuzz/file_mutator.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/playing.hpp"

/// Records that no parser has checked, given to the decoders: a number of edits, the edits (which,
/// value in 16 bits), the file whose records they change. The decoders' own checks are all that
/// stands between such a record and memory. With the top bit of the number set, chunks are decoded
/// one in the place of the other, as the prefetcher does.
namespace {

using namespace relit;
using namespace relit::container;
using namespace relit::fuzz;

constexpr unsigned kMostEdits = 8;
constexpr std::uint64_t kFramesTried = 8;

template <class Values>
auto* pick(Values& values, unsigned at) {
  return values.empty() ? nullptr : &values[at % values.size()];
}

/// All but the check for misuse: with edited records it may be one.
template <class R>
bool said(const R& result) {
  if (!result) require(!result.error().message.empty());
  return static_cast<bool>(result);
}

void edit_model(ModelRecord& model, unsigned which, std::uint16_t value) {
  switch (which % 4) {
    case 0:
      model.order = static_cast<std::uint8_t>(value);
      break;
    case 1:
      model.width = value;
      break;
    case 2:
      model.height = value;
      break;
    default:
      model.mean.resize(value % 32);
  }
}

void edit_plane(PlaneRecord& plane, unsigned which, std::uint16_t value) {
  MatrixEntry* entry = pick(plane.matrix, value);
  Rect& rect = value % 2 == 0 ? plane.mantissa_rect : plane.exponent_rect;
  switch (which % 6) {
    case 0:
      plane.component = static_cast<std::uint8_t>(value);
      break;
    case 1:
      rect.x = value / 2;
      break;
    case 2:
      rect.width = value / 2;
      break;
    case 3:
      plane.scale = static_cast<float>(value) - 1;
      break;
    case 4:
      if (entry != nullptr) entry->coefficient = static_cast<std::uint8_t>(value);
      break;
    default:
      if (entry != nullptr) entry->channel = static_cast<std::uint8_t>(value);
  }
}

void edit_layer(LayerRecord& layer, unsigned which, std::uint16_t value) {
  constexpr std::size_t kMostPlanes = 300;
  switch (which % 7) {
    case 0:
      layer.bit_depth = static_cast<std::uint8_t>(value);
      break;
    case 1:
      layer.exponent_block = static_cast<std::uint8_t>(value);
      break;
    case 2:
      layer.coded_width = value;
      break;
    case 3:
      layer.chroma = static_cast<Chroma>(value % 4);
      break;
    case 4:
      layer.planes.resize(value % kMostPlanes,
                          layer.planes.empty() ? PlaneRecord{} : layer.planes.front());
      break;
    case 5:
      layer.codec_private.resize(std::size_t{value} * 64);
      break;
    default:
      if (value % 8 < 5) layer.codec.resize(value % 8);
  }
}

void edit_stream(VertexStream& stream, unsigned which, std::uint16_t value) {
  if (which % 2 == 0)
    stream.stride = static_cast<std::uint8_t>(value);
  else
    stream.semantic = static_cast<Semantic>(value % 9);
}

void edit_mesh(MeshRecord& mesh, unsigned which, std::uint16_t value) {
  const auto at =
      static_cast<std::ptrdiff_t>(value % std::max<std::size_t>(1, mesh.streams.size()));
  switch (which % 6) {
    case 0:
      mesh.vertex_count = value * 2u;
      break;
    case 1:
      mesh.index_count = value * 64u + value % 3;
      break;
    case 2:
      mesh.morph_targets.resize(value % 2048);
      break;
    case 3:
      if (!mesh.streams.empty()) mesh.streams.erase(mesh.streams.begin() + at);
      break;
    case 4:
      if (!mesh.streams.empty()) mesh.streams.push_back(VertexStream(*(mesh.streams.begin() + at)));
      break;
    default:
      if (VertexStream* stream = pick(mesh.streams, value / 8))
        edit_stream(*stream, which / 6, value);
  }
}

void edit_pose(FileContents& file, unsigned which, std::uint16_t value) {
  SkeletonRecord& skeleton = file.skeleton;
  NodeRecord* node = pick(skeleton.nodes, value / 4);
  PoseTrackRecord* track = pick(file.pose_tracks, value / 4);
  switch (which % 5) {
    case 0:
      skeleton.nodes.resize(std::size_t{value} * 2);
      break;
    case 1:
      skeleton.palette.resize(value % 64);
      break;
    case 2:
      skeleton.morph_weight_count = value * 2u;
      break;
    case 3:
      if (node != nullptr) node->parent = static_cast<std::int32_t>(value) - 2;
      break;
    default:
      if (track != nullptr) track->kind = static_cast<PoseKind>(value % 3);
  }
}

/// What an edit may change of the file's static part.
void edit(FileContents& file, unsigned which, std::uint16_t value) {
  LayerRecord* layer = pick(file.layers, which / 5);
  PlaneRecord* plane = layer != nullptr ? pick(layer->planes, value) : nullptr;
  switch (which % 5) {
    case 0:
      if (ModelRecord* model = pick(file.models, value)) edit_model(*model, which / 5, value);
      break;
    case 1:
      if (layer != nullptr) edit_layer(*layer, which / 5, value);
      break;
    case 2:
      if (plane != nullptr) edit_plane(*plane, which / 5, value);
      break;
    case 3:
      if (MeshRecord* mesh = pick(file.meshes, value)) edit_mesh(*mesh, which / 5, value);
      break;
    default:
      edit_pose(file, which / 5, value);
  }
}

void edit_chunk(SegmentRecord& segment, ChunkRecord& chunk, unsigned which, std::uint16_t value) {
  Packet* packet = pick(chunk.packets, value);
  switch (which % 7) {
    case 0:
      segment.first_frame = value;
      break;
    case 1:
      segment.frame_count = value * 32u;
      break;
    case 2:
      chunk.packets.resize(value % 64);
      break;
    case 3:
      if (packet != nullptr) packet->pts = static_cast<std::int16_t>(value);
      break;
    case 4:
      if (packet != nullptr) packet->offset = value;
      break;
    case 5:
      if (packet != nullptr) packet->key = !packet->key;
      break;
    default:
      std::swap(chunk.track_id, segment.index);
  }
}

struct Edit {
  unsigned which = 0;
  std::uint16_t value = 0;
};

struct Segments {
  std::vector<std::pair<SegmentRecord, ChunkRecord>> chunks;
};

Segments read_segments(Reader& reader) {
  Segments segments;
  SegmentRecord segment;
  while (auto record = reader.next()) {
    if (!*record) break;
    if (auto* s = std::get_if<SegmentRecord>(&(*record)->body)) segment = std::move(*s);
    if (auto* c = std::get_if<ChunkRecord>(&(*record)->body))
      segments.chunks.emplace_back(segment, std::move(*c));
  }
  return segments;
}

void decode_planes(const FileContents& file, const ModelRecord& model, const Segments& segments) {
  const auto layers = file.layers_of(model.id);
  auto decoder = decoders::PlaneDecoder::open(model, layers);
  if (!said(decoder)) return;
  for (const auto& [segment, chunk] : segments.chunks) said(decoder->add_chunk(segment, chunk));
  for (std::uint64_t i = 0; i < kFramesTried; ++i) said(decoder->frame(i * 5 % kFramesTried));
  decoder->forget_before(2);
  const auto view = decoder->frame(1);
  if (!said(view)) return;
  std::vector<float> transfer(model.mean.size() * 3 * model.width * model.height);
  said(decoders::reconstruct(view->planes(), model, layers, transfer));
}

void show(const LayerRecord& layer, const Result<const decoders::VideoFrame*>& picture) {
  if (!said(picture) || layer.has_exponents) return;
  decoders::VideoFrame mantissas(**picture);
  require(mantissas.same_picture(**picture) && mantissas.buffer_bytes() > 0);
  decoders::FrameView view;
  view.reset(1, layer.planes.size(), 1);
  view.show(layer, 0, 0, mantissas, nullptr);
  require(view.frame() == 1 && view.planes().size() == layer.planes.size());
}

void replace_chunks(const FileContents& file, const Segments& segments) {
  for (const LayerRecord& layer : file.layers) {
    const ModelRecord* model = file.find_model(layer.model_id);
    if (model == nullptr || !said(decoders::check_layer(*model, layer))) continue;
    auto track = decoders::TrackDecoder::open(decoders::mantissa_format(layer));
    if (!said(track)) continue;
    for (auto [segment, chunk] : segments.chunks) {
      if (chunk.track_id != layer.mantissa_track) continue;
      if (!said(track->replace_chunk(segment, chunk))) continue;
      require(track->has_segment_of(segment.first_frame));
      for (std::uint64_t i = 0; i < std::min<std::uint64_t>(segment.frame_count, kFramesTried); ++i)
        show(layer, track->picture(segment.first_frame + i));
    }
  }
}

void decode_poses(const FileContents& file, const Segments& segments) {
  std::vector<decoders::Mesh> meshes;
  for (const MeshRecord& record : file.meshes) {
    auto mesh = decoders::decode_mesh(record, file.skeleton.palette.size(),
                                      file.skeleton.morph_weight_count);
    if (said(mesh)) meshes.push_back(std::move(*mesh));
  }
  for (const PoseTrackRecord& record : file.pose_tracks) {
    auto track = decoders::PoseTrack::create(file.skeleton, record, meshes);
    if (!said(track)) continue;
    for (const auto& [segment, chunk] : segments.chunks)
      if (chunk.track_id == record.track_id)
        said(track->add_packet(chunk.data, segment.first_frame, segment.frame_count));
    decoders::Pose pose;
    for (const double frame : {0.0, 1.5, 3.0}) said(track->sample(frame, pose));
    require(track->memory_bytes() < std::size_t{1} << 30);
    track->forget_except(0);
    said(track->sample(0, pose));
  }
}

void decode(Input file, std::span<const Edit> edits, bool replace) {
  auto reader = Reader::open(std::make_unique<MemorySource>(file));
  if (!said(reader)) return;
  auto contents = load_static(*reader);
  if (!said(contents)) return;
  Segments segments = read_segments(*reader);
  constexpr unsigned kStatic = 200;
  for (const Edit& e : edits) {
    if (e.which < kStatic)
      edit(*contents, e.which, e.value);
    else if (auto* chunk = pick(segments.chunks, e.value / 256))
      edit_chunk(chunk->first, chunk->second, e.which - kStatic, e.value);
  }
  if (replace) return replace_chunks(*contents, segments);
  for (const ModelRecord& model : contents->models) decode_planes(*contents, model, segments);
  decode_poses(*contents, segments);
}

std::size_t prefix_of(std::uint8_t first) { return 1 + 3 * std::size_t{first % kMostEdits}; }

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  const std::size_t prefix = size > 0 ? prefix_of(data[0]) : 1;
  if (size > prefix && prefix > 1 && seed % 4 != 0) {  // mostly another edit
    data[1 + seed / 4 % (prefix - 1)] = static_cast<std::uint8_t>(seed >> 16);
    return size;
  }
  return mutate_file(data, size, max_size, seed, prefix);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Cursor input({data, size});
  const std::uint8_t first = input.u8();
  std::vector<Edit> edits(first % kMostEdits);
  for (Edit& e : edits) {
    e.which = input.u8();
    e.value = input.u16();
  }
  const Input file = input.rest();
  if (quick_to_play(file)) decode(file, edits, (first & 0x80) != 0);
  return 0;
}
