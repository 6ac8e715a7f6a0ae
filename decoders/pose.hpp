// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <span>
#include <vector>

#include "container/base/result.hpp"
#include "container/records.hpp"
#include "decoders/mesh.hpp"

namespace relit::decoders {

/// What poses the meshes at one instant: palette matrices and morph weights, or the vertices
/// themselves. Reused from frame to frame, so that the steady state allocates nothing.
struct Pose {
  std::vector<glm::mat4x3> palette;  ///< world(node) × inverse_bind
  std::vector<float> morph_weights;
  std::vector<std::vector<glm::vec3>> vertices;  ///< per mesh in the clip's order; kVertices only
  std::vector<glm::mat4x3> world;                ///< of every node: sample()'s working memory
};

/// The pose packets of a clip, decoded. Frames that have not arrived hold the last one before them.
/// One thread at a time may change it; sample() with different poses may run on several.
class PoseTrack {
 public:
  /// Checks the track against the skeleton and the meshes. A kVertices track has one range for each
  /// mesh, in the order of `meshes`. Errors: kCorrupt, kLimit, kOutOfMemory.
  static Result<PoseTrack> create(const container::SkeletonRecord& skeleton,
                                  const container::PoseTrackRecord& track,
                                  std::span<const Mesh> meshes);

  /// Decodes the packet of a segment: `frame_count` frames from `first_frame`. A segment that
  /// starts at the same frame is replaced. Frames stay until `forget_before` frees them. A failure
  /// changes nothing. Errors: kCorrupt (damage, or frames that overlap another segment's), kLimit,
  /// kOutOfMemory.
  Status add_packet(std::span<const std::uint8_t> packet, std::uint64_t first_frame,
                    std::uint32_t frame_count);

  /// Frees the segments that end at or before `frame`.
  void forget_before(std::uint64_t frame);
  void forget_all();
  /// Frees all segments but the one that begins with `first_frame`.
  void forget_except(std::uint64_t first_frame);

  /// The pose at `frame` (fractions interpolate: rotations by normalised lerp on the shorter arc,
  /// the rest linearly), written into `pose`. A negative frame is frame 0. Allocates nothing once
  /// `pose` has been used with this track. Errors: kNotFound when no frame at or before it is
  /// known, kInvalid when it is not finite, kCorrupt when the numbers of the file lead beyond all
  /// bounds, kOutOfMemory.
  Status sample(double frame, Pose& pose) const;

  /// Bytes that the decoded frames occupy.
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Segment {
    std::uint64_t first_frame;
    std::uint32_t frame_count;
    std::vector<std::uint16_t>
        values;  ///< [frame][value]; dequantised on sampling, so it stays small
  };
  /// Where the three quantities of a node come from: a channel, or else the rest values.
  struct NodePlan {
    bool from_trs = false;          ///< else the record's matrix
    std::int32_t translation = -1;  ///< indices of channels
    std::int32_t rotation = -1;
    std::int32_t scale = -1;
    container::RestTrs rest;
    glm::mat4x3 local;
  };
  /// The two frames to interpolate between, and how far.
  struct Sampling {
    const std::uint16_t* from;
    const std::uint16_t* to;
    float fraction;
  };

  PoseTrack() = default;
  Status plan(std::span<const Mesh> meshes);
  template <class Predicate>
  void forget_if(Predicate&& forgotten);
  [[nodiscard]] std::vector<std::uint16_t> take_spare();
  Status add_segment(std::span<const std::uint8_t> packet, std::uint64_t first_frame,
                     std::uint32_t frame_count);
  Status sample_at(double frame, Pose& pose) const;
  Status plan_joints();
  Status plan_vertices(std::span<const Mesh> meshes);
  [[nodiscard]] const std::uint16_t* frame_values(std::uint64_t frame) const;
  [[nodiscard]] glm::vec3 sample_vector(std::size_t channel, const Sampling& at) const;
  [[nodiscard]] glm::vec4 sample_rotation(std::size_t channel, const Sampling& at) const;
  [[nodiscard]] glm::mat4x3 local_matrix(const NodePlan& plan, const Sampling& at) const;
  Status sample_joints(const Sampling& at, Pose& pose) const;
  void sample_vertices(const Sampling& at, Pose& pose) const;

  container::SkeletonRecord skeleton_;
  container::PoseTrackRecord track_;
  std::vector<NodePlan> nodes_;
  std::vector<glm::mat4x3> inverse_bind_;     ///< by palette entry
  std::vector<std::size_t> channel_offsets_;  ///< of each channel's first value within a frame
  std::vector<std::uint32_t> vertex_counts_;
  std::size_t values_per_frame_ = 0;
  std::vector<Segment> segments_;                  ///< by first frame, without overlap
  std::vector<std::vector<std::uint16_t>> spare_;  ///< storage of segments that are gone
  std::vector<std::uint8_t> bytes_;                ///< of a packet that is being decoded
};

/// Posed positions, and normals where `normals` is not empty, in model space. `mesh_index` selects
/// Pose::vertices. Sizes: mesh.positions.size(); `normals` may be empty. Normals are the mesh's own
/// by the inverse transpose of the blended joints (cofactors times the determinant's sign), so that
/// non-uniform and negative scales are right; where the pose is kVertices or the mesh has no
/// normals, they are the posed triangles', weighted by area. Unit length. Allocates nothing.
void pose_mesh(const Mesh& mesh, std::size_t mesh_index, const Pose& pose,
               std::span<glm::vec3> positions, std::span<glm::vec3> normals);

}  // namespace relit::decoders
