// SPDX-License-Identifier: MIT
#include "bake_minimal/transfer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "decoders/sh.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::bake;

namespace {

constexpr double kSqrt4Pi = 3.5449077018110318;

// A scene put together from quads that each own one texel of an 8×8 map.
struct QuadScene {
  TraceGeometry geometry;
  std::vector<glm::vec3> positions, normals;
  std::vector<TexelSample> samples;
  static constexpr int kSide = 8;

  QuadScene() { geometry.surfaces.push_back({}); }

  // Corners counter-clockwise as seen from the front; the sample lies in the middle.
  std::size_t add(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d,
                  std::uint32_t surface = 0, glm::vec3 normal = glm::vec3(0)) {
    if (normal == glm::vec3(0)) normal = glm::normalize(glm::cross(b - a, c - a));
    const auto base = static_cast<std::uint32_t>(positions.size());
    const auto quad = static_cast<std::uint32_t>(samples.size());
    for (const glm::vec3& p : {a, b, c, d}) {
      positions.push_back(p), normals.push_back(normal);
      const glm::vec2 uv((static_cast<float>(quad % kSide) + 0.5f) / kSide,
                         (static_cast<float>(quad / kSide) + 0.5f) / kSide);
      geometry.lightmap_uv.push_back(uv), geometry.albedo_uv.push_back(uv);
    }
    const auto triangle = static_cast<std::uint32_t>(geometry.surface.size());
    for (const std::uint32_t i : {0u, 1u, 2u, 0u, 2u, 3u}) geometry.indices.push_back(base + i);
    for (int t = 0; t < 2; ++t)
      geometry.surface.push_back(surface), geometry.other_side.push_back(kNoOtherSide);
    // A point off the diagonal, so that no ray meets the edge the two triangles share.
    samples.push_back({quad, triangle, 0.31f, 0.33f, true});
    return quad;
  }

  void pair(std::size_t front, std::size_t back) {
    for (std::uint32_t t = 0; t < 2; ++t) {
      const auto f = static_cast<std::uint32_t>(2 * front) + t,
                 b = static_cast<std::uint32_t>(2 * back) + t;
      geometry.other_side[f] = b, geometry.other_side[b] = f;
    }
  }

  // [coefficients][3][samples]
  std::vector<float> trace(TransferOptions options,
                           std::vector<std::uint8_t>* buried = nullptr) const {
    options.width = options.height = kSide;
    auto tracer = TransferTracer::create(geometry, samples, options);
    REQUIRE(tracer);
    std::vector<float> out(samples.size() * 3 *
                           static_cast<std::size_t>(decoders::coefficient_count(options.order)));
    std::vector<std::uint8_t> flags(samples.size());
    REQUIRE(tracer->trace(positions, normals, out, flags));
    if (buried != nullptr) *buried = flags;
    return out;
  }

  double value(const std::vector<float>& transfer, int n, int channel, std::size_t sample) const {
    return transfer[(static_cast<std::size_t>(n) * 3 + static_cast<std::size_t>(channel)) *
                        samples.size() +
                    sample];
  }
};

// A square of side 2·half around `centre`, facing `normal`.
std::array<glm::vec3, 4> square(glm::vec3 centre, glm::vec3 normal, float half) {
  const glm::vec3 helper = std::abs(normal.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
  const glm::vec3 a = half * glm::normalize(glm::cross(helper, normal)), b = glm::cross(normal, a);
  return {centre - a - b, centre + a - b, centre + a + b, centre - a + b};
}

std::size_t add_square(QuadScene& scene, glm::vec3 centre, glm::vec3 normal, float half,
                       std::uint32_t surface = 0) {
  const auto q = square(centre, normal, half);
  return scene.add(q[0], q[1], q[2], q[3], surface);
}

}  // namespace

TEST_CASE("directions cover the sphere evenly and depend on the seed alone") {
  for (const int count : {64, 1024, 1000}) {
    const auto directions = sphere_directions(count, 7);
    REQUIRE(directions.size() == static_cast<std::size_t>(count));
    CHECK(directions == sphere_directions(count, 7));
    CHECK(directions != sphere_directions(count, 8));
    glm::dvec3 mean(0);
    for (const glm::vec3& d : directions) {
      CHECK(glm::length(d) == Approx(1).margin(1e-6));
      mean += glm::dvec3(d) / double(count);
    }
    // The lattice integrates band 1 to O(1/count).
    CHECK(glm::length(mean) < 2.0 / count);
  }
}

TEST_CASE("an open surface has T = A_l/pi Y_lm(N), in every band and orientation") {
  // Convex body: sign, order and scale of every coefficient. The clamped cosine has a kink at the
  // horizon, where 4096 lattice points err by less than 0.3 % of the largest coefficient.
  const glm::vec3 normals[] = {{1, 0, 0},
                               {-1, 0, 0},
                               {0, 1, 0},
                               {0, -1, 0},
                               {0, 0, 1},
                               {0, 0, -1},
                               glm::normalize(glm::vec3(1, 2, 3)),
                               glm::normalize(glm::vec3(-2, 1, -0.5f))};
  for (const glm::vec3& normal : normals) {
    QuadScene scene;
    add_square(scene, glm::vec3(0.3f, -2, 5), normal, 0.5f);
    TransferOptions options;
    options.order = 3, options.directions = 4096;
    const auto transfer = scene.trace(options);
    double y[16];
    decoders::evaluate_sh(3, glm::dvec3(normal), y);
    for (int n = 0; n < 16; ++n) {
      const double expected =
          decoders::clamped_cosine(decoders::band_of(n)) / std::numbers::pi * y[n];
      INFO("n " << n << " normal " << normal.x << " " << normal.y << " " << normal.z);
      for (int c = 0; c < 3; ++c)
        CHECK(scene.value(transfer, n, c, 0) == Approx(expected).margin(1e-3));
    }
  }
}

TEST_CASE("an unoccluded point under uniform light of radiance 1 is 1.000 +- 0.005") {
  for (const std::uint64_t seed : {0u, 1u, 2u, 99u}) {
    QuadScene scene;
    add_square(scene, glm::vec3(0), glm::normalize(glm::vec3(0.2f, 1, -0.4f)), 1);
    TransferOptions options;
    options.seed = seed;
    const auto transfer = scene.trace(options);
    CHECK(kSqrt4Pi * scene.value(transfer, 0, 0, 0) == Approx(1).margin(0.005));
  }
}

TEST_CASE("directions below the face count as occluded, whatever the vertex normal says") {
  QuadScene scene;
  const auto q = square(glm::vec3(0), glm::vec3(0, 1, 0), 1);
  // The normal leans 60 degrees: of its hemisphere the wedge below the face is lost. The irradiance
  // of the rest of a uniform sky is (1 + cos 60°)/2 = 0.75.
  scene.add(q[0], q[1], q[2], q[3], 0, glm::vec3(std::sqrt(3.0f) / 2, 0.5f, 0));
  TransferOptions options;
  options.directions = 8192;
  CHECK(kSqrt4Pi * scene.value(scene.trace(options), 0, 0, 0) == Approx(0.75).margin(0.003));
}

TEST_CASE("a wall shades the floor by its view factor, and bounces its colour") {
  // A floor point at distance 1 from a wall too high and too wide to see past (400 m): half of the
  // sky is covered, cos-weighted: F = 1/2. The wall itself sees half a sky and the floor below.
  QuadScene scene;
  HitSurface red;
  red.base_color = glm::vec4(0.8f, 0.2f, 0.0f, 1.0f);
  scene.geometry.surfaces.push_back(red);
  const std::size_t floor = add_square(scene, glm::vec3(0), glm::vec3(0, 1, 0), 0.05f);
  const std::size_t wall =
      scene.add({-1, 0, 200}, {-1, 0, -200}, {-1, 400, -200}, {-1, 400, 200}, 1);
  REQUIRE(
      glm::cross(scene.positions[5] - scene.positions[4], scene.positions[6] - scene.positions[4])
          .x > 0);
  TransferOptions options;
  options.directions = 16384, options.bounces = 0;
  const auto direct = scene.trace(options);
  CHECK(kSqrt4Pi * scene.value(direct, 0, 0, floor) == Approx(0.5).margin(0.004));
  CHECK(kSqrt4Pi * scene.value(direct, 0, 0, wall) == Approx(1.0).margin(0.004));
  options.bounces = 1;
  const auto bounced = scene.trace(options);
  // The wall's unit-albedo radiance is 1, times its albedo, times the half of the hemisphere it
  // fills.
  CHECK(kSqrt4Pi * scene.value(bounced, 0, 0, floor) == Approx(0.5 + 0.5 * 0.8).margin(0.006));
  CHECK(kSqrt4Pi * scene.value(bounced, 0, 1, floor) == Approx(0.5 + 0.5 * 0.2).margin(0.006));
  CHECK(kSqrt4Pi * scene.value(bounced, 0, 2, floor) == Approx(0.5).margin(0.004));
  // Band 1 leans away from the wall: light from +X reaches the floor, light from -X does not.
  CHECK(scene.value(direct, 3, 0, floor) > 0.1);
}

TEST_CASE("a white furnace returns what came in") {
  // Five inner walls of a cube of albedo 1, open at the top, uniform light: with every bounce
  // counted each wall radiates exactly 1. One texel a wall makes this exact only in the mean over a
  // wall, so the cube is tall and open on two sides instead: parallel plates, where all points are
  // alike.
  QuadScene scene;
  const float half = 1e4f;
  const std::size_t low = add_square(scene, glm::vec3(0), glm::vec3(0, 1, 0), half);
  const std::size_t high = add_square(scene, glm::vec3(0, half, 0), glm::vec3(0, -1, 0), half);
  TransferOptions options;
  options.directions = 4096, options.bounces = 40;
  const auto transfer = scene.trace(options);
  CHECK(kSqrt4Pi * scene.value(transfer, 0, 0, low) == Approx(1).margin(0.005));
  CHECK(kSqrt4Pi * scene.value(transfer, 0, 1, high) == Approx(1).margin(0.005));
}

TEST_CASE("the two sides of a sheet do not shade themselves and are lit on both") {
  QuadScene scene;
  const std::size_t front = add_square(scene, glm::vec3(0, 1, 0), glm::vec3(0, 1, 0), 1);
  const auto q = square(glm::vec3(0, 1, 0), glm::vec3(0, 1, 0), 1);
  const std::size_t back = scene.add(q[0], q[3], q[2], q[1]);
  const std::size_t floor = add_square(scene, glm::vec3(0), glm::vec3(0, 1, 0), 0.2f);
  scene.pair(front, back);
  TransferOptions options;
  options.directions = 8192, options.bounces = 0;
  const auto direct = scene.trace(options);
  CHECK(kSqrt4Pi * scene.value(direct, 0, 0, front) == Approx(1).margin(0.004));
  CHECK(kSqrt4Pi * scene.value(direct, 0, 0, back) > 0.9);
  CHECK(scene.value(direct, 1, 0, back) < -0.3);  // lit from below
  options.bounces = 1;
  // The floor is lit again by the sheet's underside, of albedo 1, and not by its top.
  std::vector<std::uint8_t> buried;
  const auto bounced = scene.trace(options, &buried);
  CHECK(scene.value(bounced, 1, 0, floor) < scene.value(direct, 1, 0, floor));
  CHECK(std::count(buried.begin(), buried.end(), 1) == 0);
}

TEST_CASE("back faces are black, and points inside closed geometry are found out") {
  QuadScene scene;
  const glm::vec3 directions[] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                  {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
  for (const glm::vec3& d : directions) add_square(scene, d, d, 1);
  const std::size_t inner = add_square(scene, glm::vec3(0), glm::vec3(0, 1, 0), 0.2f);
  std::vector<std::uint8_t> buried;
  const auto transfer = scene.trace({}, &buried);
  CHECK(scene.value(transfer, 0, 0, inner) == Approx(0).margin(1e-6));
  CHECK(buried[inner] == 1);
  for (std::size_t outer = 0; outer < 6; ++outer) {
    CHECK(buried[outer] == 0);
    CHECK(kSqrt4Pi * scene.value(transfer, 0, 0, outer) == Approx(1).margin(0.005));
  }
}

TEST_CASE("masked texels let light through") {
  // A roof whose image is opaque in its left half and transparent in its right half.
  Image image;
  image.width = 2, image.height = 1;
  image.rgba = {255, 255, 255, 255, 255, 255, 255, 0};
  HitSurface leaf;
  leaf.image = &image, leaf.masked = true, leaf.linear_filter = false;
  leaf.wrap_u = leaf.wrap_v = container::Wrap::kClamp;
  const auto floor_light = [&](bool masked) {
    QuadScene scene;
    leaf.masked = masked;
    scene.geometry.surfaces.push_back(leaf);
    const std::size_t floor = add_square(scene, glm::vec3(0), glm::vec3(0, 1, 0), 0.001f);
    const std::size_t roof =
        scene.add({-100, 1, -100}, {100, 1, -100}, {100, 1, 100}, {-100, 1, 100}, 1);
    const glm::vec2 uv[] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    for (std::size_t v = 0; v < 4; ++v) scene.geometry.albedo_uv[4 * roof + v] = uv[v];
    TransferOptions options;
    options.directions = 8192, options.bounces = 0;
    return kSqrt4Pi * scene.value(scene.trace(options), 0, 0, floor);
  };
  CHECK(floor_light(false) == Approx(0).margin(0.004));
  CHECK(floor_light(true) == Approx(0.5).margin(0.006));
}

TEST_CASE("transfer stays within its physical bounds") {
  QuadScene scene;
  add_square(scene, glm::vec3(0), glm::vec3(0, 1, 0), 2);
  add_square(scene, glm::vec3(0.5f, 0.5f, 0), glm::normalize(glm::vec3(-1, 0.2f, 0)), 0.5f);
  add_square(scene, glm::vec3(-0.5f, 0.7f, 0.2f), glm::normalize(glm::vec3(1, -0.3f, 0.1f)), 0.5f);
  TransferOptions options;
  options.order = 3, options.bounces = 3;
  const auto transfer = scene.trace(options);
  // max |Y_n| over the sphere for bands 0 to 3 is at most √((2l+1)/4π).
  for (int n = 0; n < 16; ++n) {
    const double bound = std::sqrt((2 * decoders::band_of(n) + 1) / (4 * std::numbers::pi)) * 1.005;
    for (std::size_t s = 0; s < scene.samples.size(); ++s) {
      for (int c = 0; c < 3; ++c) CHECK(std::abs(scene.value(transfer, n, c, s)) <= bound);
    }
  }
  for (std::size_t s = 0; s < scene.samples.size(); ++s) CHECK(scene.value(transfer, 0, 0, s) >= 0);
}

TEST_CASE("the number of threads changes no bit") {
  QuadScene scene;
  for (int i = 0; i < 40; ++i) {
    const float a = 0.37f * static_cast<float>(i);
    add_square(scene, glm::vec3(std::cos(a), 0.1f * static_cast<float>(i), std::sin(a)),
               glm::normalize(glm::vec3(-std::cos(a), 0.3f, -std::sin(a))), 0.3f);
  }
  TransferOptions options;
  options.bounces = 2, options.threads = 1;
  const auto one = scene.trace(options);
  options.threads = 5;
  CHECK(scene.trace(options) == one);
}

TEST_CASE("degenerate triangles and cancelled normals leave finite numbers") {
  QuadScene scene;
  scene.add(glm::vec3(0), glm::vec3(0), glm::vec3(0), glm::vec3(0), 0, glm::vec3(0, 1, 0));
  scene.add({0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, 0, glm::vec3(0, 0, 1));
  const std::size_t q = add_square(scene, glm::vec3(0, 5, 0), glm::vec3(0, 1, 0), 1);
  for (std::size_t v = 4 * q; v < 4 * q + 4; ++v) scene.normals[v] = glm::vec3(0);
  const auto transfer = scene.trace({});
  for (const float v : transfer) CHECK(std::isfinite(v));
  CHECK(kSqrt4Pi * scene.value(transfer, 0, 0, q) == Approx(1).margin(0.005));
}

TEST_CASE("tracing refuses what it cannot do, and says why") {
  QuadScene scene;
  add_square(scene, glm::vec3(0), glm::vec3(0, 1, 0), 1);
  TransferOptions options;
  options.order = 4;
  CHECK(TransferTracer::create(scene.geometry, scene.samples, options).error().code ==
        ErrorCode::kInvalid);
  options = {};
  options.directions = 0;
  CHECK(TransferTracer::create(scene.geometry, scene.samples, options)
            .error()
            .message.find("samples 0") == 0);
  options = {};
  options.width = options.height = QuadScene::kSide;
  auto tracer = TransferTracer::create(scene.geometry, scene.samples, options);
  REQUIRE(tracer);
  std::vector<float> out(27);
  scene.positions[2].y = std::numeric_limits<float>::quiet_NaN();
  const Status status = tracer->trace(scene.positions, scene.normals, out, {});
  REQUIRE_FALSE(status);
  CHECK(status.error().message.find("vertex 2") != std::string::npos);
}
