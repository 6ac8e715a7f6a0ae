// SPDX-License-Identifier: MIT
#include "bake_minimal/joint_channels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "bake_minimal/pose_quantizer.hpp"

namespace relit::bake {
namespace {

using container::ChannelTarget;
using container::PoseChannel;
using container::RestTrs;

constexpr double kCoarsestRelativeStep =
    1.0 / 256;  // of rotations and scales, where nothing is near
constexpr double kSmallestReach = 1e-12;

bool same_trs(const Trs& a, const Trs& b) {
  return a.translation == b.translation && a.rotation == b.rotation && a.scale == b.scale;
}

using AxisSamples = std::array<std::vector<double>, 3>;

class Builder {
 public:
  Builder(const Scene& scene, const PackedScene& packed, std::span<const ScenePose> poses,
          const PoseTolerance& tolerance)
      : scene_(scene), packed_(packed), poses_(poses), tolerance_(tolerance) {}

  JointChannels run() {
    for (std::size_t n = 0; n < packed_.node_source.size(); ++n) add_node(n);
    for (std::uint32_t w = 0; w < packed_.skeleton.morph_weight_count; ++w) add_morph_weight(w);
    return std::move(out_);
  }

 private:
  void add_node(std::size_t n) {
    const std::size_t source = packed_.node_source[n];
    const Node& node = scene_.nodes[source];
    if (node.matrix) return;
    const bool rests = std::all_of(poses_.begin(), poses_.end(), [&](const ScenePose& pose) {
      return same_trs(pose.local[source], node.local);
    });
    if (rests) return;
    const double reach = std::max(tolerance_.reach[n], kSmallestReach);
    RestTrs rest;
    rest.node = static_cast<std::uint32_t>(n);
    const bool t = add_vector(ChannelTarget::kTranslation, n, translations(source),
                              tolerance_.surface / tolerance_.parent_scale[n], rest.translation);
    const bool r = add_rotation(
        n, rotations(source),
        std::clamp(tolerance_.surface / reach, kFinestRotationStep, kCoarsestRelativeStep),
        rest.rotation);
    const AxisSamples s = scales(source);
    double largest_scale = 0;
    for (const auto& component : s) {
      for (const double v : component) largest_scale = std::max(largest_scale, std::abs(v));
    }
    // A scale that is off by a fraction moves a vertex by that fraction of its distance.
    const double scale_step =
        largest_scale * std::min(tolerance_.surface / reach, kCoarsestRelativeStep);
    const bool k = add_vector(ChannelTarget::kScale, n, s, scale_step, rest.scale);
    const bool needs_rest = (!t && rest.translation != RestTrs{}.translation) ||
                            (!r && rest.rotation != RestTrs{}.rotation) ||
                            (!k && rest.scale != RestTrs{}.scale) || (!t && !r && !k);
    if (needs_rest) out_.rest.push_back(rest);
  }

  AxisSamples translations(std::size_t source) const {
    return collect([&](const ScenePose& pose, int i) { return pose.local[source].translation[i]; });
  }
  AxisSamples scales(std::size_t source) const {
    return collect([&](const ScenePose& pose, int i) { return pose.local[source].scale[i]; });
  }
  template <class Get>
  AxisSamples collect(Get get) const {
    AxisSamples out;
    for (const ScenePose& pose : poses_) {
      for (int i = 0; i < 3; ++i) out[static_cast<std::size_t>(i)].push_back(get(pose, i));
    }
    return out;
  }
  std::vector<glm::dvec4> rotations(std::size_t source) const {
    std::vector<glm::dvec4> out;
    for (const ScenePose& pose : poses_) {
      const glm::quat& q = pose.local[source].rotation;
      const glm::dvec4 v(q.x, q.y, q.z, q.w);
      out.push_back(v / std::sqrt(glm::dot(v, v)));
    }
    make_continuous(out);
    return out;
  }

  /// Adds a channel, or where nothing moves sets `rest`. Returns whether there is a channel.
  bool add_vector(ChannelTarget target, std::size_t node, const AxisSamples& values, double step,
                  std::array<float, 3>& rest) {
    if (constant_within(values, step)) {
      for (std::size_t i = 0; i < 3; ++i) rest[i] = static_cast<float>(middle(values[i]));
      return false;
    }
    add_channel(target, node, quantize_linear(values, step));
    return true;
  }

  bool add_rotation(std::size_t node, const std::vector<glm::dvec4>& values, double step,
                    std::array<float, 4>& rest) {
    std::array<std::vector<double>, 4> components;
    for (const glm::dvec4& q : values) {
      for (int i = 0; i < 4; ++i) components[static_cast<std::size_t>(i)].push_back(q[i]);
    }
    if (!constant_within(components, step)) {
      add_channel(ChannelTarget::kRotation, node, quantize_rotation(values, step));
      return true;
    }
    glm::dvec4 q;
    for (int i = 0; i < 4; ++i) q[i] = middle(components[static_cast<std::size_t>(i)]);
    q /= std::sqrt(glm::dot(q, q));
    for (int i = 0; i < 4; ++i) rest[static_cast<std::size_t>(i)] = static_cast<float>(q[i]);
    return false;
  }

  /// How far a weight of 1 moves a vertex, in metres, over all meshes that use it.
  double morph_reach(std::uint32_t weight) const {
    double reach = 0;
    for (std::size_t m = 0; m < packed_.meshes.size(); ++m) {
      const decoders::Mesh& mesh = packed_.meshes[m];
      if (weight < mesh.first_morph_weight ||
          weight - mesh.first_morph_weight >= mesh.morph_targets.size()) {
        continue;
      }
      for (const glm::vec3& d : mesh.morph_targets[weight - mesh.first_morph_weight]) {
        const double length = std::sqrt(static_cast<double>(glm::dot(d, d)));
        reach = std::max(reach, length * tolerance_.mesh_scale[m]);
      }
    }
    return reach;
  }

  /// A weight that rests at something else than 0 is a channel all of whose integers are 0.
  void add_morph_weight(std::uint32_t weight) {
    const double reach = morph_reach(weight);
    if (reach == 0) return;
    std::vector<double> values;
    for (const ScenePose& pose : poses_) values.push_back(pose.morph_weights[weight]);
    const double step = tolerance_.surface / reach;
    const std::span<const std::vector<double>> one(&values, 1);
    if (constant_within(one, step)) {
      const double rest = middle(values);
      if (std::abs(rest) <= step / 2) return;
      values.assign(values.size(), rest);
    }
    add_channel(ChannelTarget::kMorphWeight, weight, quantize_linear(one, step));
  }

  void add_channel(ChannelTarget target, std::size_t index, QuantizedChannel channel) {
    out_.channels.push_back(
        {target, static_cast<std::uint32_t>(index), channel.offset, channel.step});
    for (std::vector<std::uint16_t>& words : channel.words) out_.words.push_back(std::move(words));
  }

  const Scene& scene_;
  const PackedScene& packed_;
  std::span<const ScenePose> poses_;
  const PoseTolerance& tolerance_;
  JointChannels out_;
};

}  // namespace

JointChannels build_joint_channels(const Scene& scene, const PackedScene& packed,
                                   std::span<const ScenePose> poses,
                                   const PoseTolerance& tolerance) {
  return Builder(scene, packed, poses, tolerance).run();
}

}  // namespace relit::bake
