// SPDX-License-Identifier: MIT
#include "gles/environment.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace relit::gles {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

float clean(float value) { return std::isfinite(value) && value > 0 ? value : 0.0f; }

// A picture reduced to width × height: means over the area of the smaller picture's pixels, so that
// small bright sources keep their power. They are taken when they are asked for, until they are
// kept.
struct Equirect {
  int width = 0;
  int height = 0;
  EnvironmentView source;
  std::vector<glm::vec3> texels;

  [[nodiscard]] glm::vec3 at(int x, int y) const {
    if (texels.empty()) return mean(x, y);
    return texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
  // Beyond a pole lies the row on its other side.
  [[nodiscard]] glm::vec3 across(int x, int y) const {
    if (y < 0 || y >= height) {
      y = y < 0 ? -1 - y : 2 * height - 1 - y;
      x += width / 2;
    }
    return at((x % width + width) % width, std::clamp(y, 0, height - 1));
  }
  [[nodiscard]] glm::vec3 pixel(int x, int y) const {
    const float* p = source.rgb.data() +
                     3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(source.width) +
                          static_cast<std::size_t>(x));
    return {clean(p[0]), clean(p[1]), clean(p[2])};
  }
  [[nodiscard]] glm::vec3 mean(int x, int y) const {
    const auto begin = [](int i, int of, int from) {
      return static_cast<int>(std::int64_t{i} * from / of);
    };
    const int x0 = begin(x, width, source.width), y0 = begin(y, height, source.height);
    const int x1 = std::max(x0 + 1, begin(x + 1, width, source.width));
    const int y1 = std::max(y0 + 1, begin(y + 1, height, source.height));
    if (x1 == x0 + 1 && y1 == y0 + 1) return pixel(x0, y0);
    glm::vec3 sum(0.0f);
    float weight = 0;
    for (int j = y0; j < y1; ++j) {
      const float row =
          std::sin(kPi * (static_cast<float>(j) + 0.5f) / static_cast<float>(source.height));
      for (int i = x0; i < x1; ++i) {
        sum += row * pixel(i, j);
        weight += row;
      }
    }
    return sum / weight;
  }
  void keep() {
    std::vector<glm::vec3> kept;
    kept.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) kept.push_back(mean(x, y));
    texels = std::move(kept);
  }
};

// exp((d·d' - 1)/σ²), the Gaussian's like on the sphere, over the pixels' solid angles. Its weights
// depend on the two rows and the distance between the columns only.
void blur(Equirect& map, float sigma_rad) {
  const Equirect source = map;
  const float cut = 4.5f * sigma_rad * sigma_rad;  // of 1 - d·d': three deviations
  const auto height = static_cast<float>(map.height);
  std::vector<float> weights(static_cast<std::size_t>(map.width / 2 + 1));
  for (int y = 0; y < map.height; ++y) {
    const float theta = kPi * (static_cast<float>(y) + 0.5f) / height;
    glm::vec3* out = map.texels.data() + static_cast<std::ptrdiff_t>(y) * map.width;
    std::fill(out, out + map.width, glm::vec3(0.0f));
    float total = 0;
    for (int j = 0; j < map.height; ++j) {
      const float other = kPi * (static_cast<float>(j) + 0.5f) / height;
      int reach = 0;
      for (int dx = 0; dx <= map.width / 2; ++dx) {
        const float turn = 2 * kPi * static_cast<float>(dx) / static_cast<float>(map.width);
        const float away = 1 - std::cos(theta) * std::cos(other) -
                           std::sin(theta) * std::sin(other) * std::cos(turn);
        if (away > cut) break;
        weights[static_cast<std::size_t>(reach++)] =
            std::sin(other) * std::exp(-away / (sigma_rad * sigma_rad));
      }
      for (int dx = 0; dx < reach; ++dx) {
        const float weight = weights[static_cast<std::size_t>(dx)];
        // Straight ahead and straight behind there is one column, elsewhere one on either side.
        const bool single = dx == 0 || 2 * dx == map.width;
        total += single ? weight : 2 * weight;
        for (int x = 0; x < map.width; ++x) {
          out[x] += weight * source.at((x + dx) % map.width, j);
          if (!single) out[x] += weight * source.at((x + map.width - dx) % map.width, j);
        }
      }
    }
    for (int x = 0; x < map.width; ++x) out[x] /= total;
  }
}

glm::vec3 lookup(const Equirect& map, const glm::vec3& direction) {
  const float theta = std::acos(std::clamp(direction.y, -1.0f, 1.0f));
  const float phi = std::atan2(direction.z, direction.x);
  const float x = phi / (2 * kPi) * static_cast<float>(map.width) - 0.5f;
  const float y = theta / kPi * static_cast<float>(map.height) - 0.5f;
  const int x0 = static_cast<int>(std::floor(x));
  const int y0 = static_cast<int>(std::floor(y));
  const float fx = x - static_cast<float>(x0);
  const float fy = y - static_cast<float>(y0);
  return (1 - fy) * ((1 - fx) * map.across(x0, y0) + fx * map.across(x0 + 1, y0)) +
         fy * ((1 - fx) * map.across(x0, y0 + 1) + fx * map.across(x0 + 1, y0 + 1));
}

// The mean is taken of some texels only where there are many.
template <class Radiance>
CubeMap cube_of(int side, Radiance radiance) {
  const int step = side >= 128 ? 4 : 1;
  double sum = 0;
  std::int64_t count = 0;
  for (int face = 0; face < 6; ++face)
    for (int y = 0; y < side; y += step)
      for (int x = 0; x < side; x += step, count += 3) {
        const glm::vec3 value = radiance(cube_direction(face, x, y, side));
        for (int c = 0; c < 3; ++c) sum += clean(value[c]);
      }
  const double mean = sum / static_cast<double>(count);
  CubeMap cube;
  cube.side = side;
  cube.scale = mean > 1e-30 ? static_cast<float>(mean) : 1.0f;
  cube.write = [side, scale = cube.scale, radiance = std::move(radiance)](int face,
                                                                          std::span<float> rgb) {
    auto out = rgb.begin();
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) {
        const glm::vec3 value = radiance(cube_direction(face, x, y, side));
        for (int c = 0; c < 3; ++c) *out++ = std::min(clean(value[c]) / scale, 60000.0f);
      }
  };
  return cube;
}

// Real spherical harmonics of bands 0 to 3 in the design's order.
std::array<float, 16> basis(const glm::vec3& d) {
  const float x = d.x, y = d.y, z = d.z;
  return {0.28209479f,
          0.48860251f * y,
          0.48860251f * z,
          0.48860251f * x,
          1.09254843f * x * y,
          1.09254843f * y * z,
          0.31539157f * (3 * z * z - 1),
          1.09254843f * x * z,
          0.54627422f * (x * x - y * y),
          0.59004359f * y * (3 * x * x - y * y),
          2.89061144f * x * y * z,
          0.45704580f * y * (5 * z * z - 1),
          0.37317633f * z * (5 * z * z - 3),
          0.45704580f * x * (5 * z * z - 1),
          1.44530572f * z * (x * x - y * y),
          0.59004359f * x * (x * x - 3 * y * y)};
}

}  // namespace

glm::vec3 cube_direction(int face, int x, int y, int side) {
  const float s = 2.0f * static_cast<float>(x) / static_cast<float>(side - 1) - 1.0f;
  const float t = 2.0f * static_cast<float>(y) / static_cast<float>(side - 1) - 1.0f;
  glm::vec3 d;
  switch (face) {
    case 0:
      d = {1, -t, -s};
      break;
    case 1:
      d = {-1, -t, s};
      break;
    case 2:
      d = {s, 1, t};
      break;
    case 3:
      d = {s, -1, -t};
      break;
    case 4:
      d = {s, -t, 1};
      break;
    default:
      d = {-s, -t, -1};
      break;
  }
  return glm::normalize(d);
}

CubeMap make_cube_map(const EnvironmentView& environment, float blur_rad, int max_side) {
  // A face spans a quarter of the width. Blurred pictures need only two texels a deviation.
  int width = std::min(environment.width, 4 * max_side);
  if (blur_rad > 0)
    width = std::min(width, std::max(64, static_cast<int>(2 * (2 * kPi) / blur_rad)));
  const int height =
      std::clamp(static_cast<int>(std::int64_t{environment.height} * width / environment.width), 1,
                 environment.height);
  Equirect map{width, height, environment, {}};
  if (blur_rad > 0) {
    map.keep();
    blur(map, blur_rad);
  }
  const int side = std::clamp(width / 4, 2, max_side);
  return cube_of(side, [map = std::move(map)](const glm::vec3& d) { return lookup(map, d); });
}

CubeMap make_cube_map(std::span<const std::array<float, 3>> sh, int side) {
  return cube_of(side, [sh](const glm::vec3& d) {
    const std::array<float, 16> y = basis(d);
    glm::vec3 sum(0.0f);
    for (std::size_t n = 0; n < std::min(sh.size(), y.size()); ++n)
      sum += y[n] * glm::vec3(sh[n][0], sh[n][1], sh[n][2]);
    return sum;
  });
}

}  // namespace relit::gles
