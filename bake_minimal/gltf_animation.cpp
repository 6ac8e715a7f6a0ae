// SPDX-License-Identifier: MIT
#include "bake_minimal/gltf_animation.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "bake_minimal/gltf_accessors.hpp"
#include "bake_minimal/gltf_instances.hpp"
#include "container/base/limits.hpp"

namespace relit::bake::gltf {
namespace {

/// Times beyond it are mistakes, and would keep whoever steps through the frames busy for good.
constexpr float kClipSeconds = 86400;

Status read_times(const Document& document, int accessor, const std::string& where,
                  Channel& channel) {
  RELIT_ASSIGN(Numbers times, read_numbers(document, accessor, {where + ", input", 1}));
  if (times.count == 0) {
    return document.fail(ErrorCode::kCorrupt, where,
                         "it has no keys; remove the channel or give it one");
  }
  channel.times = std::move(times.values);
  for (std::size_t k = 0; k < channel.times.size(); ++k) {
    const float time = channel.times[k];
    if (!std::isfinite(time) || time < 0 || (k > 0 && time <= channel.times[k - 1])) {
      return document.fail(ErrorCode::kCorrupt, where,
                           "the time of key " + std::to_string(k) +
                               " is not finite, negative or not after the one before; times must "
                               "increase from 0 on");
    }
  }
  if (channel.times.back() > kClipSeconds) {
    return document.fail(ErrorCode::kLimit, where,
                         "its last key is at " + std::to_string(channel.times.back()) +
                             " s; a day is the limit: are the times frames instead of seconds?");
  }
  return {};
}

Status check_rotations(const Document& document, const std::string& where, const Channel& channel) {
  const std::size_t per_key = channel.interpolation == Interpolation::kCubicSpline ? 3 : 1;
  const std::size_t value = per_key / 2;
  for (std::size_t k = 0; k < channel.times.size(); ++k) {
    const float* q = channel.values.data() + (k * per_key + value) * 4;
    if (!(glm::length(glm::dvec4(q[0], q[1], q[2], q[3])) > 1e-6)) {
      return document.fail(ErrorCode::kCorrupt, where,
                           "the rotation of key " + std::to_string(k) +
                               " is no unit quaternion; 0 0 0 1 stands for none");
    }
  }
  return {};
}

Status read_values(const Document& document, int accessor, const std::string& where,
                   std::size_t components, Channel& channel) {
  const bool weights = channel.path == Path::kWeights;
  RELIT_ASSIGN(Numbers values,
               read_numbers(document, accessor,
                            {where + ", output", weights ? 1 : static_cast<int>(components)}));
  const std::size_t per_key = channel.interpolation == Interpolation::kCubicSpline ? 3 : 1;
  const std::size_t needed = channel.times.size() * per_key * (weights ? components : 1);
  if (values.count != needed) {
    return document.fail(ErrorCode::kCorrupt, where,
                         std::to_string(values.count) + " values for " +
                             std::to_string(channel.times.size()) + " keys; there must be " +
                             std::to_string(needed));
  }
  channel.values = std::move(values.values);
  for (std::size_t i = 0; i < channel.values.size(); ++i) {
    if (!std::isfinite(channel.values[i])) {
      return document.fail(ErrorCode::kCorrupt, where,
                           "the value of key " + std::to_string(i / (per_key * components)) +
                               " is not finite; repair the animation and export it again");
    }
  }
  return channel.path == Path::kRotation ? check_rotations(document, where, channel) : Status();
}

std::optional<Path> path_of(const std::string& name) {
  if (name == "translation") return Path::kTranslation;
  if (name == "rotation") return Path::kRotation;
  if (name == "scale") return Path::kScale;
  if (name == "weights") return Path::kWeights;
  return std::nullopt;
}

std::optional<Interpolation> interpolation_of(const std::string& name) {
  if (name == "STEP") return Interpolation::kStep;
  if (name == "LINEAR" || name.empty()) return Interpolation::kLinear;
  if (name == "CUBICSPLINE") return Interpolation::kCubicSpline;
  return std::nullopt;
}

class ClipReader {
 public:
  ClipReader(Document& document, const NodeMap& nodes, const Scene& scene)
      : document_(document), nodes_(nodes), scene_(scene), morphs_(morph_ranges(scene)) {}

  Result<Clip> read(std::size_t index) {
    const tinygltf::Animation& source = document_.model.animations[index];
    Clip clip;
    clip.name = source.name.empty() ? std::to_string(index) : source.name;
    const std::string where = label("animation", index, source.name);
    if (source.channels.empty() && !document_.emptied_animations.contains(index)) {
      return document_.fail(ErrorCode::kCorrupt, where,
                            "it has no channels; remove it or export it with its keys");
    }
    std::set<std::pair<int, Path>> seen;
    for (std::size_t c = 0; c < source.channels.size(); ++c) {
      const std::string channel_where = where + ", channel " + std::to_string(c);
      RELIT_ASSIGN(auto channel, read_channel(source, c, channel_where));
      if (!channel) continue;
      clip.duration_s = std::max(clip.duration_s, static_cast<double>(channel->times.back()));
      if (!seen.insert({channel->node, channel->path}).second) {
        document_.warn(channel_where, "another channel moves the same; this one is ignored");
        continue;
      }
      clip.channels.push_back(std::move(*channel));
    }
    return clip;
  }

 private:
  Result<std::optional<Channel>> read_channel(const tinygltf::Animation& animation,
                                              std::size_t index, const std::string& where) {
    const tinygltf::AnimationChannel& source = animation.channels[index];
    if (!in_range(source.sampler, animation.samplers.size())) {
      return document_.fail(ErrorCode::kCorrupt, where,
                            "sampler " + std::to_string(source.sampler) +
                                " does not exist; there are " +
                                std::to_string(animation.samplers.size()));
    }
    if (!in_range(source.target_node, nodes_.to_scene.size())) {
      return document_.fail(ErrorCode::kCorrupt, where,
                            "node " + std::to_string(source.target_node) +
                                " does not exist; there are " +
                                std::to_string(nodes_.to_scene.size()));
    }
    const auto path = path_of(source.target_path);
    if (!path) {
      document_.warn(where, "it moves \"" + source.target_path + "\" and is ignored");
      return std::optional<Channel>();
    }
    const auto& sampler = animation.samplers[static_cast<std::size_t>(source.sampler)];
    const auto interpolation = interpolation_of(sampler.interpolation);
    if (!interpolation) {
      return document_.fail(ErrorCode::kCorrupt, where,
                            "interpolation \"" + sampler.interpolation +
                                "\" does not exist; use STEP, LINEAR or CUBICSPLINE");
    }
    Channel channel;
    channel.path = *path;
    channel.interpolation = *interpolation;
    channel.node = nodes_.to_scene[static_cast<std::size_t>(source.target_node)];
    std::size_t components = *path == Path::kRotation ? 4 : 3;
    const auto node = static_cast<std::size_t>(channel.node);
    if (*path == Path::kWeights) {
      if (morphs_[node].count == 0) {
        document_.warn(where, "its node shows no morph targets; it is ignored");
        return std::optional<Channel>();
      }
      components = morphs_[node].count;
      channel.first_morph_weight = morphs_[node].first;
    } else if (scene_.nodes[node].matrix) {
      return document_.fail(ErrorCode::kCorrupt, where,
                            "its node has a matrix, which cannot be animated; give the node "
                            "translation, rotation and scale");
    }
    RELIT_TRY(read_times(document_, sampler.input, where, channel));
    RELIT_TRY(read_values(document_, sampler.output, where, components, channel));
    return std::optional(std::move(channel));
  }

  Document& document_;
  const NodeMap& nodes_;
  const Scene& scene_;
  std::vector<MorphRange> morphs_;
};

}  // namespace

Status read_animations(Document& document, const NodeMap& nodes, Scene& scene) {
  const std::size_t count = document.model.animations.size();
  if (count > limits::kClips) {
    return document.fail(ErrorCode::kLimit, "animations",
                         "there are " + std::to_string(count) + "; at most " +
                             std::to_string(limits::kClips) + " are taken: split the file");
  }
  ClipReader reader(document, nodes, scene);
  for (std::size_t a = 0; a < count; ++a) {
    RELIT_ASSIGN(Clip clip, reader.read(a));
    if (clip.channels.empty()) {
      document.warn(label("animation", a, document.model.animations[a].name),
                    "it moves nothing that can be baked and is left out");
      continue;
    }
    const bool twice = std::any_of(scene.clips.begin(), scene.clips.end(),
                                   [&](const Clip& other) { return other.name == clip.name; });
    if (twice) {
      document.warn(label("animation", a, clip.name),
                    "an earlier one has the same name; choose this one by its number");
    }
    scene.clips.push_back(std::move(clip));
  }
  return {};
}

}  // namespace relit::bake::gltf
