// SPDX-License-Identifier: MIT
#include <zstd.h>

#include <cstdint>

#include "container/record_codec.hpp"
#include "decoders/pose.hpp"
#include "decoders/pose_packet.hpp"
#include "tests/fuzz/fuzz.hpp"

/// Hostile pose tracks: a byte of flags; the payloads of SKEL and POSE, each behind its length in
/// 16 bits; then packets: first frame, number of frames, length, bytes. With flag 1 the packets
/// stand uncompressed in the input.
namespace {

using namespace relit;
using namespace relit::fuzz;

/// A triangle that the first palette entry moves, with a morph target.
decoders::Mesh triangle(std::uint32_t id, bool rigged) {
  decoders::Mesh mesh;
  mesh.id = id;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.lightmap_uv = {{0, 0}, {1, 0}, {0, 1}};
  mesh.indices = {0, 1, 2};
  if (!rigged) return mesh;
  mesh.influences_per_vertex = 4;
  mesh.joints.assign(12, 0);
  mesh.weights = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
  return mesh;
}

Bytes compress(Input bytes) {
  Bytes out(ZSTD_compressBound(bytes.size()));
  out.resize(ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 1));
  return out;
}

void check_pose(const decoders::PoseTrack& track, const decoders::Mesh& mesh, double frame) {
  decoders::Pose pose;
  if (!check(track.sample(frame, pose))) return;
  require_finite(pose.palette);
  require_finite(pose.morph_weights);
  for (const auto& vertices : pose.vertices) require_finite(vertices);
  std::vector<glm::vec3> positions(mesh.positions.size()), normals(positions.size());
  decoders::pose_mesh(mesh, 0, pose, positions, normals);
  require_finite(positions);
  require_finite(normals);
}

void add_packets(decoders::PoseTrack& track, Cursor& input, bool plain) {
  for (int packets = 0; packets < 8 && !input.empty(); ++packets) {
    const std::uint64_t first = input.u8();
    const std::uint32_t frames = input.u8();
    const Input bytes = input.piece();
    check(track.add_packet(plain ? compress(bytes) : copy(bytes), first, frames));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Cursor input({data, size});
  const unsigned how = input.u8();
  const auto skeleton = container::parse_skeleton(input.piece());
  const auto record = container::parse_pose_track(input.piece());
  if (!check(skeleton) || !check(record)) return 0;
  const std::uint32_t id = record->vertex_ranges.empty() ? 1 : record->vertex_ranges[0].mesh_id;
  const decoders::Mesh mesh = triangle(id, !skeleton->palette.empty());
  auto track = decoders::PoseTrack::create(*skeleton, *record, {&mesh, 1});
  if (!check(track)) return 0;
  add_packets(*track, input, (how & 1) != 0);
  for (const double frame : {0.0, 0.5, 1.0, 3.25, 100.0, 255.5, 1e12})
    check_pose(*track, mesh, frame);
  track->forget_before(how);
  check_pose(*track, mesh, how + 0.75);
  return 0;
}
