// SPDX-License-Identifier: MIT
#include "decoders/texel_normals.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <new>

#include "decoders/texel_raster.hpp"

namespace relit::decoders {
namespace {

constexpr float kShares = 65535;
constexpr std::uint32_t kBeside = 0xFFFFFFFF;

/// Rows of neighbours from the top left to the bottom right.
constexpr std::array<glm::ivec2, 8> kNeighbours{
    {{-1, -1}, {0, -1}, {1, -1}, {-1, 0}, {1, 0}, {-1, 1}, {0, 1}, {1, 1}}};

/// What normals that cancel leave is no direction.
constexpr float kLeastLength = 1e-3f;

glm::vec3 unit_or_zero(const glm::vec3& v) {
  const float length2 = glm::dot(v, v);
  return length2 > kLeastLength * kLeastLength ? v / std::sqrt(length2) : glm::vec3(0.0f);
}

}  // namespace

Result<TexelNormals> TexelNormals::create(std::span<const Mesh> meshes, int width, int height) {
  try {
    TexelNormals normals;
    normals.meshes_ = meshes;
    normals.width_ = width, normals.height_ = height;
    std::vector<glm::vec2> uv;
    std::size_t most = 0, index_count = 0;
    for (const Mesh& mesh : meshes) index_count += mesh.indices.size();
    normals.indices_.reserve(index_count);
    for (const Mesh& mesh : meshes) {
      const auto base = static_cast<std::uint32_t>(uv.size());
      uv.insert(uv.end(), mesh.lightmap_uv.begin(), mesh.lightmap_uv.end());
      for (const std::uint16_t index : mesh.indices) normals.indices_.push_back(base + index);
      most = std::max(most, mesh.positions.size());
    }
    // All of it at once: a list that grows would take up to three times as much on the way.
    normals.places_.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    RELIT_TRY(rasterize_atlas(uv, normals.indices_, width, height, [&](const TexelSample& sample) {
      const auto share = [](float b) {
        return static_cast<std::uint16_t>(std::lround(std::clamp(b, 0.0f, 1.0f) * kShares));
      };
      normals.places_.push_back(
          {sample.texel, sample.triangle, share(sample.b1), share(sample.b2)});
    }));
    normals.add_fringe();
    normals.positions_.resize(most);
    normals.normals_.resize(uv.size());
    return normals;
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kOutOfMemory, "no memory for the normals of a light map's texels");
  }
}

void TexelNormals::add_fringe() {
  on_surface_ = places_.size();
  const auto width = static_cast<std::size_t>(width_);
  std::vector<std::uint8_t> on_surface(width * static_cast<std::size_t>(height_), 0);
  for (const Place& place : places_) on_surface[place.texel] = 1;
  for (std::size_t texel = 0; texel < on_surface.size(); ++texel) {
    if (on_surface[texel] != 0) continue;
    const glm::ivec2 at(static_cast<int>(texel % width), static_cast<int>(texel / width));
    unsigned neighbours = 0;
    for (std::size_t i = 0; i < kNeighbours.size(); ++i) {
      const glm::ivec2 p = at + kNeighbours[i];
      if (p.x < 0 || p.y < 0 || p.x >= width_ || p.y >= height_) continue;
      const auto other = static_cast<std::size_t>(p.y) * width + static_cast<std::size_t>(p.x);
      if (on_surface[other] != 0) neighbours |= 1u << i;
    }
    if (neighbours != 0)
      places_.push_back(
          {static_cast<std::uint32_t>(texel), kBeside, static_cast<std::uint16_t>(neighbours), 0});
  }
}

void TexelNormals::compute(const Pose& pose, std::span<glm::vec3> out) {
  std::fill(out.begin(), out.end(), glm::vec3(0.0f));
  std::size_t first = 0;
  for (std::size_t m = 0; m < meshes_.size(); ++m) {
    const std::size_t count = meshes_[m].positions.size();
    pose_mesh(meshes_[m], m, pose, std::span(positions_).first(count),
              std::span(normals_).subspan(first, count));
    first += count;
  }
  const std::span<const Place> places(places_);
  for (const Place& place : places.first(on_surface_)) {
    const std::uint32_t* const corner = &indices_[3 * std::size_t{place.triangle}];
    const float b1 = static_cast<float>(place.b1) / kShares;
    const float b2 = static_cast<float>(place.b2) / kShares;
    out[place.texel] = unit_or_zero((1 - b1 - b2) * normals_[corner[0]] + b1 * normals_[corner[1]] +
                                    b2 * normals_[corner[2]]);
  }
  for (const Place& place : places.subspan(on_surface_)) {
    glm::vec3 sum(0.0f);
    for (std::size_t i = 0; i < kNeighbours.size(); ++i) {
      if ((place.b1 >> i & 1u) == 0) continue;
      const auto step = std::ptrdiff_t{kNeighbours[i].y} * width_ + kNeighbours[i].x;
      sum += out[static_cast<std::size_t>(static_cast<std::ptrdiff_t>(place.texel) + step)];
    }
    out[place.texel] = unit_or_zero(sum);
  }
}

void TexelNormals::mark(std::span<std::uint8_t> mask) const {
  for (const Place& place : places_) mask[place.texel] = 1;
}

std::size_t TexelNormals::memory_bytes(std::size_t texels, std::size_t vertices,
                                       std::size_t most_vertices, std::size_t indices) {
  return texels * sizeof(Place) + indices * sizeof(std::uint32_t) +
         (vertices + most_vertices) * sizeof(glm::vec3);
}

}  // namespace relit::decoders
