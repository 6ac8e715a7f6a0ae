// SPDX-License-Identifier: MIT
// The schema is documented in container/INFO.md; fields may be added, never change their meaning.
#include "player/file_survey.hpp"

namespace relit::player {

using namespace container;
using nlohmann::ordered_json;

const char* chroma_name(Chroma chroma) {
  switch (chroma) {
    case Chroma::kLuma:
      return "luma";
    case Chroma::k420:
      return "4:2:0";
    case Chroma::k444:
      return "4:4:4";
  }
  return "?";
}

const char* pose_kind_name(PoseKind kind) {
  return kind == PoseKind::kJoints ? "joints" : "vertices";
}

namespace {

constexpr const char* kWrapNames[] = {"repeat", "clamp", "mirror"};
constexpr const char* kAlphaNames[] = {"opaque", "mask", "blend"};
constexpr const char* kSemanticNames[] = {"position", "normal", "lightmap_uv", "albedo_uv",
                                          "color",    "joints", "weights",     "twin"};
constexpr const char* kTargetNames[] = {"translation", "rotation", "scale", "morph_weight"};

template <class Enum>
std::size_t number(Enum value) {
  return static_cast<std::size_t>(value);
}

/// Every element through `convert`, as an array.
template <class Range, class Convert>
ordered_json list(const Range& range, Convert convert) {
  ordered_json json = ordered_json::array();
  for (const auto& element : range) json.push_back(convert(element));
  return json;
}

ordered_json blob_json(std::uint64_t bytes, std::uint32_t crc) {
  return {{"bytes", bytes}, {"crc32", crc}};
}
ordered_json blob_json(const std::vector<std::uint8_t>& bytes) {
  return blob_json(bytes.size(), crc32(bytes));
}

ordered_json clip_json(const ClipRecord& clip) {
  return {{"id", clip.id},
          {"name", clip.name},
          {"frames", clip.frame_count},
          {"tick_rate", {clip.tick_rate.num, clip.tick_rate.den}},
          {"duration_ticks", clip.duration_ticks},
          {"duration_s", duration_s(clip)},
          {"loop", clip.loop},
          {"bounds", {clip.bounds_min, clip.bounds_max}}};
}

ordered_json image_json(const ImageRecord& image) {
  return {{"id", image.id},
          {"media_type", image.media_type},
          {"bytes", image.bytes.size()},
          {"crc32", crc32(image.bytes)}};
}

ordered_json material_json(const MaterialRecord& m) {
  return {{"id", m.id},
          {"name", m.name},
          {"base_color", m.base_color},
          {"image", m.image_id},
          {"wrap", {kWrapNames[number(m.wrap_u)], kWrapNames[number(m.wrap_v)]}},
          {"linear_filter", m.linear_filter},
          {"alpha_mode", kAlphaNames[number(m.alpha_mode)]},
          {"alpha_cutoff", m.alpha_cutoff}};
}

ordered_json stream_json(const VertexStream& s) {
  return {{"semantic", kSemanticNames[number(s.semantic)]},
          {"stride", s.stride},
          {"offset", s.offset},
          {"scale", s.scale},
          {"data", blob_json(s.bytes)}};
}

ordered_json mesh_json(const MeshRecord& mesh) {
  return {{"id", mesh.id},
          {"name", mesh.name},
          {"material", mesh.material_id},
          {"vertices", mesh.vertex_count},
          {"triangles", mesh.index_count / 3},
          {"streams", list(mesh.streams, stream_json)},
          {"indices", blob_json(mesh.indices)},
          {"first_morph_weight", mesh.first_morph_weight},
          {"morph_targets", list(mesh.morph_targets, [](const MorphTarget& t) {
             return ordered_json{{"scale", t.scale}, {"data", blob_json(t.bytes)}};
           })}};
}

ordered_json skeleton_json(const SkeletonRecord& skeleton) {
  return {{"morph_weights", skeleton.morph_weight_count},
          {"nodes", list(skeleton.nodes,
                         [](const NodeRecord& n) {
                           return ordered_json{{"parent", n.parent}, {"local", n.local}};
                         })},
          {"palette", list(skeleton.palette, [](const PaletteEntry& p) {
             return ordered_json{{"node", p.node}, {"inverse_bind", p.inverse_bind}};
           })}};
}

ordered_json rest_json(const RestTrs& t) {
  return {{"node", t.node},
          {"translation", t.translation},
          {"rotation", t.rotation},
          {"scale", t.scale}};
}

ordered_json channel_json(const PoseChannel& c) {
  return {{"target", kTargetNames[number(c.target)]},
          {"index", c.index},
          {"offset", c.offset},
          {"step", c.step}};
}

ordered_json range_json(const VertexRange& v) {
  return {{"mesh", v.mesh_id}, {"offset", v.offset}, {"step", v.step}};
}

std::uint64_t bytes_of(const FileSurvey& survey, std::uint32_t track) {
  const auto found = survey.track_bytes.find(track);
  return found == survey.track_bytes.end() ? 0 : found->second;
}

ordered_json pose_json(const FileSurvey& survey, const PoseTrackRecord& pose) {
  return {{"track", pose.track_id},
          {"clip", pose.clip_id},
          {"kind", pose_kind_name(pose.kind)},
          {"rest", list(pose.rest, rest_json)},
          {"channels", list(pose.channels, channel_json)},
          {"vertex_ranges", list(pose.vertex_ranges, range_json)},
          {"bytes", bytes_of(survey, pose.track_id)}};
}

ordered_json rect_json(const Rect& r) { return {r.x, r.y, r.width, r.height}; }

ordered_json plane_json(const LayerRecord& layer, const PlaneRecord& plane) {
  ordered_json json{{"component", plane.component},
                    {"mantissa_rect", rect_json(plane.mantissa_rect)}};
  if (layer.has_exponents) json["exponent_rect"] = rect_json(plane.exponent_rect);
  json["scale"] = plane.scale;
  json["matrix"] = list(plane.matrix, [](const MatrixEntry& m) {
    return ordered_json{m.coefficient, m.channel, m.value};
  });
  return json;
}

ordered_json layer_json(const FileSurvey& survey, const LayerRecord& layer) {
  ordered_json json{{"id", layer.id},
                    {"codec", layer.codec},
                    {"codec_private", blob_json(layer.codec_private)},
                    {"bit_depth", layer.bit_depth},
                    {"chroma", chroma_name(layer.chroma)},
                    {"lossless", layer.lossless},
                    {"coded", {layer.coded_width, layer.coded_height}},
                    {"pictures", layer.mantissa_pictures},
                    {"track", layer.mantissa_track},
                    {"bytes", bytes_of(survey, layer.mantissa_track)}};
  if (layer.has_exponents) {
    json["exponents"] = {{"codec", layer.exponent_codec},
                         {"codec_private", blob_json(layer.exponent_private)},
                         {"block", layer.exponent_block},
                         {"coded", {layer.exponent_width, layer.exponent_height}},
                         {"pictures", layer.exponent_pictures},
                         {"track", layer.exponent_track},
                         {"bytes", bytes_of(survey, layer.exponent_track)}};
  }
  json["planes"] =
      list(layer.planes, [&](const PlaneRecord& plane) { return plane_json(layer, plane); });
  return json;
}

ordered_json model_json(const FileSurvey& survey, const ModelRecord& model) {
  return {{"id", model.id},
          {"clip", model.clip_id},
          {"kind", "shlm"},
          {"order", model.order},
          {"size", {model.width, model.height}},
          {"prediction_plane", model.prediction_plane},
          {"mean", model.mean},
          {"layers", list(survey.contents.layers_of(model.id),
                          [&](const LayerRecord& layer) { return layer_json(survey, layer); })}};
}

ordered_json chunk_json(const SurveyedSegment& segment, const SegmentRecord::ChunkSize& announced) {
  ordered_json json{{"track", announced.track_id}, {"bytes", announced.chunk_bytes}};
  json["packets"] = nullptr;
  json["data"] = nullptr;
  for (const SurveyedChunk& chunk : segment.chunks) {
    if (chunk.track_id != announced.track_id) continue;
    json["packets"] = list(chunk.packets, [](const Packet& p) {
      return ordered_json{p.pts, p.key ? 1 : 0, p.size};
    });
    json["data"] = blob_json(chunk.data_bytes, chunk.data_crc);
  }
  return json;
}

ordered_json segment_json(const SurveyedSegment& segment) {
  const SegmentRecord& record = segment.record;
  return {{"offset", segment.offset_bytes},
          {"index", record.index},
          {"clip", record.clip_id},
          {"first_frame", record.first_frame},
          {"frames", record.frame_count},
          {"first_tick", record.first_tick},
          {"durations", record.durations},
          {"chunks", list(record.chunks, [&](const SegmentRecord::ChunkSize& announced) {
             return chunk_json(segment, announced);
           })}};
}

ordered_json index_json(const std::optional<IndexRecord>& index) {
  if (!index) return nullptr;
  return list(index->segments, [](const IndexRecord::Entry& e) {
    return ordered_json{{"index", e.segment_index},     {"clip", e.clip_id},
                        {"first_frame", e.first_frame}, {"frames", e.frame_count},
                        {"first_tick", e.first_tick},   {"offset", e.offset}};
  });
}

ordered_json end_json(const std::optional<EndRecord>& end) {
  if (!end) return nullptr;
  return {{"index_offset", end->index_offset},
          {"copies_offset", end->copies_offset},
          {"file_bytes", end->file_bytes}};
}

ordered_json passed_over_json(const PassedOver& record) {
  return {{"offset", record.offset_bytes},
          {"type", type_name(record.header.type)},
          {"flags", record.header.flags},
          {"payload_bytes", record.header.payload_bytes},
          {"payload_crc", record.header.payload_crc}};
}

}  // namespace

ordered_json survey_json(const FileSurvey& survey) {
  const FileContents& contents = survey.contents;
  ordered_json json;
  json["version"] = {contents.header.version_major, contents.header.version_minor};
  json["writer"] = contents.header.writer;
  json["bytes"] = survey.bytes;
  json["complete"] = survey.end.has_value();
  json["repaired"] = contents.repaired;
  json["lost"] = {{"records", survey.loss.damaged_records},
                  {"bytes", survey.loss.dropped_bytes},
                  {"segments", survey.loss.missing_segments}};
  json["clips"] = list(contents.clips, clip_json);
  json["images"] = list(contents.images, image_json);
  json["materials"] = list(contents.materials, material_json);
  json["meshes"] = list(contents.meshes, mesh_json);
  json["skeleton"] = skeleton_json(contents.skeleton);
  json["poses"] = list(contents.pose_tracks,
                       [&](const PoseTrackRecord& pose) { return pose_json(survey, pose); });
  json["models"] =
      list(contents.models, [&](const ModelRecord& model) { return model_json(survey, model); });
  json["segments"] = list(survey.segments, segment_json);
  json["index"] = index_json(survey.index);
  json["end"] = end_json(survey.end);
  json["passed_over"] = list(survey.passed_over, passed_over_json);
  return json;
}

}  // namespace relit::player
