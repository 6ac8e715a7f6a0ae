// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <random>
#include <vector>

/// Small meshes to unwrap.
namespace relit::bake::shapes {

struct Mesh {
  std::vector<glm::vec3> positions;
  std::vector<glm::vec3> normals;
  std::vector<std::uint32_t> indices;
};

inline constexpr float kTau = 6.28318530717958647692f;

inline void add_quad(Mesh& m, glm::vec3 a, glm::vec3 b, glm::vec3 c, glm::vec3 d) {
  const auto base = static_cast<std::uint32_t>(m.positions.size());
  const glm::vec3 n = glm::normalize(glm::cross(b - a, c - a));
  for (const glm::vec3& p : {a, b, c, d}) {
    m.positions.push_back(p);
    m.normals.push_back(n);
  }
  m.indices.insert(m.indices.end(), {base, base + 1, base + 2, base, base + 2, base + 3});
}

/// Six faces with vertices and normals of their own.
inline Mesh box(glm::vec3 size) {
  Mesh m;
  const glm::vec3 o(0), x(size.x, 0, 0), y(0, size.y, 0), z(0, 0, size.z);
  add_quad(m, z, z + x, z + x + y, z + y);
  add_quad(m, x, o, y, x + y);
  add_quad(m, o, x, x + z, z);
  add_quad(m, y, y + z, y + x + z, y + x);
  add_quad(m, o, z, z + y, y);
  add_quad(m, x, x + y, x + y + z, x + z);
  return m;
}

/// A grid of (columns + 1) × (rows + 1) vertices; `place` maps [0,1]² to position and normal.
template <class Place>
Mesh grid(int columns, int rows, Place&& place) {
  Mesh m;
  for (int r = 0; r <= rows; ++r) {
    for (int c = 0; c <= columns; ++c) {
      glm::vec3 n(0);
      m.positions.push_back(place(static_cast<float>(c) / static_cast<float>(columns),
                                  static_cast<float>(r) / static_cast<float>(rows), n));
      m.normals.push_back(n);
    }
  }
  const auto id = [&](int r, int c) { return static_cast<std::uint32_t>(r * (columns + 1) + c); };
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const std::uint32_t a = id(r, c), b = id(r, c + 1), d = id(r + 1, c), e = id(r + 1, c + 1);
      m.indices.insert(m.indices.end(), {a, b, e, a, e, d});
    }
  }
  return m;
}

/// With degenerate triangles at both poles and a seam of doubled vertices, as modellers export it.
inline Mesh sphere(int columns, int rows) {
  return grid(columns, rows, [](float u, float v, glm::vec3& n) {
    const float theta = v * kTau / 2, phi = -u * kTau;
    const float s = v == 0 || v == 1 ? 0.0f : std::sin(theta);
    const float around = u == 1 ? 0.0f : phi;
    n = {s * std::cos(around), v == 1 ? -1.0f : std::cos(theta), s * std::sin(around)};
    return n;
  });
}

inline Mesh torus(int columns, int rows) {
  return grid(columns, rows, [](float u, float v, glm::vec3& n) {
    const float a = u == 1 ? 0.0f : u * kTau, b = v == 1 ? 0.0f : v * kTau;
    n = {std::cos(a) * std::cos(b), std::sin(b), -std::sin(a) * std::cos(b)};
    return glm::vec3(std::cos(a), 0, -std::sin(a)) + 0.4f * n;
  });
}

inline Mesh cylinder(int columns, int rows) {
  Mesh m = grid(columns, rows, [](float u, float v, glm::vec3& n) {
    const float a = u == 1 ? 0.0f : -u * kTau;
    n = {std::cos(a), 0, std::sin(a)};
    return glm::vec3(0.5f * n.x, 2 - 2 * v, 0.5f * n.z);
  });
  for (const float side : {1.0f, -1.0f}) {
    const auto centre = static_cast<std::uint32_t>(m.positions.size());
    m.positions.push_back({0, side > 0 ? 2.0f : 0.0f, 0});
    m.normals.push_back({0, side, 0});
    for (int c = 0; c < columns; ++c) {
      const float a = -static_cast<float>(c) / static_cast<float>(columns) * kTau;
      m.positions.push_back({0.5f * std::cos(a), side > 0 ? 2.0f : 0.0f, 0.5f * std::sin(a)});
      m.normals.push_back({0, side, 0});
      const auto i = static_cast<std::uint32_t>(c);
      const std::uint32_t n = (i + 1) % static_cast<std::uint32_t>(columns);
      const std::uint32_t p = centre + 1 + (side > 0 ? i : n), q = centre + 1 + (side > 0 ? n : i);
      m.indices.insert(m.indices.end(), {centre, p, q});
    }
  }
  return m;
}

/// A wavy sheet of about one metre.
inline Mesh sheet(int columns, int rows) {
  return grid(columns, rows, [](float u, float v, glm::vec3& n) {
    n = {0, 1, 0};
    return glm::vec3(u, 0.05f * std::sin(9 * u) * std::cos(7 * v), 1 - v);
  });
}

/// A Möbius strip: the last column meets the first with the other orientation, so that no
/// consistent one exists; a fin on it makes edges of three triangles.
inline Mesh moebius_with_fin(int columns) {
  Mesh m = grid(columns, 3, [](float u, float v, glm::vec3& n) {
    const float a = u * kTau, w = (v - 0.5f) * 0.6f;
    const glm::vec3 out(std::cos(a), 0, std::sin(a));
    const glm::vec3 along = std::cos(a / 2) * out + std::sin(a / 2) * glm::vec3(0, 1, 0);
    n = {0, 1, 0};
    return out + w * along;
  });
  for (std::uint32_t c = 0; c < 6; ++c) {
    const auto top = static_cast<std::uint32_t>(m.positions.size());
    m.positions.push_back(m.positions[c] + glm::vec3(0.1f, 0.5f, 0));
    m.normals.push_back({1, 0, 0});
    m.indices.insert(m.indices.end(), {c, c + 1, top});
  }
  return m;
}

/// Triangles of very different sizes that share nothing.
inline Mesh loose_triangles(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
  Mesh m;
  for (int i = 0; i < count; ++i) {
    const glm::vec3 at(4 * unit(random), 4 * unit(random), 4 * unit(random));
    const float size = std::pow(10.0f, -2.5f + 2.5f * std::abs(unit(random)));
    for (int k = 0; k < 3; ++k) {
      m.indices.push_back(static_cast<std::uint32_t>(m.positions.size()));
      m.positions.push_back(at + size * glm::vec3(unit(random), unit(random), unit(random)));
      m.normals.push_back({0, 1, 0});
    }
  }
  return m;
}

inline void append(Mesh& to, const Mesh& from, glm::vec3 offset) {
  const auto base = static_cast<std::uint32_t>(to.positions.size());
  for (const glm::vec3& p : from.positions) to.positions.push_back(p + offset);
  to.normals.insert(to.normals.end(), from.normals.begin(), from.normals.end());
  for (const std::uint32_t i : from.indices) to.indices.push_back(base + i);
}

}  // namespace relit::bake::shapes
