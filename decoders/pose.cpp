// SPDX-License-Identifier: MIT
#include "decoders/pose.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "container/base/limits.hpp"
#include "container/base/out_of_memory.hpp"
#include "decoders/pose_packet.hpp"

namespace relit::decoders {
namespace {

using container::Affine;
using container::ChannelTarget;
using container::PoseChannel;
using container::PoseKind;
using container::RestTrs;

constexpr float kMaxMorphWeight = 1e6f;
constexpr float kMaxMatrixEntry = 1e12f;  // times kMaxCoordinate and its sums: still finite
constexpr unsigned kRotationBits = 15;
constexpr unsigned kRotationMask = (1u << kRotationBits) - 1;

template <std::size_t N>
bool within(const std::array<float, N>& values, float bound) {
  return std::all_of(values.begin(), values.end(),
                     [&](float v) { return std::abs(v) <= bound; });  // false for NaN
}

glm::mat4x3 to_matrix(const Affine& m) {
  return {m[0], m[4], m[8], m[1], m[5], m[9], m[2], m[6], m[10], m[3], m[7], m[11]};
}

glm::mat4x3 multiply(const glm::mat4x3& a, const glm::mat4x3& b) {
  glm::mat4x3 out;
  for (int c = 0; c < 4; ++c) out[c] = a[0] * b[c].x + a[1] * b[c].y + a[2] * b[c].z;
  out[3] += a[3];
  return out;
}

/// `q` is x, y, z, w, of unit length.
glm::mat4x3 compose(const glm::vec3& t, const glm::vec4& q, const glm::vec3& s) {
  const float x = q.x, y = q.y, z = q.z, w = q.w;
  glm::mat4x3 m;
  m[0] = glm::vec3(1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)) * s.x;
  m[1] = glm::vec3(2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)) * s.y;
  m[2] = glm::vec3(2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)) * s.z;
  m[3] = t;
  return m;
}

glm::vec4 normalized(const glm::vec4& q) { return q / std::sqrt(glm::dot(q, q)); }

/// FORMAT.md, "Pose packets": three components of 15 bits; which of x, y, z, w is left out (and not
/// negative) stands in the top bits of the first two words.
glm::vec4 unpack_rotation(const std::uint16_t* words, const PoseChannel& channel) {
  const auto top_bit = [](std::uint16_t word) { return unsigned{word} >> kRotationBits; };
  const unsigned omitted = top_bit(words[0]) | top_bit(words[1]) << 1;
  glm::vec4 q(0.0f);
  float squares = 0;
  for (unsigned i = 0, component = 0; i < 3; ++i, ++component) {
    if (component == omitted) ++component;
    const float v =
        channel.offset[i] + channel.step[i] * static_cast<float>(words[i] & kRotationMask);
    q[static_cast<int>(component)] = v;
    squares += v * v;
  }
  q[static_cast<int>(omitted)] = std::sqrt(std::max(0.0f, 1.0f - squares));
  return normalized(q);
}

std::size_t channel_values(ChannelTarget target) {
  return target == ChannelTarget::kMorphWeight ? 1 : 3;
}

bool channel_in_bounds(const PoseChannel& channel) {
  const bool rotation = channel.target == ChannelTarget::kRotation;
  const float top = rotation ? static_cast<float>(kRotationMask) : 65535.0f;
  const float bound =
      channel.target == ChannelTarget::kMorphWeight ? kMaxMorphWeight : kMaxCoordinate;
  for (std::size_t i = 0; i < channel_values(channel.target); ++i) {
    const float high = channel.offset[i] + channel.step[i] * top;
    if (!(std::abs(channel.offset[i]) <= bound) || !(std::abs(high) <= bound)) return false;
  }
  return true;
}

Status check_skeleton(const container::SkeletonRecord& skeleton) {
  if (skeleton.nodes.size() > limits::kNodes || skeleton.palette.size() > limits::kPalette) {
    return fail(ErrorCode::kLimit, "skeleton: " + std::to_string(skeleton.nodes.size()) +
                                       " nodes and " + std::to_string(skeleton.palette.size()) +
                                       " palette entries; at most " +
                                       std::to_string(limits::kNodes) + " of each are allowed");
  }
  if (skeleton.morph_weight_count > limits::kMorphTargets * limits::kMeshes) {
    return fail(ErrorCode::kLimit, "skeleton: " + std::to_string(skeleton.morph_weight_count) +
                                       " morph weights are too many");
  }
  for (std::size_t n = 0; n < skeleton.nodes.size(); ++n) {
    const container::NodeRecord& node = skeleton.nodes[n];
    if (node.parent < -1 || node.parent >= static_cast<std::int64_t>(n)) {
      return fail(ErrorCode::kCorrupt, "skeleton, node " + std::to_string(n) + ": parent " +
                                           std::to_string(node.parent) +
                                           " does not come before it");
    }
    if (!within(node.local, kMaxCoordinate)) {
      return fail(ErrorCode::kCorrupt,
                  "skeleton, node " + std::to_string(n) + ": matrix entries beyond ±1e9");
    }
  }
  for (std::size_t p = 0; p < skeleton.palette.size(); ++p) {
    const container::PaletteEntry& entry = skeleton.palette[p];
    if (entry.node >= skeleton.nodes.size() || !within(entry.inverse_bind, kMaxCoordinate)) {
      return fail(ErrorCode::kCorrupt, "skeleton, palette entry " + std::to_string(p) +
                                           ": no such node, or matrix entries beyond ±1e9");
    }
  }
  return {};
}

}  // namespace

Result<PoseTrack> PoseTrack::create(const container::SkeletonRecord& skeleton,
                                    const container::PoseTrackRecord& track,
                                    std::span<const Mesh> meshes) {
  return catch_out_of_memory("preparing a pose track", [&]() -> Result<PoseTrack> {
    RELIT_TRY(check_skeleton(skeleton));
    PoseTrack out;
    out.skeleton_ = skeleton;
    out.track_ = track;
    RELIT_TRY(out.plan(meshes));
    return out;
  });
}

Status PoseTrack::plan(std::span<const Mesh> meshes) {
  switch (track_.kind) {
    case PoseKind::kJoints:
      return plan_joints();
    case PoseKind::kVertices:
      return plan_vertices(meshes);
  }
  return fail(ErrorCode::kUnsupported, "pose track " + std::to_string(track_.track_id) +
                                           ": unknown kind " +
                                           std::to_string(static_cast<int>(track_.kind)));
}

Status PoseTrack::plan_joints() {
  const std::string where = "pose track " + std::to_string(track_.track_id);
  const std::size_t node_count = skeleton_.nodes.size();
  if (track_.channels.size() > 3 * node_count + skeleton_.morph_weight_count ||
      track_.rest.size() > node_count) {
    return fail(ErrorCode::kCorrupt,
                where + ": more channels or rest values than the skeleton has");
  }
  nodes_.resize(node_count);
  for (std::size_t n = 0; n < node_count; ++n)
    nodes_[n].local = to_matrix(skeleton_.nodes[n].local);
  for (const container::PaletteEntry& entry : skeleton_.palette) {
    inverse_bind_.push_back(to_matrix(entry.inverse_bind));
  }
  std::vector<bool> rest_seen(node_count);
  for (const RestTrs& rest : track_.rest) {
    const glm::vec4 q(rest.rotation[0], rest.rotation[1], rest.rotation[2], rest.rotation[3]);
    if (rest.node >= node_count || rest_seen[rest.node]) {
      return fail(ErrorCode::kCorrupt, where + ": rest values of node " +
                                           std::to_string(rest.node) +
                                           ", which does not exist or has them already");
    }
    if (!within(rest.translation, kMaxCoordinate) || !within(rest.scale, kMaxCoordinate) ||
        !(std::abs(glm::dot(q, q) - 1.0f) < 0.01f)) {
      return fail(ErrorCode::kCorrupt, where + ", rest of node " + std::to_string(rest.node) +
                                           ": beyond ±1e9, or its rotation is not of unit length");
    }
    rest_seen[rest.node] = true;
    nodes_[rest.node].rest = rest;
    nodes_[rest.node].from_trs = true;
  }
  std::vector<bool> weight_seen(skeleton_.morph_weight_count);
  for (const PoseChannel& channel : track_.channels) {
    const std::string what = where + ", channel " + std::to_string(channel_offsets_.size());
    if (!channel_in_bounds(channel)) {
      return fail(ErrorCode::kCorrupt, what + ": offset and step lead beyond the bounds");
    }
    const auto number = static_cast<std::int32_t>(channel_offsets_.size());
    std::int32_t* slot = nullptr;
    if (channel.target == ChannelTarget::kMorphWeight) {
      if (channel.index >= weight_seen.size() || weight_seen[channel.index]) {
        return fail(ErrorCode::kCorrupt, what + ": morph weight " + std::to_string(channel.index) +
                                             " does not exist or is animated twice");
      }
      weight_seen[channel.index] = true;
    } else {
      if (channel.index < node_count) {
        NodePlan& plan = nodes_[channel.index];
        plan.from_trs = true;
        slot = channel.target == ChannelTarget::kTranslation ? &plan.translation
               : channel.target == ChannelTarget::kRotation  ? &plan.rotation
               : channel.target == ChannelTarget::kScale     ? &plan.scale
                                                             : nullptr;
      }
      if (slot == nullptr || *slot >= 0) {
        return fail(ErrorCode::kCorrupt, what + ": node " + std::to_string(channel.index) +
                                             " does not exist or is animated twice");
      }
      *slot = number;
    }
    channel_offsets_.push_back(values_per_frame_);
    values_per_frame_ += channel_values(channel.target);
  }
  return {};
}

Status PoseTrack::plan_vertices(std::span<const Mesh> meshes) {
  const std::string where = "pose track " + std::to_string(track_.track_id);
  if (track_.vertex_ranges.size() != meshes.size()) {
    return fail(ErrorCode::kCorrupt, where + ": " + std::to_string(track_.vertex_ranges.size()) +
                                         " vertex ranges for " + std::to_string(meshes.size()) +
                                         " meshes");
  }
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const container::VertexRange& range = track_.vertex_ranges[m];
    if (range.mesh_id != meshes[m].id) {
      return fail(ErrorCode::kCorrupt, where + ": vertex range " + std::to_string(m) +
                                           " is of mesh " + std::to_string(range.mesh_id) +
                                           " where mesh " + std::to_string(meshes[m].id) +
                                           " is expected");
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const float high = range.offset[i] + range.step[i] * 65535.0f;
      if (!(std::abs(range.offset[i]) <= kMaxCoordinate) || !(std::abs(high) <= kMaxCoordinate)) {
        return fail(ErrorCode::kCorrupt,
                    where + ": vertex range " + std::to_string(m) + " leads beyond ±1e9");
      }
    }
    vertex_counts_.push_back(static_cast<std::uint32_t>(meshes[m].positions.size()));
    values_per_frame_ += 3 * meshes[m].positions.size();
  }
  return {};
}

Status PoseTrack::add_packet(std::span<const std::uint8_t> packet, std::uint64_t first_frame,
                             std::uint32_t frame_count) {
  return catch_out_of_memory("decoding a pose packet",
                             [&] { return add_segment(packet, first_frame, frame_count); });
}

Status PoseTrack::add_segment(std::span<const std::uint8_t> packet, std::uint64_t first_frame,
                              std::uint32_t frame_count) {
  const auto where = [&] {
    return "pose track " + std::to_string(track_.track_id) + ", frame " +
           std::to_string(first_frame);
  };
  if (frame_count == 0 || frame_count > limits::kFramesPerSegment ||
      first_frame > limits::kFrames - frame_count) {
    return fail(ErrorCode::kLimit, where() + ": a segment of " + std::to_string(frame_count) +
                                       " frames; 1 to " +
                                       std::to_string(limits::kFramesPerSegment) + " are allowed");
  }
  const PosePacketShape shape{values_per_frame_, frame_count, track_.kind};
  if (values_per_frame_ > limits::kDecompressedBytes / 2 / frame_count - 1) {
    return fail(ErrorCode::kLimit, where() + ": " + std::to_string(frame_count) + " frames of " +
                                       std::to_string(values_per_frame_) +
                                       " values are more than a stream may hold");
  }
  auto next = std::lower_bound(
      segments_.begin(), segments_.end(), first_frame,
      [](const Segment& segment, std::uint64_t frame) { return segment.first_frame < frame; });
  const bool replaces = next != segments_.end() && next->first_frame == first_frame;
  const auto after = replaces ? next + 1 : next;
  const bool into_next = after != segments_.end() && after->first_frame < first_frame + frame_count;
  const bool into_last = next != segments_.begin() &&
                         std::prev(next)->first_frame + std::prev(next)->frame_count > first_frame;
  if (into_next || into_last) {
    return fail(ErrorCode::kCorrupt, where() + ": its " + std::to_string(frame_count) +
                                         " frames overlap another segment");
  }
  std::vector<std::uint16_t> values = take_spare();
  if (const Status decoded = decode_pose_packet(packet, shape, bytes_, values); !decoded) {
    return fail(decoded.error().code, where() + ": " + decoded.error().message);
  }
  if (replaces) {
    std::swap(next->values, values);
    next->frame_count = frame_count;
    spare_.push_back(std::move(values));
  } else {
    segments_.insert(next, Segment{first_frame, frame_count, std::move(values)});
  }
  return {};
}

std::vector<std::uint16_t> PoseTrack::take_spare() {
  if (spare_.empty()) return {};
  std::vector<std::uint16_t> values = std::move(spare_.back());
  spare_.pop_back();
  return values;
}

template <class Predicate>
void PoseTrack::forget_if(Predicate&& forgotten) {
  constexpr std::size_t kMostSpares = 2;
  for (Segment& segment : segments_) {
    if (!forgotten(segment)) continue;
    if (spare_.size() < kMostSpares) spare_.push_back(std::move(segment.values));
  }
  std::erase_if(segments_, forgotten);
}

void PoseTrack::forget_before(std::uint64_t frame) {
  forget_if(
      [&](const Segment& segment) { return segment.first_frame + segment.frame_count <= frame; });
}

void PoseTrack::forget_all() {
  forget_if([](const Segment&) { return true; });
}

void PoseTrack::forget_except(std::uint64_t first_frame) {
  forget_if([&](const Segment& segment) { return segment.first_frame != first_frame; });
}

std::size_t PoseTrack::memory_bytes() const {
  std::size_t bytes = 0;
  for (const Segment& segment : segments_) bytes += segment.values.size() * sizeof(std::uint16_t);
  return bytes;
}

const std::uint16_t* PoseTrack::frame_values(std::uint64_t frame) const {
  const auto after = std::upper_bound(
      segments_.begin(), segments_.end(), frame,
      [](std::uint64_t f, const Segment& segment) { return f < segment.first_frame; });
  if (after == segments_.begin()) return nullptr;
  const Segment& segment = *std::prev(after);
  const std::uint64_t local =
      std::min<std::uint64_t>(frame - segment.first_frame, segment.frame_count - 1);
  // A track without values still knows which frames have arrived.
  static constexpr std::uint16_t kNoValues = 0;
  if (values_per_frame_ == 0) return &kNoValues;
  return segment.values.data() + static_cast<std::size_t>(local) * values_per_frame_;
}

Status PoseTrack::sample(double frame, Pose& pose) const {
  return catch_out_of_memory("sampling a pose", [&] { return sample_at(frame, pose); });
}

Status PoseTrack::sample_at(double frame, Pose& pose) const {
  if (!std::isfinite(frame)) return fail(ErrorCode::kInvalid, "pose: the frame is not finite");
  frame = std::clamp(frame, 0.0, static_cast<double>(limits::kFrames));
  const auto whole = static_cast<std::uint64_t>(frame);
  Sampling at{frame_values(whole), nullptr, static_cast<float>(frame - static_cast<double>(whole))};
  if (at.from == nullptr) {
    return fail(ErrorCode::kNotFound, "pose track " + std::to_string(track_.track_id) +
                                          ": no frame at or before " + std::to_string(whole) +
                                          " has been decoded");
  }
  at.to = at.fraction > 0 ? frame_values(whole + 1) : at.from;
  if (track_.kind == PoseKind::kJoints) return sample_joints(at, pose);
  sample_vertices(at, pose);
  return {};
}

glm::vec3 PoseTrack::sample_vector(std::size_t channel, const Sampling& at) const {
  const PoseChannel& c = track_.channels[channel];
  const std::size_t first = channel_offsets_[channel];
  glm::vec3 out(0.0f);
  for (std::size_t i = 0; i < channel_values(c.target); ++i) {
    const float from = at.from[first + i];
    const float to = at.to[first + i];
    out[static_cast<int>(i)] = c.offset[i] + c.step[i] * (from + (to - from) * at.fraction);
  }
  return out;
}

glm::vec4 PoseTrack::sample_rotation(std::size_t channel, const Sampling& at) const {
  const PoseChannel& c = track_.channels[channel];
  const glm::vec4 from = unpack_rotation(at.from + channel_offsets_[channel], c);
  if (at.to == at.from) return from;
  glm::vec4 to = unpack_rotation(at.to + channel_offsets_[channel], c);
  if (glm::dot(from, to) < 0) to = -to;
  // On the shorter arc the dot product is at least 0, so the sum is never shorter than 1/√2.
  return normalized(from + (to - from) * at.fraction);
}

glm::mat4x3 PoseTrack::local_matrix(const NodePlan& plan, const Sampling& at) const {
  if (!plan.from_trs) return plan.local;
  const RestTrs& rest = plan.rest;
  const glm::vec3 t =
      plan.translation >= 0
          ? sample_vector(static_cast<std::size_t>(plan.translation), at)
          : glm::vec3(rest.translation[0], rest.translation[1], rest.translation[2]);
  const glm::vec3 s = plan.scale >= 0 ? sample_vector(static_cast<std::size_t>(plan.scale), at)
                                      : glm::vec3(rest.scale[0], rest.scale[1], rest.scale[2]);
  const glm::vec4 q =
      plan.rotation >= 0
          ? sample_rotation(static_cast<std::size_t>(plan.rotation), at)
          : glm::vec4(rest.rotation[0], rest.rotation[1], rest.rotation[2], rest.rotation[3]);
  return compose(t, q, s);
}

Status PoseTrack::sample_joints(const Sampling& at, Pose& pose) const {
  pose.vertices.clear();
  pose.world.resize(nodes_.size());
  pose.palette.resize(skeleton_.palette.size());
  pose.morph_weights.assign(skeleton_.morph_weight_count, 0.0f);
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    const glm::mat4x3 local = local_matrix(nodes_[n], at);
    const std::int32_t parent = skeleton_.nodes[n].parent;
    pose.world[n] =
        parent < 0 ? local : multiply(pose.world[static_cast<std::size_t>(parent)], local);
  }
  float largest = 0;
  for (std::size_t p = 0; p < pose.palette.size(); ++p) {
    const glm::mat4x3 m = multiply(pose.world[skeleton_.palette[p].node], inverse_bind_[p]);
    pose.palette[p] = m;
    for (int c = 0; c < 4; ++c) {
      for (int r = 0; r < 3; ++r) {
        // max() drops a NaN on its left, so it is asked for.
        largest = std::isnan(m[c][r]) ? std::numeric_limits<float>::infinity()
                                      : std::max(largest, std::abs(m[c][r]));
      }
    }
    if (!(largest <= kMaxMatrixEntry)) {
      return fail(ErrorCode::kCorrupt, "pose track " + std::to_string(track_.track_id) +
                                           ": the matrix of palette entry " + std::to_string(p) +
                                           " leads beyond all bounds");
    }
  }
  for (std::size_t c = 0; c < track_.channels.size(); ++c) {
    const PoseChannel& channel = track_.channels[c];
    if (channel.target == ChannelTarget::kMorphWeight) {
      pose.morph_weights[channel.index] = sample_vector(c, at).x;
    }
  }
  return {};
}

void PoseTrack::sample_vertices(const Sampling& at, Pose& pose) const {
  pose.palette.clear();
  pose.morph_weights.clear();
  pose.vertices.resize(vertex_counts_.size());
  std::size_t first = 0;
  for (std::size_t m = 0; m < vertex_counts_.size(); ++m) {
    const container::VertexRange& range = track_.vertex_ranges[m];
    const glm::vec3 offset(range.offset[0], range.offset[1], range.offset[2]);
    const glm::vec3 step(range.step[0], range.step[1], range.step[2]);
    pose.vertices[m].resize(vertex_counts_[m]);
    for (glm::vec3& out : pose.vertices[m]) {
      const std::uint16_t* a = at.from + first;
      const std::uint16_t* b = at.to + first;
      const glm::vec3 from(a[0], a[1], a[2]);
      const glm::vec3 to(b[0], b[1], b[2]);
      out = offset + step * (from + (to - from) * at.fraction);
      first += 3;
    }
  }
}

}  // namespace relit::decoders
