// SPDX-License-Identifier: MIT
#include "bake_minimal/push_pull.hpp"

#include <algorithm>
#include <cassert>

namespace relit::bake {
namespace {

// Enough to take the 2×2 steps of the interpolation out; the pyramid has done the far distances.
constexpr int kRelaxSweeps = 4;

std::size_t at(int x, int y, int width) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
         static_cast<std::size_t>(x);
}

}  // namespace

PushPull::PushPull(int width, int height, std::span<const std::uint8_t> valid) {
  assert(width > 0 && height > 0);
  assert(valid.size() == at(0, height, width));
  Level base;
  base.width = width;
  base.height = height;
  base.weight.resize(valid.size());
  for (std::size_t i = 0; i < valid.size(); ++i) {
    base.weight[i] = valid[i] != 0 ? 1.0f : 0.0f;
    if (valid[i] == 0) holes_.push_back(static_cast<std::uint32_t>(i));
  }
  any_ = holes_.size() < valid.size();
  levels_.push_back(std::move(base));
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    const Level& fine = levels_.back();
    Level level;
    level.width = (fine.width + 1) / 2;
    level.height = (fine.height + 1) / 2;
    level.offset = scratch_size_;
    const std::size_t count = at(0, level.height, level.width);
    level.weight.resize(count);
    level.children.resize(count);
    for (int y = 0; y < level.height; ++y) {
      for (int x = 0; x < level.width; ++x) {
        std::array<float, 4> share{};
        float sum = 0;
        for (int k = 0; k < 4; ++k) {
          const int fx = 2 * x + (k & 1);
          const int fy = 2 * y + (k >> 1);
          if (fx >= fine.width || fy >= fine.height) continue;
          share[static_cast<std::size_t>(k)] = fine.weight[at(fx, fy, fine.width)];
          sum += share[static_cast<std::size_t>(k)];
        }
        if (sum > 0) {
          for (float& s : share) s /= sum;
        }
        level.weight[at(x, y, level.width)] = std::min(1.0f, sum);
        level.children[at(x, y, level.width)] = share;
      }
    }
    scratch_size_ += count;
    levels_.push_back(std::move(level));
  }
}

void PushPull::pull(std::span<const float> fine, const Level& below, const Level& level,
                    std::span<float> out) const {
  for (int y = 0; y < level.height; ++y) {
    for (int x = 0; x < level.width; ++x) {
      const std::array<float, 4>& share = level.children[at(x, y, level.width)];
      float sum = 0;
      for (int k = 0; k < 4; ++k) {
        // A share of zero must not read: the texel may hold anything, NaN included, or not exist.
        const float s = share[static_cast<std::size_t>(k)];
        if (s > 0) sum += s * fine[at(2 * x + (k & 1), 2 * y + (k >> 1), below.width)];
      }
      out[at(x, y, level.width)] = sum;
    }
  }
}

void PushPull::push(std::span<const float> coarse, const Level& above, const Level& level,
                    std::span<float> out) const {
  for (int y = 0; y < level.height; ++y) {
    // The centre of an even texel lies a quarter before that of its parent, an odd one's after.
    const int y0 = y / 2;
    const int y1 = std::clamp(y0 + ((y & 1) != 0 ? 1 : -1), 0, above.height - 1);
    for (int x = 0; x < level.width; ++x) {
      const std::size_t i = at(x, y, level.width);
      const float known = level.weight[i];
      if (known >= 1.0f) continue;
      const int x0 = x / 2;
      const int x1 = std::clamp(x0 + ((x & 1) != 0 ? 1 : -1), 0, above.width - 1);
      const float near_row =
          0.75f * coarse[at(x0, y0, above.width)] + 0.25f * coarse[at(x1, y0, above.width)];
      const float far_row =
          0.75f * coarse[at(x0, y1, above.width)] + 0.25f * coarse[at(x1, y1, above.width)];
      const float guess = 0.75f * near_row + 0.25f * far_row;
      out[i] = known > 0 ? known * out[i] + (1.0f - known) * guess : guess;
    }
  }
}

void PushPull::relax(std::span<float> plane) const {
  const int width = levels_.front().width;
  const int height = levels_.front().height;
  const auto stride = static_cast<std::size_t>(width);
  for (int sweep = 0; sweep < kRelaxSweeps; ++sweep) {
    for (const std::uint32_t i : holes_) {
      const auto x = static_cast<int>(i % static_cast<std::uint32_t>(width));
      const auto y = static_cast<int>(i / static_cast<std::uint32_t>(width));
      const float left = plane[x > 0 ? i - 1 : i];
      const float right = plane[x + 1 < width ? i + 1 : i];
      const float up = plane[y > 0 ? i - stride : i];
      const float down = plane[y + 1 < height ? i + stride : i];
      plane[i] = 0.25f * ((left + right) + (up + down));
    }
  }
}

void PushPull::fill(std::span<float> plane, std::span<float> scratch) const {
  assert(plane.size() == levels_.front().weight.size() && scratch.size() >= scratch_size_);
  if (holes_.empty()) return;
  if (!any_) {
    std::fill(plane.begin(), plane.end(), 0.0f);
    return;
  }
  const auto values = [&](std::size_t l) {
    return l == 0 ? plane : scratch.subspan(levels_[l].offset, levels_[l].weight.size());
  };
  for (std::size_t l = 1; l < levels_.size(); ++l) {
    pull(values(l - 1), levels_[l - 1], levels_[l], values(l));
  }
  for (std::size_t l = levels_.size() - 1; l-- > 0;) {
    push(values(l + 1), levels_[l + 1], levels_[l], values(l));
  }
  relax(plane);
}

void PushPull::fill(std::span<float> plane) const {
  std::vector<float> scratch(scratch_size_);
  fill(plane, scratch);
}

}  // namespace relit::bake
