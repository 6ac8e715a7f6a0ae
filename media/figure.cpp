// SPDX-License-Identifier: MIT
#include "media/figure.hpp"

#include <cmath>
#include <cstddef>

#include "media/body.hpp"
#include "media/sash.hpp"

namespace relit::media {
namespace {

std::vector<Pose> make_keys(const Walk& walk) {
  const double height = find_pelvis_height(walk);
  const auto count = static_cast<std::size_t>(std::lround(walk.duration_s() * walk.rate_hz));
  std::vector<Pose> keys;
  for (std::size_t k = 0; k < count; ++k) {
    keys.push_back(walk_pose(walk, static_cast<double>(k) / walk.rate_hz, height));
  }
  swing_tails(walk, keys);
  keys.push_back(keys.front());
  // q and -q are one rotation, but not to a reader that mixes neighbours.
  for (std::size_t k = 1; k < keys.size(); ++k) {
    for (std::size_t j = 0; j < keys[k].local.size(); ++j) {
      if (glm::dot(keys[k].local[j], keys[k - 1].local[j]) < 0.0)
        keys[k].local[j] = -keys[k].local[j];
    }
  }
  return keys;
}

}  // namespace

Figure make_figure() {
  Figure figure;
  std::vector<Surface> surfaces = base_surfaces();
  for (auto& part : body_surfaces()) surfaces.push_back(part);
  for (auto& part : sash_surfaces()) surfaces.push_back(part);
  std::vector<Chart> charts;
  for (const Surface& surface : surfaces) {
    figure.patches.push_back(tessellate(surface));
    charts.push_back(figure.patches.back().chart);
  }
  const Layout layout = lay_out(charts);
  for (std::size_t i = 0; i < figure.patches.size(); ++i) {
    Patch& patch = figure.patches[i];
    const auto stride = static_cast<std::size_t>(patch.columns) + 1;
    for (std::size_t v = 0; v < patch.vertices.size(); ++v) {
      const double turn = static_cast<double>(v % stride) / static_cast<double>(patch.columns);
      patch.vertices[v].lightmap =
          glm::vec2(layout.placements[i].place(charts[i], v / stride, turn));
    }
  }
  figure.coverage = layout.coverage;
  figure.texels_per_metre = layout.texels_per_metre;
  figure.keys = make_keys(figure.walk);
  return figure;
}

}  // namespace relit::media
