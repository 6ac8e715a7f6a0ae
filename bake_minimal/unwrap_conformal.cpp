// SPDX-License-Identifier: MIT
#include "bake_minimal/unwrap_conformal.hpp"

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <cmath>

#include "bake_minimal/cross2.hpp"

namespace relit::bake {
namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Solver = Eigen::SimplicialLDLT<Matrix>;
using Triplet = Eigen::Triplet<double>;

// Half the cotangent of the angle at corner i: the weight of the opposite edge.
double half_cotangent(const std::array<glm::dvec2, 3>& p, std::size_t i) {
  const glm::dvec2 a = p[(i + 1) % 3] - p[i];
  const glm::dvec2 b = p[(i + 2) % 3] - p[i];
  return 0.5 * glm::dot(a, b) / cross2(a, b);
}

bool all_finite(const Eigen::VectorXd& v) { return v.allFinite(); }

}  // namespace

std::optional<std::vector<glm::dvec2>> solve_conformal(const PatchMesh& mesh) {
  // Unknowns: u and v of every vertex but the pins; `slot` of a pin is negative.
  std::vector<int> slot(mesh.vertex_count, 0);
  slot[mesh.pins[0]] = -1;
  slot[mesh.pins[1]] = -2;
  int unknowns = 0;
  for (int& s : slot) {
    if (s == 0) s = 2 * unknowns++;
  }
  const std::array<glm::dvec2, 2> pinned{glm::dvec2(0.0), glm::dvec2(mesh.pin_distance, 0.0)};
  std::vector<Triplet> entries;
  Eigen::VectorXd right = Eigen::VectorXd::Zero(2 * unknowns);
  const auto add = [&](std::uint32_t row, int row_axis, std::uint32_t column, int column_axis,
                       double value) {
    if (slot[row] < 0) return;
    const int r = slot[row] + row_axis;
    if (slot[column] >= 0) {
      entries.emplace_back(r, slot[column] + column_axis, value);
    } else {
      right[r] -= value * pinned[static_cast<std::size_t>(-1 - slot[column])][column_axis];
    }
  };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t i = mesh.triangles[t][(k + 1) % 3];
      const std::uint32_t j = mesh.triangles[t][(k + 2) % 3];
      const double w = half_cotangent(mesh.rest[t], k);
      for (int axis = 0; axis < 2; ++axis) {
        add(i, axis, i, axis, w);
        add(j, axis, j, axis, w);
        add(i, axis, j, axis, -w);
        add(j, axis, i, axis, -w);
      }
      // The area ½ Σ (u_i v_j - u_j v_i); inner edges cancel out.
      add(i, 0, j, 1, -0.5);
      add(j, 1, i, 0, -0.5);
      add(j, 0, i, 1, 0.5);
      add(i, 1, j, 0, 0.5);
    }
  }
  Matrix matrix(2 * unknowns, 2 * unknowns);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Solver solver(matrix);
  if (solver.info() != Eigen::Success) return std::nullopt;
  const Eigen::VectorXd x = solver.solve(right);
  if (!all_finite(x)) return std::nullopt;
  std::vector<glm::dvec2> uv(mesh.vertex_count);
  for (std::size_t v = 0; v < uv.size(); ++v) {
    const int s = slot[v];
    uv[v] = s < 0 ? pinned[static_cast<std::size_t>(-1 - s)] : glm::dvec2(x[s], x[s + 1]);
  }
  return uv;
}

std::optional<std::vector<glm::dvec2>> solve_rigid(const PatchMesh& mesh,
                                                   std::vector<glm::dvec2> uv, int steps) {
  // Vertex 0 stays at the origin, the others are the unknowns.
  const auto unknowns = static_cast<int>(mesh.vertex_count) - 1;
  if (unknowns < 1) return uv;
  std::vector<Triplet> entries;
  const auto add = [&](std::uint32_t row, std::uint32_t column, double value) {
    if (row == 0 || column == 0) return;
    entries.emplace_back(static_cast<int>(row) - 1, static_cast<int>(column) - 1, value);
  };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t i = mesh.triangles[t][(k + 1) % 3];
      const std::uint32_t j = mesh.triangles[t][(k + 2) % 3];
      const double w = half_cotangent(mesh.rest[t], k);
      add(i, i, w);
      add(j, j, w);
      add(i, j, -w);
      add(j, i, -w);
    }
  }
  Matrix matrix(unknowns, unknowns);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Solver solver(matrix);
  if (solver.info() != Eigen::Success) return std::nullopt;
  Eigen::MatrixX2d right(unknowns, 2);
  for (int step = 0; step < steps; ++step) {
    right.setZero();
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const auto& tri = mesh.triangles[t];
      const auto& rest = mesh.rest[t];
      std::array<double, 3> w{};
      double along = 0, across = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        w[k] = half_cotangent(rest, k);
        const glm::dvec2 now = uv[tri[(k + 2) % 3]] - uv[tri[(k + 1) % 3]];
        const glm::dvec2 was = rest[(k + 2) % 3] - rest[(k + 1) % 3];
        along += w[k] * glm::dot(was, now);
        across += w[k] * cross2(was, now);
      }
      const double length = std::hypot(along, across);
      const double cosine = length > 0 ? along / length : 1.0;
      const double sine = length > 0 ? across / length : 0.0;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t i = tri[(k + 1) % 3];
        const std::uint32_t j = tri[(k + 2) % 3];
        const glm::dvec2 was = rest[(k + 2) % 3] - rest[(k + 1) % 3];
        const glm::dvec2 pull =
            w[k] * glm::dvec2(cosine * was.x - sine * was.y, sine * was.x + cosine * was.y);
        for (int axis = 0; axis < 2; ++axis) {
          if (j != 0) right(static_cast<int>(j) - 1, axis) += pull[axis];
          if (i != 0) right(static_cast<int>(i) - 1, axis) -= pull[axis];
        }
      }
    }
    const Eigen::MatrixX2d x = solver.solve(right);
    if (!x.allFinite()) return std::nullopt;
    uv[0] = glm::dvec2(0.0);
    for (int v = 0; v < unknowns; ++v) {
      uv[static_cast<std::size_t>(v) + 1] = glm::dvec2(x(v, 0), x(v, 1));
    }
  }
  return uv;
}

}  // namespace relit::bake
