// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bake_minimal/coding_options.hpp"
#include "tests/conformance/draft.hpp"

/// The contents of the vectors: a quad that bends in two joints, under synthetic transfer.
namespace relit::conformance {

/// Ids and tracks of a clip; clips of one file need different ones.
struct ClipIds {
  std::uint32_t clip = 1;
  std::uint32_t model = 1;
  std::uint32_t first_layer = 1;
  std::uint32_t pose_track = 1;
  std::uint32_t first_track = 2;
};

struct FigureOptions {
  int order = 0;
  int width = 16;
  int height = 16;
  int frames = 3;
  bake::CodingOptions coding;
  ClipIds ids = {};
};

/// FFV1, 8 bits, luma, 2 frames a segment, no exponents: the smallest files.
FigureOptions plain_figure();

/// A complete valid file: clip, image, material, mesh, skeleton, pose, model, layers, segments.
/// Throws bake's message where this FFmpeg lacks the encoder.
Draft figure(const FigureOptions& options = plain_figure());

/// The parts of one clip: CLIP, POSE, MODL, LAYR and segments numbered from `first_segment`.
Draft clip_parts(const FigureOptions& options, std::uint32_t first_segment = 0);

/// Four vertices, two triangles, joints and weights; `influences` 0, 4 or 8.
container::MeshRecord quad(int influences = 4);
/// The bytes of a vertex stream of quad(); those of a morph target are coded like positions.
/// `twins`: none, or one a vertex.
std::vector<std::uint8_t> quad_stream(container::Semantic semantic,
                                      std::span<const std::uint8_t> bytes,
                                      std::vector<std::uint16_t> twins = {});
container::SkeletonRecord two_joints();
/// Rotation of node 1 over the clip: record, and one packet for `frames` frames from `first`.
container::PoseTrackRecord bending(const ClipIds& ids);
container::ChunkRecord pose_chunk(const container::PoseTrackRecord& pose,
                                  std::size_t values_per_frame, std::uint64_t first,
                                  std::uint32_t frames);
/// Puts the pose packets of `pose` into the segments of its clip in place of those there are.
void set_pose(Draft& draft, const container::PoseTrackRecord& pose, std::size_t values_per_frame);

/// Renumbers the packets of a clip whose frames last other than a tick each.
void set_durations(Draft& draft, const std::vector<std::uint32_t>& durations);

}  // namespace relit::conformance
