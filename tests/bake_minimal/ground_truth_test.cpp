// SPDX-License-Identifier: MIT
// Baked transfer against an independent estimate of outgoing radiance
// (tests/reference/path_tracer.hpp): random paths, another intersection code, the light as a
// function of direction.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>

#include "bake_minimal/bake.hpp"
#include "decoders/sh.hpp"
#include "tests/places.hpp"
#include "tests/reference/path_tracer.hpp"

using namespace relit;
using namespace relit::bake;

namespace {

constexpr int kOrder = 2;
constexpr int kCoefficients = 9;
constexpr int kSeeds = 12;    // independent sets of fixed directions, to know their error
constexpr int kTexels = 70;   // a frame
constexpr int kPaths = 2048;  // a texel

// A sun in a dim sky, from which shadows and bounces are as plain as order 2 lets them be.
decoders::Light test_light() {
  decoders::Light light;
  light.sh.resize(kCoefficients);
  const glm::dvec3 sun = glm::normalize(glm::dvec3(0.6, 0.7, 0.4));
  double y[kCoefficients];
  decoders::evaluate_sh(kOrder, sun, y);
  for (int n = 0; n < kCoefficients; ++n) {
    const double bright =
        2.0 * y[n] * (1 + std::cos(3.14159265358979 * decoders::band_of(n) / 5)) / 2;
    light.sh[static_cast<std::size_t>(n)] = {bright, 0.8 * bright, 0.5 * bright};
  }
  light.sh[0][0] += 0.5, light.sh[0][1] += 0.8, light.sh[0][2] += 1.5;
  return light;
}

struct Score {
  int values = 0, beyond = 0;
  double sum = 0, sum_of_squares = 0, largest = 0;
  double difference = 0, radiance = 0, fixed = 0;
};

// The estimator's scene: positions and normals of the packed vertices, albedo by its own lookup.
struct Truth {
  std::vector<std::uint32_t> indices;
  std::vector<std::uint32_t> kept;  // triangles that are not the second side of a sheet
  TraceGeometry geometry;
};

Truth make_truth(const PreparedBake& prepared) {
  Truth truth;
  truth.geometry = trace_geometry(prepared.packed);
  for (std::uint32_t t = 0; t < truth.geometry.indices.size() / 3; ++t) {
    const std::uint32_t other = truth.geometry.other_side[t];
    if (other != kNoOtherSide && other < t) continue;
    truth.kept.push_back(t);
    for (std::size_t k = 0; k < 3; ++k)
      truth.indices.push_back(truth.geometry.indices[3 * std::size_t{t} + k]);
  }
  return truth;
}

// Compares one frame; adds to `score`.
void compare_frame(const PreparedBake& prepared, std::uint64_t frame, int bounces,
                   std::mt19937_64& random, Score& score) {
  const decoders::Light light = test_light();
  auto poser = BakePoser::create(prepared);
  REQUIRE(poser);
  REQUIRE(poser->pose(frame));
  const Truth truth = make_truth(prepared);
  std::uniform_int_distribution<std::size_t> pick(0, prepared.samples.size() - 1);
  // What comes from other surfaces is gathered from their texels; direct light needs none but those
  // that are looked at, of which some will not do.
  const bool gathers = bounces > 0;
  std::vector<TexelSample> traced;
  while (!gathers && traced.size() < 4 * kTexels) traced.push_back(prepared.samples[pick(random)]);
  if (gathers) traced = prepared.samples;
  std::vector<std::vector<float>> bakes(kSeeds);
  std::vector<std::uint8_t> buried(traced.size());
  for (int seed = 0; seed < kSeeds; ++seed) {
    TransferOptions options;
    options.order = kOrder, options.bounces = bounces,
    options.seed = static_cast<std::uint64_t>(seed);
    options.width = options.height = 128;
    auto tracer = TransferTracer::create(trace_geometry(prepared.packed), traced, options);
    REQUIRE(tracer);
    auto& out = bakes[static_cast<std::size_t>(seed)];
    out.resize(traced.size() * 3 * kCoefficients);
    REQUIRE(tracer->trace(poser->positions(), poser->normals(), out, buried));
  }
  const auto relit = [&](int seed, std::size_t sample, std::size_t c) {
    double sum = 0;
    for (std::size_t n = 0; n < kCoefficients; ++n) {
      sum += light.sh[n][c] *
             static_cast<double>(
                 bakes[static_cast<std::size_t>(seed)][(n * 3 + c) * traced.size() + sample]);
    }
    return sum;
  };

  const reference::TriangleTree tree(poser->positions(), truth.indices);
  std::vector<std::uint32_t> to_kept(truth.geometry.indices.size() / 3, 0);
  for (std::uint32_t k = 0; k < truth.kept.size(); ++k) to_kept[truth.kept[k]] = k;
  reference::PathScene scene;
  scene.tree = &tree;
  scene.normals = poser->normals();
  scene.indices = truth.indices;
  scene.albedo = [&](std::size_t t, double b1, double b2) {
    const std::uint32_t* i = &truth.indices[3 * t];
    const auto mix = [&](const auto& v) {
      return static_cast<float>(1 - b1 - b2) * v[i[0]] + static_cast<float>(b1) * v[i[1]] +
             static_cast<float>(b2) * v[i[2]];
    };
    const HitSurface& surface = truth.geometry.surfaces[truth.geometry.surface[truth.kept[t]]];
    return glm::dvec3(
        surface_albedo(surface, mix(truth.geometry.albedo_uv), mix(truth.geometry.colors)));
  };
  scene.double_sided = [&](std::size_t t) {
    return truth.geometry.other_side[truth.kept[t]] != kNoOtherSide;
  };
  const auto radiance = [&](const glm::dvec3& d) {
    const auto r = decoders::radiance(light, d);
    return glm::dvec3(r[0], r[1], r[2]);
  };

  std::size_t next = 0;
  for (int taken = 0; taken < kTexels;) {
    const std::size_t s = gathers ? pick(random) : next++;
    REQUIRE(s < traced.size());
    const TexelSample& sample = traced[s];
    const bool second_side = truth.geometry.other_side[sample.triangle] != kNoOtherSide &&
                             truth.geometry.other_side[sample.triangle] < sample.triangle;
    if (!sample.covered || buried[s] != 0 || second_side) continue;
    ++taken;
    const auto estimate =
        reference::outgoing_radiance(scene, to_kept[sample.triangle], double(sample.b1),
                                     double(sample.b2), bounces, kPaths, random, radiance);
    for (std::size_t c = 0; c < 3; ++c) {
      double mean = 0, squares = 0;
      for (int seed = 0; seed < kSeeds; ++seed) mean += relit(seed, s, c) / kSeeds;
      for (int seed = 0; seed < kSeeds; ++seed)
        squares += std::pow(relit(seed, s, c) - mean, 2) / (kSeeds - 1);
      const int ci = static_cast<int>(c);
      const double error = std::hypot(estimate.standard_error[ci], std::sqrt(squares), 1e-4);
      const double z = (relit(0, s, c) - estimate.mean[ci]) / error;
      ++score.values;
      score.beyond += std::abs(z) > 3.3 ? 1 : 0;
      score.sum += z, score.sum_of_squares += z * z;
      score.largest = std::max(score.largest, std::abs(z));
      score.difference += relit(0, s, c) - estimate.mean[ci], score.radiance += estimate.mean[ci];
      score.fixed += squares;
    }
  }
}

void check(const std::filesystem::path& file, int bounces) {
  BakeOptions options;
  options.input = file;
  options.output = "unused.relit";
  options.transfer.order = kOrder;
  auto prepared = prepare_bake(options);
  if (!prepared) FAIL(prepared.error().message);
  std::mt19937_64 random(20030514);
  Score score;
  for (const double at : {0.0, 0.37, 0.71}) {
    compare_frame(*prepared, static_cast<std::uint64_t>(at * static_cast<double>(prepared->frames)),
                  bounces, random, score);
  }
  const double count = score.values;
  const double mean = score.sum / count;
  const double bias = score.difference / score.radiance;
  std::printf(
      "%s, %d bounce(s): %d values, mean z %+.3f, rms z %.3f, largest %.2f, beyond 3.3: %.2f %%, "
      "bias %+.4f %%, "
      "rms error of the fixed directions %.4f of the mean radiance\n",
      file.filename().c_str(), bounces, score.values, mean, std::sqrt(score.sum_of_squares / count),
      score.largest, 100 * score.beyond / count, 100 * bias,
      std::sqrt(score.fixed / count) / (score.radiance / count));
  // The channels of a texel share their paths, so there are about a third as many independent
  // values.
  CHECK(std::abs(mean) < 3.3 * std::sqrt(3 / count));
  CHECK(100 * score.beyond <= score.values);
  CHECK(std::abs(bias) < 0.005);
}

std::filesystem::path own_character() { return test::binary_dir() / "media/mannequin.glb"; }

}  // namespace

TEST_CASE("direct light on the mannequin agrees with random paths", "[long]") {
  check(own_character(), 0);
}

TEST_CASE("one bounce on the mannequin agrees with random paths", "[long]") {
  check(own_character(), 1);
}

TEST_CASE("one bounce on CesiumMan agrees with random paths", "[long]") {
  const auto file = test::shared_asset("CesiumMan.glb");
  if (file) check(*file, 1);
}
