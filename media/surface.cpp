// SPDX-License-Identifier: MIT
#include "media/surface.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "media/exact_math.hpp"

namespace relit::media {
namespace {

constexpr int kFineSteps = 400;
constexpr int kProbes = 12;  // angles at which the rings are compared with their chords
constexpr double kRingsPerTexture = 0.16;  // metres across the grain that the wood texture spans
constexpr double kGrainPerTexture = 0.64;  // metres along it

using Row = std::array<double, 7>;

Row to_row(const Ring& r) { return {r.y, r.rx, r.front, r.back, r.cx, r.cz, r.exponent}; }

double knot_distance(const Row& a, const Row& b) {
  double sum = 0.0;
  for (std::size_t k = 0; k < 6; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(std::sqrt(sum)) + 1e-9;
}

Row mix_rows(const Row& a, const Row& b, double ta, double tb, double t) {
  Row out{};
  for (std::size_t k = 0; k < out.size(); ++k)
    out[k] = (a[k] * (tb - t) + b[k] * (t - ta)) / (tb - ta);
  return out;
}

// Barry and Goldman's pyramid of the centripetal Catmull-Rom spline, between p1 and p2.
Row catmull_rom(const Row& p0, const Row& p1, const Row& p2, const Row& p3, double f) {
  const double t1 = knot_distance(p0, p1);
  const double t2 = t1 + knot_distance(p1, p2);
  const double t3 = t2 + knot_distance(p2, p3);
  const double t = t1 + (t2 - t1) * f;
  const Row a = mix_rows(p0, p1, 0, t1, t), b = mix_rows(p1, p2, t1, t2, t),
            c = mix_rows(p2, p3, t2, t3, t);
  return mix_rows(mix_rows(a, b, 0, t2, t), mix_rows(b, c, t1, t3, t), t1, t2, t);
}

// The ring beyond an end: the mirror image through a pole, or a straight continuation.
Row beyond(const Row& end, const Row& next) {
  Row out = end;
  if (end[1] <= 0.0) {
    out = next;
    for (std::size_t k = 1; k < 4; ++k) out[k] = -next[k];
  } else {
    for (std::size_t k = 0; k < out.size(); ++k) out[k] = 2.0 * end[k] - next[k];
  }
  return out;
}

glm::dvec3 ring_point(const Row& r, double angle) {
  const double x = exact_sin(angle), z = exact_cos(angle);
  double scale = 1.0;
  if (r[6] != 2.0) {
    scale = exact_pow(exact_pow(std::abs(x), r[6]) + exact_pow(std::abs(z), r[6]), -1.0 / r[6]);
  }
  return {r[4] + r[1] * scale * x, r[0], r[5] + (z >= 0.0 ? r[2] : r[3]) * scale * z};
}

// Largest distance of the ring at `t` from the chord between the rings at `a` and `b`.
double chord_error(const std::vector<std::array<glm::dvec3, kProbes>>& fine, std::size_t a,
                   std::size_t b, std::size_t t) {
  double worst = 0.0;
  for (std::size_t k = 0; k < kProbes; ++k) {
    const glm::dvec3 chord = fine[b][k] - fine[a][k], to = fine[t][k] - fine[a][k];
    const double length2 = glm::dot(chord, chord);
    const double along = length2 > 0.0 ? std::clamp(glm::dot(to, chord) / length2, 0.0, 1.0) : 0.0;
    worst = std::max(worst, glm::length(to - along * chord));
  }
  return worst;
}

using FineRings = std::vector<std::array<glm::dvec3, kProbes>>;

void split(const FineRings& fine, const Surface& surface, std::size_t a, std::size_t b,
           std::vector<std::size_t>& out) {
  double worst = 0.0, length = 0.0;
  std::size_t at = (a + b) / 2;
  for (std::size_t t = a + 1; t < b; ++t) {
    const double error = chord_error(fine, a, b, t);
    if (error > worst) {
      worst = error;
      at = t;
    }
  }
  for (std::size_t k = 0; k < kProbes; ++k)
    length = std::max(length, glm::length(fine[b][k] - fine[a][k]));
  if (b - a < 2 || (worst <= surface.tolerance_m && length <= surface.step_m)) return;
  if (worst <= surface.tolerance_m) at = (a + b) / 2;
  split(fine, surface, a, at, out);
  out.push_back(at);
  split(fine, surface, at, b, out);
}

std::vector<double> choose_rows(const Surface& surface) {
  std::vector<double> grid;
  for (int i = 0; i <= kFineSteps; ++i) grid.push_back(static_cast<double>(i) / kFineSteps);
  std::vector<double> fixed{0.0, 1.0};
  for (const Band& band : surface.bands) fixed.insert(fixed.end(), {band.t0, band.t1});
  grid.insert(grid.end(), fixed.begin() + 2, fixed.end());
  std::sort(grid.begin(), grid.end());
  grid.erase(std::unique(grid.begin(), grid.end()), grid.end());
  std::sort(fixed.begin(), fixed.end());
  FineRings fine(grid.size());
  for (std::size_t i = 0; i < grid.size(); ++i) {
    for (std::size_t k = 0; k < kProbes; ++k) {
      fine[i][k] = surface.point(grid[i], kTau * static_cast<double>(k) / kProbes);
    }
  }
  std::vector<std::size_t> chosen;
  for (std::size_t f = 0; f + 1 < fixed.size(); ++f) {
    const auto index = [&](double t) {
      return static_cast<std::size_t>(std::lower_bound(grid.begin(), grid.end(), t) - grid.begin());
    };
    chosen.push_back(index(fixed[f]));
    split(fine, surface, index(fixed[f]), index(fixed[f + 1]), chosen);
  }
  chosen.push_back(grid.size() - 1);
  std::vector<double> rows;
  for (const std::size_t i : chosen) rows.push_back(grid[i]);
  return rows;
}

// Derivatives by central differences: the surfaces are smooth, and only a direction is wanted.
glm::dvec3 raw_normal(const Surface& surface, double t, double angle) {
  constexpr double kStep = 1e-5;
  const double ta = std::max(t - kStep, 0.0), tb = std::min(t + kStep, 1.0);
  const glm::dvec3 along = surface.point(tb, angle) - surface.point(ta, angle);
  const glm::dvec3 around = surface.point(t, angle + kStep) - surface.point(t, angle - kStep);
  return glm::cross(around, along);
}

glm::dvec3 normal_at(const Surface& surface, double t, double angle, bool pole) {
  if (!pole) return glm::normalize(raw_normal(surface, t, angle));
  const double inside = t < 0.5 ? 1e-3 : 1.0 - 1e-3;
  glm::dvec3 sum(0.0);
  for (int k = 0; k < kProbes; ++k) {
    sum += glm::normalize(raw_normal(surface, inside, kTau * static_cast<double>(k) / kProbes));
  }
  return glm::normalize(sum);
}

glm::vec2 wood_coordinate(const Surface& surface, const glm::dvec3& p) {
  const Grain& g = surface.grain;
  const double x = p.x + g.pith_m * exact_sin(g.angle), z = p.z + g.pith_m * exact_cos(g.angle);
  return {static_cast<float>(std::sqrt(x * x + z * z) / kRingsPerTexture),
          static_cast<float>((p.y + g.offset_m) / kGrainPerTexture)};
}

void measure_chart(const Surface& surface, const std::vector<std::vector<glm::dvec3>>& rings,
                   Chart& chart) {
  chart.unroll = surface.unroll;
  chart.weight = surface.texel_weight;
  double at = 0.0, widest = 0.0;
  for (std::size_t r = 0; r < rings.size(); ++r) {
    double width = 0.0, step = 0.0;
    const std::size_t n = rings[r].size() - 1;
    for (std::size_t c = 0; c < n; ++c) {
      width += glm::length(rings[r][c + 1] - rings[r][c]);
      if (r > 0) step += glm::length(rings[r][c] - rings[r - 1][c]) / static_cast<double>(n);
    }
    at += step;
    chart.row_at.push_back(at);
    chart.row_width.push_back(width);
    widest = std::max(widest, width);
  }
  for (double& width : chart.row_width) width = std::max(width, surface.narrowest * widest);
}

Matter matter_between(const Surface& surface, double t0, double t1) {
  const double middle = 0.5 * (t0 + t1);
  for (const Band& band : surface.bands) {
    if (middle > band.t0 && middle < band.t1) return band.matter;
  }
  return surface.matter;
}

}  // namespace

std::function<glm::dvec3(double, double)> loft(std::vector<Ring> rings, double seam) {
  std::vector<Row> rows;
  for (const Ring& ring : rings) rows.push_back(to_row(ring));
  rows.insert(rows.begin(), beyond(rows[0], rows[1]));
  rows.push_back(beyond(rows[rows.size() - 1], rows[rows.size() - 2]));
  return [rows = std::move(rows), seam](double t, double angle) {
    const double place = t * static_cast<double>(rows.size() - 3);
    const auto i = std::min(static_cast<std::size_t>(place), rows.size() - 4);
    const Row row =
        catmull_rom(rows[i], rows[i + 1], rows[i + 2], rows[i + 3], place - static_cast<double>(i));
    return ring_point(row, angle + seam);
  };
}

double find_height(const std::function<glm::dvec3(double, double)>& point, double y) {
  const double start = point(0.0, 0.0).y - y;
  double before = 0.0, after = 1.0;
  for (int i = 1; i <= kFineSteps; ++i) {
    const double t = static_cast<double>(i) / kFineSteps;
    if ((point(t, 0.0).y - y) * start <= 0.0) {
      after = t;
      break;
    }
    before = t;
  }
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (before + after);
    ((point(middle, 0.0).y - y) * start > 0.0 ? before : after) = middle;
  }
  return 0.5 * (before + after);
}

Patch tessellate(const Surface& surface) {
  Patch patch{.name = surface.name, .joint = surface.joint, .columns = surface.columns};
  patch.skinned = static_cast<bool>(surface.influence);
  const std::vector<double> rows = choose_rows(surface);
  const auto stride = static_cast<std::uint32_t>(surface.columns + 1);
  std::vector<std::vector<glm::dvec3>> rings;
  std::vector<glm::dvec3> normals;
  std::vector<bool> pole;
  double outward = 0.0;
  for (const double t : rows) {
    std::vector<glm::dvec3> ring;
    glm::dvec3 centre(0.0);
    for (int c = 0; c <= surface.columns; ++c) {
      ring.push_back(
          surface.point(t, kTau * static_cast<double>(c % surface.columns) / surface.columns));
      if (c < surface.columns) centre += ring.back() / static_cast<double>(surface.columns);
    }
    pole.push_back(glm::length(ring[0] - centre) < 1e-7);
    for (int c = 0; c <= surface.columns; ++c) {
      const double angle = kTau * static_cast<double>(c % surface.columns) / surface.columns;
      normals.push_back(normal_at(surface, t, angle, pole.back()));
      outward += glm::dot(normals.back(), ring[static_cast<std::size_t>(c)] - centre);
    }
    rings.push_back(std::move(ring));
  }
  const double sign = outward < 0.0 ? -1.0 : 1.0;
  for (std::size_t r = 0; r < rings.size(); ++r) {
    for (std::size_t c = 0; c < stride; ++c) {
      Vertex vertex;
      vertex.position = glm::vec3(rings[r][c]);
      vertex.normal = glm::vec3(sign * normals[r * stride + c]);
      vertex.wood = wood_coordinate(surface, rings[r][c]);
      if (surface.influence) vertex.influence = surface.influence(rings[r][c], rows[r]);
      patch.vertices.push_back(vertex);
    }
  }
  for (std::uint32_t r = 0; r + 1 < rings.size(); ++r) {
    const Matter matter = matter_between(surface, rows[r], rows[r + 1]);
    for (std::uint32_t c = 0; c + 1 < stride; ++c) {
      const std::uint32_t a = r * stride + c, b = a + 1, d = a + stride, e = d + 1;
      const auto add = [&](std::uint32_t i, std::uint32_t j, std::uint32_t k) {
        const glm::dvec3 p(patch.vertices[i].position), q(patch.vertices[j].position),
            s(patch.vertices[k].position);
        if (glm::length(glm::cross(q - p, s - p)) < 1e-10) return;
        patch.triangles.push_back(sign > 0.0 ? std::array{i, j, k} : std::array{i, k, j});
        patch.matter.push_back(matter);
      };
      if (!pole[r]) add(a, b, e);
      if (!pole[r + 1]) add(a, e, d);
    }
  }
  measure_chart(surface, rings, patch.chart);
  return patch;
}

}  // namespace relit::media
