// SPDX-License-Identifier: MIT
#include "tests/conformance/frames.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <vector>

#include "container/framing.hpp"
#include "container/reader.hpp"
#include "decoders/mesh.hpp"
#include "decoders/plane_decoder.hpp"
#include "decoders/pose.hpp"
#include "decoders/texel_normals.hpp"

namespace relit::conformance {

using namespace container;
using nlohmann::ordered_json;

namespace {

/// A number as short as it can be written without losing the float.
ordered_json number(float value) {
  std::array<char, 32> text{};
  std::to_chars(text.data(), text.data() + text.size() - 1, value);
  return std::strtod(text.data(), nullptr);
}

/// CRC-32 of the samples row by row, two little-endian bytes each above 8 bits.
std::string hash(const SampleView& view) {
  std::vector<std::uint8_t> bytes;
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      const int sample = view.at(x, y);
      bytes.push_back(static_cast<std::uint8_t>(sample & 255));
      if (view.bytes_per_sample == 2) bytes.push_back(static_cast<std::uint8_t>(sample >> 8));
    }
  }
  std::array<char, 9> text{};
  std::snprintf(text.data(), text.size(), "%08x", static_cast<unsigned>(crc32(bytes)));
  return text.data();
}

ordered_json plane_json(const PlaneView& plane) {
  if (plane.mantissa.empty()) return nullptr;
  return plane.exponent.empty() ? hash(plane.mantissa)
                                : hash(plane.mantissa) + ":" + hash(plane.exponent);
}

/// A model with its decoders, or a clip's poses.
struct ModelTracks {
  ModelRecord model;
  std::vector<LayerRecord> layers;
  decoders::PlaneDecoder decoder;
};

struct ClipPoses {
  PoseTrackRecord record;
  decoders::PoseTrack track;
  std::vector<bool> known;  ///< by frame
};

struct Decoding {
  FileContents contents;
  std::vector<decoders::Mesh> meshes;
  std::vector<ModelTracks> models;
  std::vector<ClipPoses> poses;
};

Result<Decoding> open_decoders(Reader& reader) {
  Decoding d;
  RELIT_ASSIGN(d.contents, load_static(reader));
  for (const MeshRecord& record : d.contents.meshes) {
    RELIT_ASSIGN(auto mesh, decoders::decode_mesh(record, d.contents.skeleton.palette.size(),
                                                  d.contents.skeleton.morph_weight_count));
    d.meshes.push_back(std::move(mesh));
  }
  for (const ModelRecord& model : d.contents.models) {
    auto layers = d.contents.layers_of(model.id);
    RELIT_ASSIGN(auto decoder, decoders::PlaneDecoder::open(model, layers));
    d.models.push_back({model, std::move(layers), std::move(decoder)});
  }
  for (const PoseTrackRecord& record : d.contents.pose_tracks) {
    RELIT_ASSIGN(auto track, decoders::PoseTrack::create(d.contents.skeleton, record, d.meshes));
    d.poses.push_back({record, std::move(track), {}});
    d.poses.back().known.resize(d.contents.find_clip(record.clip_id)->frame_count);
  }
  return d;
}

void take_pose(ClipPoses& poses, const SegmentRecord& segment, const ChunkRecord& chunk) {
  const Packet& packet = chunk.packets.front();
  const std::span bytes(chunk.data.data() + packet.offset, packet.size);
  if (!poses.track.add_packet(bytes, segment.first_frame, segment.frame_count)) return;
  for (std::uint64_t f = segment.first_frame; f < segment.first_frame + segment.frame_count; ++f) {
    if (f < poses.known.size()) poses.known[f] = true;
  }
}

/// Damaged packets show when their frames are asked for, and so are left out in silence here.
void take_chunk(Decoding& d, const SegmentRecord& segment, const ChunkRecord& chunk) {
  for (ModelTracks& m : d.models) {
    if (m.model.clip_id == segment.clip_id) (void)m.decoder.add_chunk(segment, chunk);
  }
  for (ClipPoses& p : d.poses) {
    if (p.record.clip_id == segment.clip_id && p.record.track_id == chunk.track_id)
      take_pose(p, segment, chunk);
  }
}

void read_segments(Reader& reader, Decoding& d) {
  std::optional<SegmentRecord> segment;
  for (;;) {
    auto record = reader.next();
    if (!record) {
      if (reader.can_continue()) continue;
      const auto again = reader.resync();
      if (!again || !*again) return;
      continue;
    }
    if (!*record) return;
    RecordBody& body = (**record).body;
    if (auto* next = std::get_if<SegmentRecord>(&body)) segment = std::move(*next);
    if (const auto* chunk = std::get_if<ChunkRecord>(&body)) take_chunk(d, *segment, *chunk);
  }
}

std::array<std::array<int, 2>, 4> probe_texels(const ModelRecord& model) {
  const int w = model.width, h = model.height;
  return {{{0, 0}, {w / 3, h / 2}, {w / 2, h / 3}, {w - 1, h - 1}}};
}

ordered_json frame_json(ModelTracks& m, std::uint64_t frame, std::vector<float>& transfer) {
  decoders::FrameView view;
  const Status status = m.decoder.frame(frame, view);
  ordered_json planes = ordered_json::array();
  bool any = false;
  for (const PlaneView& plane : view.planes()) {
    planes.push_back(plane_json(plane));
    any |= !plane.mantissa.empty();
  }
  if (!any) return nullptr;
  ordered_json json{{"planes", planes}, {"coefficients", nullptr}};
  ModelRecord linear = m.model;
  linear.prediction_plane = -1;
  if (!status || !decoders::reconstruct(view.planes(), linear, m.layers, transfer)) return json;
  const std::size_t texels = std::size_t{m.model.width} * m.model.height;
  json["coefficients"] = ordered_json::array();
  for (const auto& [x, y] : probe_texels(m.model)) {
    ordered_json values = ordered_json::array();
    const auto texel = static_cast<std::size_t>(y) * m.model.width + static_cast<std::size_t>(x);
    for (std::size_t i = texel; i < transfer.size(); i += texels)
      values.push_back(number(transfer[i]));
    json["coefficients"].push_back(values);
  }
  return json;
}

/// Adds the normals of the probe texels to the frames of a model that predicts.
Status add_normals(const Decoding& d, const ModelRecord& model, ordered_json& frames) {
  RELIT_ASSIGN(auto texels, decoders::TexelNormals::create(d.meshes, model.width, model.height));
  const auto poses = std::find_if(d.poses.begin(), d.poses.end(), [&](const ClipPoses& p) {
    return p.record.clip_id == model.clip_id;
  });
  std::vector<glm::vec3> normals(std::size_t{model.width} * model.height);
  decoders::Pose pose;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    if (frames[f].is_null()) continue;
    ordered_json& probes = frames[f]["normals"];
    if (poses == d.poses.end() || !poses->known[f] ||
        !poses->track.sample(static_cast<double>(f), pose)) {
      probes = nullptr;
      continue;
    }
    texels.compute(pose, normals);
    for (const auto& [x, y] : probe_texels(model)) {
      const glm::vec3& n =
          normals[static_cast<std::size_t>(y) * model.width + static_cast<std::size_t>(x)];
      probes.push_back({number(n.x), number(n.y), number(n.z)});
    }
  }
  return {};
}

Result<ordered_json> model_json(const Decoding& d, ModelTracks& m, std::uint64_t frame_count) {
  std::vector<float> transfer(m.model.mean.size() * 3 * m.model.width * m.model.height);
  ordered_json frames = ordered_json::array();
  for (std::uint64_t f = 0; f < frame_count; ++f) frames.push_back(frame_json(m, f, transfer));
  if (m.model.prediction_plane >= 0) RELIT_TRY(add_normals(d, m.model, frames));
  return ordered_json{{"model", m.model.id},
                      {"clip", m.model.clip_id},
                      {"probe_texels", probe_texels(m.model)},
                      {"frames", frames}};
}

ordered_json pose_json(const Decoding& d, const ClipPoses& p) {
  ordered_json frames = ordered_json::array();
  decoders::Pose pose;
  for (std::size_t f = 0; f < p.known.size(); ++f) {
    if (!p.known[f] || !p.track.sample(static_cast<double>(f), pose)) {
      frames.push_back(nullptr);
      continue;
    }
    ordered_json vertices = ordered_json::array();
    for (std::size_t m = 0; m < d.meshes.size(); ++m) {
      std::vector<glm::vec3> positions(d.meshes[m].positions.size());
      decoders::pose_mesh(d.meshes[m], m, pose, positions, {});
      for (std::size_t v = 0; v < std::min<std::size_t>(positions.size(), 4); ++v)
        vertices.push_back(
            {number(positions[v].x), number(positions[v].y), number(positions[v].z)});
    }
    frames.push_back(vertices);
  }
  return {{"clip", p.record.clip_id}, {"vertices", frames}};
}

}  // namespace

Result<ordered_json> decode_frames(std::unique_ptr<ByteSource> source) {
  // More frames than any vector has: a clip's length is only a promise.
  constexpr std::uint64_t kMostFrames = 4096;
  RELIT_ASSIGN(Reader reader, Reader::open(std::move(source)));
  RELIT_ASSIGN(Decoding d, open_decoders(reader));
  for (const ClipRecord& clip : d.contents.clips) {
    if (clip.frame_count > kMostFrames)
      return fail(ErrorCode::kLimit, "a clip of more than 4096 frames is no vector's");
  }
  read_segments(reader, d);
  ordered_json json{
      {"hash", "crc32"}, {"models", ordered_json::array()}, {"poses", ordered_json::array()}};
  for (ModelTracks& m : d.models) {
    const ClipRecord& clip = *d.contents.find_clip(m.model.clip_id);
    RELIT_ASSIGN(ordered_json model, model_json(d, m, clip.frame_count));
    json["models"].push_back(std::move(model));
  }
  for (const ClipPoses& p : d.poses) json["poses"].push_back(pose_json(d, p));
  return json;
}

}  // namespace relit::conformance
