// SPDX-License-Identifier: MIT
#include "bake_minimal/unwrap_flatten.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <unordered_map>

#include "bake_minimal/cross2.hpp"
#include "bake_minimal/unwrap_conformal.hpp"
#include "decoders/texel_raster.hpp"

namespace relit::bake {
namespace {

constexpr double kPlaneCosine = 1 - 1e-6;
// A disc's inner angle defects sum to its total curvature: beyond this (a hemisphere has 2π) no
// flat image keeps to the limits.
constexpr double kGreatestCurvature = 5.0;
constexpr int kRigidSteps = 12;
constexpr int kLeastOverlapSide = 32;
constexpr int kGreatestOverlapSide = 512;

class UnionFind {
 public:
  explicit UnionFind(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  std::uint32_t find(std::uint32_t a) {
    while (parent_[a] != a) a = parent_[a] = parent_[parent_[a]];
    return a;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

class Flattener {
 public:
  Flattener(const Surface& surface, std::span<const std::uint32_t> patch,
            const FlattenLimits& limits)
      : surface_(surface), limits_(limits) {
    chart_.triangles.assign(patch.begin(), patch.end());
  }

  std::optional<FlatChart> run() {
    build_mesh();
    if (is_plane()) {
      project();
      // A plane patch can only overlap itself where the surface does.
      if (acceptable()) return finish();
    } else if (topology_allows()) {
      choose_pins();
      if (auto uv = solve_conformal(mesh_)) {
        chart_.uv = *std::move(uv);
        if (!flipped()) {
          normalise();
          const std::vector<glm::dvec2> conformal = chart_.uv;
          if (auto rigid = solve_rigid(mesh_, conformal, kRigidSteps)) {
            chart_.uv = *std::move(rigid);
            if (!flipped() && acceptable()) return finish();
            chart_.uv = conformal;
          }
          if (acceptable()) return finish();
        }
      }
    }
    return std::nullopt;
  }

 private:
  void build_mesh() {
    const auto count = static_cast<std::uint32_t>(chart_.triangles.size());
    std::unordered_map<std::uint32_t, std::uint32_t> local;
    for (std::uint32_t i = 0; i < count; ++i) local[chart_.triangles[i]] = i;
    UnionFind corners(3 * static_cast<std::size_t>(count));
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t t = chart_.triangles[i];
      chart_.area += surface_.areas[t];
      for (std::uint32_t k = 0; k < 3; ++k) {
        const auto found = local.find(surface_.neighbours[t][k]);
        if (found == local.end()) {
          chart_.outline += surface_.edge_length(t, k);
          ++border_edges_;
          continue;
        }
        const std::uint32_t j = found->second;
        const auto side = static_cast<std::uint32_t>(
            surface_.side_towards(found->first, t, surface_.triangles[t][(k + 1) % 3]));
        corners.join(3 * i + k, 3 * j + (side + 1) % 3);
        corners.join(3 * i + (k + 1) % 3, 3 * j + side);
      }
    }
    chart_.corners.resize(3 * static_cast<std::size_t>(count));
    std::vector<std::uint32_t> number(chart_.corners.size());
    for (std::uint32_t c = 0; c < chart_.corners.size(); ++c) {
      const std::uint32_t root = corners.find(c);
      if (root == c) number[c] = static_cast<std::uint32_t>(mesh_.vertex_count++);
      chart_.corners[c] = number[root];
    }
    point_.resize(mesh_.vertex_count);
    for (std::uint32_t i = 0; i < count; ++i) add_triangle(i);
  }

  void add_triangle(std::uint32_t i) {
    const std::uint32_t t = chart_.triangles[i];
    const glm::dvec3 a = surface_.corner(t, 0);
    const glm::dvec3 along = glm::normalize(surface_.corner(t, 1) - a);
    const glm::dvec3 up = glm::cross(surface_.normals[t], along);
    std::array<glm::dvec2, 3> rest;
    std::array<std::uint32_t, 3> vertices;
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec3 d = surface_.corner(t, k) - a;
      rest[k] = {glm::dot(d, along), glm::dot(d, up)};
      vertices[k] = chart_.corners[3 * static_cast<std::size_t>(i) + k];
      point_[vertices[k]] = surface_.triangles[t][k];
    }
    mesh_.triangles.push_back(vertices);
    mesh_.rest.push_back(rest);
  }

  glm::dvec3 mean_normal() const {
    glm::dvec3 sum(0.0);
    for (const std::uint32_t t : chart_.triangles) sum += surface_.normals[t] * surface_.areas[t];
    const double length = glm::length(sum);
    return length > 0 ? sum / length : surface_.normals[chart_.triangles.front()];
  }

  bool is_plane() const {
    const glm::dvec3 n = mean_normal();
    return std::all_of(chart_.triangles.begin(), chart_.triangles.end(), [&](std::uint32_t t) {
      return glm::dot(n, surface_.normals[t]) > kPlaneCosine;
    });
  }

  void project() {
    const glm::dvec3 n = mean_normal();
    const glm::dvec3 least = std::abs(n.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 along = glm::normalize(least - n * glm::dot(n, least));
    const glm::dvec3 up = glm::cross(n, along);
    chart_.uv.resize(mesh_.vertex_count);
    for (std::size_t v = 0; v < point_.size(); ++v) {
      const glm::dvec3 d = surface_.points[point_[v]] - surface_.corner(chart_.triangles[0], 0);
      chart_.uv[v] = {glm::dot(d, along), glm::dot(d, up)};
    }
  }

  // Cheap necessary conditions: a border, no handle, and little enough curvature.
  bool topology_allows() const {
    if (border_edges_ == 0) return false;
    const auto faces = static_cast<std::int64_t>(mesh_.triangles.size());
    const std::int64_t edges = (3 * faces + border_edges_) / 2;
    const std::int64_t euler = static_cast<std::int64_t>(mesh_.vertex_count) - edges + faces;
    if (euler > 1) return false;
    if (euler < 1) return true;
    std::vector<double> defect(mesh_.vertex_count, 2 * std::numbers::pi);
    std::vector<bool> on_border(mesh_.vertex_count, false);
    mark_border(on_border);
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const glm::dvec2 a = mesh_.rest[t][(k + 1) % 3] - mesh_.rest[t][k];
        const glm::dvec2 b = mesh_.rest[t][(k + 2) % 3] - mesh_.rest[t][k];
        defect[mesh_.triangles[t][k]] -= std::atan2(cross2(a, b), glm::dot(a, b));
      }
    }
    double total = 0;
    for (std::size_t v = 0; v < defect.size(); ++v) {
      if (!on_border[v]) total += defect[v];
    }
    return std::abs(total) < kGreatestCurvature;
  }

  void mark_border(std::vector<bool>& on_border) const {
    // An inner edge's corners are joined on both of its sides, so a border edge is one whose pair
    // of local vertices no other triangle runs through backwards.
    std::unordered_map<std::uint64_t, int> forward;
    const auto key = [](std::uint32_t a, std::uint32_t b) {
      return (static_cast<std::uint64_t>(a) << 32) | b;
    };
    for (const auto& tri : mesh_.triangles) {
      for (std::size_t k = 0; k < 3; ++k) ++forward[key(tri[k], tri[(k + 1) % 3])];
    }
    for (const auto& tri : mesh_.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        if (forward.count(key(tri[(k + 1) % 3], tri[k])) != 0) continue;
        on_border[tri[k]] = true;
        on_border[tri[(k + 1) % 3]] = true;
      }
    }
  }

  void choose_pins() {
    const auto farthest = [&](std::uint32_t from) {
      std::uint32_t best = from;
      double best_distance = -1;
      for (std::uint32_t v = 0; v < point_.size(); ++v) {
        const glm::dvec3 d = surface_.points[point_[v]] - surface_.points[point_[from]];
        if (glm::dot(d, d) > best_distance && v != from) {
          best_distance = glm::dot(d, d);
          best = v;
        }
      }
      return best;
    };
    mesh_.pins[0] = farthest(0);
    mesh_.pins[1] = farthest(mesh_.pins[0]);
    mesh_.pin_distance = glm::length(surface_.points[point_[mesh_.pins[0]]] -
                                     surface_.points[point_[mesh_.pins[1]]]);
    if (!(mesh_.pin_distance > 0)) mesh_.pin_distance = std::sqrt(chart_.area);
  }

  double uv_area2(std::size_t t) const {
    const auto& tri = mesh_.triangles[t];
    return cross2(chart_.uv[tri[1]] - chart_.uv[tri[0]], chart_.uv[tri[2]] - chart_.uv[tri[0]]);
  }

  bool flipped() const {
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (!(uv_area2(t) > 0)) return true;
    }
    return false;
  }

  void normalise() {
    double sum = 0;
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) sum += uv_area2(t) / 2;
    const double scale = std::sqrt(chart_.area / sum);
    for (glm::dvec2& p : chart_.uv) p *= scale;
  }

  // The value below which `share` of the area lies.
  double quantile(std::vector<std::pair<double, double>>& value_and_area, double share) const {
    std::sort(value_and_area.begin(), value_and_area.end());
    double before = 0;
    for (const auto& [value, area] : value_and_area) {
      before += area;
      if (before >= share * chart_.area) return value;
    }
    return value_and_area.back().first;
  }

  bool acceptable() {
    normalise();
    chart_.size = turn_to_least_rectangle(chart_.uv);
    if (chart_.triangles.size() == 1) return true;
    if (!size_fits()) return false;
    std::vector<std::pair<double, double>> density, anisotropy;
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      const double area = surface_.areas[chart_.triangles[t]];
      density.emplace_back(std::sqrt(std::max(0.0, uv_area2(t) / 2) / area), area);
      anisotropy.emplace_back(triangle_anisotropy(t), area);
    }
    return quantile(density, 0.02) >= limits_.least_density &&
           quantile(density, 0.98) <= limits_.greatest_density &&
           quantile(anisotropy, 0.98) <= limits_.greatest_anisotropy && !overlaps();
  }

  bool size_fits() const {
    double edge = 0;
    for (const std::uint32_t t : chart_.triangles) {
      for (std::size_t k = 0; k < 3; ++k) edge = std::max(edge, surface_.edge_length(t, k));
    }
    edge *= 1.05;
    if (limits_.greatest_side > 0 && chart_.size.x > std::max(edge, limits_.greatest_side)) {
      return false;
    }
    if (limits_.greatest_short_side > 0 &&
        chart_.size.y > std::max(edge, limits_.greatest_short_side)) {
      return false;
    }
    return chart_.area >= limits_.least_fill * chart_.size.x * chart_.size.y;
  }

  // Ratio of the singular values of the map from the triangle's rest shape to its UVs.
  double triangle_anisotropy(std::size_t t) const {
    const auto& tri = mesh_.triangles[t];
    const auto& rest = mesh_.rest[t];
    const glm::dmat2 from(rest[1] - rest[0], rest[2] - rest[0]);
    const glm::dmat2 to(chart_.uv[tri[1]] - chart_.uv[tri[0]],
                        chart_.uv[tri[2]] - chart_.uv[tri[0]]);
    const glm::dmat2 j = to * glm::inverse(from);
    const double e = (j[0][0] + j[1][1]) / 2, f = (j[0][0] - j[1][1]) / 2;
    const double g = (j[0][1] + j[1][0]) / 2, h = (j[0][1] - j[1][0]) / 2;
    const double q = std::hypot(e, h), r = std::hypot(f, g);
    return q > r ? (q + r) / (q - r) : std::numeric_limits<double>::infinity();
  }

  // Texels owned twice, by the exact rasteriser.
  bool overlaps() const {
    const double longest = std::max(chart_.size.x, chart_.size.y);
    const double wanted =
        limits_.overlap_scale > 0 ? limits_.overlap_scale * longest : double{kGreatestOverlapSide};
    const int side = static_cast<int>(
        std::clamp(wanted, double{kLeastOverlapSide}, double{kGreatestOverlapSide}));
    const double scale = (side - 2) / longest;
    std::vector<glm::vec2> uv;
    uv.reserve(chart_.uv.size());
    for (const glm::dvec2& p : chart_.uv) uv.emplace_back((p * scale + 1.0) / double(side));
    std::vector<std::uint8_t> taken(static_cast<std::size_t>(side) *
                                    static_cast<std::size_t>(side));
    for (const auto& tri : mesh_.triangles) {
      bool twice = false;
      decoders::FixedTriangle(uv[tri[0]], uv[tri[1]], uv[tri[2]], side, side)
          .for_each_row(0, side, side, [&](int y, int x0, int x1) {
            for (int x = x0; x <= x1; ++x) {
              std::uint8_t& cell = taken[static_cast<std::size_t>(y * side + x)];
              twice = twice || cell != 0;
              cell = 1;
            }
          });
      if (twice) return true;
    }
    return false;
  }

  FlatChart finish() { return std::move(chart_); }

  const Surface& surface_;
  const FlattenLimits& limits_;
  FlatChart chart_;
  PatchMesh mesh_;
  std::vector<std::uint32_t> point_;  // of the surface, by local vertex
  std::int64_t border_edges_ = 0;
};

std::vector<glm::dvec2> convex_hull(std::vector<glm::dvec2> p) {
  std::sort(p.begin(), p.end(), [](const glm::dvec2& a, const glm::dvec2& b) {
    return a.x != b.x ? a.x < b.x : a.y < b.y;
  });
  std::vector<glm::dvec2> hull(2 * p.size());
  std::size_t k = 0;
  const auto extend = [&](const glm::dvec2& q, std::size_t floor) {
    while (k >= floor && cross2(hull[k - 1] - hull[k - 2], q - hull[k - 2]) <= 0) --k;
    hull[k++] = q;
  };
  for (const glm::dvec2& q : p) extend(q, 2);
  const std::size_t floor = k + 1;
  for (std::size_t i = p.size() - 1; i-- > 0;) extend(p[i], floor);
  hull.resize(k > 1 ? k - 1 : k);
  return hull;
}

}  // namespace

glm::dvec2 turn_to_least_rectangle(std::span<glm::dvec2> points) {
  if (points.empty()) return glm::dvec2(0.0);
  const std::vector<glm::dvec2> hull = convex_hull({points.begin(), points.end()});
  const auto bounds = [](std::span<const glm::dvec2> p, const glm::dvec2& x, glm::dvec2& lo,
                         glm::dvec2& hi) {
    lo = glm::dvec2(std::numeric_limits<double>::infinity());
    hi = -lo;
    for (const glm::dvec2& q : p) {
      const glm::dvec2 r(glm::dot(q, x), cross2(x, q));
      lo = glm::min(lo, r);
      hi = glm::max(hi, r);
    }
  };
  // The least rectangle has a side along an edge of the hull.
  glm::dvec2 axis(1, 0), lo, hi;
  bounds(hull, axis, lo, hi);
  double least = (hi.x - lo.x) * (hi.y - lo.y);
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const glm::dvec2 edge = hull[(i + 1) % hull.size()] - hull[i];
    const double length = glm::length(edge);
    if (!(length > 0)) continue;
    bounds(hull, edge / length, lo, hi);
    const double area = (hi.x - lo.x) * (hi.y - lo.y);
    if (area < least * (1 - 1e-9)) {
      least = area;
      axis = edge / length;
    }
  }
  bounds(hull, axis, lo, hi);
  if (hi.x - lo.x < hi.y - lo.y) axis = {-axis.y, axis.x};
  bounds(points, axis, lo, hi);
  for (glm::dvec2& q : points) q = glm::dvec2(glm::dot(q, axis), cross2(axis, q)) - lo;
  return hi - lo;
}

std::optional<FlatChart> flatten_patch(const Surface& surface, std::span<const std::uint32_t> patch,
                                       const FlattenLimits& limits) {
  return Flattener(surface, patch, limits).run();
}

}  // namespace relit::bake
