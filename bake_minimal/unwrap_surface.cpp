// SPDX-License-Identifier: MIT
#include "bake_minimal/unwrap_surface.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace relit::bake {
namespace {

constexpr double kWeldShare = 1e-6;
constexpr double kLeastHeightShare = 1e-4;
constexpr float kHardCosine = 0.866f;  // 30°
constexpr double kSharpCosine = 0.5;   // 60°

struct WeldKey {
  std::uint32_t group;
  std::array<std::int64_t, 3> cell;
  std::uint32_t vertex;
};

bool same_place(const WeldKey& a, const WeldKey& b) {
  return a.group == b.group && a.cell == b.cell;
}

bool finite(const glm::vec3& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

// The point of every vertex; points are numbered by their first vertex.
std::vector<std::uint32_t> weld(const SurfaceInput& input, std::vector<glm::dvec3>& points) {
  glm::dvec3 lo(std::numeric_limits<double>::infinity());
  glm::dvec3 hi = -lo;
  for (const glm::vec3& p : input.positions) {
    if (!finite(p)) continue;
    lo = glm::min(lo, glm::dvec3(p));
    hi = glm::max(hi, glm::dvec3(p));
  }
  const double extent = lo.x <= hi.x ? glm::length(hi - lo) : 0.0;
  const double cell = extent > 0 ? extent * kWeldShare : 1.0;
  std::vector<WeldKey> keys;
  keys.reserve(input.positions.size());
  for (std::size_t v = 0; v < input.positions.size(); ++v) {
    const glm::vec3 p = finite(input.positions[v]) ? input.positions[v] : glm::vec3(0.0f);
    WeldKey key{input.vertex_group[v], {}, static_cast<std::uint32_t>(v)};
    for (int k = 0; k < 3; ++k) {
      key.cell[static_cast<std::size_t>(k)] =
          std::llround((p[k] - (extent > 0 ? lo[k] : 0)) / cell);
    }
    keys.push_back(key);
  }
  std::sort(keys.begin(), keys.end(), [](const WeldKey& a, const WeldKey& b) {
    if (a.group != b.group) return a.group < b.group;
    if (a.cell != b.cell) return a.cell < b.cell;
    return a.vertex < b.vertex;
  });
  std::vector<std::uint32_t> first(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const bool opens = i == 0 || !same_place(keys[i], keys[i - 1]);
    first[keys[i].vertex] = opens ? keys[i].vertex : first[keys[i - 1].vertex];
  }
  std::vector<std::uint32_t> point(keys.size());
  for (std::size_t v = 0; v < point.size(); ++v) {
    if (first[v] == v) {
      point[v] = static_cast<std::uint32_t>(points.size());
      points.emplace_back(input.positions[v]);
    } else {
      point[v] = point[first[v]];
    }
  }
  return point;
}

struct HalfEdge {
  std::uint32_t low, high;
  std::uint32_t triangle;
  std::uint8_t side;
  bool forward;
};

struct Pairing {
  double straightness;
  std::size_t a, b;
};

class EdgeJoiner {
 public:
  EdgeJoiner(Surface& surface, const SurfaceInput& input) : surface_(surface), input_(input) {}

  void run() {
    collect();
    for (std::size_t i = 0; i < edges_.size();) {
      std::size_t end = i;
      while (end < edges_.size() && edges_[end].low == edges_[i].low &&
             edges_[end].high == edges_[i].high) {
        ++end;
      }
      join_group(i, end);
      i = end;
    }
  }

 private:
  void collect() {
    for (std::uint32_t t = 0; t < surface_.triangles.size(); ++t) {
      if (surface_.areas[t] <= 0) continue;
      for (std::uint8_t side = 0; side < 3; ++side) {
        const std::uint32_t a = surface_.triangles[t][side];
        const std::uint32_t b = surface_.triangles[t][(side + 1u) % 3u];
        edges_.push_back({std::min(a, b), std::max(a, b), t, side, a < b});
      }
    }
    std::sort(edges_.begin(), edges_.end(), [](const HalfEdge& a, const HalfEdge& b) {
      if (a.low != b.low) return a.low < b.low;
      if (a.high != b.high) return a.high < b.high;
      return a.triangle < b.triangle;
    });
  }

  void join_group(std::size_t begin, std::size_t end) {
    pairings_.clear();
    // Hundreds of triangles on one edge are a defect of the model, and not worth their square.
    const std::size_t last = std::min(end, begin + 64);
    for (std::size_t a = begin; a < last; ++a) {
      for (std::size_t b = a + 1; b < last; ++b) {
        if (edges_[a].forward == edges_[b].forward) continue;
        pairings_.push_back(
            {glm::dot(surface_.normals[edges_[a].triangle], surface_.normals[edges_[b].triangle]),
             a, b});
      }
    }
    std::stable_sort(pairings_.begin(), pairings_.end(), [](const Pairing& a, const Pairing& b) {
      return a.straightness > b.straightness;
    });
    for (const Pairing& p : pairings_) join(edges_[p.a], edges_[p.b]);
  }

  void join(const HalfEdge& a, const HalfEdge& b) {
    auto& from = surface_.neighbours[a.triangle][a.side];
    auto& to = surface_.neighbours[b.triangle][b.side];
    if (from != kNoTriangle || to != kNoTriangle) return;
    from = b.triangle;
    to = a.triangle;
    const Crease crease = crease_between(a, b);
    surface_.creases[a.triangle][a.side] = crease;
    surface_.creases[b.triangle][b.side] = crease;
  }

  Crease crease_between(const HalfEdge& a, const HalfEdge& b) const {
    if (input_.normals.empty()) return Crease::kSmooth;
    const auto normal = [&](const HalfEdge& e, std::size_t end) {
      return input_.normals[input_.indices[3 * e.triangle + (e.side + end) % 3u]];
    };
    if (glm::dot(normal(a, 0), normal(b, 1)) >= kHardCosine &&
        glm::dot(normal(a, 1), normal(b, 0)) >= kHardCosine) {
      return Crease::kSmooth;
    }
    const double bend = glm::dot(surface_.normals[a.triangle], surface_.normals[b.triangle]);
    return bend < kSharpCosine ? Crease::kSharp : Crease::kHard;
  }

  Surface& surface_;
  const SurfaceInput& input_;
  std::vector<HalfEdge> edges_;
  std::vector<Pairing> pairings_;
};

}  // namespace

Surface::Surface(const SurfaceInput& input) {
  assert(input.vertex_group.size() == input.positions.size());
  assert(input.normals.empty() || input.normals.size() == input.positions.size());
  const std::vector<std::uint32_t> point = weld(input, points);
  const std::size_t count = input.indices.size() / 3;
  triangles.resize(count);
  normals.assign(count, glm::dvec3(0.0));
  areas.assign(count, 0.0);
  neighbours.assign(count, {kNoTriangle, kNoTriangle, kNoTriangle});
  creases.assign(count, {Crease::kSmooth, Crease::kSmooth, Crease::kSmooth});
  for (std::size_t t = 0; t < count; ++t) {
    bool usable = true;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t v = input.indices[3 * t + i];
      triangles[t][i] = point[v];
      usable = usable && finite(input.positions[v]);
    }
    if (!usable) continue;
    const auto id = static_cast<std::uint32_t>(t);
    const glm::dvec3 c = glm::cross(corner(id, 1) - corner(id, 0), corner(id, 2) - corner(id, 0));
    const double twice = glm::length(c);
    const double longest = std::max({edge_length(id, 0), edge_length(id, 1), edge_length(id, 2)});
    if (!(twice > kLeastHeightShare * longest * longest)) continue;
    areas[t] = twice / 2;
    normals[t] = c / twice;
  }
  EdgeJoiner(*this, input).run();
}

std::size_t Surface::side_towards(std::uint32_t t, std::uint32_t neighbour,
                                  std::uint32_t first_point) const {
  for (std::size_t i = 0; i < 3; ++i) {
    if (neighbours[t][i] == neighbour && triangles[t][i] == first_point) return i;
  }
  assert(false);
  return 0;
}

}  // namespace relit::bake
