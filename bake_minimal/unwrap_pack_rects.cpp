// SPDX-License-Identifier: MIT
#include <cassert>

#include "bake_minimal/unwrap_pack.hpp"

#define STB_RECT_PACK_IMPLEMENTATION
#define STBRP_STATIC
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb_rect_pack.h>
#pragma GCC diagnostic pop

namespace relit::bake {

bool pack_rectangles(std::span<const glm::ivec2> sizes, glm::ivec2 atlas,
                     std::span<glm::ivec2> at) {
  assert(sizes.size() == at.size());
  std::vector<stbrp_rect> rects(sizes.size());
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    if (sizes[i].x > atlas.x || sizes[i].y > atlas.y) return false;
    rects[i].id = static_cast<int>(i);
    rects[i].w = static_cast<stbrp_coord>(sizes[i].x);
    rects[i].h = static_cast<stbrp_coord>(sizes[i].y);
  }
  std::vector<stbrp_node> nodes(static_cast<std::size_t>(atlas.x));
  stbrp_context context;
  stbrp_init_target(&context, atlas.x, atlas.y, nodes.data(), static_cast<int>(nodes.size()));
  if (stbrp_pack_rects(&context, rects.data(), static_cast<int>(rects.size())) == 0) return false;
  for (const stbrp_rect& r : rects) {
    at[static_cast<std::size_t>(r.id)] = {static_cast<int>(r.x), static_cast<int>(r.y)};
  }
  return true;
}

}  // namespace relit::bake
