// SPDX-License-Identifier: MIT
#include "bake_minimal/atlas_edit.hpp"

#include <cassert>
#include <limits>

namespace relit::bake {
namespace {

template <class T>
void append_copies(std::vector<T>& values, std::span<const std::uint32_t> from, std::size_t width) {
  if (values.empty() || width == 0) return;
  values.reserve(values.size() + from.size() * width);
  for (const std::uint32_t v : from) {
    for (std::size_t k = 0; k < width; ++k) {
      const T value = values[static_cast<std::size_t>(v) * width + k];
      values.push_back(value);
    }
  }
}

// Every attribute that the glTF gave; the light map's UVs are the caller's.
void append_vertices(Primitive& p, std::span<const std::uint32_t> from) {
  const auto influences = static_cast<std::size_t>(p.influences_per_vertex);
  append_copies(p.positions, from, 1);
  append_copies(p.normals, from, 1);
  for (auto& set : p.texcoords) append_copies(set, from, 1);
  append_copies(p.colors, from, 1);
  append_copies(p.joints, from, influences);
  append_copies(p.weights, from, influences);
  for (MorphDelta& m : p.morph_targets) {
    append_copies(m.positions, from, 1);
    append_copies(m.normals, from, 1);
  }
}

}  // namespace

void add_other_side(Primitive& primitive, std::vector<glm::vec3>& posed) {
  const std::size_t vertices = primitive.positions.size();
  const std::size_t corners = primitive.indices.size() / 3 * 3;
  std::vector<std::uint32_t> all(vertices);
  for (std::size_t v = 0; v < vertices; ++v) all[v] = static_cast<std::uint32_t>(v);
  append_vertices(primitive, all);
  append_copies(posed, all, 1);
  for (std::size_t v = vertices; v < primitive.normals.size(); ++v) {
    primitive.normals[v] = -primitive.normals[v];
  }
  for (MorphDelta& m : primitive.morph_targets) {
    for (std::size_t v = vertices; v < m.normals.size(); ++v) m.normals[v] = -m.normals[v];
  }
  const auto offset = static_cast<std::uint32_t>(vertices);
  primitive.indices.resize(corners);
  for (std::size_t k = 0; k < corners; k += 3) {
    const std::uint32_t a = primitive.indices[k], b = primitive.indices[k + 1],
                        c = primitive.indices[k + 2];
    primitive.indices.insert(primitive.indices.end(), {a + offset, c + offset, b + offset});
  }
  const auto triangles = static_cast<std::uint32_t>(corners / 3);
  primitive.other_side.clear();
  for (std::uint32_t t = 0; t < triangles; ++t) primitive.other_side.push_back(t + triangles);
  for (std::uint32_t t = 0; t < triangles; ++t) primitive.other_side.push_back(t);
}

void set_corner_uvs(Primitive& primitive, std::span<const glm::vec2> corner_uv) {
  assert(corner_uv.size() == primitive.indices.size());
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  const std::size_t vertices = primitive.positions.size();
  std::vector<std::uint32_t> copied;
  std::vector<bool> used(vertices, false);
  // The copies of one vertex form a list.
  std::vector<std::uint32_t> next(vertices, kNone);
  primitive.lightmap_uv.assign(vertices, glm::vec2(0.0f));
  for (std::size_t k = 0; k < corner_uv.size(); ++k) {
    std::uint32_t v = primitive.indices[k];
    const std::uint32_t source = v;
    if (!used[v]) {
      used[v] = true;
      primitive.lightmap_uv[v] = corner_uv[k];
      continue;
    }
    while (primitive.lightmap_uv[v] != corner_uv[k] && next[v] != kNone) v = next[v];
    if (primitive.lightmap_uv[v] != corner_uv[k]) {
      const auto fresh = static_cast<std::uint32_t>(primitive.lightmap_uv.size());
      primitive.lightmap_uv.push_back(corner_uv[k]);
      next[v] = fresh;
      next.push_back(kNone);
      copied.push_back(source);
      v = fresh;
    }
    primitive.indices[k] = v;
  }
  append_vertices(primitive, copied);
}

}  // namespace relit::bake
