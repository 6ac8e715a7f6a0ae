// SPDX-License-Identifier: MIT
#include "decoders/coverage.hpp"

#include <algorithm>
#include <numeric>

#include "tests/test.hpp"

using namespace relit;
using decoders::Mesh;

namespace {

constexpr int kSide = 64;

/// A grid of cells over the atlas from v = 0 to `bottom`, two triangles each.
Mesh grid(int cells, float bottom = 1) {
  Mesh mesh;
  const int points = cells + 1;
  for (int i = 0; i < points * points; ++i)
    mesh.lightmap_uv.emplace_back(
        static_cast<float>(i % points) / static_cast<float>(cells),
        bottom * static_cast<float>(i / points) / static_cast<float>(cells));
  for (int y = 0; y < cells; ++y) {
    for (int x = 0; x < cells; ++x) {
      const int corner = y * points + x;
      for (const int at : {0, 1, points, 1, points + 1, points})
        mesh.indices.push_back(static_cast<std::uint16_t>(corner + at));
    }
  }
  return mesh;
}

}  // namespace

TEST_CASE("texels whose centres lie inside a triangle are covered, and no others") {
  const std::vector<Mesh> meshes{grid(1, 0.25f)};
  std::vector<std::uint8_t> mask(kSide * kSide, 7);
  REQUIRE(decoders::mark_covered_texels(meshes, kSide, kSide, mask));
  for (std::size_t i = 0; i < mask.size(); ++i) CHECK(mask[i] == (i < mask.size() / 4 ? 1 : 0));
}

TEST_CASE("triangles smaller than texels cover them together") {
  const std::vector<Mesh> meshes{grid(100, 0.5f), {}, grid(100)};
  std::vector<std::uint8_t> mask(kSide * kSide);
  REQUIRE(decoders::mark_covered_texels(meshes, kSide, kSide, mask));
  CHECK(std::accumulate(mask.begin(), mask.end(), 0) == kSide * kSide);
}

TEST_CASE("triangles that all cover the whole light map are refused") {
  Mesh mesh = grid(1);
  for (int i = 0; i < 14; ++i) {
    const auto before = mesh.indices;
    mesh.indices.insert(mesh.indices.end(), before.begin(), before.end());
  }
  std::vector<std::uint8_t> mask(kSide * kSide);
  const Status marked = decoders::mark_covered_texels(std::vector<Mesh>{mesh}, kSide, kSide, mask);
  REQUIRE_FALSE(marked);
  CHECK(marked.error().code == ErrorCode::kLimit);
}
