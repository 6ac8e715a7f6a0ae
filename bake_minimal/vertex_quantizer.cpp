// SPDX-License-Identifier: MIT
#include "bake_minimal/vertex_quantizer.hpp"

#include <algorithm>
#include <cmath>

namespace relit::bake {

std::uint16_t Grid::nearest(float value, std::size_t axis) const {
  const double steps = (static_cast<double>(value) - offset[axis]) / step[axis];
  return static_cast<std::uint16_t>(std::lround(std::clamp(steps, 0.0, 65535.0)));
}

Grid uniform_grid(const glm::vec3& low, const glm::vec3& high, int bits) {
  const double extent =
      std::max({static_cast<double>(high.x) - low.x, static_cast<double>(high.y) - low.y,
                static_cast<double>(high.z) - low.z});
  float step = static_cast<float>(extent / ((1 << bits) - 1));
  // A subnormal step would lose its digits.
  if (!(step >= 1e-30f)) step = 1;
  return {{low.x, low.y, low.z}, {step, step, step}};
}

int uv_bits(double steps) {
  int bits = 10;
  while (bits < 16 && (1 << bits) < steps) ++bits;
  return bits;
}

std::vector<Influence> quantize_weights(std::span<const Influence> influences) {
  struct Share {
    std::uint16_t joint;
    double weight;
    int whole;
    double remainder;
  };
  std::vector<Share> shares;
  double sum = 0;
  for (const Influence& i : influences) {
    if (!(i.weight > 0)) continue;
    sum += i.weight;
    const auto same = std::find_if(shares.begin(), shares.end(),
                                   [&](const Share& s) { return s.joint == i.joint; });
    if (same != shares.end()) {
      same->weight += i.weight;
    } else {
      shares.push_back({i.joint, i.weight, 0, 0});
    }
  }
  if (shares.empty()) return {{influences.empty() ? std::uint16_t{0} : influences[0].joint, 255}};
  // Sorted, so that vertices that share their influences in another order get the same weights.
  std::sort(shares.begin(), shares.end(),
            [](const Share& a, const Share& b) { return a.joint < b.joint; });
  int left = 255;
  for (Share& s : shares) {
    const double exact = 255 * s.weight / sum;
    s.whole = std::min(static_cast<int>(exact), left);
    s.remainder = exact - s.whole;
    left -= s.whole;
  }
  for (; left > 0; --left) {
    Share& next =
        *std::max_element(shares.begin(), shares.end(),
                          [](const Share& a, const Share& b) { return a.remainder < b.remainder; });
    ++next.whole;
    next.remainder -= 1;
  }
  std::stable_sort(shares.begin(), shares.end(),
                   [](const Share& a, const Share& b) { return a.whole > b.whole; });
  std::vector<Influence> out;
  for (const Share& s : shares) {
    if (s.whole > 0) out.push_back({s.joint, static_cast<float>(s.whole)});
  }
  return out;
}

std::array<std::int8_t, 2> encode_octahedral(const glm::vec3& n) {
  const float sum = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
  float x = n.x / sum, y = n.y / sum;
  if (n.z < 0) {
    const float fx = (1 - std::abs(y)) * (x >= 0 ? 1.0f : -1.0f);
    y = (1 - std::abs(x)) * (y >= 0 ? 1.0f : -1.0f);
    x = fx;
  }
  return {static_cast<std::int8_t>(std::lround(127 * x)),
          static_cast<std::int8_t>(std::lround(127 * y))};
}

void append_u16(std::vector<std::uint8_t>& bytes, unsigned value) {
  bytes.push_back(static_cast<std::uint8_t>(value & 255));
  bytes.push_back(static_cast<std::uint8_t>(value >> 8 & 255));
}

}  // namespace relit::bake
