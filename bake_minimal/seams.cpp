// SPDX-License-Identifier: MIT
#include "bake_minimal/seams.hpp"

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace relit::bake {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

constexpr float kSmoothCosine = 0.99f;
// Weights of the two terms. On CesiumMan at 128x128 they bring the mismatch down to a sixth. Much
// looser filled texels would close seams further, but swing far beyond the values around them where
// a lookup gives them little weight, and the quantiser's range with them.
constexpr double kSeamWeight = 2.0;
constexpr double kTracedWeight = 1.0;
constexpr double kFilledWeight = 0.5;

using Key = std::array<float, 3>;
Key key_of(const glm::vec3& p) { return {p.x, p.y, p.z}; }

// A directed edge of a triangle, by its vertices.
struct Edge {
  std::uint32_t a, b;
};

// Edges by the positions of their ends, in the order of the first triangle that has them.
struct EdgeTable {
  std::map<std::pair<Key, Key>, std::vector<Edge>> edges;

  explicit EdgeTable(const SeamGeometry& g) {
    for (std::size_t t = 0; t + 2 < g.indices.size(); t += 3) {
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t a = g.indices[t + i], b = g.indices[t + (i + 1) % 3];
        const Key from = key_of(g.positions[a]), to = key_of(g.positions[b]);
        if (from == to) continue;
        if (to < from)
          edges[{to, from}].push_back({b, a});
        else
          edges[{from, to}].push_back({a, b});
      }
    }
  }
};

// Whether the surface goes on over the edge. The two sides of a sheet share edges, too, but their
// normals are opposite.
bool smooth(const SeamGeometry& g, const Edge& p, const Edge& q) {
  const auto coincide = [&](std::uint32_t a, std::uint32_t b) {
    return g.positions[a] == g.positions[b] && glm::dot(g.normals[a], g.normals[b]) > kSmoothCosine;
  };
  return coincide(p.a, q.a) && coincide(p.b, q.b);
}

}  // namespace

std::vector<Seam> find_seams(const SeamGeometry& first, const SeamGeometry& second) {
  constexpr std::size_t kMostTriangles = 8;  // a fan of loose parts: nothing smooth to find there
  std::vector<Seam> seams;
  const auto& uv = first.lightmap_uv;
  for (const auto& [ends, edges] : EdgeTable(first).edges) {
    if (edges.size() > kMostTriangles) continue;
    for (std::size_t i = 0; i < edges.size(); ++i) {
      for (std::size_t j = i + 1; j < edges.size(); ++j) {
        const Edge &p = edges[i], &q = edges[j];
        if (uv[p.a] == uv[q.a] && uv[p.b] == uv[q.b]) continue;
        if (smooth(first, p, q) && smooth(second, p, q))
          seams.push_back({{uv[p.a], uv[q.a]}, {uv[p.b], uv[q.b]}});
      }
    }
  }
  return seams;
}

struct SeamStitcher::Impl {
  // The difference of two bilinear lookups: eight texels, those of the second side negative.
  struct Difference {
    std::array<std::uint32_t, 8> texel;
    std::array<double, 8> weight;
    std::array<int, 8> slot;  // among the unknowns

    [[nodiscard]] double of(std::span<const float> plane) const {
      double sum = 0;
      for (std::size_t k = 0; k < 8; ++k) sum += weight[k] * static_cast<double>(plane[texel[k]]);
      return sum;
    }
  };

  int width = 0, height = 0;
  std::vector<Difference> differences;
  std::vector<std::uint32_t> texels;  // of the unknowns
  Eigen::SimplicialLDLT<Matrix> solver;
  bool solvable = false;

  void add_lookup(glm::vec2 uv, std::size_t first, double sign, Difference& out) const;
  void sample_seam(const Seam& seam);
  void number_texels();
  void factor(std::span<const TexelSample> traced);
};

void SeamStitcher::Impl::add_lookup(glm::vec2 uv, std::size_t first, double sign,
                                    Difference& out) const {
  const double x = std::clamp(static_cast<double>(uv.x) * width - 0.5, 0.0, width - 1.0);
  const double y = std::clamp(static_cast<double>(uv.y) * height - 0.5, 0.0, height - 1.0);
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  for (std::size_t k = 0; k < 4; ++k) {
    const int right = static_cast<int>(k % 2), down = static_cast<int>(k / 2);
    const int i = std::min(x0 + right, width - 1), j = std::min(y0 + down, height - 1);
    const double fx = x - x0, fy = y - y0;
    out.texel[first + k] = static_cast<std::uint32_t>(j * width + i);
    out.weight[first + k] = sign * (right != 0 ? fx : 1 - fx) * (down != 0 ? fy : 1 - fy);
  }
}

void SeamStitcher::Impl::sample_seam(const Seam& seam) {
  const glm::vec2 size(static_cast<float>(width), static_cast<float>(height));
  const float length_texels = std::max(glm::length((seam.to[0] - seam.from[0]) * size),
                                       glm::length((seam.to[1] - seam.from[1]) * size));
  // Two samples a texel see every bilinear patch that the edge crosses.
  const int count = std::clamp(static_cast<int>(std::ceil(2 * length_texels)), 1, 1 << 14);
  for (int i = 0; i <= count; ++i) {
    const float t = static_cast<float>(i) / static_cast<float>(count);
    Difference d{};
    add_lookup(glm::mix(seam.from[0], seam.to[0], t), 0, 1, d);
    add_lookup(glm::mix(seam.from[1], seam.to[1], t), 4, -1, d);
    differences.push_back(d);
  }
}

void SeamStitcher::Impl::number_texels() {
  std::vector<int> slots(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), -1);
  for (Difference& d : differences) {
    for (std::size_t k = 0; k < 8; ++k) {
      int& slot = slots[d.texel[k]];
      if (slot < 0) {
        slot = static_cast<int>(texels.size());
        texels.push_back(d.texel[k]);
      }
      d.slot[k] = slot;
    }
  }
}

void SeamStitcher::Impl::factor(std::span<const TexelSample> traced) {
  std::vector<std::uint8_t> is_traced(
      static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0);
  for (const TexelSample& s : traced) is_traced[s.texel] = 1;
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(64 * differences.size() + texels.size());
  for (std::size_t i = 0; i < texels.size(); ++i) {
    entries.emplace_back(static_cast<int>(i), static_cast<int>(i),
                         is_traced[texels[i]] != 0 ? kTracedWeight : kFilledWeight);
  }
  for (const Difference& d : differences) {
    for (std::size_t i = 0; i < 8; ++i) {
      for (std::size_t j = 0; j < 8; ++j)
        entries.emplace_back(d.slot[i], d.slot[j], kSeamWeight * d.weight[i] * d.weight[j]);
    }
  }
  const auto n = static_cast<Eigen::Index>(texels.size());
  Matrix matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  if (n > 0) solver.compute(matrix);
  // Positive definite by construction, every texel having a weight of its own.
  solvable = n > 0 && solver.info() == Eigen::Success;
}

SeamStitcher::SeamStitcher(int width, int height, std::span<const Seam> seams,
                           std::span<const TexelSample> samples)
    : impl_(std::make_unique<Impl>()) {
  impl_->width = width, impl_->height = height;
  for (const Seam& seam : seams) impl_->sample_seam(seam);
  impl_->number_texels();
  impl_->factor(samples);
}

SeamStitcher::SeamStitcher(SeamStitcher&&) noexcept = default;
SeamStitcher& SeamStitcher::operator=(SeamStitcher&&) noexcept = default;
SeamStitcher::~SeamStitcher() = default;

void SeamStitcher::stitch(std::span<float> plane) const {
  if (!impl_->solvable) return;
  // Solved for the change, so that a plane without mismatch stays as it is to the bit.
  Eigen::VectorXd right = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(impl_->texels.size()));
  for (const Impl::Difference& d : impl_->differences) {
    const double difference = kSeamWeight * d.of(plane);
    for (std::size_t k = 0; k < 8; ++k) right[d.slot[k]] -= d.weight[k] * difference;
  }
  const Eigen::VectorXd change = impl_->solver.solve(right);
  const auto [least, most] = std::ranges::minmax(plane);
  for (std::size_t i = 0; i < impl_->texels.size(); ++i) {
    float& value = plane[impl_->texels[i]];
    value =
        std::clamp(value + static_cast<float>(change[static_cast<Eigen::Index>(i)]), least, most);
  }
}

double SeamStitcher::mismatch(std::span<const float> plane) const {
  double sum = 0;
  for (const Impl::Difference& d : impl_->differences) sum += d.of(plane) * d.of(plane);
  const auto count = static_cast<double>(std::max<std::size_t>(1, impl_->differences.size()));
  return std::sqrt(sum / count);
}

std::size_t SeamStitcher::texel_count() const { return impl_->texels.size(); }

}  // namespace relit::bake
