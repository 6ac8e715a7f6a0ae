// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <limits>
#include <numeric>
#include <random>
#include <span>
#include <vector>

/// An independent estimate of outgoing radiance, to judge baked transfer by: double precision, a
/// tree and an intersection test of its own, random cosine-distributed directions, and the light as
/// a function of direction. No transfer vectors, no light map, no fixed directions.
namespace relit::reference {

struct Hit {
  double t = std::numeric_limits<double>::infinity();
  std::size_t triangle = 0;
  double b1 = 0, b2 = 0;
};

/// A triangle soup in a median-split tree of boxes.
class TriangleTree {
 public:
  TriangleTree(std::span<const glm::vec3> positions, std::span<const std::uint32_t> indices) {
    corners_.reserve(indices.size() / 3);
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
      corners_.push_back({glm::dvec3(positions[indices[i]]), glm::dvec3(positions[indices[i + 1]]),
                          glm::dvec3(positions[indices[i + 2]])});
    }
    order_.resize(corners_.size());
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    if (!order_.empty()) build(0, order_.size());
  }

  /// The nearest triangle that `accept` takes, or t = infinity.
  template <class Accept>
  [[nodiscard]] Hit intersect(const glm::dvec3& origin, const glm::dvec3& direction,
                              const Accept& accept) const {
    Hit best;
    if (!nodes_.empty()) visit(0, origin, direction, accept, best);
    return best;
  }

  [[nodiscard]] glm::dvec3 face_normal(std::size_t triangle) const {
    const auto& c = corners_[triangle];
    const glm::dvec3 n = glm::cross(c[1] - c[0], c[2] - c[0]);
    const double length = glm::length(n);
    return length > 0 ? n / length : glm::dvec3(0);
  }

  [[nodiscard]] glm::dvec3 point(std::size_t triangle, double b1, double b2) const {
    const auto& c = corners_[triangle];
    return (1 - b1 - b2) * c[0] + b1 * c[1] + b2 * c[2];
  }

  [[nodiscard]] double diagonal() const {
    return nodes_.empty() ? 0 : glm::length(nodes_[0].high - nodes_[0].low);
  }

 private:
  struct Node {
    glm::dvec3 low, high;
    std::size_t begin = 0, end = 0;  // of order_, for leaves
    std::size_t left = 0, right = 0;
  };

  std::size_t build(std::size_t begin, std::size_t end) {
    const std::size_t self = nodes_.size();
    nodes_.emplace_back();
    glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
    for (std::size_t i = begin; i < end; ++i) {
      for (const glm::dvec3& p : corners_[order_[i]])
        low = glm::min(low, p), high = glm::max(high, p);
    }
    nodes_[self].low = low, nodes_[self].high = high;
    nodes_[self].begin = begin, nodes_[self].end = end;
    if (end - begin <= 4) return self;
    const glm::dvec3 size = high - low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t middle = (begin + end) / 2;
    const auto centre = [&](std::size_t t) {
      return corners_[t][0][axis] + corners_[t][1][axis] + corners_[t][2][axis];
    };
    std::nth_element(order_.begin() + static_cast<std::ptrdiff_t>(begin),
                     order_.begin() + static_cast<std::ptrdiff_t>(middle),
                     order_.begin() + static_cast<std::ptrdiff_t>(end),
                     [&](std::size_t a, std::size_t b) { return centre(a) < centre(b); });
    const std::size_t left = build(begin, middle);
    const std::size_t right = build(middle, end);
    nodes_[self].left = left, nodes_[self].right = right;
    return self;
  }

  static bool box_hit(const Node& node, const glm::dvec3& o, const glm::dvec3& d, double limit) {
    double enter = 0, leave = limit;
    for (int a = 0; a < 3; ++a) {
      if (d[a] == 0) {
        if (o[a] < node.low[a] || o[a] > node.high[a]) return false;
        continue;
      }
      const double t0 = (node.low[a] - o[a]) / d[a], t1 = (node.high[a] - o[a]) / d[a];
      enter = std::max(enter, std::min(t0, t1));
      leave = std::min(leave, std::max(t0, t1));
    }
    return enter <= leave * (1 + 1e-12) + 1e-12;
  }

  template <class Accept>
  void visit(std::size_t index, const glm::dvec3& o, const glm::dvec3& d, const Accept& accept,
             Hit& best) const {
    const Node& node = nodes_[index];
    if (!box_hit(node, o, d, best.t)) return;
    if (node.left != 0) {
      visit(node.left, o, d, accept, best);
      visit(node.right, o, d, accept, best);
      return;
    }
    for (std::size_t i = node.begin; i < node.end; ++i) {
      const auto& c = corners_[order_[i]];
      const glm::dvec3 e1 = c[1] - c[0], e2 = c[2] - c[0], p = glm::cross(d, e2);
      const double det = glm::dot(e1, p);
      if (det == 0) continue;
      const glm::dvec3 s = o - c[0];
      const double b1 = glm::dot(s, p) / det;
      if (b1 < 0 || b1 > 1) continue;
      const glm::dvec3 q = glm::cross(s, e1);
      const double b2 = glm::dot(d, q) / det;
      if (b2 < 0 || b1 + b2 > 1) continue;
      const double t = glm::dot(e2, q) / det;
      if (t <= 0 || t >= best.t) continue;
      const Hit hit{t, order_[i], b1, b2};
      if (accept(hit)) best = hit;
    }
  }

  std::vector<std::array<glm::dvec3, 3>> corners_;
  std::vector<std::size_t> order_;
  std::vector<Node> nodes_;
};

/// A surface of the soup as the estimator sees it.
struct PathScene {
  const TriangleTree* tree = nullptr;
  std::span<const glm::vec3> normals;  ///< per vertex
  std::span<const std::uint32_t> indices;
  std::function<glm::dvec3(std::size_t triangle, double b1, double b2)> albedo;
  std::function<bool(std::size_t triangle)> double_sided;
};

struct Estimate {
  glm::dvec3 mean{0};
  glm::dvec3 standard_error{0};
};

/// Radiance leaving a point of unit albedo, with `bounces` 0 or more, from `samples` random paths.
/// `radiance(direction)` is the light; it may be negative.
template <class Radiance>
Estimate outgoing_radiance(const PathScene& scene, std::size_t triangle, double b1, double b2,
                           int bounces, int samples, std::mt19937_64& random,
                           const Radiance& radiance) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  const double offset = 2e-5 * scene.tree->diagonal();
  struct Place {
    glm::dvec3 point, normal, face;
  };
  const auto cosine_direction = [&](const glm::dvec3& n) {
    const double u = uniform(random), phi = 2 * 3.14159265358979323846 * uniform(random);
    const glm::dvec3 helper = std::abs(n.x) < 0.7 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 a = glm::normalize(glm::cross(helper, n)), b = glm::cross(n, a);
    return std::sqrt(u) * (std::cos(phi) * a + std::sin(phi) * b) + std::sqrt(1 - u) * n;
  };
  const auto shading_normal = [&](std::size_t t, double c1, double c2) {
    const std::uint32_t* i = &scene.indices[3 * t];
    return glm::normalize((1 - c1 - c2) * glm::dvec3(scene.normals[i[0]]) +
                          c1 * glm::dvec3(scene.normals[i[1]]) +
                          c2 * glm::dvec3(scene.normals[i[2]]));
  };
  glm::dvec3 sum(0), squares(0);
  for (int k = 0; k < samples; ++k) {
    glm::dvec3 carried(1), value(0);
    Place at{glm::dvec3(0), shading_normal(triangle, b1, b2), scene.tree->face_normal(triangle)};
    at.point = scene.tree->point(triangle, b1, b2);
    for (int depth = 0; depth <= bounces; ++depth) {
      const glm::dvec3 d = cosine_direction(at.normal);
      if (glm::dot(d, at.face) <= 0) break;
      const Hit hit =
          scene.tree->intersect(at.point + offset * at.face, d, [](const Hit&) { return true; });
      if (!std::isfinite(hit.t)) {
        value += carried * radiance(d);
        break;
      }
      glm::dvec3 face = scene.tree->face_normal(hit.triangle);
      const bool back = glm::dot(face, d) > 0;
      if (back && !scene.double_sided(hit.triangle)) break;
      carried *= scene.albedo(hit.triangle, hit.b1, hit.b2);
      const double side = back ? -1 : 1;
      at = {scene.tree->point(hit.triangle, hit.b1, hit.b2),
            side * shading_normal(hit.triangle, hit.b1, hit.b2), side * face};
    }
    sum += value;
    squares += value * value;
  }
  Estimate estimate;
  estimate.mean = sum / double(samples);
  const glm::dvec3 variance =
      glm::max(squares / double(samples) - estimate.mean * estimate.mean, glm::dvec3(0));
  estimate.standard_error = glm::sqrt(variance / double(samples - 1));
  return estimate;
}

}  // namespace relit::reference
