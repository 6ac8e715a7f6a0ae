// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>

#include "bake_minimal/texture_math.hpp"
#include "bake_minimal/transfer.hpp"

namespace relit::bake {
namespace {

const std::array<float, 256>& srgb_table() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> t{};
    for (std::size_t i = 0; i < t.size(); ++i) {
      t[i] = static_cast<float>(srgb_to_linear(static_cast<double>(i) / 255.0));
    }
    return t;
  }();
  return table;
}

// One fetch: linear RGB with straight alpha.
glm::vec4 texel(const Image& image, int x, int y) {
  const std::uint8_t* p =
      &image.rgba[4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                       static_cast<std::size_t>(x))];
  const auto& table = srgb_table();
  return {table[p[0]], table[p[1]], table[p[2]], static_cast<float>(p[3]) / 255.0f};
}

glm::vec4 sample(const Image& image, glm::vec2 uv, const HitSurface& surface) {
  // Coordinates beyond ±1e6 have no texel to speak of, and would overflow the integers.
  uv = glm::clamp(uv, glm::vec2(-1e6f), glm::vec2(1e6f));
  uv.x -= surface.wrap_u == container::Wrap::kRepeat ? std::floor(uv.x) : 0.0f;
  uv.y -= surface.wrap_v == container::Wrap::kRepeat ? std::floor(uv.y) : 0.0f;
  uv = glm::clamp(uv, glm::vec2(-64.0f), glm::vec2(64.0f));
  const auto u = [&](int x) { return wrapped(x, image.width, surface.wrap_u); };
  const auto v = [&](int y) { return wrapped(y, image.height, surface.wrap_v); };
  const float fx = uv.x * static_cast<float>(image.width);
  const float fy = uv.y * static_cast<float>(image.height);
  if (!surface.linear_filter) {
    return texel(image, u(static_cast<int>(std::floor(fx))), v(static_cast<int>(std::floor(fy))));
  }
  const float x = std::floor(fx - 0.5f), y = std::floor(fy - 0.5f);
  const float tx = fx - 0.5f - x, ty = fy - 0.5f - y;
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const glm::vec4 top = glm::mix(texel(image, u(x0), v(y0)), texel(image, u(x0 + 1), v(y0)), tx);
  const glm::vec4 bottom =
      glm::mix(texel(image, u(x0), v(y0 + 1)), texel(image, u(x0 + 1), v(y0 + 1)), tx);
  return glm::mix(top, bottom, ty);
}

}  // namespace

glm::vec4 surface_albedo(const HitSurface& surface, glm::vec2 uv, glm::vec4 color) {
  glm::vec4 albedo = surface.base_color * color;
  if (surface.image != nullptr) albedo *= sample(*surface.image, uv, surface);
  return glm::clamp(albedo, glm::vec4(0.0f), glm::vec4(1.0f));
}

}  // namespace relit::bake
