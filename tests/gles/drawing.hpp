// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "gles/character_renderer.hpp"
#include "gles/picture.hpp"
#include "tests/results.hpp"

/// What the drawing tests share: a quad, a constant light map, pictures to look into.
namespace relit::test {

struct Picture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgba;  ///< top row first

  [[nodiscard]] std::array<int, 4> at(int x, int y) const {
    const std::size_t i = 4 * static_cast<std::size_t>(y * width + x);
    return {rgba[i], rgba[i + 1], rgba[i + 2], rgba[i + 3]};
  }
};

/// Two triangles over [-1,1]², facing +z; uv (0,0) is the upper left corner, times `repeats`.
struct Quad {
  explicit Quad(float repeats = 1, float half = 1, float z = 0) {
    positions = {{-half, -half, z}, {half, -half, z}, {half, half, z}, {-half, half, z}};
    uv = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
    for (const glm::vec2& at : uv) albedo_uv.push_back(at * repeats);
  }
  [[nodiscard]] gles::MeshView view(std::uint32_t material = 0) const {
    gles::MeshView mesh;
    mesh.vertex_count = positions.size();
    mesh.lightmap_uv = uv;
    mesh.albedo_uv = albedo_uv;
    mesh.colors = colors;
    mesh.indices = indices;
    mesh.material = material;
    return mesh;
  }
  std::vector<glm::vec3> positions;
  std::vector<glm::vec2> uv;
  std::vector<glm::vec2> albedo_uv;
  std::vector<glm::u8vec4> colors;
  std::vector<std::uint16_t> indices{0, 1, 2, 0, 2, 3};
};

/// A quad and a square framebuffer that sees it, of `side` pixels and one sample.
struct QuadStage {
  QuadStage(const gles::Device& device, const Quad& quad, int side_pixels)
      : side(side_pixels),
        framebuffer(take(gles::Framebuffer::create(device, {side, side, 1}))),
        renderer(take(gles::CharacterRenderer::create(device))) {
    const gles::MeshView mesh = quad.view();
    const gles::MaterialView material;
    require(renderer->set_materials({}, std::span(&material, 1)));
    require(renderer->set_meshes(std::span(&mesh, 1)));
    require(renderer->update_positions(0, quad.positions));
  }
  template <class Light>
  Picture draw(Light& light, double exposure = 1) {
    gles::View view;
    view.width = view.height = side;
    view.exposure = static_cast<float>(exposure);
    framebuffer.bind();
    require(renderer->draw(view, light));
    require(framebuffer.resolve());
    Picture picture{side, side,
                    std::vector<std::uint8_t>(4 * static_cast<std::size_t>(side * side))};
    require(framebuffer.read_back(picture.rgba));
    return picture;
  }
  int side;
  gles::Framebuffer framebuffer;
  std::unique_ptr<gles::CharacterRenderer> renderer;
};

/// [3][height][width] of one colour.
inline std::vector<float> constant_light(int width, int height, std::array<float, 3> rgb) {
  std::vector<float> values;
  for (const float c : rgb)
    values.insert(values.end(), static_cast<std::size_t>(width * height), c);
  return values;
}

inline double encode_srgb(double c) {
  c = std::min(1.0, std::max(0.0, c));
  return 255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055);
}

inline double decode_srgb(int byte) {
  const double c = byte / 255.0;
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

}  // namespace relit::test
