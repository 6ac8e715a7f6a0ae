// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "container/records.hpp"
#include "container/references.hpp"
#include "decoders/mesh.hpp"
#include "player/validator_findings.hpp"

/// The records before the first segment: their fields, what they say of each other, and everything
/// in them that can be decoded.
namespace relit::player {

/// A record and where it stands.
template <class R>
struct Placed {
  FindingPlace place;
  R record;
};

class StaticChecker {
 public:
  StaticChecker(FindingLog& log, bool decode) : log_(log), decode_(decode) {}

  /// Takes the payload of a record from CLIP to LAYR, in the order of the file.
  void add(const FindingPlace& place, std::span<const std::uint8_t> payload);
  /// Checks the fields of a record that stands where it does not count.
  void check_fields(const FindingPlace& place, std::span<const std::uint8_t> payload);
  /// A record was lost to damage: what refers to it is not to be blamed.
  void note_loss() { trusted_ = false; }
  /// What only shows when all records are there, with `end` behind them; decodes meshes.
  void finish(const FindingPlace& end);

  /// Whether everything that later records may refer to is here and consistent.
  [[nodiscard]] bool trusted() const { return trusted_; }
  [[nodiscard]] const container::ReferenceChecker& references() const { return references_; }
  [[nodiscard]] const std::vector<Placed<container::ClipRecord>>& clips() const { return clips_; }
  [[nodiscard]] const container::SkeletonRecord& skeleton() const { return skeleton_; }
  [[nodiscard]] const std::vector<Placed<container::PoseTrackRecord>>& pose_tracks() const {
    return pose_tracks_;
  }
  [[nodiscard]] const std::vector<Placed<container::ModelRecord>>& models() const {
    return models_;
  }
  [[nodiscard]] const std::vector<Placed<container::LayerRecord>>& layers() const {
    return layers_;
  }
  /// In the order of the file; nothing if one of them does not decode.
  [[nodiscard]] const std::optional<std::vector<decoders::Mesh>>& meshes() const { return meshes_; }

 private:
  template <class R>
  void take(const FindingPlace& place, Result<R> parsed);
  void keep(const FindingPlace& place, container::ClipRecord&& record);
  void keep(const FindingPlace& place, container::ImageRecord&& record);
  void keep(const FindingPlace& place, container::MaterialRecord&& record);
  void keep(const FindingPlace& place, container::MeshRecord&& record);
  void keep(const FindingPlace& place, container::SkeletonRecord&& record);
  void keep(const FindingPlace& place, container::PoseTrackRecord&& record);
  void keep(const FindingPlace& place, container::ModelRecord&& record);
  void keep(const FindingPlace& place, container::LayerRecord&& record);
  void note_reference(const FindingPlace& place, const Status& status);
  void decode_meshes();

  FindingLog& log_;
  bool decode_;
  bool trusted_ = true;
  bool keeping_ = true;
  container::ReferenceChecker references_;
  std::vector<Placed<container::ClipRecord>> clips_;
  std::vector<Placed<container::MeshRecord>> mesh_records_;
  container::SkeletonRecord skeleton_;
  std::vector<Placed<container::PoseTrackRecord>> pose_tracks_;
  std::vector<Placed<container::ModelRecord>> models_;
  std::vector<Placed<container::LayerRecord>> layers_;
  std::optional<std::vector<decoders::Mesh>> meshes_;
};

}  // namespace relit::player
