// SPDX-License-Identifier: MIT
#include "bake_minimal/scene.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <limits>

namespace relit::bake {
namespace {

/// Where `time_s` falls among the keys: keys k and k+1, `u` of the way from one to the other.
struct KeySpan {
  std::size_t key = 0;
  double u = 0;
  double length_s = 0;
};

KeySpan find_key(const std::vector<float>& times, double time_s) {
  const std::size_t last = times.size() - 1;
  if (!(time_s > static_cast<double>(times.front()))) return {0, 0, 0};
  if (time_s >= static_cast<double>(times[last])) return {last, 0, 0};
  const auto after = std::upper_bound(times.begin(), times.end(), time_s, [](double t, float key) {
    return t < static_cast<double>(key);
  });
  const auto k = static_cast<std::size_t>(after - times.begin()) - 1;
  const double begin = static_cast<double>(times[k]);
  const double length = static_cast<double>(times[k + 1]) - begin;
  return {k, (time_s - begin) / length, length};
}

std::size_t component_count(const Channel& channel) {
  const std::size_t per_key = channel.interpolation == Interpolation::kCubicSpline ? 3 : 1;
  return channel.values.size() / (channel.times.size() * per_key);
}

/// Component `c` at the key span, without the spherical interpolation of rotations.
double interpolate(const Channel& channel, const KeySpan& span, std::size_t components,
                   std::size_t c) {
  const auto value = [&](std::size_t index) { return static_cast<double>(channel.values[index]); };
  if (channel.interpolation != Interpolation::kCubicSpline) {
    const double a = value(span.key * components + c);
    if (channel.interpolation == Interpolation::kStep || span.u == 0) return a;
    return a + (value((span.key + 1) * components + c) - a) * span.u;
  }
  // In-tangent, value, out-tangent of every key; glTF 2.0, appendix C.4.
  const std::size_t at = span.key * 3 * components + c;
  const double v0 = value(at + components);
  if (span.u == 0) return v0;
  const double b0 = value(at + 2 * components);
  const double a1 = value(at + 3 * components);
  const double v1 = value(at + 4 * components);
  const double t = span.u, t2 = t * t, t3 = t2 * t;
  return (2 * t3 - 3 * t2 + 1) * v0 + span.length_s * (t3 - 2 * t2 + t) * b0 +
         (-2 * t3 + 3 * t2) * v1 + span.length_s * (t3 - t2) * a1;
}

glm::dvec4 normalized(const glm::dvec4& q) {
  const double length = glm::length(q);
  return length > 1e-12 ? q / length : glm::dvec4(0, 0, 0, 1);
}

/// On the shorter arc; x, y, z, w of unit length.
glm::dvec4 slerp(const glm::dvec4& a, glm::dvec4 b, double u) {
  double cosine = glm::dot(a, b);
  if (cosine < 0) {
    b = -b;
    cosine = -cosine;
  }
  // Below this angle of 1e-4 the chord and the arc agree to 1e-9 of their length.
  if (cosine > 1 - 5e-9) return normalized(a + (b - a) * u);
  const double angle = std::acos(cosine);
  return normalized((std::sin((1 - u) * angle) * a + std::sin(u * angle) * b) / std::sin(angle));
}

glm::quat sample_rotation(const Channel& channel, const KeySpan& span) {
  glm::dvec4 q;
  if (channel.interpolation == Interpolation::kLinear && span.u > 0) {
    const float* keys = channel.values.data() + span.key * 4;
    const glm::dvec4 a = normalized({keys[0], keys[1], keys[2], keys[3]});
    const glm::dvec4 b = normalized({keys[4], keys[5], keys[6], keys[7]});
    q = slerp(a, b, span.u);
  } else {
    for (int c = 0; c < 4; ++c) q[c] = interpolate(channel, span, 4, static_cast<std::size_t>(c));
    q = normalized(q);
  }
  const glm::vec4 f(q);
  return {f.w, f.x, f.y, f.z};
}

glm::vec3 sample_vec3(const Channel& channel, const KeySpan& span) {
  return {static_cast<float>(interpolate(channel, span, 3, 0)),
          static_cast<float>(interpolate(channel, span, 3, 1)),
          static_cast<float>(interpolate(channel, span, 3, 2))};
}

void apply_channel(const Channel& channel, double time_s, ScenePose& pose) {
  const KeySpan span = find_key(channel.times, time_s);
  Trs& local = pose.local[static_cast<std::size_t>(channel.node)];
  switch (channel.path) {
    case Path::kTranslation:
      local.translation = sample_vec3(channel, span);
      break;
    case Path::kRotation:
      local.rotation = sample_rotation(channel, span);
      break;
    case Path::kScale:
      local.scale = sample_vec3(channel, span);
      break;
    case Path::kWeights: {
      const std::size_t components = component_count(channel);
      for (std::size_t c = 0; c < components; ++c) {
        pose.morph_weights[channel.first_morph_weight + c] =
            static_cast<float>(interpolate(channel, span, components, c));
      }
      break;
    }
  }
}

glm::dmat4 local_matrix(const Node& node, const Trs& trs) {
  if (node.matrix) return glm::dmat4(*node.matrix);
  glm::dmat4 m = glm::mat4_cast(glm::dquat(trs.rotation));
  for (int c = 0; c < 3; ++c) m[c] *= static_cast<double>(trs.scale[c]);
  m[3] = glm::dvec4(glm::dvec3(trs.translation), 1);
  return m;
}

/// The inverse transpose of the upper 3×3, but for a positive factor; zero for a matrix of rank 1.
glm::dmat3 normal_matrix(const glm::dmat4& m) {
  const glm::dvec3 x(m[0]), y(m[1]), z(m[2]);
  const glm::dmat3 cofactors(glm::cross(y, z), glm::cross(z, x), glm::cross(x, y));
  return glm::dot(cofactors[0], x) < 0 ? -cofactors : cofactors;
}

struct MorphedVertices {
  std::vector<glm::dvec3> positions;
  std::vector<glm::dvec3> normals;
};

MorphedVertices morph(const Primitive& primitive, const ScenePose& pose) {
  MorphedVertices out;
  out.positions.assign(primitive.positions.begin(), primitive.positions.end());
  out.normals.assign(primitive.normals.begin(), primitive.normals.end());
  for (std::size_t t = 0; t < primitive.morph_targets.size(); ++t) {
    const double weight = static_cast<double>(pose.morph_weights[primitive.first_morph_weight + t]);
    if (weight == 0) continue;
    const MorphDelta& target = primitive.morph_targets[t];
    for (std::size_t v = 0; v < target.positions.size(); ++v) {
      out.positions[v] += weight * glm::dvec3(target.positions[v]);
    }
    for (std::size_t v = 0; v < target.normals.size(); ++v) {
      out.normals[v] += weight * glm::dvec3(target.normals[v]);
    }
  }
  return out;
}

std::vector<glm::dmat4> skin_palette(const Skin& skin, std::span<const glm::mat4> world) {
  std::vector<glm::dmat4> palette(skin.joints.size());
  for (std::size_t j = 0; j < palette.size(); ++j) {
    palette[j] = glm::dmat4(world[static_cast<std::size_t>(skin.joints[j])]) *
                 glm::dmat4(skin.inverse_bind[j]);
  }
  return palette;
}

glm::dmat4 blend(const Primitive& primitive, std::span<const glm::dmat4> palette,
                 std::size_t vertex) {
  const auto influences = static_cast<std::size_t>(primitive.influences_per_vertex);
  glm::dmat4 sum(0.0);
  for (std::size_t i = vertex * influences; i < (vertex + 1) * influences; ++i) {
    const double weight = static_cast<double>(primitive.weights[i]);
    if (weight != 0) sum += palette[primitive.joints[i]] * weight;
  }
  return sum;
}

glm::vec3 transformed_normal(const glm::dmat3& m, const glm::dvec3& normal,
                             const glm::vec3& otherwise) {
  const glm::dvec3 n = m * normal;
  const double length = glm::length(n);
  // A joint that is scaled to nothing has no normal; the pose that hides a limb must stay finite.
  return length > 1e-30 && std::isfinite(length) ? glm::vec3(n / length) : otherwise;
}

}  // namespace

void Scene::sample(int clip, double time_s, ScenePose& pose) const {
  pose.local.resize(nodes.size());
  for (std::size_t n = 0; n < nodes.size(); ++n) pose.local[n] = nodes[n].local;
  pose.morph_weights = default_morph_weights;
  if (clip < 0) return;
  for (const Channel& channel : clips[static_cast<std::size_t>(clip)].channels) {
    apply_channel(channel, time_s, pose);
  }
}

void Scene::world_matrices(const ScenePose& pose, std::vector<glm::mat4>& world) const {
  std::vector<glm::dmat4> exact(nodes.size());
  world.resize(nodes.size());
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    exact[n] = local_matrix(nodes[n], pose.local[n]);
    if (nodes[n].parent >= 0)
      exact[n] = exact[static_cast<std::size_t>(nodes[n].parent)] * exact[n];
    world[n] = glm::mat4(exact[n]);
  }
}

void Scene::pose_primitive(const Primitive& primitive, const ScenePose& pose,
                           std::span<const glm::mat4> world, std::span<glm::vec3> positions,
                           std::span<glm::vec3> normals) const {
  const MorphedVertices vertices = morph(primitive, pose);
  const bool skinned = primitive.skin >= 0;
  std::vector<glm::dmat4> palette;
  glm::dmat4 matrix(world[static_cast<std::size_t>(primitive.node)]);
  if (skinned) palette = skin_palette(skins[static_cast<std::size_t>(primitive.skin)], world);
  glm::dmat3 for_normals = normal_matrix(matrix);
  for (std::size_t v = 0; v < vertices.positions.size(); ++v) {
    if (skinned) {
      matrix = blend(primitive, palette, v);
      if (!normals.empty()) for_normals = normal_matrix(matrix);
    }
    if (!positions.empty()) {
      positions[v] = glm::vec3(glm::dvec3(matrix * glm::dvec4(vertices.positions[v], 1)));
    }
    if (!normals.empty()) {
      normals[v] = transformed_normal(for_normals, vertices.normals[v], primitive.normals[v]);
    }
  }
}

Result<int> find_clip(const Scene& scene, std::string_view name_or_number) {
  const auto by_name = std::find_if(scene.clips.begin(), scene.clips.end(),
                                    [&](const Clip& clip) { return clip.name == name_or_number; });
  if (by_name != scene.clips.end()) return static_cast<int>(by_name - scene.clips.begin());
  std::size_t number = 0;
  const char* end = name_or_number.data() + name_or_number.size();
  const auto parsed = std::from_chars(name_or_number.data(), end, number);
  if (parsed.ec == std::errc() && parsed.ptr == end && number < scene.clips.size()) {
    return static_cast<int>(number);
  }
  std::string message =
      scene.path.string() + ": no clip is called \"" + std::string(name_or_number) + "\"; ";
  if (scene.clips.empty()) return fail(ErrorCode::kNotFound, message + "the file has no animation");
  message += "there are";
  for (std::size_t c = 0; c < scene.clips.size(); ++c) {
    message += (c == 0 ? " " : ", ") + std::to_string(c) + " \"" + scene.clips[c].name + "\"";
  }
  return fail(ErrorCode::kNotFound, std::move(message));
}

Result<Bounds> clip_bounds(const Scene& scene, int clip, double fps) {
  if (!(fps > 0) || !std::isfinite(fps)) {
    return fail(ErrorCode::kInvalid, "the frame rate must be a positive number");
  }
  const double duration = clip < 0 ? 0 : scene.clips[static_cast<std::size_t>(clip)].duration_s;
  Bounds bounds{glm::vec3(std::numeric_limits<float>::max()),
                glm::vec3(std::numeric_limits<float>::lowest())};
  ScenePose pose;
  std::vector<glm::mat4> world;
  std::vector<glm::vec3> positions;
  std::uint64_t frame = 0;
  do {
    scene.sample(clip, static_cast<double>(frame) / fps, pose);
    scene.world_matrices(pose, world);
    for (const Primitive& primitive : scene.primitives) {
      positions.resize(primitive.positions.size());
      scene.pose_primitive(primitive, pose, world, positions, {});
      for (const glm::vec3& p : positions) {
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
          return fail(ErrorCode::kInvalid, scene.path.string() + ": \"" + primitive.name +
                                               "\" leaves the range of numbers in frame " +
                                               std::to_string(frame) +
                                               "; check the scales of its nodes and joints");
        }
        bounds.min = glm::min(bounds.min, p);
        bounds.max = glm::max(bounds.max, p);
      }
    }
    ++frame;
  } while (static_cast<double>(frame) / fps < duration);
  return bounds;
}

}  // namespace relit::bake
