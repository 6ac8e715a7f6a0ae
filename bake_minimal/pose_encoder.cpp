// SPDX-License-Identifier: MIT
#include "bake_minimal/pose_encoder.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "bake_minimal/joint_channels.hpp"
#include "bake_minimal/pose_quantizer.hpp"
#include "bake_minimal/vertex_quantizer.hpp"
#include "container/base/limits.hpp"
#include "decoders/pose.hpp"
#include "decoders/pose_packet.hpp"

namespace relit::bake {
namespace {

using container::PoseKind;
using decoders::PosePacketShape;

// What the records take, for comparing the kinds: field sizes without their framing.
constexpr std::uint64_t kChannelBytes = 29;
constexpr std::uint64_t kRestBytes = 44;
constexpr std::uint64_t kNodeBytes = 52;
constexpr std::uint64_t kPaletteBytes = 52;
constexpr std::uint64_t kStreamHeaderBytes = 30;
constexpr std::uint64_t kTargetHeaderBytes = 16;
constexpr std::uint64_t kVertexRangeBytes = 28;

constexpr std::size_t kReachFrames = 8;  // that are looked at for lever arms and extents

double longest_axis(const glm::dvec3& v) { return std::max({v.x, v.y, v.z}); }

struct Box {
  glm::dvec3 low{1e300};
  glm::dvec3 high{-1e300};

  void add(const glm::dvec3& p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  [[nodiscard]] double longest_side() const {
    return high.x < low.x ? 0 : longest_axis(high - low);
  }
};

class PoseEncoder {
 public:
  PoseEncoder(const Scene& scene, std::span<const double> frame_times, const PackedScene& packed,
              const PoseOptions& options)
      : scene_(scene), times_(frame_times), packed_(packed), options_(options) {}

  Result<PoseEncoding> run() {
    RELIT_TRY(check());
    RELIT_TRY(sample_frames());
    RELIT_TRY(measure());
    std::optional<PoseEncoding> joints, vertices;
    if (options_.choice != PoseChoice::kVertices) {
      RELIT_ASSIGN(joints, encode_joints());
    }
    if (options_.choice != PoseChoice::kJoints) {
      RELIT_ASSIGN(vertices, encode_vertices(joints ? joints->joints_bytes : 0));
    }
    if (joints && vertices) {
      vertices->joints_bytes = joints->joints_bytes;
      joints->vertices_bytes = vertices->vertices_bytes;
      (vertices->vertices_bytes < joints->joints_bytes ? joints : vertices).reset();
    }
    PoseEncoding chosen = std::move(joints ? *joints : *vertices);
    // What the decoder's checks refuse must not be written.
    RELIT_TRY(decoders::PoseTrack::create(packed_.skeleton, chosen.track, packed_.meshes));
    return chosen;
  }

 private:
  Status check() const {
    if (times_.empty() || times_.size() > limits::kFrames) {
      return fail(ErrorCode::kInvalid, "pose: a clip has at least one frame");
    }
    if (std::any_of(times_.begin(), times_.end(), [](double t) { return !std::isfinite(t); })) {
      return fail(ErrorCode::kInvalid, "pose: a frame's time is not finite");
    }
    if (options_.clip < -1 || options_.clip >= static_cast<int>(scene_.clips.size())) {
      return fail(ErrorCode::kInvalid, "pose: clip " + std::to_string(options_.clip) +
                                           " of a scene with " +
                                           std::to_string(scene_.clips.size()));
    }
    if (options_.segment_frames == 0 || options_.segment_frames > limits::kFramesPerSegment) {
      return fail(ErrorCode::kInvalid, "pose: segments have 1 to " +
                                           std::to_string(limits::kFramesPerSegment) + " frames");
    }
    if (options_.precision_bits < 8 || options_.precision_bits > 20) {
      return fail(ErrorCode::kInvalid, "pose: the precision is 8 to 20 bits");
    }
    return {};
  }

  Status sample_frames() {
    poses_.resize(times_.size());
    for (std::size_t k = 0; k < times_.size(); ++k) {
      scene_.sample(options_.clip, times_[k], poses_[k]);
      bool finite = poses_[k].morph_weights.size() >= scene_.morph_weight_count;
      for (const Trs& trs : poses_[k].local) {
        const float sum = glm::dot(trs.translation, glm::vec3(1)) +
                          glm::dot(trs.scale, glm::vec3(1)) + glm::dot(trs.rotation, trs.rotation);
        finite = finite && std::isfinite(sum) && glm::dot(trs.rotation, trs.rotation) > 0;
      }
      for (const float w : poses_[k].morph_weights) finite = finite && std::isfinite(w);
      if (!finite) {
        return fail(ErrorCode::kInvalid, "pose, frame " + std::to_string(k) +
                                             ": a node or morph weight is missing or not finite");
      }
    }
    return {};
  }

  /// Positions of all primitives of one frame, by primitive; those without a mesh stay empty.
  void pose_primitives(std::size_t frame, std::vector<std::vector<glm::vec3>>& posed) {
    scene_.world_matrices(poses_[frame], world_);
    posed.resize(scene_.primitives.size());
    for (const PackedMeshSource& source : packed_.sources) {
      std::vector<glm::vec3>& positions = posed[source.primitive];
      const bool again = &source != packed_.sources.data() &&
                         (&source - 1)->primitive == source.primitive;  // parts are neighbours
      if (again) continue;
      const Primitive& primitive = scene_.primitives[source.primitive];
      positions.resize(primitive.positions.size());
      scene_.pose_primitive(primitive, poses_[frame], world_, positions, {});
    }
  }

  /// The surface's extent, and how node transforms act on it, over a few frames.
  Status measure() {
    const std::size_t nodes = packed_.node_source.size();
    tolerance_.reach.assign(nodes, 0);
    tolerance_.parent_scale.assign(nodes, 0);
    tolerance_.mesh_scale.assign(packed_.meshes.size(), 1);
    double extent = 0;
    std::vector<std::vector<glm::vec3>> posed;
    const std::size_t looks = std::min(kReachFrames, times_.size());
    for (std::size_t look = 0; look < looks; ++look) {
      const std::size_t frame = look * times_.size() / looks;
      pose_primitives(frame, posed);
      Box box;
      for (std::size_t m = 0; m < packed_.meshes.size(); ++m) {
        box = measure_mesh(m, posed[packed_.sources[m].primitive], look == 0, box);
      }
      extent = std::max(extent, box.longest_side());
      measure_parents();
    }
    if (!std::isfinite(extent)) {
      return fail(ErrorCode::kInvalid, "pose: the posed meshes are not finite");
    }
    tolerance_.surface = extent / (1 << options_.precision_bits);
    return {};
  }

  Box measure_mesh(std::size_t m, const std::vector<glm::vec3>& posed, bool first, Box all) {
    const decoders::Mesh& mesh = packed_.meshes[m];
    const std::vector<std::uint32_t>& source = packed_.sources[m].source_vertex;
    const auto influences = static_cast<std::size_t>(mesh.influences_per_vertex);
    Box own, bind;
    for (std::size_t v = 0; v < source.size(); ++v) {
      const glm::dvec3 p(posed[source[v]]);
      own.add(p);
      all.add(p);
      bind.add(glm::dvec3(mesh.positions[v]));
      for (std::size_t i = v * influences; i < (v + 1) * influences; ++i) {
        if (mesh.weights[i] > 0) extend_reach(packed_.skeleton.palette[mesh.joints[i]].node, p);
      }
    }
    if (first && bind.longest_side() > 0) {
      tolerance_.mesh_scale[m] = own.longest_side() / bind.longest_side();
    }
    return all;
  }

  void extend_reach(std::uint32_t node, const glm::dvec3& p) {
    for (auto n = static_cast<std::int32_t>(node); n >= 0;) {
      const auto i = static_cast<std::size_t>(n);
      const glm::dvec3 arm = p - glm::dvec3(world_[packed_.node_source[i]][3]);
      tolerance_.reach[i] = std::max(tolerance_.reach[i], std::sqrt(glm::dot(arm, arm)));
      n = packed_.skeleton.nodes[i].parent;
    }
  }

  void measure_parents() {
    for (std::size_t n = 0; n < packed_.node_source.size(); ++n) {
      const std::int32_t parent = packed_.skeleton.nodes[n].parent;
      const glm::mat4 m = parent < 0
                              ? glm::mat4(1.0f)
                              : world_[packed_.node_source[static_cast<std::size_t>(parent)]];
      double& scale = tolerance_.parent_scale[n];
      for (int c = 0; c < 3; ++c) {
        const glm::dvec3 axis(m[c]);
        scale = std::max(scale, std::sqrt(glm::dot(axis, axis)));
      }
    }
  }

  PoseEncoding start(PoseKind kind) const {
    PoseEncoding out;
    out.track.track_id = options_.track_id;
    out.track.clip_id = options_.clip_id;
    out.track.kind = kind;
    return out;
  }

  Status check_packet(const PosePacketShape& shape) const {
    if (decoders::pose_packet_bytes(shape) <= limits::kDecompressedBytes) return {};
    return fail(ErrorCode::kLimit, "pose: a segment of " + std::to_string(shape.frames) +
                                       " frames with " + std::to_string(shape.values) +
                                       " values each is too large; make the segments shorter");
  }

  Result<PoseEncoding> encode_joints() {
    const JointChannels joints = build_joint_channels(scene_, packed_, poses_, tolerance_);
    PoseEncoding out = start(PoseKind::kJoints);
    out.track.rest = joints.rest;
    out.track.channels = joints.channels;
    out.joints_bytes =
        joints.rest.size() * kRestBytes + joints.channels.size() * kChannelBytes + rig_bytes();
    for (std::size_t first = 0; first < times_.size(); first += options_.segment_frames) {
      const std::size_t frames =
          std::min<std::size_t>(options_.segment_frames, times_.size() - first);
      const PosePacketShape shape{joints.words.size(), frames, PoseKind::kJoints};
      RELIT_TRY(check_packet(shape));
      std::vector<std::uint16_t> values(shape.values * frames);
      for (std::size_t t = 0; t < frames; ++t) {
        for (std::size_t v = 0; v < shape.values; ++v) {
          values[t * shape.values + v] = joints.words[v][first + t];
        }
      }
      out.packets.push_back(encode_pose_packet(values, shape));
      out.joints_bytes += out.packets.back().size();
    }
    return out;
  }

  /// What of the records only kJoints needs.
  std::uint64_t rig_bytes() const {
    std::uint64_t bytes = packed_.skeleton.nodes.size() * kNodeBytes +
                          packed_.skeleton.palette.size() * kPaletteBytes;
    for (const container::MeshRecord& record : packed_.mesh_records) {
      for (const container::VertexStream& s : record.streams) {
        const bool rig = s.semantic == container::Semantic::kJoints ||
                         s.semantic == container::Semantic::kWeights;
        if (rig) bytes += kStreamHeaderBytes + s.bytes.size();
      }
      for (const container::MorphTarget& t : record.morph_targets) {
        bytes += kTargetHeaderBytes + t.bytes.size();
      }
    }
    return bytes;
  }

  /// One grid for all meshes over frames [0, end), so that vertices that coincide stay together.
  Grid vertex_grid(std::size_t end) {
    glm::vec3 low(0), high(0);
    bool first = true;
    std::vector<std::vector<glm::vec3>> posed;
    for (std::size_t frame = 0; frame < end; ++frame) {
      pose_primitives(frame, posed);
      for (const PackedMeshSource& source : packed_.sources) {
        for (const std::uint32_t v : source.source_vertex) {
          const glm::vec3& p = posed[source.primitive][v];
          low = first ? p : glm::min(low, p);
          high = first ? p : glm::max(high, p);
          first = false;
        }
      }
    }
    Grid grid = uniform_grid(low, high, 16);
    for (float& step : grid.step) step = std::max(step, static_cast<float>(tolerance_.surface));
    return grid;
  }

  /// The packet of the segment that starts at `first`.
  Result<std::vector<std::uint8_t>> encode_vertex_segment(std::size_t first, const Grid& grid) {
    const std::size_t frames =
        std::min<std::size_t>(options_.segment_frames, times_.size() - first);
    PosePacketShape shape{0, frames, PoseKind::kVertices};
    for (const decoders::Mesh& mesh : packed_.meshes) shape.values += 3 * mesh.positions.size();
    RELIT_TRY(check_packet(shape));
    std::vector<std::uint16_t> values;
    values.reserve(shape.values * frames);
    std::vector<std::vector<glm::vec3>> posed;
    for (std::size_t t = 0; t < frames; ++t) {
      pose_primitives(first + t, posed);
      for (const PackedMeshSource& source : packed_.sources) {
        for (const std::uint32_t v : source.source_vertex) {
          const glm::vec3& p = posed[source.primitive][v];
          for (std::size_t i = 0; i < 3; ++i) {
            values.push_back(grid.nearest(p[static_cast<int>(i)], i));
          }
        }
      }
    }
    return encode_pose_packet(values, shape);
  }

  /// Nothing once it is clear that the result has `enough` bytes or more (0: never enough).
  Result<std::optional<PoseEncoding>> encode_vertices(std::uint64_t enough) {
    const std::size_t first_end = std::min<std::size_t>(options_.segment_frames, times_.size());
    if (enough > 0 && first_end < times_.size()) {
      // One segment often is too much already; then the others need not even be posed.
      RELIT_ASSIGN(const std::vector<std::uint8_t> probe,
                   encode_vertex_segment(0, vertex_grid(first_end)));
      if (probe.size() >= enough) return std::optional<PoseEncoding>();
    }
    const Grid grid = vertex_grid(times_.size());
    PoseEncoding out = start(PoseKind::kVertices);
    for (const decoders::Mesh& mesh : packed_.meshes) {
      out.track.vertex_ranges.push_back({mesh.id, grid.offset, grid.step});
    }
    out.vertices_bytes = packed_.meshes.size() * kVertexRangeBytes;
    for (std::size_t first = 0; first < times_.size(); first += options_.segment_frames) {
      RELIT_ASSIGN(std::vector<std::uint8_t> packet, encode_vertex_segment(first, grid));
      out.vertices_bytes += packet.size();
      out.packets.push_back(std::move(packet));
      if (enough > 0 && out.vertices_bytes >= enough) return std::optional<PoseEncoding>();
    }
    return std::optional<PoseEncoding>(std::move(out));
  }

  const Scene& scene_;
  std::span<const double> times_;
  const PackedScene& packed_;
  const PoseOptions& options_;
  std::vector<ScenePose> poses_;
  std::vector<glm::mat4> world_;
  PoseTolerance tolerance_;
};

}  // namespace

Result<PoseEncoding> encode_pose(const Scene& scene, std::span<const double> frame_times,
                                 const PackedScene& packed, const PoseOptions& options) {
  return PoseEncoder(scene, frame_times, packed, options).run();
}

}  // namespace relit::bake
