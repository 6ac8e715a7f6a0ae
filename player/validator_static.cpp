// SPDX-License-Identifier: MIT
#include "player/validator_static.hpp"

#include <string>
#include <utility>

#include "container/record_codec.hpp"
#include "decoders/image.hpp"

namespace relit::player {

using namespace container;

template <class R>
void StaticChecker::take(const FindingPlace& place, Result<R> parsed) {
  if (!parsed) {
    log_.add_parse_error(place, parsed.error());
    note_loss();
    return;
  }
  if (!keeping_) return;
  note_reference(place, references_.add(*parsed));
  keep(place, std::move(*parsed));
}

void StaticChecker::add(const FindingPlace& place, std::span<const std::uint8_t> payload) {
  if (place.type == types::kClip) take(place, parse_clip(payload));
  if (place.type == types::kImage) take(place, parse_image(payload));
  if (place.type == types::kMaterial) take(place, parse_material(payload));
  if (place.type == types::kMesh) take(place, parse_mesh(payload));
  if (place.type == types::kSkeleton) take(place, parse_skeleton(payload));
  if (place.type == types::kPoseTrack) take(place, parse_pose_track(payload));
  if (place.type == types::kModel) take(place, parse_model(payload));
  if (place.type == types::kLayer) take(place, parse_layer(payload));
}

void StaticChecker::check_fields(const FindingPlace& place, std::span<const std::uint8_t> payload) {
  const bool keeping = std::exchange(keeping_, false);
  add(place, payload);
  keeping_ = keeping;
}

void StaticChecker::note_reference(const FindingPlace& place, const Status& status) {
  if (status) return;
  // Behind a lost record every reference may lead nowhere; behind a wrong one, later ones may.
  if (trusted_ && status.error().code == ErrorCode::kLimit)
    log_.add("REF_LIMIT", place, status.error().message);
  else if (trusted_)
    log_.add("REF_INVALID", place, status.error().message);
}

void StaticChecker::keep(const FindingPlace& place, ClipRecord&& record) {
  clips_.push_back({place, std::move(record)});
}

void StaticChecker::keep(const FindingPlace& place, ImageRecord&& record) {
  if (!decode_) return;
  if (const auto image = decoders::decode_image(record.bytes, record.media_type); !image)
    log_.add("DECODE_IMAGE", place,
             "image " + std::to_string(record.id) + ": " + image.error().message);
}

void StaticChecker::keep(const FindingPlace&, MaterialRecord&&) {}

void StaticChecker::keep(const FindingPlace& place, MeshRecord&& record) {
  if (decode_) mesh_records_.push_back({place, std::move(record)});
}

void StaticChecker::keep(const FindingPlace&, SkeletonRecord&& record) {
  skeleton_ = std::move(record);
}

void StaticChecker::keep(const FindingPlace& place, PoseTrackRecord&& record) {
  pose_tracks_.push_back({place, std::move(record)});
}

void StaticChecker::keep(const FindingPlace& place, ModelRecord&& record) {
  models_.push_back({place, std::move(record)});
}

void StaticChecker::keep(const FindingPlace& place, LayerRecord&& record) {
  layers_.push_back({place, std::move(record)});
}

void StaticChecker::finish(const FindingPlace& end) {
  if (clips_.empty() && trusted_) {
    log_.add("ORDER_NO_CLIP", end, "the records before this place hold no CLIP");
    note_loss();
  }
  if (trusted_) note_reference(end, references_.finish());
  if (decode_) decode_meshes();
}

void StaticChecker::decode_meshes() {
  meshes_.emplace();
  bool complete = true;
  for (Placed<MeshRecord>& mesh : mesh_records_) {
    auto decoded =
        decoders::decode_mesh(mesh.record, skeleton_.palette.size(), skeleton_.morph_weight_count);
    mesh.record = {};
    if (decoded) {
      // Nothing but what poses and light maps need is kept.
      decoded->morph_targets = {};
      decoded->normals = {};
      decoded->colors = {};
      meshes_->push_back(std::move(*decoded));
      continue;
    }
    complete = false;
    // Without its skeleton no mesh can be right.
    if (trusted_) log_.add("DECODE_MESH", mesh.place, decoded.error().message);
  }
  mesh_records_ = {};
  if (!complete) meshes_.reset();
}

}  // namespace relit::player
