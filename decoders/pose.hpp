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
  std::vector<glm::mat4x3> palette;                  ///< world(node) × inverse_bind
  std::vector<float> morph_weights;
  std::vector<std::vector<glm::vec3>> vertices;      ///< per mesh in the clip's order; kVertices only
};

/// The pose packets of a clip, decoded. Frames that have not arrived hold the last one before them.
class PoseTrack {
 public:
  /// Checks the track against the skeleton and the meshes. Errors: kCorrupt, kLimit.
  static Result<PoseTrack> create(const container::SkeletonRecord& skeleton,
                                  const container::PoseTrackRecord& track,
                                  std::span<const Mesh> meshes);

  /// Decodes the packet of a segment: `frame_count` frames from `first_frame`. Keeps the frames of the
  /// most recent segments only as long as `forget_before` is not called. Errors: kCorrupt, kLimit.
  Status add_packet(std::span<const std::uint8_t> packet, std::uint64_t first_frame,
                    std::uint32_t frame_count);

  /// Frees the segments that end at or before `frame`.
  void forget_before(std::uint64_t frame);

  /// The pose at `frame` (fractions interpolate: rotations by normalised lerp on the shorter arc, the
  /// rest linearly), written into `pose`. Errors: kNotFound when no frame at or before it is known.
  Status sample(double frame, Pose& pose) const;

 private:
  struct Segment {
    std::uint64_t first_frame;
    std::uint32_t frame_count;
    std::vector<std::uint16_t> values;  ///< dequantised on sampling, so a long clip stays small
  };
  container::SkeletonRecord skeleton_;
  container::PoseTrackRecord track_;
  std::vector<std::uint32_t> vertex_counts_;
  std::vector<Segment> segments_;
};

/// Posed positions, and normals where `normals` is not empty and the mesh has them (cofactor matrix of
/// the blended joints, so that non-uniform and negative scales are right), in model space.
/// `mesh_index` selects Pose::vertices. Sizes: mesh.positions.size().
void pose_mesh(const Mesh& mesh, std::size_t mesh_index, const Pose& pose,
               std::span<glm::vec3> positions, std::span<glm::vec3> normals);

}  // namespace relit::decoders
