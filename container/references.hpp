// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "container/base/result.hpp"
#include "container/records.hpp"

namespace relit::container {

/// What the records before the first segment say about each other: unique ids, existing references,
/// planes of the model's size, one user per track. Takes them in the order of the file, one by one,
/// and remembers no more than ids and counts. Each record must pass validate() by itself.
class ReferenceChecker {
 public:
  /// Errors: kCorrupt, kLimit for too many records of a kind; the message names record and
  /// reference.
  Status add(const ClipRecord& record);
  Status add(const ImageRecord& record);
  Status add(const MaterialRecord& record);
  Status add(const MeshRecord& record);
  Status add(const SkeletonRecord& record);
  Status add(const PoseTrackRecord& record);
  Status add(const ModelRecord& record);
  Status add(const LayerRecord& record);

  /// What only shows when all records are there. Errors: kCorrupt.
  [[nodiscard]] Status finish() const;

  [[nodiscard]] std::optional<std::uint64_t> frame_count(std::uint32_t clip_id) const;
  [[nodiscard]] std::optional<std::uint64_t> duration_ticks(std::uint32_t clip_id) const;
  /// All clips, by id.
  [[nodiscard]] std::vector<std::uint32_t> clips() const;
  /// The tracks of a clip in the order of their declaration: pose, then each layer's mantissas and
  /// exponents. It is the order of a segment's chunks.
  [[nodiscard]] std::span<const std::uint32_t> tracks(std::uint32_t clip_id) const;

 private:
  struct Clip {
    std::uint64_t frame_count = 0;
    std::uint64_t duration_ticks = 0;
    double ticks_per_s = 1;
    bool has_pose = false;
    std::vector<std::uint32_t> tracks;
    std::uint64_t samples_per_frame = 0;  ///< of all mantissa and exponent pictures
  };
  struct Model {
    std::uint32_t clip_id = 0;
    std::uint32_t coefficients = 0;
    std::uint16_t width = 0, height = 0;
    std::int32_t prediction_plane = -1;
    std::uint32_t planes = 0;
  };

  Status add_geometry(const MeshRecord& record);
  Status add_track(std::uint32_t track_id, Clip& clip);
  [[nodiscard]] static Status check_rate(std::uint32_t clip_id, const Clip& clip);

  std::map<std::uint32_t, Clip> clips_;
  std::set<std::uint32_t> images_;
  std::set<std::uint32_t> materials_;
  std::set<std::uint32_t> meshes_;
  std::uint64_t vertices_ = 0, indices_ = 0, morph_offsets_ = 0;  ///< of all meshes
  std::map<std::uint32_t, Model> models_;
  std::set<std::uint32_t> layers_;
  std::set<std::uint32_t> tracks_;
  std::size_t nodes_ = 0;
  std::size_t palette_ = 0;
  std::uint32_t morph_weights_ = 0;
  bool joints_used_ = false;
  std::uint32_t morph_weights_used_ = 0;
};

/// Whether a chunk belongs to its segment: same index, packets of the segment's frames, the first
/// packet a key with the first frame. Errors: kCorrupt.
[[nodiscard]] Status check_chunk(const SegmentRecord& segment, const ChunkRecord& chunk);

}  // namespace relit::container
