// SPDX-License-Identifier: MIT
#include "container/references.hpp"

#include <algorithm>
#include <string>

#include "container/record_checks.hpp"

namespace relit::container {

using namespace checks;

namespace {

std::string label(const char* what, std::uint32_t id) {
  return std::string(what) + " " + std::to_string(id);
}

/// Notes a new id, refuses a used one and too many of them.
Status note(std::set<std::uint32_t>& ids, std::uint32_t id, std::size_t limit, const char* what) {
  RELIT_REQUIRE(ids.insert(id).second, label(what, id) + " exists twice");
  return at_most(ids.size(), limit, "number of records of this kind");
}

template <class Ids>
Status exists(const Ids& ids, std::uint32_t id, const char* what) {
  RELIT_REQUIRE(ids.count(id) != 0, label(what, id) + " does not exist");
  return {};
}

}  // namespace

Status ReferenceChecker::add(const ClipRecord& record) {
  Clip clip;
  clip.frame_count = record.frame_count, clip.duration_ticks = record.duration_ticks;
  clip.ticks_per_s =
      static_cast<double>(record.tick_rate.num) / static_cast<double>(record.tick_rate.den);
  RELIT_REQUIRE(clips_.emplace(record.id, std::move(clip)).second,
                label("clip", record.id) + " exists twice");
  return at_most(clips_.size(), limits::kClips, "number of clips");
}

Status ReferenceChecker::add(const ImageRecord& record) {
  RELIT_REQUIRE(record.id <= 0x7FFFFFFF, label("image", record.id) + " exceeds 2147483647");
  return note(images_, record.id, limits::kImages, "image");
}

Status ReferenceChecker::add(const MaterialRecord& record) {
  RELIT_TRY(note(materials_, record.id, limits::kMaterials, "material"));
  if (record.image_id < 0) return {};
  return exists(images_, static_cast<std::uint32_t>(record.image_id), "image");
}

Status ReferenceChecker::add(const MeshRecord& record) {
  RELIT_TRY(note(meshes_, record.id, limits::kMeshes, "mesh"));
  RELIT_TRY(exists(materials_, record.material_id, "material"));
  RELIT_TRY(add_geometry(record));
  joints_used_ |= std::ranges::any_of(
      record.streams, [](const VertexStream& s) { return s.semantic == Semantic::kJoints; });
  if (!record.morph_targets.empty())
    morph_weights_used_ =
        std::max(morph_weights_used_, record.first_morph_weight +
                                          static_cast<std::uint32_t>(record.morph_targets.size()));
  return {};
}

/// A mesh of the greatest size takes some hundred bytes of a file: zeros compress well.
Status ReferenceChecker::add_geometry(const MeshRecord& record) {
  vertices_ += record.vertex_count;
  indices_ += record.index_count;
  morph_offsets_ += std::uint64_t{record.vertex_count} * record.morph_targets.size();
  RELIT_TRY(at_most(vertices_, limits::kVertices, "number of vertices of all meshes"));
  RELIT_TRY(at_most(indices_, limits::kIndices, "number of indices of all meshes"));
  return at_most(morph_offsets_, limits::kMorphOffsets, "number of morph offsets of all meshes");
}

Status ReferenceChecker::add(const SkeletonRecord& record) {
  nodes_ = record.nodes.size();
  palette_ = record.palette.size();
  morph_weights_ = record.morph_weight_count;
  return {};
}

Status ReferenceChecker::add(const PoseTrackRecord& record) {
  RELIT_TRY(exists(clips_, record.clip_id, "clip"));
  Clip& clip = clips_.at(record.clip_id);
  RELIT_REQUIRE(!clip.has_pose, label("clip", record.clip_id) + " has two pose tracks");
  clip.has_pose = true;
  RELIT_TRY(add_track(record.track_id, clip));
  for (const RestTrs& t : record.rest)
    RELIT_REQUIRE(t.node < nodes_, label("node", t.node) + " does not exist");
  for (const PoseChannel& c : record.channels) {
    if (c.target == ChannelTarget::kMorphWeight)
      RELIT_REQUIRE(c.index < morph_weights_, label("morph weight", c.index) + " does not exist");
    else
      RELIT_REQUIRE(c.index < nodes_, label("node", c.index) + " does not exist");
  }
  for (const VertexRange& v : record.vertex_ranges) RELIT_TRY(exists(meshes_, v.mesh_id, "mesh"));
  RELIT_REQUIRE(record.kind != PoseKind::kVertices || record.vertex_ranges.size() == meshes_.size(),
                "a track of vertices needs one vertex range for each mesh");
  return {};
}

Status ReferenceChecker::add(const ModelRecord& record) {
  RELIT_TRY(exists(clips_, record.clip_id, "clip"));
  const Model model{record.clip_id,
                    static_cast<std::uint32_t>(record.mean.size()),
                    record.width,
                    record.height,
                    record.prediction_plane,
                    0};
  RELIT_REQUIRE(models_.emplace(record.id, model).second,
                label("model", record.id) + " exists twice");
  return at_most(models_.size(), limits::kLayers, "number of models");
}

Status ReferenceChecker::add(const LayerRecord& record) {
  RELIT_TRY(note(layers_, record.id, limits::kLayers, "layer"));
  RELIT_TRY(exists(models_, record.model_id, "model"));
  Model& model = models_.at(record.model_id);
  Clip& clip = clips_.at(model.clip_id);
  RELIT_TRY(add_track(record.mantissa_track, clip));
  if (record.has_exponents) RELIT_TRY(add_track(record.exponent_track, clip));
  clip.samples_per_frame += std::uint64_t{record.coded_width} * record.coded_height;
  if (record.has_exponents)
    clip.samples_per_frame += std::uint64_t{record.exponent_width} * record.exponent_height;
  model.planes += static_cast<std::uint32_t>(record.planes.size());
  RELIT_TRY(at_most(model.planes, limits::kPlanes, "number of planes of the model"));
  for (const PlaneRecord& p : record.planes) {
    RELIT_REQUIRE(p.mantissa_rect.width == model.width && p.mantissa_rect.height == model.height,
                  "a plane does not have the size of the light map");
    for (const MatrixEntry& m : p.matrix)
      RELIT_REQUIRE(m.coefficient < model.coefficients,
                    "matrix.coefficient " + std::to_string(m.coefficient) +
                        " is not one of the model's " + std::to_string(model.coefficients));
  }
  return {};
}

Status ReferenceChecker::add_track(std::uint32_t track_id, Clip& clip) {
  RELIT_REQUIRE(tracks_.insert(track_id).second, label("track", track_id) + " is used twice");
  clip.tracks.push_back(track_id);
  return at_most(clip.tracks.size(), limits::kChunksPerSegment, "number of tracks of the clip");
}

Status ReferenceChecker::finish() const {
  RELIT_REQUIRE(!clips_.empty(), "the file has no clip");
  RELIT_REQUIRE(!joints_used_ || palette_ > 0, "a mesh has joints, but there is no palette");
  RELIT_REQUIRE(morph_weights_used_ <= morph_weights_,
                "a mesh uses " + std::to_string(morph_weights_used_) +
                    " morph weights, the skeleton has " + std::to_string(morph_weights_));
  for (const auto& [id, model] : models_)
    RELIT_REQUIRE(model.prediction_plane < static_cast<std::int64_t>(model.planes),
                  label("model", id) + " predicts from plane " +
                      std::to_string(model.prediction_plane) + " of " +
                      std::to_string(model.planes));
  for (const auto& [id, clip] : clips_) RELIT_TRY(check_rate(id, clip));
  return {};
}

/// A small file must not keep a decoder busy for years.
Status ReferenceChecker::check_rate(std::uint32_t clip_id, const Clip& clip) {
  const auto samples =
      static_cast<double>(clip.samples_per_frame) * static_cast<double>(clip.frame_count);
  const double per_s = samples * clip.ticks_per_s / static_cast<double>(clip.duration_ticks);
  if (samples <= static_cast<double>(limits::kVideoSamples) &&
      per_s <= static_cast<double>(limits::kVideoSamplesPerSecond))
    return {};
  return fail(ErrorCode::kLimit, label("clip", clip_id) + " has " + std::to_string(samples) +
                                     " samples of video, " + std::to_string(per_s) +
                                     " a second; the limits are 2^48 and 2^33");
}

std::optional<std::uint64_t> ReferenceChecker::frame_count(std::uint32_t clip_id) const {
  const auto it = clips_.find(clip_id);
  if (it == clips_.end()) return std::nullopt;
  return it->second.frame_count;
}

std::optional<std::uint64_t> ReferenceChecker::duration_ticks(std::uint32_t clip_id) const {
  const auto it = clips_.find(clip_id);
  if (it == clips_.end()) return std::nullopt;
  return it->second.duration_ticks;
}

std::vector<std::uint32_t> ReferenceChecker::clips() const {
  std::vector<std::uint32_t> ids;
  for (const auto& [id, clip] : clips_) ids.push_back(id);
  return ids;
}

std::span<const std::uint32_t> ReferenceChecker::tracks(std::uint32_t clip_id) const {
  const auto it = clips_.find(clip_id);
  if (it == clips_.end()) return {};
  return it->second.tracks;
}

Status check_chunk(const SegmentRecord& segment, const ChunkRecord& chunk) {
  RELIT_REQUIRE(chunk.segment_index == segment.index,
                "the chunk belongs to segment " + std::to_string(chunk.segment_index) +
                    ", not to " + std::to_string(segment.index));
  RELIT_REQUIRE(!chunk.packets.empty() && chunk.packets.front().key,
                "the first packet of a segment must be a key");
  const auto first = static_cast<std::int64_t>(segment.first_frame);
  RELIT_REQUIRE(chunk.packets.front().pts == first,
                "the first packet has pts " + std::to_string(chunk.packets.front().pts) +
                    ", the segment starts with frame " + std::to_string(first));
  for (const Packet& p : chunk.packets)
    RELIT_REQUIRE(p.pts >= first && p.pts < first + std::int64_t{segment.frame_count},
                  "packet of frame " + std::to_string(p.pts) + " lies outside the segment");
  return {};
}

}  // namespace relit::container
