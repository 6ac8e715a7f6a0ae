// SPDX-License-Identifier: MIT
#include "tests/container/sample.hpp"

#include <stdlib.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

namespace relit::container::sample {
namespace {

void must(const Status& status) {
  if (!status) throw std::runtime_error(status.error().message);
}

}  // namespace

ClipRecord clip(std::uint32_t id, std::uint64_t frames) {
  return {id, "walk äö", {30000, 1001}, frames, true, {-1, 0, -2.5f}, {1, 1.75f, 2}, frames};
}

ImageRecord image() { return {3, "image/png", {0x89, 'P', 'N', 'G', 1, 2, 3}}; }

MaterialRecord material() {
  return {9,     "skin",           {0.5f, 0.25f, 1, 0.75f},
          3,     Wrap::kClamp,     Wrap::kMirror,
          false, AlphaMode::kMask, 0.25f};
}

MeshRecord mesh() {
  MeshRecord m;
  m.id = 11;
  m.name = "body";
  m.material_id = 9;
  m.vertex_count = 3;
  m.index_count = 3;
  m.streams = {{Semantic::kPosition, 8, {-1, 0, 1}, {1e-4f, 2e-4f, 0}, {1, 2, 3}},
               {Semantic::kNormal, 4, {}, {1, 1, 1}, {4}},
               {Semantic::kLightMapUv, 4, {}, {1, 1, 1}, {5, 6}},
               {Semantic::kJoints, 8, {}, {1, 1, 1}, {7}},
               {Semantic::kWeights, 4, {}, {1, 1, 1}, {8}}};
  m.indices = {0xE1, 0, 1, 2};
  m.first_morph_weight = 1;
  m.morph_targets = {{{0.5f, 0.25f, 0.125f}, {9, 9}}};
  return m;
}

SkeletonRecord skeleton() {
  SkeletonRecord s;
  s.nodes = {{-1, {1, 0, 0, 0.5f, 0, 1, 0, 0, 0, 0, 1, 0}}, {0, {}}};
  s.palette = {{1, {}}, {0, {}}};
  s.morph_weight_count = 2;
  return s;
}

PoseTrackRecord pose_track() {
  PoseTrackRecord p;
  p.track_id = 1;
  p.clip_id = 7;
  p.rest = {{1, {0, 1, 0}, {0, 0, 0, 1}, {1, -1, 1}}};
  p.channels = {{ChannelTarget::kRotation, 1, {}, {1, 1, 1}},
                {ChannelTarget::kTranslation, 1, {-1, -1, -1}, {1e-5f, 1e-5f, 0}},
                {ChannelTarget::kMorphWeight, 1, {}, {1e-4f, 0, 0}}};
  return p;
}

PoseTrackRecord vertex_track() {
  PoseTrackRecord p;
  p.track_id = 1;
  p.clip_id = 7;
  p.kind = PoseKind::kVertices;
  p.vertex_ranges = {{11, {-1, -1, -1}, {1e-4f, 1e-4f, 1e-4f}}};
  return p;
}

ModelRecord model() {
  ModelRecord m;
  m.id = 20;
  m.clip_id = 7;
  m.order = 1;
  m.width = 12;
  m.height = 10;
  m.mean = {{0.1f, 0.2f, 0.3f}, {}, {-0.5f, 0, 0}, {}};
  return m;
}

LayerRecord layer() {
  LayerRecord l;
  l.id = 30;
  l.model_id = 20;
  l.mantissa_track = 2;
  l.codec = "h264";
  l.codec_private = {1, 100, 0, 31};
  l.coded_width = 32;
  l.coded_height = 16;
  l.chroma = Chroma::k420;
  l.has_exponents = true;
  l.exponent_track = 3;
  l.exponent_codec = "ffv1";
  l.exponent_private = {2, 3};
  l.exponent_width = 4;
  l.exponent_height = 3;
  l.exponent_block = 4;
  l.planes = {
      {0, {16, 0, 12, 10}, {1, 0, 3, 3}, 0.25f, {{0, 0, 1}, {0, 1, 1}, {0, 2, 1}}},
      {1, {16, 0, 12, 10}, {1, 0, 3, 3}, 0.25f, {{0, 0, 1}, {0, 2, -1}}},
      {2, {16, 0, 12, 10}, {1, 0, 3, 3}, 0.25f, {{0, 0, -1}, {0, 1, 1}, {0, 2, -1}}},
  };
  return l;
}

LayerRecord second_layer() {
  LayerRecord l;
  l.id = 31;
  l.model_id = 20;
  l.mantissa_track = 4;
  l.codec = "hevc";
  l.coded_width = 48;
  l.coded_height = 16;
  l.bit_depth = 10;
  l.chroma = Chroma::kLuma;
  l.lossless = true;
  l.planes = {{0, {1, 3, 12, 10}, {}, 1e-3f, {{3, 2, -0.125f}}}, {0, {13, 3, 12, 10}, {}, 2, {}}};
  return l;
}

ChunkRecord chunk(std::uint32_t track, std::uint64_t first_frame, std::uint32_t frame_count) {
  ChunkRecord c;
  c.track_id = track;
  for (std::uint32_t i = 0; i < frame_count; ++i) {
    const std::uint64_t size = 3 + track + i;
    c.packets.push_back({static_cast<std::int64_t>(first_frame + i), i == 0, c.data.size(), size});
    for (std::uint64_t k = 0; k < size; ++k)
      c.data.push_back(static_cast<std::uint8_t>(31 * track + 7 * (first_frame + i) + k));
  }
  return c;
}

std::vector<ChunkRecord> chunks(std::uint64_t first_frame, std::uint32_t frame_count) {
  ChunkRecord pose = chunk(1, first_frame, 1);
  return {pose, chunk(2, first_frame, frame_count), chunk(3, first_frame, 1),
          chunk(4, first_frame, frame_count)};
}

void add_static(Writer& writer) {
  must(writer.add(clip()));
  must(writer.add(image()));
  must(writer.add(material()));
  must(writer.add(mesh()));
  must(writer.add(skeleton()));
  must(writer.add(pose_track()));
  must(writer.add(model()));
  must(writer.add(layer()));
  must(writer.add(second_layer()));
}

Bytes file() {
  MemorySink sink;
  auto writer = Writer::create(sink, "sample 1");
  if (!writer) throw std::runtime_error(writer.error().message);
  add_static(*writer);
  must(writer->write_segment({7, 0, 2}, chunks(0, 2)));
  must(writer->write_segment({7, 2, 2}, chunks(2, 2)));
  must(writer->write_segment({7, 4, 1}, chunks(4, 1)));
  must(writer->finish());
  return sink.take();
}

Result<std::size_t> Pipe::read(std::span<std::uint8_t> out) {
  const std::size_t n = std::min({out.size(), step_, bytes_.size() - position_});
  std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(position_), n, out.begin());
  position_ += n;
  return n;
}

std::unique_ptr<ByteSource> memory(Bytes bytes) {
  return std::make_unique<MemorySource>(std::move(bytes));
}

Result<Everything> read_everything(std::unique_ptr<ByteSource> source,
                                   const ReaderOptions& options) {
  RELIT_ASSIGN(auto reader, Reader::open(std::move(source), options));
  Everything all;
  RELIT_ASSIGN(all.contents, load_static(reader));
  for (;;) {
    auto record = reader.next();
    if (!record) {
      all.errors.push_back(record.error());
      if (reader.can_continue()) continue;
      auto found = reader.resync();
      if (found && *found) continue;
      break;
    }
    if (!*record) break;
    all.rest.push_back(std::move((**record).body));
  }
  all.finished = reader.finished();
  all.loss = reader.loss();
  return all;
}

bool same(const FileContents& a, const FileContents& b) {
  return a.header == b.header && a.clips == b.clips && a.images == b.images &&
         a.materials == b.materials && a.meshes == b.meshes && a.skeleton == b.skeleton &&
         a.pose_tracks == b.pose_tracks && a.models == b.models && a.layers == b.layers;
}

bool same(const Everything& a, const Everything& b) {
  return same(a.contents, b.contents) && a.rest == b.rest && a.finished == b.finished &&
         a.errors.size() == b.errors.size();
}

namespace {

RecordHeader header_at(const Bytes& file, std::uint64_t offset) {
  const auto bytes = std::span(file).subspan(offset).first<kRecordHeaderBytes>();
  auto header = decode_header(bytes);
  if (!header) throw std::runtime_error(header.error().message);
  return *header;
}

}  // namespace

RecordType type_at(const Bytes& file, std::uint64_t offset) { return header_at(file, offset).type; }

std::vector<std::uint64_t> record_offsets(const Bytes& file) {
  std::vector<std::uint64_t> offsets;
  for (std::uint64_t at = kSignature.size(); at < file.size();) {
    offsets.push_back(at);
    at += record_bytes(header_at(file, at).payload_bytes);
  }
  return offsets;
}

std::uint64_t offset_of(const Bytes& file, RecordType type, int n) {
  for (const auto offset : record_offsets(file))
    if (type_at(file, offset) == type && n-- == 0) return offset;
  throw std::runtime_error("no such record");
}

Bytes with_inserted(const Bytes& file, std::uint64_t offset, const Bytes& bytes) {
  Bytes result = file;
  result.insert(result.begin() + static_cast<std::ptrdiff_t>(offset), bytes.begin(), bytes.end());
  return result;
}

TemporaryDirectory::TemporaryDirectory() {
  auto pattern = (std::filesystem::temp_directory_path() / "relit-test-XXXXXX").string();
  if (::mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary directory");
  root_ = pattern;
}

TemporaryDirectory::~TemporaryDirectory() {
  std::error_code ignored;
  std::filesystem::remove_all(root_, ignored);
}

std::vector<std::string> TemporaryDirectory::names() const {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(root_))
    names.push_back(entry.path().filename().string());
  std::ranges::sort(names);
  return names;
}

}  // namespace relit::container::sample
