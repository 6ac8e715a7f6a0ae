// SPDX-License-Identifier: MIT
#include "bake_minimal/unwrap_charts.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <queue>
#include <tuple>
#include <unordered_map>

namespace relit::bake {
namespace {

constexpr double kConeCosine = 0.5;  // 60°
constexpr double kOutlineWeight = 0.25;
constexpr double kCreaseWeight = 0.5;
constexpr int kLloydRounds = 4;

glm::dvec3 centroid(const Surface& s, std::uint32_t t) {
  return (s.corner(t, 0) + s.corner(t, 1) + s.corner(t, 2)) / 3.0;
}

glm::dvec3 unit_or(const glm::dvec3& v, const glm::dvec3& otherwise) {
  const double length = glm::length(v);
  return length > 0 ? v / length : otherwise;
}

class Grower {
 public:
  explicit Grower(const Surface& surface)
      : surface_(surface), patch_(surface.triangles.size(), kNoTriangle) {
    by_area_.reserve(surface.triangles.size());
    for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
      if (surface.areas[t] > 0) by_area_.push_back(t);
    }
    std::stable_sort(by_area_.begin(), by_area_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return surface.areas[a] > surface.areas[b];
    });
  }

  std::vector<std::vector<std::uint32_t>> run() {
    grow_all({}, {});
    for (int round = 0; round < kLloydRounds; ++round) {
      std::vector<glm::dvec3> axes;
      std::vector<std::uint32_t> seeds = central_seeds(axes);
      grow_all(seeds, axes);
    }
    smooth_outlines();
    std::vector<std::vector<std::uint32_t>> patches(normal_sum_.size());
    for (std::uint32_t t = 0; t < patch_.size(); ++t) {
      if (patch_[t] != kNoTriangle) patches[patch_[t]].push_back(t);
    }
    std::erase_if(patches, [](const auto& p) { return p.empty(); });
    return patches;
  }

 private:
  struct Entry {
    double cost;
    std::uint32_t triangle;
    std::uint32_t patch;
    std::uint8_t side;                      // of the triangle, towards the patch
    bool operator<(const Entry& o) const {  // reversed: the least cost comes first
      return std::tie(o.cost, o.triangle, o.patch, o.side) < std::tie(cost, triangle, patch, side);
    }
  };

  void grow_all(const std::vector<std::uint32_t>& seeds, const std::vector<glm::dvec3>& axes) {
    std::fill(patch_.begin(), patch_.end(), kNoTriangle);
    normal_sum_.clear();
    axis_.clear();
    for (std::size_t i = 0; i < seeds.size(); ++i) {
      const auto id = open_patch(axes[i]);
      take(seeds[i], id);
    }
    drain();
    for (const std::uint32_t t : by_area_) {
      if (patch_[t] != kNoTriangle) continue;
      take(t, open_patch(glm::dvec3(0.0)));
      drain();
    }
  }

  std::uint32_t open_patch(const glm::dvec3& axis) {
    normal_sum_.emplace_back(0.0);
    axis_.push_back(axis);
    return static_cast<std::uint32_t>(normal_sum_.size() - 1);
  }

  // Patches of the Lloyd rounds measure against a fixed axis, new ones against their own mean.
  glm::dvec3 axis(std::uint32_t patch) const {
    return axis_[patch] != glm::dvec3(0.0) ? axis_[patch]
                                           : unit_or(normal_sum_[patch], glm::dvec3(0, 0, 1));
  }

  void take(std::uint32_t t, std::uint32_t patch) {
    patch_[t] = patch;
    normal_sum_[patch] += surface_.normals[t] * surface_.areas[t];
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t n = surface_.neighbours[t][i];
      if (n == kNoTriangle || patch_[n] != kNoTriangle) continue;
      const std::size_t side = surface_.side_towards(n, t, surface_.triangles[t][(i + 1) % 3]);
      push(n, patch, static_cast<std::uint8_t>(side));
    }
  }

  void push(std::uint32_t t, std::uint32_t patch, std::uint8_t side) {
    const double c = cost(t, patch, side);
    if (std::isfinite(c)) queue_.push({c, t, patch, side});
  }

  double cost(std::uint32_t t, std::uint32_t patch, std::uint8_t side) const {
    const double cosine = glm::dot(surface_.normals[t], axis(patch));
    if (cosine < kConeCosine || surface_.creases[t][side] == Crease::kSharp) {
      return std::numeric_limits<double>::infinity();
    }
    double inside = 0, all = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double length = surface_.edge_length(t, i);
      const std::uint32_t n = surface_.neighbours[t][i];
      all += length;
      if (n != kNoTriangle && patch_[n] == patch) inside += length;
    }
    const double outline = (all - 2 * inside) / all;
    const double crease = surface_.creases[t][side] == Crease::kHard ? kCreaseWeight : 0.0;
    return (1 - cosine) / (1 - kConeCosine) + kOutlineWeight * outline + crease;
  }

  void drain() {
    while (!queue_.empty()) {
      Entry e = queue_.top();
      queue_.pop();
      if (patch_[e.triangle] != kNoTriangle) continue;
      // The patch has grown since: what has become dearer goes back.
      const double now = cost(e.triangle, e.patch, e.side);
      if (!std::isfinite(now)) continue;
      if (now > e.cost + 1e-9 && !queue_.empty() && now > queue_.top().cost) {
        e.cost = now;
        queue_.push(e);
        continue;
      }
      take(e.triangle, e.patch);
    }
  }

  // Of every patch the triangle nearest to its centroid among those within half the cone.
  std::vector<std::uint32_t> central_seeds(std::vector<glm::dvec3>& axes) const {
    const std::size_t count = normal_sum_.size();
    std::vector<glm::dvec3> centre(count, glm::dvec3(0.0));
    std::vector<double> area(count, 0.0);
    for (std::uint32_t t = 0; t < patch_.size(); ++t) {
      if (patch_[t] == kNoTriangle) continue;
      centre[patch_[t]] += centroid(surface_, t) * surface_.areas[t];
      area[patch_[t]] += surface_.areas[t];
    }
    std::vector<std::uint32_t> best(count, kNoTriangle);
    std::vector<double> best_cost(count, std::numeric_limits<double>::infinity());
    for (std::uint32_t t = 0; t < patch_.size(); ++t) {
      const std::uint32_t p = patch_[t];
      if (p == kNoTriangle) continue;
      const glm::dvec3 off = centroid(surface_, t) - centre[p] / area[p];
      const double bend = 1 - glm::dot(surface_.normals[t], unit_or(normal_sum_[p], {0, 0, 1}));
      const double cost = glm::dot(off, off) / area[p] + bend;
      if (cost < best_cost[p]) {
        best_cost[p] = cost;
        best[p] = t;
      }
    }
    std::vector<std::uint32_t> seeds;
    for (std::size_t p = 0; p < count; ++p) {
      if (best[p] == kNoTriangle) continue;
      seeds.push_back(best[p]);
      axes.push_back(unit_or(normal_sum_[p], surface_.normals[best[p]]));
    }
    return seeds;
  }

  // Teeth of the outline change sides: a triangle with one edge to its own patch and two to
  // another. Such a triangle is a leaf, so its patch stays connected.
  void smooth_outlines() {
    for (int round = 0; round < 4; ++round) {
      bool changed = false;
      for (std::uint32_t t = 0; t < patch_.size(); ++t) {
        if (patch_[t] == kNoTriangle) continue;
        int own = 0;
        std::array<std::uint32_t, 3> others{kNoTriangle, kNoTriangle, kNoTriangle};
        for (std::size_t i = 0; i < 3; ++i) {
          const std::uint32_t n = surface_.neighbours[t][i];
          if (n == kNoTriangle) continue;
          if (patch_[n] == patch_[t]) {
            ++own;
          } else if (surface_.creases[t][i] == Crease::kSmooth) {
            others[i] = patch_[n];
          }
        }
        if (own != 1) continue;
        for (std::size_t i = 0; i < 3; ++i) {
          const std::uint32_t other = others[i];
          if (other == kNoTriangle || other != others[(i + 1) % 3]) continue;
          if (glm::dot(surface_.normals[t], axis(other)) < kConeCosine) continue;
          patch_[t] = other;
          changed = true;
          break;
        }
      }
      if (!changed) return;
    }
  }

  const Surface& surface_;
  std::vector<std::uint32_t> by_area_;
  std::vector<std::uint32_t> patch_;
  std::vector<glm::dvec3> normal_sum_;
  std::vector<glm::dvec3> axis_;
  std::priority_queue<Entry> queue_;
};

using LocalGraph = std::vector<std::array<std::uint32_t, 3>>;

LocalGraph local_graph(const Surface& surface, std::span<const std::uint32_t> patch) {
  std::unordered_map<std::uint32_t, std::uint32_t> local;
  for (std::uint32_t i = 0; i < patch.size(); ++i) local[patch[i]] = i;
  LocalGraph graph(patch.size(), {kNoTriangle, kNoTriangle, kNoTriangle});
  for (std::size_t i = 0; i < patch.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto found = local.find(surface.neighbours[patch[i]][k]);
      if (found != local.end()) graph[i][k] = found->second;
    }
  }
  return graph;
}

// Distances over centroids from the sources; `nearest` says from which.
std::vector<double> distances(const Surface& surface, std::span<const std::uint32_t> patch,
                              const LocalGraph& graph, std::span<const std::uint32_t> sources,
                              std::vector<std::uint32_t>& nearest) {
  using Item = std::pair<double, std::uint32_t>;
  std::vector<double> distance(patch.size(), std::numeric_limits<double>::infinity());
  nearest.assign(patch.size(), 0);
  std::priority_queue<Item, std::vector<Item>, std::greater<>> queue;
  for (std::uint32_t s = 0; s < sources.size(); ++s) {
    distance[sources[s]] = 0;
    nearest[sources[s]] = s;
    queue.push({0.0, sources[s]});
  }
  while (!queue.empty()) {
    const auto [d, i] = queue.top();
    queue.pop();
    if (d > distance[i]) continue;
    for (const std::uint32_t n : graph[i]) {
      if (n == kNoTriangle) continue;
      const double step = glm::length(centroid(surface, patch[i]) - centroid(surface, patch[n]));
      if (d + step < distance[n]) {
        distance[n] = d + step;
        nearest[n] = nearest[i];
        queue.push({distance[n], n});
      }
    }
  }
  return distance;
}

std::uint32_t farthest(const std::vector<double>& distance) {
  return static_cast<std::uint32_t>(std::max_element(distance.begin(), distance.end()) -
                                    distance.begin());
}

}  // namespace

std::vector<std::vector<std::uint32_t>> grow_patches(const Surface& surface) {
  return Grower(surface).run();
}

std::vector<std::vector<std::uint32_t>> split_patch(const Surface& surface,
                                                    std::span<const std::uint32_t> patch) {
  assert(patch.size() >= 2);
  const LocalGraph graph = local_graph(surface, patch);
  std::vector<std::uint32_t> nearest;
  const std::uint32_t start = 0;
  const std::uint32_t a = farthest(distances(surface, patch, graph, {&start, 1}, nearest));
  std::uint32_t b = farthest(distances(surface, patch, graph, {&a, 1}, nearest));
  // Coincident centroids leave every distance at zero.
  if (b == a) b = a == 0 ? 1 : 0;
  const std::array<std::uint32_t, 2> seeds{a, b};
  distances(surface, patch, graph, seeds, nearest);
  std::vector<std::vector<std::uint32_t>> parts(2);
  for (std::size_t i = 0; i < patch.size(); ++i) parts[nearest[i]].push_back(patch[i]);
  return parts;
}

std::vector<std::vector<std::uint32_t>> connected_parts(const Surface& surface,
                                                        std::span<const std::uint32_t> patch) {
  const LocalGraph graph = local_graph(surface, patch);
  std::vector<bool> seen(patch.size(), false);
  std::vector<std::vector<std::uint32_t>> parts;
  for (std::uint32_t first = 0; first < patch.size(); ++first) {
    if (seen[first]) continue;
    std::vector<std::uint32_t>& part = parts.emplace_back();
    std::vector<std::uint32_t> stack{first};
    seen[first] = true;
    while (!stack.empty()) {
      const std::uint32_t i = stack.back();
      stack.pop_back();
      part.push_back(patch[i]);
      for (const std::uint32_t n : graph[i]) {
        if (n == kNoTriangle || seen[n]) continue;
        seen[n] = true;
        stack.push_back(n);
      }
    }
    std::sort(part.begin(), part.end());
  }
  return parts;
}

}  // namespace relit::bake
