// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "bake_minimal/scene.hpp"

/// Scenes built by hand for the packer and the pose encoder.
namespace relit::test {

/// A (columns+1) × (rows+1) sheet in the plane of x and y, [-1, 1] each way, facing +z, gently
/// waved.
inline bake::Primitive sheet(int columns, int rows) {
  bake::Primitive p;
  p.name = "sheet";
  p.node = 0;
  p.texcoords.resize(1);
  for (int y = 0; y <= rows; ++y) {
    for (int x = 0; x <= columns; ++x) {
      const float u = static_cast<float>(x) / static_cast<float>(columns);
      const float v = static_cast<float>(y) / static_cast<float>(rows);
      p.positions.emplace_back(2 * u - 1, 2 * v - 1, 0.1f * std::sin(5 * u + 3 * v));
      p.normals.push_back(glm::normalize(
          glm::vec3(-0.25f * std::cos(5 * u + 3 * v), -0.15f * std::cos(5 * u + 3 * v), 1)));
      p.texcoords[0].emplace_back(u, v);
    }
  }
  const auto at = [&](int x, int y) { return static_cast<std::uint32_t>(y * (columns + 1) + x); };
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      p.indices.insert(p.indices.end(), {at(x, y), at(x + 1, y), at(x + 1, y + 1)});
      p.indices.insert(p.indices.end(), {at(x, y), at(x + 1, y + 1), at(x, y + 1)});
    }
  }
  p.lightmap_uv = p.texcoords[0];
  return p;
}

/// One still sheet under one node.
inline bake::Scene still_scene(int columns = 8, int rows = 6) {
  bake::Scene scene;
  scene.materials.emplace_back();
  scene.nodes.emplace_back();
  scene.primitives.push_back(sheet(columns, rows));
  return scene;
}

inline bake::Channel channel(bake::Path path, int node, std::vector<float> times,
                             std::vector<float> values) {
  bake::Channel c;
  c.path = path;
  c.node = node;
  c.times = std::move(times);
  c.values = std::move(values);
  return c;
}

/// A sheet skinned to a chain of `joints` nodes (after a root at node 0) along x; each vertex
/// follows two neighbours, or with `influences` = 8 up to eight. A clip of one second bends every
/// joint about z and y and stretches the last one.
inline bake::Scene chain_scene(int joints, int influences = 4) {
  bake::Scene scene = still_scene(24, 6);
  scene.nodes[0].local.translation = {0.5f, -0.25f, 2};
  scene.nodes[0].local.scale = {1.5f, 1.5f, 1.5f};
  bake::Skin skin;
  const float length = 2.0f / static_cast<float>(joints);
  for (int j = 0; j < joints; ++j) {
    bake::Node node;
    node.parent = j;
    node.local.translation = {j == 0 ? -1.0f : length, 0, 0};
    scene.nodes.push_back(node);
    skin.joints.push_back(j + 1);
    glm::mat4 bind(1.0f);
    bind[3] = glm::vec4(1 - length * static_cast<float>(j), 0, 0, 1);
    skin.inverse_bind.push_back(bind);
  }
  scene.skins.push_back(skin);
  bake::Primitive& p = scene.primitives[0];
  p.skin = 0;
  p.influences_per_vertex = influences;
  for (const glm::vec3& v : p.positions) {
    float sum = 0;
    std::vector<float> weights;
    for (int j = 0; j < influences; ++j) {
      const int joint = std::min(j, joints - 1);
      const float d = (v.x + 1) / length - static_cast<float>(joint) - 0.5f;
      weights.push_back(j < joints ? std::exp(-d * d) : 0.0f);
      p.joints.push_back(static_cast<std::uint16_t>(joint));
      sum += weights.back();
    }
    for (const float w : weights) p.weights.push_back(w / sum);
  }
  bake::Clip clip;
  clip.duration_s = 1;
  for (int j = 0; j < joints; ++j) {
    std::vector<float> times, values;
    for (int k = 0; k <= 8; ++k) {
      times.push_back(static_cast<float>(k) / 8);
      const float angle = 0.6f * std::sin(0.8f * static_cast<float>(k + j));
      const glm::quat q = glm::angleAxis(angle, glm::normalize(glm::vec3(0, 0.5f, 1)));
      values.insert(values.end(), {q.x, q.y, q.z, q.w});
    }
    clip.channels.push_back(channel(bake::Path::kRotation, j + 1, times, values));
  }
  clip.channels.push_back(
      channel(bake::Path::kTranslation, 1, {0, 1}, {-1, 0, 0, -1, 0.5f, 0.25f}));
  clip.channels.push_back(channel(bake::Path::kScale, joints, {0, 1}, {1, 1, 1, 1.25f, 0.75f, 1}));
  scene.clips.push_back(clip);
  return scene;
}

}  // namespace relit::test
