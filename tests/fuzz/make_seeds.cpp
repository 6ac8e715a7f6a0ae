// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "container/reader.hpp"
#include "container/record_codec.hpp"
#include "tests/bake_minimal/coding_clip.hpp"
#include "tests/bake_minimal/gltf_builder.hpp"
#include "tests/container/sample.hpp"
#include "tests/decoders/image_samples.hpp"
#include "tests/decoders/mesh_fixture.hpp"
#include "tests/fuzz/encoder_form.hpp"
#include "tests/fuzz/file_parts.hpp"
#include "tests/fuzz/vector_choice.hpp"
#include "tests/player/coded_file.hpp"

/// `relit-seeds FOLDER [VECTORS]` writes the first inputs of every fuzzer to FOLDER/<fuzzer>/. They
/// are made here, so that no binary corpus has to be kept; the files of VECTORS are added.
namespace {

using namespace relit;
using namespace relit::container;
using fuzz::Bytes;
using Numbers = std::initializer_list<std::uint8_t>;
using Values = std::initializer_list<std::uint16_t>;
namespace fs = std::filesystem;

class Seeds {
 public:
  explicit Seeds(fs::path root) : root_(std::move(root)) {}

  /// Once, however often the same bytes come.
  void add(const std::string& fuzzer, const std::string& name, const Bytes& bytes) {
    if (!known_.emplace(fuzzer, bytes).second) return;
    fs::create_directories(root_ / fuzzer);
    std::ofstream out(root_ / fuzzer / name, std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()),
              static_cast<std::streamsize>(bytes.size()));
    failed_ |= !out;
    ++count_;
  }
  [[nodiscard]] bool failed() const { return failed_; }
  [[nodiscard]] int count() const { return count_; }

 private:
  fs::path root_;
  std::set<std::pair<std::string, Bytes>> known_;
  bool failed_ = false;
  int count_ = 0;
};

void append(Bytes& out, const Bytes& bytes) { out.insert(out.end(), bytes.begin(), bytes.end()); }

Bytes with_prefix(Bytes prefix, const Bytes& bytes) {
  append(prefix, bytes);
  return prefix;
}

/// Behind its length in 16 bits, as Cursor::piece() takes it.
void append_piece(Bytes& out, const Bytes& bytes) {
  out.push_back(static_cast<std::uint8_t>(bytes.size() & 255));
  out.push_back(static_cast<std::uint8_t>(bytes.size() >> 8));
  append(out, bytes);
}

/// The letter by which record_fuzz knows a type; 0: none.
std::uint8_t letter_of(RecordType type) {
  constexpr char kLetters[] = "hcimgspalSIE";  // by order_of()
  return static_cast<std::uint8_t>(type == types::kChunk ? 'C' : kLetters[order_of(type)]);
}

void add_records(Seeds& seeds, const Bytes& file, const std::string& name) {
  int number = 0;
  for (const fuzz::Part& part : fuzz::split(file)) {
    if (part.payload.size() > 4096 || part.flags != 0) continue;
    seeds.add("record_fuzz", name + "_" + std::to_string(number++),
              with_prefix({letter_of(part.type)}, part.payload));
  }
}

/// The ways in which the fuzzers of files may take one; the first byte of their inputs.
constexpr std::array<std::uint8_t, 4> kReadingWays{0, 17, 34, 56};
constexpr std::array<std::uint8_t, 5> kPlayingWays{0, 1, 2, 8, 4};
constexpr std::array<std::uint8_t, 3> kCheckingWays{0, 1, 2};  // fields, payloads, recovery
constexpr std::array<std::uint8_t, 4> kStarvingWays{0, 17, 34, 128};

void add_way(Seeds& seeds, const char* fuzzer, const Bytes& file, const std::string& name,
             std::uint8_t how) {
  const bool starving = fuzzer == std::string_view("alloc_fuzz");  // after 40 allocations
  seeds.add(fuzzer, name + "_" + std::to_string(how),
            with_prefix(starving ? Bytes{how, 40, 0} : Bytes{how}, file));
}

/// What the decoders see of it.
void add_decoded(Seeds& seeds, const Bytes& file, const std::string& name) {
  for (const std::uint8_t how : Numbers{0, 0x80}) add_way(seeds, "decode_fuzz", file, name, how);
}

/// A whole file in every way.
void add_file(Seeds& seeds, const Bytes& file, const std::string& name) {
  for (const std::uint8_t how : kReadingWays) add_way(seeds, "container_fuzz", file, name, how);
  for (const std::uint8_t how : kPlayingWays) add_way(seeds, "play_fuzz", file, name, how);
  for (const std::uint8_t how : kCheckingWays) add_way(seeds, "validate_fuzz", file, name, how);
  for (const std::uint8_t how : kStarvingWays) add_way(seeds, "alloc_fuzz", file, name, how);
  add_decoded(seeds, file, name);
  add_records(seeds, file, name);
}

/// One of many files, in one way for each fuzzer: another for each number.
void add_once(Seeds& seeds, const Bytes& file, const std::string& name, std::size_t number) {
  add_way(seeds, "container_fuzz", file, name, kReadingWays[number % kReadingWays.size()]);
  add_way(seeds, "play_fuzz", file, name, kPlayingWays[number % kPlayingWays.size()]);
  add_way(seeds, "alloc_fuzz", file, name, kStarvingWays[number % kStarvingWays.size()]);
  for (const std::uint8_t how : {kCheckingWays[1], kCheckingWays[2]})
    add_way(seeds, "validate_fuzz", file, name, how);
}

/// Whether decode_fuzz's edit changes a layer or a plane, of which one file has more than the
/// other.
bool is_of_layers(std::uint8_t which) { return which % 5 == 1 || which % 5 == 2; }

/// One file with edits that decode_fuzz knows, and values around the limits of most of them. `all`:
/// each; else those of layers and chunks.
void add_edits(Seeds& seeds, const Bytes& file, const std::string& name, bool all) {
  constexpr std::uint8_t kStatic = 60, kChunk = 200, kChunkEnd = 207;
  const auto add = [&](std::uint8_t how, std::uint8_t which, std::uint16_t value) {
    seeds.add("decode_fuzz",
              name + "_edit" + std::to_string(how) + "_" + std::to_string(which) + "_" +
                  std::to_string(value),
              with_prefix({how, which, static_cast<std::uint8_t>(value & 255),
                           static_cast<std::uint8_t>(value >> 8)},
                          file));
  };
  constexpr std::array<std::uint16_t, 4> kOthers{1, 5, 270, 65535};
  for (std::uint8_t which = 0; which < kStatic; ++which) {
    if (!all && !is_of_layers(which)) continue;
    for (const std::uint16_t value : Values{0, 3, 40000, kOthers[which % kOthers.size()]})
      add(1, which, value);
  }
  for (std::uint8_t which = kChunk; which < kChunkEnd; ++which)
    for (const std::uint16_t value : Values{0, 1, 6, 270, 40000, 65535})
      for (const std::uint8_t how : Numbers{1, 0x81}) add(how, which, value);
}

Bytes unpacked(const Bytes& frame) {
  Bytes plain(ZSTD_getFrameContentSize(frame.data(), frame.size()));
  ZSTD_decompress(plain.data(), plain.size(), frame.data(), frame.size());
  return plain;
}

/// Compressed as in a file, and with the streams unpacked for the fuzzer to compress.
void add_mesh(Seeds& seeds, MeshRecord mesh, const std::string& name) {
  seeds.add("mesh_fuzz", name, with_prefix({0, 4, 4}, serialize(mesh)));
  for (auto& stream : mesh.streams) stream.bytes = unpacked(stream.bytes);
  for (auto& target : mesh.morph_targets) target.bytes = unpacked(target.bytes);
  mesh.indices = unpacked(mesh.indices);
  seeds.add("mesh_fuzz", name + "_plain", with_prefix({1, 4, 4}, serialize(mesh)));
}

void add_meshes(Seeds& seeds) {
  for (const std::size_t influences : Numbers{0, 1, 2}) {
    MeshRecord mesh = test::quad(influences);
    add_mesh(seeds, mesh, "quad" + std::to_string(influences));
    using test::stream;
    const std::vector<std::uint8_t> normals{127, 0, 0, 0, 0, 127, 0, 0, 0, 0, 0, 0, 129, 129, 0, 0};
    const std::vector<std::uint16_t> uv{0, 0, 9, 9, 99, 999, 9999, 65535};
    mesh.streams.push_back(stream(Semantic::kNormal, 4, normals));
    mesh.streams.push_back(stream(Semantic::kAlbedoUv, 4, uv, {}, {1e-3f, 1e-3f, 1}));
    mesh.streams.push_back(stream(Semantic::kColor, 4, normals));
    const std::vector<std::uint16_t> offsets(16, 7);
    mesh.morph_targets = {{{0.5f, 0.25f, 0.125f}, test::vertex_bytes(test::bytes_of(offsets), 8)}};
    add_mesh(seeds, mesh, "full" + std::to_string(influences));
    // No vertex has a twin, so that the other streams still fit.
    const Bytes twins(8, 0);
    mesh.streams.push_back({Semantic::kTwin, 2, {}, {1, 1, 1}, test::zstd(twins)});
    add_mesh(seeds, mesh, "twins" + std::to_string(influences));
  }
}

Bytes pose_seed(const SkeletonRecord& skeleton, const PoseTrackRecord& track, std::size_t values,
                std::uint8_t mode, bool plain) {
  Bytes out{static_cast<std::uint8_t>(plain ? 1 : 0)};
  append_piece(out, serialize(skeleton));
  append_piece(out, serialize(track));
  constexpr std::uint8_t kFrames = 3;
  for (std::uint8_t first = 0; first < 2 * kFrames; first = first + kFrames) {
    Bytes packet(1 + 2 * values * kFrames, static_cast<std::uint8_t>(3 + first));
    packet[0] = mode;
    out.push_back(first);
    out.push_back(kFrames);
    append_piece(out, plain ? packet : test::zstd(packet));
  }
  return out;
}

void add_poses(Seeds& seeds) {
  for (const bool plain : {false, true}) {
    const std::string suffix = plain ? "_plain" : "";
    for (const std::uint8_t mode : Numbers{0, 1, 2})
      seeds.add("pose_fuzz", "joints" + std::to_string(mode) + suffix,
                pose_seed(sample::skeleton(), sample::pose_track(), 7, mode, plain));
    for (const std::uint8_t mode : Numbers{0, 5, 6})
      seeds.add("pose_fuzz", "vertices" + std::to_string(mode) + suffix,
                pose_seed({}, sample::vertex_track(), 9, mode, plain));
  }
}

void add_images(Seeds& seeds) {
  using test::PngSpec;
  const Bytes texels(64, 90);
  const std::vector<PngSpec> pictures{{4, 4, 8, 6, texels, {}, {}},
                                      {4, 4, 8, 2, Bytes(48, 7), {}, {}},
                                      {8, 8, 1, 0, Bytes(8, 0xA5), {}, {}},
                                      {4, 4, 16, 4, texels, {}, {}},
                                      {4, 2, 8, 3, Bytes(8, 1), {1, 2, 3, 4, 5, 6}, {9, 8}}};
  int number = 0;
  for (const PngSpec& spec : pictures)
    seeds.add("image_fuzz", "png" + std::to_string(number++),
              with_prefix({1}, test::make_png(spec)));
  for (const auto& components : {std::vector<int>{90}, {90, 128, 30}, {10, 20, 30, 40}})
    seeds.add("image_fuzz", "jpeg" + std::to_string(components.size()),
              with_prefix({0}, test::make_flat_jpeg(components)));
}

/// By the numbers that video_fuzz gives them.
constexpr std::array<const char*, 6> kCodecs{"h264", "hevc", "mpeg4", "ffv1", "vp9", "av1"};

/// codec, size, flags, codec_private, packets: what video_fuzz takes. `encoders`: in their form.
Bytes video_seed(std::uint8_t codec, const LayerRecord& layer, const ChunkRecord& chunk,
                 bool exponents, bool encoders = false) {
  const std::string_view name = kCodecs[codec % kCodecs.size()];
  const auto flags = static_cast<std::uint8_t>(
      (exponents ? 8u
                 : static_cast<unsigned>(layer.chroma) | (layer.bit_depth > 8 ? 4u : 0u) | 8u) |
      (encoders ? 16u : 0u) | (codec >= kCodecs.size() ? 32u : 0u));
  const auto side = [](std::uint16_t v) { return static_cast<std::uint8_t>(v - 1); };
  Bytes out{codec, side(exponents ? layer.exponent_width : layer.coded_width),
            side(exponents ? layer.exponent_height : layer.coded_height), flags};
  const Bytes& codec_private = exponents ? layer.exponent_private : layer.codec_private;
  append_piece(out, encoders ? fuzz::encoder_private(name, codec_private) : codec_private);
  for (const Packet& packet : chunk.packets) {
    const auto bytes = fuzz::Input(chunk.data).subspan(packet.offset, packet.size);
    append_piece(out, encoders ? fuzz::encoder_packet(name, bytes) : fuzz::copy(bytes));
  }
  return out;
}

/// The first chunk of each mantissa track, as stored, as encoders give it, and for decoders by
/// name: one of the codec, one of another.
void add_streams(Seeds& seeds, const Bytes& file, const std::string& name) {
  auto reader = Reader::open(std::make_unique<MemorySource>(file));
  if (!reader) return;
  const auto contents = load_static(*reader);
  if (!contents) return;
  auto layers = contents->layers;
  while (const auto record = reader->next()) {
    if (!*record) return;
    const auto* chunk = std::get_if<ChunkRecord>(&(*record)->body);
    const auto layer = std::ranges::find_if(layers, [&](const LayerRecord& l) {
      return chunk != nullptr && chunk->track_id == l.mantissa_track;
    });
    if (layer == layers.end()) continue;
    const auto codec = std::ranges::find(kCodecs, layer->codec);
    if (codec == kCodecs.end() || layer->coded_width > 128 || layer->coded_height > 128) continue;
    const auto number = static_cast<std::uint8_t>(codec - kCodecs.begin());
    const std::string track = name + "_" + std::to_string(layer->mantissa_track);
    seeds.add("video_fuzz", track, video_seed(number, *layer, *chunk, false));
    seeds.add("video_fuzz", track + "_encoders", video_seed(number, *layer, *chunk, false, true));
    for (const unsigned decoder : {unsigned{number}, number + 1u}) {
      const auto both = static_cast<std::uint8_t>(number + kCodecs.size() * (decoder % 6 + 6));
      seeds.add("video_fuzz", track + "_by_name" + std::to_string(decoder),
                video_seed(both, *layer, *chunk, false));
    }
    layers.erase(layer);
  }
}

/// A file of the encoded planes, with meshes and poses of the small sample.
Bytes coded_file(const bake::test::Encoded& encoded, std::uint32_t frames) {
  MemorySink sink;
  auto writer = Writer::create(sink, "relit-seeds");
  if (!writer) return {};
  bool good = static_cast<bool>(
      writer->add(ClipRecord{3, "c", {25, 1}, frames, true, {-9, -9, -9}, {9, 9, 9}, frames}));
  MeshRecord mesh = test::quad(std::size_t{0});
  mesh.material_id = 9;
  MaterialRecord material;
  material.id = 9;
  good = good && writer->add(material) && writer->add(mesh);
  PoseTrackRecord track;
  track.track_id = 1;
  track.clip_id = 3;
  good = good && writer->add(track) && writer->add(encoded.model);
  for (const auto& layer : encoded.layers) good = good && writer->add(layer);
  for (const auto& s : encoded.segments) {
    auto chunks = s.chunks;
    ChunkRecord pose;
    pose.track_id = 1;
    pose.data = test::zstd(Bytes{0});
    pose.packets = {{static_cast<std::int64_t>(s.segment.first_frame), true, 0, pose.data.size()}};
    chunks.push_back(pose);
    good = good && writer->write_segment({3, s.segment.first_frame, s.segment.frame_count}, chunks);
  }
  good = good && writer->finish();
  return good ? sink.take() : Bytes{};
}

struct VideoCase {
  const char* codec;
  int bits;
  Chroma chroma;
  int block;
  bool lossless;
};

bool add_video(Seeds& seeds, std::uint8_t number, const VideoCase& video) {
  constexpr int kFrames = 4;
  auto options = bake::test::quick(video.codec, video.bits, video.chroma, video.block, 0);
  options.lossless = video.lossless;
  options.segment_frames = 2;
  const auto clip = bake::test::smooth_clip(1, 32, 32, kFrames);
  const auto encoded = bake::test::encode(clip, options);
  if (!encoded) {
    std::fprintf(stderr, "no %s: %s\n", video.codec, encoded.error().message.c_str());
    return false;
  }
  const std::string name = std::string(video.codec) + "_" + std::to_string(video.bits) + "_" +
                           std::to_string(static_cast<int>(video.chroma));
  const LayerRecord& layer = encoded->layers.front();
  for (const ChunkRecord& chunk : encoded->segments.front().chunks) {
    if (chunk.track_id == layer.mantissa_track)
      seeds.add("video_fuzz", name, video_seed(number, layer, chunk, false));
    if (layer.has_exponents && chunk.track_id == layer.exponent_track)
      seeds.add("video_fuzz", name + "_exponents", video_seed(3, layer, chunk, true));
  }
  const Bytes file = coded_file(*encoded, kFrames);
  if (file.empty()) return false;
  add_file(seeds, file, name);
  add_streams(seeds, file, name);
  return true;
}

bool add_videos(Seeds& seeds) {
  const Chroma luma = Chroma::kLuma, c420 = Chroma::k420, c444 = Chroma::k444;
  // Encoders that are not installed are passed over; these two every libavcodec has.
  const bool good = add_video(seeds, 2, {"mpeg4", 8, c420, 8, false}) &&
                    add_video(seeds, 3, {"ffv1", 10, c444, 4, true});
  add_video(seeds, 0, {"h264", 10, c420, 0, false});
  add_video(seeds, 0, {"h264", 8, c444, 8, false});
  add_video(seeds, 1, {"hevc", 8, c420, 8, false});
  add_video(seeds, 3, {"ffv1", 8, luma, 1, true});
  add_video(seeds, 4, {"vp9", 8, c420, 0, false});
  add_video(seeds, 5, {"av1", 8, c420, 0, false});
  return good;
}

Bytes text(const std::string& s) { return {s.begin(), s.end()}; }

Bytes read(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void add_lights(Seeds& seeds) {
  seeds.add("light_fuzz", "json1", text("j{\"sh\": [[1, 2.5, -3e-2]]}"));
  seeds.add("light_fuzz", "json4",
            text("j{\"sh\": [[1,1,1],[0,0.5,0],[0,0,1],[0.25,0,0]], \"name\": \"x\"}"));
  seeds.add(
      "light_fuzz", "json_keys",
      text("j{\"loop\": true, \"interpolation\": \"step\", \"period_s\": 3,\n"
           "\"keys\": [{\"time_s\": 0, \"sh\": [[1,1,1]]}, {\"time_s\": 2, \"sh\": [[2,0,1]]}]}"));
  const std::string grid = "\"origin\": [0,-1,0.5], \"spacing\": [1,2,0.5], \"size\": [2,1,1]";
  seeds.add("light_fuzz", "json_probes",
            text("j{\"probes\": {" + grid + ", \"sh\": [[[1,1,1]], [[2,0,-1]]]}}"));
  seeds.add("light_fuzz", "json_both",
            text("j{\"probes\": {" + grid + "}, \"interpolation\": \"linear\", \"keys\": [" +
                 "{\"time_s\": -1.5, \"sh\": [[[1,1,1]], [[2,0,-1]]]}," +
                 "{\"time_s\": 1e2, \"sh\": [[[1,1,1]], [[2,0,-1]]]}]}"));
  const std::string header = "h#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n";
  std::string flat = header + "-Y 2 +X 4\n";
  for (int i = 0; i < 8; ++i) flat += std::string("\x80\x40\x90", 3) + static_cast<char>(120 + i);
  seeds.add("light_fuzz", "hdr_flat", text(flat));
  std::string coded = header + "-Y 2 +X 16\n";
  for (int y = 0; y < 2; ++y) {
    coded += std::string("\x02\x02\x00\x10", 4);
    for (int c = 0; c < 3; ++c) coded += "\x90\x81";  // a run of 16
    coded +=
        std::string("\x08\x80\x80\x80\x80\x80\x80\x80\x80", 9) + "\x88\x82";  // 8 and a run of 8
  }
  seeds.add("light_fuzz", "hdr_coded", text(coded));
}

template <class T>
void append_le(Bytes& out, T value) {
  for (std::size_t i = 0; i < sizeof value; ++i)
    out.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * i)));
}

void append_attribute(Bytes& out, const std::string& name, const std::string& type,
                      const Bytes& value) {
  append(out, text(name + '\0' + type + '\0'));
  append_le<std::uint32_t>(out, static_cast<std::uint32_t>(value.size()));
  append(out, value);
}

/// An uncompressed scan-line OpenEXR of half floats: 4×2, all pixels 1.
Bytes make_exr() {
  constexpr std::uint32_t kWidth = 4, kHeight = 2;
  Bytes out{0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0};
  Bytes channels;
  for (const char* name : {"B", "G", "R"}) {
    append(channels, text(std::string(name) + '\0'));
    for (const std::uint32_t v : {1u, 0u, 1u, 1u}) append_le(channels, v);
  }
  channels.push_back(0);
  Bytes box;
  for (const std::uint32_t v : {0u, 0u, kWidth - 1, kHeight - 1}) append_le(box, v);
  append_attribute(out, "channels", "chlist", channels);
  append_attribute(out, "compression", "compression", {0});
  append_attribute(out, "dataWindow", "box2i", box);
  append_attribute(out, "displayWindow", "box2i", box);
  append_attribute(out, "lineOrder", "lineOrder", {0});
  append_attribute(out, "pixelAspectRatio", "float", {0, 0, 0x80, 0x3f});
  append_attribute(out, "screenWindowCenter", "v2f", Bytes(8, 0));
  append_attribute(out, "screenWindowWidth", "float", {0, 0, 0x80, 0x3f});
  out.push_back(0);
  constexpr std::uint32_t kLineBytes = kWidth * 3 * 2;
  const std::size_t lines = out.size() + 8 * kHeight;
  for (std::uint32_t y = 0; y < kHeight; ++y)
    append_le<std::uint64_t>(out, lines + std::uint64_t{y} * (8 + kLineBytes));
  for (std::uint32_t y = 0; y < kHeight; ++y) {
    append_le(out, y);
    append_le(out, kLineBytes);
    for (std::uint32_t i = 0; i < kLineBytes / 2; ++i) append_le<std::uint16_t>(out, 0x3c00);
  }
  return out;
}

void add_models(Seeds& seeds) {
  using test::GltfBuilder;
  const GltfBuilder plain = test::file_with(test::triangle());
  seeds.add("gltf_fuzz", "plain.glb", plain.glb());
  seeds.add("gltf_fuzz", "plain.gltf", text(plain.gltf()));
  GltfBuilder full;
  auto spec = test::triangle();
  spec.colors.assign(12, 0.5f);
  spec.joints.assign(12, 0);
  spec.weights = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
  spec.morph_positions = {std::vector<float>(9, 0.25f)};
  const Bytes png = test::make_rgba_png(1, 1, Bytes(4, 200));
  const int texture = full.add_texture(png, "image/png", {{"wrapS", 33071}});
  spec.material =
      full.add_material({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}},
                         {"doubleSided", true}});
  const int mesh = full.add_mesh({spec}, "m");
  const int bone = full.add_node({{"rotation", {0, 0, 0, 1}}});
  const int skin = full.add_skin({bone});
  full.add_node({{"mesh", mesh}, {"skin", skin}});
  full.add_animation({{bone, "rotation", {0, 1}, {0, 0, 0, 1, 0, 0, 1, 0}, "LINEAR"},
                      {bone, "translation", {0, 1}, {0, 0, 0, 1, 1, 1}, "STEP"},
                      {1, "weights", {0, 1}, {0, 1}, "LINEAR"}},
                     "a");
  seeds.add("gltf_fuzz", "full.glb", full.glb());
  seeds.add("gltf_fuzz", "full.gltf", text(full.gltf()));
}

void add_vectors(Seeds& seeds, const fs::path& folder) {
  constexpr std::uintmax_t kMostBytes = 1 << 16;
  fuzz::VectorChoice choice;
  std::size_t chosen = 0;
  for (const fs::path& path : fuzz::relit_files(folder)) {
    if (fs::file_size(path) > kMostBytes) continue;
    const Bytes file = read(path);
    const std::string name = path.stem().string();
    // What is wrong with a payload has one finding, and a line of code for each reason.
    const bool of_payloads = name.starts_with("mesh") || name.starts_with("pose") ||
                             name.starts_with("packet") || name.starts_with("skeleton");
    if (choice.is_new(path))
      add_once(seeds, file, name, chosen++);
    else if (of_payloads)
      add_way(seeds, "validate_fuzz", file, name, kCheckingWays[1]);
    if (name.starts_with("rig")) add_way(seeds, "play_fuzz", file, name, kPlayingWays[0]);
    if (name.starts_with("durations")) add_way(seeds, "play_fuzz", file, name, kPlayingWays[4]);
    add_records(seeds, file, name);
    const bool coded = name.starts_with("coding") || name.starts_with("packets-b");
    if (coded) add_streams(seeds, file, name);
    // Of all others the decoders see nothing new.
    if (coded || name.starts_with("exponents") || name.starts_with("rig"))
      add_decoded(seeds, file, name);
    if (name == "rig-morph") add_edits(seeds, file, name, true);
  }
}

void add_files(Seeds& seeds) {
  add_file(seeds, sample::file(), "sample");
  for (const bool exponents : {false, true}) {
    for (const char* codec : {"ffv1", "mpeg4"}) {
      const Bytes file = player::test::coded_file({codec, exponents, exponents, !exponents});
      const std::string name = std::string("small_") + codec + (exponents ? "_exponents" : "");
      add_file(seeds, file, name);
      if (exponents && codec == std::string_view("ffv1")) add_edits(seeds, file, name, false);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3) {
    std::fprintf(stderr, "usage: relit-seeds FOLDER [FOLDER OF .relit FILES]\n");
    return 2;
  }
  Seeds seeds(argv[1]);
  add_files(seeds);
  add_meshes(seeds);
  add_poses(seeds);
  add_images(seeds);
  const bool coded = add_videos(seeds);
  add_lights(seeds);
  seeds.add("light_fuzz", "exr", with_prefix({'e'}, make_exr()));
  add_models(seeds);
  if (argc == 3) add_vectors(seeds, argv[2]);
  std::printf("%d seeds\n", seeds.count());
  return seeds.failed() || !coded ? 1 : 0;
}
