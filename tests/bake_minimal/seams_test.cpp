// SPDX-License-Identifier: MIT
#include "bake_minimal/seams.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/test.hpp"

using namespace relit::bake;

namespace {

constexpr int kSize = 32;

// A strip of two quads, bent by `angle` about their common edge. The light map is cut along that
// edge, and the chart of the second quad is turned by a quarter.
struct Strip {
  std::vector<std::uint32_t> indices{0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7};
  std::vector<glm::vec2> uv{{0.1f, 0.1f}, {0.4f, 0.1f}, {0.4f, 0.45f}, {0.1f, 0.45f},
                            {0.9f, 0.6f}, {0.9f, 0.9f}, {0.52f, 0.9f}, {0.52f, 0.6f}};
  std::vector<glm::vec3> positions, normals;

  explicit Strip(float angle, bool shared_normals = true) {
    const glm::vec3 side(std::cos(angle), std::sin(angle), 0);
    positions = {{-1, 0, 0}, {0, 0, 0}, {0, 0, -1}, {-1, 0, -1}, {0, 0, 0}, side, side, {0, 0, -1}};
    positions[6].z = -1;
    const glm::vec3 up(0, 1, 0), tilted(-std::sin(angle), std::cos(angle), 0);
    const glm::vec3 mean = glm::normalize(up + tilted);
    const glm::vec3 left = shared_normals ? mean : up, right = shared_normals ? mean : tilted;
    normals = {up, left, left, up, right, tilted, tilted, right};
  }
  [[nodiscard]] SeamGeometry geometry() const { return {indices, uv, positions, normals}; }
};

// Every texel of the lower left and the upper right quarter was traced.
std::vector<TexelSample> traced() {
  std::vector<TexelSample> samples;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      if ((x < kSize / 2) != (y < kSize / 2)) continue;
      TexelSample sample{};
      sample.texel = static_cast<std::uint32_t>(y * kSize + x);
      samples.push_back(sample);
    }
  }
  return samples;
}

std::vector<float> noise() {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-1, 1);
  std::vector<float> plane(kSize * kSize);
  for (float& value : plane) value = uniform(random);
  return plane;
}

}  // namespace

TEST_CASE("a cut through a smooth surface is a seam, a crease is none") {
  const Strip flat(0), bent(0.5f), crease(0.5f, false);
  const auto seams = find_seams(flat.geometry(), bent.geometry());
  REQUIRE(seams.size() == 1);
  // Both sides run between the same points: (0.4, 0.1) to (0.4, 0.45) here, (0.9, 0.6) to
  // (0.52, 0.6) there.
  const Seam& seam = seams[0];
  const std::size_t here = seam.from[0].x < 0.5f ? 0 : 1, there = 1 - here;
  const bool forward = seam.from[here].y < 0.2f;
  CHECK((forward ? seam.from[there] : seam.to[there]) == glm::vec2(0.9f, 0.6f));
  CHECK((forward ? seam.to[there] : seam.from[there]) == glm::vec2(0.52f, 0.6f));
  CHECK(find_seams(crease.geometry(), crease.geometry()).empty());
  CHECK(find_seams(flat.geometry(), crease.geometry()).empty());
}

TEST_CASE("what only touches for a moment, or shares its UVs, is no seam") {
  const Strip flat(0);
  Strip apart(0);
  for (std::size_t v = 4; v < 8; ++v) apart.positions[v].y += 0.01f;
  CHECK(find_seams(flat.geometry(), apart.geometry()).empty());
  Strip joined(0);
  joined.uv[4] = joined.uv[1], joined.uv[7] = joined.uv[2];
  CHECK(find_seams(joined.geometry(), joined.geometry()).empty());
  // The other side of a sheet: the same edges, opposite normals, another chart.
  Strip sheet(0);
  sheet.positions = {{-1, 0, 0}, {0, 0, 0},  {0, 0, -1},  {-1, 0, -1},
                     {0, 0, 0},  {-1, 0, 0}, {-1, 0, -1}, {0, 0, -1}};
  for (std::size_t v = 4; v < 8; ++v) sheet.normals[v] = {0, -1, 0};
  CHECK(find_seams(sheet.geometry(), sheet.geometry()).empty());
}

TEST_CASE("stitching closes seams and leaves the rest alone") {
  const Strip flat(0);
  const auto seams = find_seams(flat.geometry(), flat.geometry());
  const SeamStitcher stitcher(kSize, kSize, seams, traced());
  const std::vector<float> before = noise();
  std::vector<float> after = before;
  stitcher.stitch(after);
  CHECK(stitcher.mismatch(before) > 0.3);
  // Even noise, which no light map resembles, loses most of its mismatch.
  CHECK(stitcher.mismatch(after) < 0.3 * stitcher.mismatch(before));
  int changed = 0;
  for (std::size_t i = 0; i < after.size(); ++i) {
    changed += after[i] != before[i] ? 1 : 0;
    const int x = static_cast<int>(i) % kSize, y = static_cast<int>(i) / kSize;
    // The seam runs along u = 0.4 (texels 12 and 13) and v = 0.6 (texels 18 and 19).
    const bool near = (x == 12 || x == 13) || (y == 18 || y == 19);
    if (!near) CHECK(after[i] == before[i]);
  }
  CHECK(changed > 40);
  // Never beyond what the plane held: the quantiser's range is not to grow.
  CHECK(std::ranges::max(after) <= std::ranges::max(before));
  CHECK(std::ranges::min(after) >= std::ranges::min(before));
  CHECK(static_cast<std::size_t>(changed) <= stitcher.texel_count());
}

TEST_CASE("a light map without mismatch stays as it is, and stitching knows no scale") {
  const Strip flat(0);
  const SeamStitcher stitcher(kSize, kSize, find_seams(flat.geometry(), flat.geometry()), traced());
  std::vector<float> constant(kSize * kSize, 0.75f);
  stitcher.stitch(constant);
  // The weights of a lookup add up to one but for their rounding to doubles.
  for (const float value : constant) CHECK(std::abs(value - 0.75f) < 1e-7f);
  std::vector<float> a = noise(), doubled = a;
  for (float& value : doubled) value *= 2;
  stitcher.stitch(a);
  stitcher.stitch(doubled);
  for (std::size_t i = 0; i < a.size(); ++i) CHECK(doubled[i] == Approx(2 * a[i]).margin(1e-6));
}

TEST_CASE("filled texels give way before traced ones") {
  const Strip flat(0);
  const auto seams = find_seams(flat.geometry(), flat.geometry());
  const SeamStitcher all_traced(kSize, kSize, seams, traced());
  const SeamStitcher none_traced(kSize, kSize, seams, {});
  std::vector<float> a = noise(), b = a;
  all_traced.stitch(a);
  none_traced.stitch(b);
  CHECK(none_traced.mismatch(b) < 0.75 * all_traced.mismatch(a));
}

TEST_CASE("a light map without seams, of one texel, or on the border is no trouble") {
  const SeamStitcher none(kSize, kSize, {}, {});
  std::vector<float> plane = noise();
  const std::vector<float> before = plane;
  none.stitch(plane);
  CHECK(plane == before);
  CHECK(none.mismatch(plane) == 0);
  const Seam corners{{{0, 0}, {1, 1}}, {{1, 0}, {0, 1}}};
  const SeamStitcher one(1, 1, std::span(&corners, 1), {});
  std::vector<float> texel{3};
  one.stitch(texel);
  CHECK(texel[0] == Approx(3));
  const SeamStitcher borders(4, 4, std::span(&corners, 1), {});
  std::vector<float> small(16, 1.0f);
  small[3] = 5;
  const double mismatch = borders.mismatch(small);
  borders.stitch(small);
  CHECK(borders.mismatch(small) < mismatch);
}
