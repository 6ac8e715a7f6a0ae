// SPDX-License-Identifier: MIT
#include "bake_minimal/pose_encoder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "bake_minimal/pose_quantizer.hpp"
#include "decoders/pose.hpp"
#include "tests/bake_minimal/scene_fixture.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::bake;
using container::ChannelTarget;
using container::PoseKind;
using decoders::Pose;
using decoders::PoseTrack;

namespace {

std::vector<double> frame_times(std::size_t count, double fps) {
  std::vector<double> times;
  for (std::size_t k = 0; k < count; ++k) times.push_back(static_cast<double>(k) / fps);
  return times;
}

PackedScene packed(const Scene& scene) {
  Result<PackedScene> result = pack_scene(scene, {});
  if (!result) FAIL(result.error().message);
  return std::move(*result);
}

PoseEncoding encoded(const Scene& scene, const PackedScene& pack, const std::vector<double>& times,
                     const PoseOptions& options) {
  Result<PoseEncoding> result = encode_pose(scene, times, pack, options);
  if (!result) FAIL(result.error().message);
  return std::move(*result);
}

PoseTrack decoded(const PackedScene& pack, const PoseEncoding& encoding, std::size_t frames,
                  std::uint32_t segment_frames) {
  Result<PoseTrack> track = PoseTrack::create(pack.skeleton, encoding.track, pack.meshes);
  if (!track) FAIL(track.error().message);
  for (std::size_t s = 0; s < encoding.packets.size(); ++s) {
    const std::size_t first = s * segment_frames;
    const auto count =
        static_cast<std::uint32_t>(std::min<std::size_t>(segment_frames, frames - first));
    const Status status = track->add_packet(encoding.packets[s], first, count);
    if (!status) FAIL(status.error().message);
  }
  return std::move(*track);
}

/// The largest distance of the decoded surface from the scene's over all frames.
double largest_error(const Scene& scene, const PackedScene& pack, const PoseTrack& track,
                     const std::vector<double>& times, int clip = 0) {
  double worst = 0;
  Pose pose;
  ScenePose exact;
  std::vector<glm::mat4> world;
  for (std::size_t k = 0; k < times.size(); ++k) {
    REQUIRE(track.sample(static_cast<double>(k), pose));
    scene.sample(clip, times[k], exact);
    scene.world_matrices(exact, world);
    for (std::size_t m = 0; m < pack.meshes.size(); ++m) {
      const PackedMeshSource& source = pack.sources[m];
      const Primitive& p = scene.primitives[source.primitive];
      std::vector<glm::vec3> expected(p.positions.size());
      scene.pose_primitive(p, exact, world, expected, {});
      std::vector<glm::vec3> got(source.source_vertex.size());
      decoders::pose_mesh(pack.meshes[m], m, pose, got, {});
      for (std::size_t v = 0; v < got.size(); ++v) {
        const glm::dvec3 d = glm::dvec3(got[v]) - glm::dvec3(expected[source.source_vertex[v]]);
        worst = std::max(worst, std::sqrt(glm::dot(d, d)));
      }
    }
  }
  return worst;
}

Scene morph_scene() {
  Scene scene = test::still_scene();
  scene.morph_weight_count = 2;
  scene.default_morph_weights = {0, 0.5f};
  Primitive& p = scene.primitives[0];
  p.morph_targets.resize(2);
  for (std::size_t v = 0; v < p.positions.size(); ++v) {
    p.morph_targets[0].positions.emplace_back(0, 0, std::sin(static_cast<float>(v)));
    p.morph_targets[1].positions.emplace_back(0, 0.25f, 0);
  }
  Clip clip;
  clip.duration_s = 1;
  clip.channels.push_back(test::channel(Path::kWeights, 0, {0, 1}, {0, 0.5f, 1, 0.5f}));
  scene.clips.push_back(clip);
  return scene;
}

}  // namespace

TEST_CASE("a chain of joints stays within the bound of its quantisers") {
  for (const auto& [joints, influences] : {std::pair{4, 4}, std::pair{8, 8}}) {
    const Scene scene = test::chain_scene(joints, influences);
    const PackedScene pack = packed(scene);
    const std::vector<double> times = frame_times(50, 50);
    PoseOptions options;
    options.choice = PoseChoice::kJoints;
    const PoseEncoding encoding = encoded(scene, pack, times, options);
    CHECK(encoding.track.kind == PoseKind::kJoints);
    CHECK(encoding.packets.size() == 2);
    const double error = largest_error(scene, pack, decoded(pack, encoding, 50, 25), times);
    // The sheet is 2 long and its root scales by 1.5, so nothing is longer than 4.5 and a step of
    // the surface is at most s = 4.5 / 2^14 = 2.7e-4. Each joint of the chain adds to a vertex:
    // rotation √3·s/w, with w >= 0.9 for angles up to 0.6 rad (1.93 s); the first one's translation
    // √3·s/2; the last one's scale s·√3/2. Positions: half of 2/4095 on three axes, times 1.5·1.25
    // (8.0e-4). Weights: eight of them off by less than 1/255 each, and matrices that differ by
    // what neighbours part, which rounding shares; their sum of errors is 0, and joints lie
    // within 4.5 of each other, with half of influences/255 changing hands at most.
    const double s = 4.5 / 16384;
    const double chain = joints * 1.93 * s + 2 * 0.87 * s + 8.0e-4;
    const double weights = influences / 2 / 255.0 * 4.5;
    CHECK(error < chain + weights);

    // Against the same mesh with the rounded weights the bound is the chain's alone.
    Scene rounded = scene;
    Primitive& p = rounded.primitives[0];
    const auto n = static_cast<std::size_t>(influences);
    std::fill(p.weights.begin(), p.weights.end(), 0.0f);
    for (std::size_t v = 0; v < pack.meshes[0].positions.size(); ++v) {
      const auto width = static_cast<std::size_t>(pack.meshes[0].influences_per_vertex);
      for (std::size_t i = 0; i < width; ++i) {
        const std::uint16_t joint = pack.meshes[0].joints[v * width + i];
        p.weights[pack.sources[0].source_vertex[v] * n + joint] +=
            pack.meshes[0].weights[v * width + i];
      }
    }
    CHECK(largest_error(rounded, pack, decoded(pack, encoding, 50, 25), times) < chain);
  }
}

TEST_CASE("more precision bits bring the surface nearer") {
  Scene scene = test::chain_scene(4);
  for (float& w : scene.primitives[0].weights)
    w = std::round(w);  // one joint each: no weight errors
  for (std::size_t v = 0; v < scene.primitives[0].positions.size(); ++v) {
    float* w = &scene.primitives[0].weights[4 * v];
    if (w[0] + w[1] + w[2] + w[3] != 1) w[0] = 1, w[1] = w[2] = w[3] = 0;
  }
  PackOptions fine;
  fine.position_bits = 16;
  Result<PackedScene> pack = pack_scene(scene, fine);
  REQUIRE(pack);
  const std::vector<double> times = frame_times(20, 20);
  PoseOptions options;
  options.choice = PoseChoice::kJoints;
  double last = 1;
  for (const int bits : {8, 11, 14}) {
    options.precision_bits = bits;
    const PoseEncoding encoding = encoded(scene, *pack, times, options);
    const double error = largest_error(scene, *pack, decoded(*pack, encoding, 20, 25), times);
    CHECK(error < last / 3);  // a factor of 8, less what chance gives
    last = error;
  }
}

TEST_CASE("vertex tracks are off by half a step of one common grid") {
  const Scene scene = test::chain_scene(4);
  PackedScene pack = packed(scene);
  const std::vector<double> times = frame_times(30, 30);
  PoseOptions options;
  options.choice = PoseChoice::kVertices;
  options.segment_frames = 8;
  const PoseEncoding encoding = encoded(scene, pack, times, options);
  REQUIRE(encoding.track.kind == PoseKind::kVertices);
  CHECK(encoding.packets.size() == 4);
  CHECK(encoding.track.channels.empty());
  drop_rig(pack);
  const double step = static_cast<double>(encoding.track.vertex_ranges[0].step[0]);
  CHECK(step < 1.1 * 4.5 / 16384);
  const double error = largest_error(scene, pack, decoded(pack, encoding, 30, 8), times);
  CHECK(error < std::sqrt(3.0) * step / 2 + 2e-6);  // floats of magnitude 5
}

TEST_CASE("segments decode by themselves") {
  const Scene scene = test::chain_scene(3);
  const PackedScene pack = packed(scene);
  const std::vector<double> times = frame_times(23, 23);
  for (const PoseChoice choice : {PoseChoice::kJoints, PoseChoice::kVertices}) {
    PoseOptions options;
    options.choice = choice;
    options.segment_frames = 10;
    const PoseEncoding encoding = encoded(scene, pack, times, options);
    REQUIRE(encoding.packets.size() == 3);
    const PoseTrack whole = decoded(pack, encoding, 23, 10);
    Result<PoseTrack> last = PoseTrack::create(pack.skeleton, encoding.track, pack.meshes);
    REQUIRE(last);
    REQUIRE(last->add_packet(encoding.packets[2], 20, 3));
    Pose a, b;
    REQUIRE(whole.sample(21.5, a));
    REQUIRE(last->sample(21.5, b));
    CHECK(a.palette == b.palette);
    CHECK(a.vertices == b.vertices);
  }
}

TEST_CASE("encoding poses is deterministic") {
  const Scene scene = test::chain_scene(5);
  const PackedScene pack = packed(scene);
  const std::vector<double> times = frame_times(40, 40);
  for (const PoseChoice choice : {PoseChoice::kJoints, PoseChoice::kVertices}) {
    PoseOptions options;
    options.choice = choice;
    CHECK(encoded(scene, pack, times, options).packets ==
          encoded(scene, pack, times, options).packets);
  }
}

TEST_CASE("only what moves becomes a channel, the rest is rest") {
  Scene scene = test::chain_scene(3);
  // Joint 1 turns by less than any step; joint 2 stands still, elsewhere than at rest.
  scene.clips[0].channels.clear();
  scene.clips[0].channels.push_back(
      test::channel(Path::kRotation, 1, {0, 1}, {0, 0, 0, 1, 1e-6f, 0, 0, 1}));
  scene.clips[0].channels.push_back(
      test::channel(Path::kTranslation, 2, {0, 1}, {0, 2, 0, 0, 2, 0}));
  scene.clips[0].channels.push_back(test::channel(Path::kScale, 3, {0, 1}, {1, 1, 1, 1, 2, 1}));
  const PackedScene pack = packed(scene);
  const std::vector<double> times = frame_times(11, 10);
  PoseOptions options;
  options.choice = PoseChoice::kJoints;
  const PoseEncoding encoding = encoded(scene, pack, times, options);
  REQUIRE(encoding.track.channels.size() == 1);
  CHECK(encoding.track.channels[0].target == ChannelTarget::kScale);
  CHECK(encoding.track.channels[0].index == 3);
  const auto rest_of_2 = std::find_if(encoding.track.rest.begin(), encoding.track.rest.end(),
                                      [](const auto& r) { return r.node == 2; });
  REQUIRE(rest_of_2 != encoding.track.rest.end());
  CHECK(rest_of_2->translation == std::array<float, 3>{0, 2, 0});
  CHECK(std::none_of(encoding.track.rest.begin(), encoding.track.rest.end(),
                     [](const auto& r) { return r.node == 0; }));
  const PoseTrack track = decoded(pack, encoding, 11, 25);
  CHECK(largest_error(scene, pack, track, times) < 0.02);  // weights: 2/255 of what neighbours part
}

TEST_CASE("morph weights are channels, and those that rest elsewhere than at zero too") {
  const Scene scene = morph_scene();
  const PackedScene pack = packed(scene);
  const std::vector<double> times = frame_times(11, 10);
  PoseOptions options;
  options.choice = PoseChoice::kJoints;
  const PoseEncoding encoding = encoded(scene, pack, times, options);
  REQUIRE(encoding.track.channels.size() == 2);
  CHECK(encoding.track.channels[1].offset[0] == 0.5f);
  const double error = largest_error(scene, pack, decoded(pack, encoding, 11, 25), times);
  // Half steps: positions and two targets √3·(2/4095)/2 each, the weight's half step of the
  // surface twice, for the sheet grows to at most 3: 3/16384/2.
  CHECK(error < 3 * 4.24e-4 + 2 * 0.92e-4);
}

TEST_CASE("auto takes the smaller kind and says what both cost") {
  const std::vector<double> times = frame_times(25, 25);
  const Scene chain = test::chain_scene(3);
  const PackedScene chain_pack = packed(chain);
  const PoseEncoding joints = encoded(chain, chain_pack, times, {});
  CHECK(joints.track.kind == PoseKind::kJoints);
  CHECK(joints.joints_bytes > 0);

  // Forty targets that hardly anything uses cost more than the motion of 63 vertices.
  Scene heavy = morph_scene();
  heavy.morph_weight_count = 40;
  heavy.default_morph_weights.assign(40, 0);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(-1, 1);
  heavy.primitives[0].morph_targets.resize(40);
  for (MorphDelta& target : heavy.primitives[0].morph_targets) {
    target.positions.clear();
    for (std::size_t v = 0; v < heavy.primitives[0].positions.size(); ++v) {
      target.positions.emplace_back(uniform(random), uniform(random), uniform(random));
    }
  }
  std::vector<float> values(80, 0.0f);
  values[40] = 1;
  heavy.clips[0].channels = {test::channel(Path::kWeights, 0, {0, 1}, values)};
  const PackedScene heavy_pack = packed(heavy);
  const PoseEncoding vertices = encoded(heavy, heavy_pack, times, {});
  CHECK(vertices.track.kind == PoseKind::kVertices);
  CHECK(vertices.vertices_bytes < vertices.joints_bytes);
  CHECK(largest_error(heavy, heavy_pack, decoded(heavy_pack, vertices, 25, 25), times) < 1e-3);
}

TEST_CASE("rotations keep the bound for every kind of motion") {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::vector<glm::dvec4> wild;
  for (int i = 0; i < 500; ++i) {
    const glm::dvec4 q(normal(random), normal(random), normal(random), normal(random));
    wild.push_back(q / std::sqrt(glm::dot(q, q)));
  }
  make_continuous(wild);
  for (std::size_t t = 1; t < wild.size(); ++t) CHECK(glm::dot(wild[t - 1], wild[t]) >= 0);
  const double step = kFinestRotationStep;
  const QuantizedChannel channel = quantize_rotation(wild, step);
  for (std::size_t t = 0; t < wild.size(); ++t) {
    const auto top_bit = [&](std::size_t word) { return unsigned{channel.words[word][t]} >> 15; };
    const unsigned omitted = top_bit(0) | top_bit(1) << 1;
    CHECK((channel.words[2][t] & 0x8000) == 0);
    glm::dvec4 q(0);
    double squares = 0;
    for (unsigned i = 0, c = 0; i < 3; ++i, ++c) {
      if (c == omitted) ++c;
      q[static_cast<int>(c)] = channel.offset[i] + channel.step[i] * (channel.words[i][t] & 0x7fff);
      squares += q[static_cast<int>(c)] * q[static_cast<int>(c)];
    }
    q[static_cast<int>(omitted)] = std::sqrt(std::max(0.0, 1 - squares));
    CHECK(std::abs(wild[t][static_cast<int>(omitted)]) >= 0.35);
    const double cosine = std::abs(glm::dot(glm::normalize(q), wild[t]));
    const double angle = 2 * std::acos(std::min(1.0, cosine));
    CHECK(angle <= 4.95 * step * 1.01);  // the bound is of first order; acos is good to 2e-8
  }
}

TEST_CASE("a turning joint keeps its omitted component while it can") {
  std::vector<glm::dvec4> turning;
  for (int k = 0; k < 100; ++k) {
    const double half = 0.5 * 2.2 * std::sin(0.1 * k);  // up to 126 degrees: w >= 0.45
    turning.emplace_back(std::sin(half), 0, 0, std::cos(half));
  }
  const QuantizedChannel channel = quantize_rotation(turning, 1e-3);
  for (std::size_t t = 0; t < turning.size(); ++t) {
    CHECK((channel.words[0][t] >> 15) == 1);
    CHECK((channel.words[1][t] >> 15) == 1);
  }
}

TEST_CASE("encode_pose refuses what makes no sense") {
  const Scene scene = test::chain_scene(3);
  const PackedScene pack = packed(scene);
  const auto refused = [&](const std::vector<double>& times, const PoseOptions& options,
                           const Scene& s) {
    const auto result = encode_pose(s, times, pack, options);
    return !result.has_value() && result.error().code == ErrorCode::kInvalid;
  };
  const std::vector<double> times{0, 0.5};
  CHECK_FALSE(refused(times, {}, scene));
  CHECK(refused({}, {}, scene));
  CHECK(refused({0, std::numeric_limits<double>::infinity()}, {}, scene));
  PoseOptions options;
  options.clip = 1;
  CHECK(refused(times, options, scene));
  options = {};
  options.segment_frames = 0;
  CHECK(refused(times, options, scene));
  options = {};
  options.precision_bits = 30;
  CHECK(refused(times, options, scene));
  Scene broken = scene;
  broken.clips[0].channels[0].values[1] = std::numeric_limits<float>::quiet_NaN();
  broken.clips[0].channels.back().values[1] = std::numeric_limits<float>::quiet_NaN();
  CHECK(refused(times, {}, broken));
}
