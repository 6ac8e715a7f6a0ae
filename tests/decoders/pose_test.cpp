// SPDX-License-Identifier: MIT
#include "decoders/pose.hpp"

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <random>

#include "container/base/limits.hpp"
#include "tests/decoders/mesh_fixture.hpp"
#include "tests/test.hpp"

using namespace relit;
using container::ChannelTarget;
using container::PoseKind;
using container::PoseTrackRecord;
using container::SkeletonRecord;
using decoders::Mesh;
using decoders::Pose;
using decoders::PoseTrack;

namespace {

using Frames = std::vector<std::vector<std::uint16_t>>;  // [frame][value]

/// A packet as FORMAT.md describes it, straight from the text.
std::vector<std::uint8_t> packet(const Frames& frames, PoseKind kind, unsigned mode) {
  const std::size_t count = frames.size(), values = frames[0].size();
  const auto time_prediction = [&](std::size_t t, std::size_t v) {
    const unsigned order = mode & 3;
    if (order == 0 || t == 0) return 0u;
    if (order == 1 || t == 1) return static_cast<unsigned>(frames[t - 1][v]);
    return 2u * frames[t - 1][v] - frames[t - 2][v];
  };
  std::vector<std::uint8_t> low(count * values), high(count * values);
  for (std::size_t t = 0; t < count; ++t) {
    for (std::size_t v = 0; v < values; ++v) {
      unsigned residual = frames[t][v] - time_prediction(t, v);
      if (kind == PoseKind::kVertices && v >= 3 && (t == 0 || (mode & 4) != 0)) {
        residual -= frames[t][v - 3] - time_prediction(t, v - 3);
      }
      const int value = static_cast<std::int16_t>(residual & 0xffff);
      const int zigzag = value >= 0 ? 2 * value : -2 * value - 1;
      const std::size_t at = kind == PoseKind::kVertices ? t * values + v : v * count + t;
      low[at] = static_cast<std::uint8_t>(zigzag & 255);
      high[at] = static_cast<std::uint8_t>(zigzag >> 8);
    }
  }
  std::vector<std::uint8_t> bytes{static_cast<std::uint8_t>(mode)};
  bytes.insert(bytes.end(), low.begin(), low.end());
  bytes.insert(bytes.end(), high.begin(), high.end());
  return test::zstd(bytes);
}

/// The words of a unit quaternion (x, y, z, w) whose component `omitted` is left out.
std::array<std::uint16_t, 3> rotation_words(glm::dvec4 q, int omitted,
                                            const container::PoseChannel& channel) {
  if (q[omitted] < 0) q = -q;
  std::array<std::uint16_t, 3> words{};
  for (int i = 0, slot = 0; i < 4; ++i) {
    if (i == omitted) continue;
    const auto s = static_cast<std::size_t>(slot++);
    const double steps = (q[i] - channel.offset[s]) / channel.step[s];
    words[s] = static_cast<std::uint16_t>(std::lround(steps));
  }
  words[0] = static_cast<std::uint16_t>(words[0] | (omitted & 1) << 15);
  words[1] = static_cast<std::uint16_t>(words[1] | (omitted >> 1) << 15);
  return words;
}

container::PoseChannel rotation_channel(std::uint32_t node) {
  return {ChannelTarget::kRotation, node, {-1, -1, -1}, {1 / 16384.0f, 1 / 16384.0f, 1 / 16384.0f}};
}

/// One node, one palette entry, one animated translation along x: value = integer / 4.
struct Slider {
  SkeletonRecord skeleton;
  PoseTrackRecord track;

  Slider() {
    skeleton.nodes.resize(1);
    skeleton.palette.resize(1);
    track.channels.push_back({ChannelTarget::kTranslation, 0, {}, {0.25f, 0.25f, 0.25f}});
  }
  [[nodiscard]] PoseTrack create() const {
    Result<PoseTrack> made = PoseTrack::create(skeleton, track, {});
    REQUIRE(made);
    return std::move(*made);
  }
};

Frames ramp(std::uint16_t first, std::size_t count) {
  Frames frames;
  for (std::size_t k = 0; k < count; ++k) {
    frames.push_back({static_cast<std::uint16_t>(first + 4 * k), 0, 0});
  }
  return frames;
}

float slide(const PoseTrack& track, double frame) {
  Pose pose;
  REQUIRE(track.sample(frame, pose));
  return pose.palette.at(0)[3].x;
}

}  // namespace

TEST_CASE("pose track interpolates between frames and holds at the ends") {
  PoseTrack track = Slider().create();
  REQUIRE(track.add_packet(packet(ramp(8, 3), PoseKind::kJoints, 1), 0, 3));
  CHECK(slide(track, 0) == 2.0f);
  CHECK(slide(track, 1) == 3.0f);
  CHECK(slide(track, 1.25) == 3.25f);
  CHECK(slide(track, 2) == 4.0f);
  CHECK(slide(track, 2.5) == 4.0f);
  CHECK(slide(track, 1e12) == 4.0f);
  CHECK(slide(track, -3) == 2.0f);
}

TEST_CASE("pose track refuses frames that are not finite") {
  PoseTrack track = Slider().create();
  REQUIRE(track.add_packet(packet(ramp(8, 3), PoseKind::kJoints, 1), 0, 3));
  Pose pose;
  for (const double frame : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    const Status status = track.sample(frame, pose);
    REQUIRE_FALSE(status);
    CHECK(status.error().code == ErrorCode::kInvalid);
  }
}

TEST_CASE("pose packets decode by themselves, in any order, and gaps hold the last frame") {
  PoseTrack track = Slider().create();
  Pose pose;
  const Status nothing = track.sample(0, pose);
  REQUIRE_FALSE(nothing);
  CHECK(nothing.error().code == ErrorCode::kNotFound);
  REQUIRE(track.add_packet(packet(ramp(400, 2), PoseKind::kJoints, 1), 4, 2));
  CHECK(slide(track, 5) == 101.0f);
  CHECK_FALSE(track.sample(3.5, pose).has_value());
  REQUIRE(track.add_packet(packet(ramp(0, 2), PoseKind::kJoints, 2), 0, 2));
  CHECK(slide(track, 3) == 1.0f);                // frame 3 never came: frame 1
  CHECK(slide(track, 3.5) == (1 + 100) / 2.0f);  // half way from the held frame to frame 4
}

TEST_CASE("pose track replaces a segment and refuses overlaps") {
  PoseTrack track = Slider().create();
  const auto two = packet(ramp(0, 2), PoseKind::kJoints, 1);
  REQUIRE(track.add_packet(two, 2, 2));
  REQUIRE(track.add_packet(packet(ramp(40, 2), PoseKind::kJoints, 1), 2, 2));
  CHECK(slide(track, 2) == 10.0f);
  CHECK(track.memory_bytes() == 2 * 3 * sizeof(std::uint16_t));
  for (const std::uint64_t first : {1ull, 3ull}) {
    const Status status = track.add_packet(two, first, 2);
    REQUIRE_FALSE(status);
    CHECK(status.error().code == ErrorCode::kCorrupt);
  }
  CHECK_FALSE(track.add_packet(packet(ramp(0, 5), PoseKind::kJoints, 1), 0, 5).has_value());
  CHECK(slide(track, 3) == 11.0f);
}

TEST_CASE("pose track forgets whole segments only") {
  PoseTrack track = Slider().create();
  REQUIRE(track.add_packet(packet(ramp(0, 2), PoseKind::kJoints, 1), 0, 2));
  REQUIRE(track.add_packet(packet(ramp(40, 2), PoseKind::kJoints, 1), 2, 2));
  track.forget_before(1);
  CHECK(slide(track, 0) == 0.0f);
  track.forget_before(2);
  Pose pose;
  CHECK_FALSE(track.sample(1, pose).has_value());
  CHECK(slide(track, 2) == 10.0f);
}

TEST_CASE("every prediction mode gives the same integers") {
  std::mt19937 random(2);
  Frames frames(5, std::vector<std::uint16_t>(3));
  for (auto& frame : frames) {
    for (std::uint16_t& v : frame) v = static_cast<std::uint16_t>(random());
  }
  for (const unsigned mode : {0u, 1u, 2u}) {
    PoseTrack track = Slider().create();
    REQUIRE(track.add_packet(packet(frames, PoseKind::kJoints, mode), 0, 5));
    Pose pose;
    for (std::size_t k = 0; k < 5; ++k) {
      REQUIRE(track.sample(static_cast<double>(k), pose));
      const glm::vec3 expected(frames[k][0], frames[k][1], frames[k][2]);
      CHECK(pose.palette[0][3] == expected * 0.25f);
    }
  }
  PoseTrack track = Slider().create();
  for (const unsigned mode : {3u, 4u, 5u, 8u, 128u}) {
    CHECK_FALSE(track.add_packet(packet(frames, PoseKind::kJoints, mode), 0, 5).has_value());
  }
}

TEST_CASE("pose track composes the hierarchy from channels, rest values and matrices") {
  // Node 0: a matrix. Node 1: its rotation animated, translation and scale at rest. Node 2: at rest
  // by its RestTrs alone. The palette looks at node 2.
  SkeletonRecord skeleton;
  skeleton.nodes.resize(3);
  skeleton.nodes[0].local = {0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3};
  skeleton.nodes[1].parent = 0;
  skeleton.nodes[2].parent = 1;
  skeleton.palette.push_back({2, {1, 0, 0, -5, 0, 1, 0, 0, 0, 0, 2, 0}});
  PoseTrackRecord track;
  track.channels.push_back(rotation_channel(1));
  track.rest.push_back({1, {4, 5, 6}, {0, 0, 0, 1}, {1, 2, -3}});
  track.rest.push_back({2, {0, 1, 0}, {0.6f, 0, 0, 0.8f}, {1, 1, 1}});
  const glm::dvec4 q = glm::normalize(glm::dvec4(0.1, -0.7, 0.3, 0.4));

  Result<PoseTrack> made = PoseTrack::create(skeleton, track, {});
  REQUIRE(made);
  const auto words = rotation_words(q, 1, track.channels[0]);
  REQUIRE(made->add_packet(packet({{words[0], words[1], words[2]}}, PoseKind::kJoints, 0), 0, 1));
  Pose pose;
  REQUIRE(made->sample(0, pose));

  const glm::dmat4 root(glm::dvec4(0, 1, 0, 0), glm::dvec4(-1, 0, 0, 0), glm::dvec4(0, 0, 1, 0),
                        glm::dvec4(1, 2, 3, 1));
  const glm::dmat4 middle = glm::translate(glm::dmat4(1), glm::dvec3(4, 5, 6)) *
                            glm::mat4_cast(glm::dquat(q.w, q.x, q.y, q.z)) *
                            glm::scale(glm::dmat4(1), glm::dvec3(1, 2, -3));
  const glm::dmat4 leaf = glm::translate(glm::dmat4(1), glm::dvec3(0, 1, 0)) *
                          glm::mat4_cast(glm::dquat(0.8, 0.6, 0, 0));
  const glm::dmat4 bind(glm::dvec4(1, 0, 0, 0), glm::dvec4(0, 1, 0, 0), glm::dvec4(0, 0, 2, 0),
                        glm::dvec4(-5, 0, 0, 1));
  const glm::dmat4 expected = root * middle * leaf * bind;
  // Words are off by half a step of 2^-14, so the quaternion by √3·2^-15/|y| (|y| = 0.81 is left
  // out) and a rotated vector by twice that, 1.3e-4 of its length; below the rotation none exceeds
  // 3·(5 + 1)·2 = 36, hence 4.7e-3. Floats add less than 1e-5.
  for (int c = 0; c < 4; ++c) {
    for (int r = 0; r < 3; ++r) CHECK(std::abs(pose.palette[0][c][r] - expected[c][r]) < 4.7e-3);
  }
}

TEST_CASE("every choice of the omitted component gives the same rotation") {
  SkeletonRecord skeleton;
  skeleton.nodes.resize(1);
  skeleton.palette.resize(1);
  PoseTrackRecord track;
  track.channels.push_back(rotation_channel(0));
  const glm::dvec4 q = glm::normalize(glm::dvec4(0.5, -0.6, 0.4, -0.5));
  const glm::dmat3 expected = glm::mat3_cast(glm::dquat(q.w, q.x, q.y, q.z));
  for (int omitted = 0; omitted < 4; ++omitted) {
    Result<PoseTrack> made = PoseTrack::create(skeleton, track, {});
    REQUIRE(made);
    const auto w = rotation_words(q, omitted, track.channels[0]);
    REQUIRE(made->add_packet(packet({{w[0], w[1], w[2]}}, PoseKind::kJoints, 0), 0, 1));
    Pose pose;
    REQUIRE(made->sample(0, pose));
    // 2·√3·2^-15 / 0.39, the least component: 2.7e-4.
    for (int c = 0; c < 3; ++c) {
      CHECK(glm::length(glm::dvec3(pose.palette[0][c]) - expected[c]) < 2.7e-4);
    }
  }
}

TEST_CASE("rotations interpolate on the shorter arc") {
  // 170° and 190° about z: their words have w and z left out, so that the quaternions as decoded
  // point away from each other; half way lies 180°, not 0°.
  SkeletonRecord skeleton;
  skeleton.nodes.resize(1);
  skeleton.palette.resize(1);
  PoseTrackRecord track;
  track.channels.push_back(rotation_channel(0));
  const auto about_z = [](double degrees) {
    const double half = degrees * std::acos(-1.0) / 360;
    return glm::dvec4(0, 0, std::sin(half), std::cos(half));
  };
  const auto a = rotation_words(about_z(170), 2, track.channels[0]);
  const auto b = rotation_words(about_z(190), 3, track.channels[0]);
  Result<PoseTrack> made = PoseTrack::create(skeleton, track, {});
  REQUIRE(made);
  REQUIRE(made->add_packet(packet({{a[0], a[1], a[2]}, {b[0], b[1], b[2]}}, PoseKind::kJoints, 0),
                           0, 2));
  Pose pose;
  REQUIRE(made->sample(0.5, pose));
  // w = cos 95° = 0.087 is left out in the second: 2·√3·2^-15/0.087 = 1.2e-3.
  CHECK(glm::length(pose.palette[0][0] - glm::vec3(-1, 0, 0)) < 1.2e-3f);
}

TEST_CASE("morph weights without a channel are zero") {
  SkeletonRecord skeleton;
  skeleton.morph_weight_count = 3;
  PoseTrackRecord track;
  track.channels.push_back({ChannelTarget::kMorphWeight, 1, {-0.5f, 0, 0}, {0.125f, 1, 1}});
  Result<PoseTrack> made = PoseTrack::create(skeleton, track, {});
  REQUIRE(made);
  REQUIRE(made->add_packet(packet({{0}, {8}}, PoseKind::kJoints, 1), 0, 2));
  Pose pose;
  REQUIRE(made->sample(0.5, pose));
  CHECK(pose.morph_weights == std::vector<float>{0, 0, 0});
  REQUIRE(made->sample(1, pose));
  CHECK(pose.morph_weights == std::vector<float>{0, 0.5f, 0});
}

TEST_CASE("a track without channels stands still once its packets arrive") {
  SkeletonRecord skeleton;
  skeleton.nodes.resize(1);
  skeleton.palette.resize(1);
  Result<PoseTrack> made = PoseTrack::create(skeleton, {}, {});
  REQUIRE(made);
  Pose pose;
  CHECK_FALSE(made->sample(0, pose).has_value());
  REQUIRE(made->add_packet(test::zstd(std::vector<std::uint8_t>{0}), 0, 9));
  REQUIRE(made->sample(3, pose));
  CHECK(pose.palette[0] == glm::mat4x3(1.0f));
}

TEST_CASE("vertex tracks give every vertex of every mesh in every mode") {
  std::vector<Mesh> meshes{test::decoded_quad(), test::decoded_quad()};
  meshes[1].id = 8;
  PoseTrackRecord track;
  track.kind = PoseKind::kVertices;
  track.vertex_ranges.push_back({7, {1, 2, 3}, {0.5f, 0.5f, 0.5f}});
  track.vertex_ranges.push_back({8, {0, 0, 0}, {0.25f, 1, 2}});
  std::mt19937 random(3);
  Frames frames(4, std::vector<std::uint16_t>(24));
  for (auto& frame : frames) {
    for (std::uint16_t& v : frame) v = static_cast<std::uint16_t>(random());
  }
  for (const unsigned mode : {0u, 1u, 2u, 4u, 5u, 6u}) {
    Result<PoseTrack> made = PoseTrack::create({}, track, meshes);
    REQUIRE(made);
    REQUIRE(made->add_packet(packet(frames, PoseKind::kVertices, mode), 10, 4));
    Pose pose;
    for (std::size_t k = 0; k < 4; ++k) {
      REQUIRE(made->sample(10.0 + static_cast<double>(k), pose));
      REQUIRE(pose.vertices.size() == 2);
      const auto& f = frames[k];
      CHECK(pose.vertices[0][3] == glm::vec3(1, 2, 3) + 0.5f * glm::vec3(f[9], f[10], f[11]));
      CHECK(pose.vertices[1][0] == glm::vec3(0.25f, 1, 2) * glm::vec3(f[12], f[13], f[14]));
    }
    REQUIRE(made->sample(10.5, pose));
    const float half = 0.25f * (frames[0][12] + 0.5f * (frames[1][12] - frames[0][12]));
    CHECK(pose.vertices[1][0].x == half);
  }
}

TEST_CASE("sampling reuses the memory of the pose") {
  PoseTrack track = Slider().create();
  REQUIRE(track.add_packet(packet(ramp(8, 3), PoseKind::kJoints, 1), 0, 3));
  Pose pose;
  REQUIRE(track.sample(0, pose));
  const void* palette = pose.palette.data();
  const void* world = pose.world.data();
  for (int i = 0; i < 10; ++i) REQUIRE(track.sample(0.2 * i, pose));
  CHECK(pose.palette.data() == palette);
  CHECK(pose.world.data() == world);
}

TEST_CASE("a pose can pass from one kind of track to the other") {
  PoseTrack joints = Slider().create();
  REQUIRE(joints.add_packet(packet(ramp(8, 3), PoseKind::kJoints, 1), 0, 3));
  const std::vector<Mesh> meshes{test::decoded_quad()};
  PoseTrackRecord record;
  record.kind = PoseKind::kVertices;
  record.vertex_ranges.push_back({7, {}, {1, 1, 1}});
  Result<PoseTrack> vertices = PoseTrack::create({}, record, meshes);
  REQUIRE(vertices);
  REQUIRE(vertices->add_packet(packet({std::vector<std::uint16_t>(12, 5)}, PoseKind::kVertices, 0),
                               0, 1));
  Pose pose;
  std::vector<glm::vec3> posed(4);
  REQUIRE(vertices->sample(0, pose));
  decoders::pose_mesh(meshes[0], 0, pose, posed, {});
  CHECK(posed[1] == glm::vec3(5));
  REQUIRE(joints.sample(0, pose));
  decoders::pose_mesh(meshes[0], 0, pose, posed, {});
  CHECK(posed[1] == meshes[0].positions[1] + glm::vec3(2, 0, 0));
}

TEST_CASE("pose track refuses records that contradict the skeleton or the meshes") {
  const auto refused = [](const SkeletonRecord& s, const PoseTrackRecord& t,
                          std::span<const Mesh> meshes = {}) {
    return !PoseTrack::create(s, t, meshes).has_value();
  };
  const Slider good;
  CHECK_FALSE(refused(good.skeleton, good.track));
  {
    Slider s;
    s.skeleton.nodes[0].parent = 0;
    CHECK(refused(s.skeleton, s.track));
    s.skeleton.nodes[0].parent = -2;
    CHECK(refused(s.skeleton, s.track));
  }
  {
    Slider s;
    s.skeleton.palette[0].node = 1;
    CHECK(refused(s.skeleton, s.track));
    s = Slider();
    s.skeleton.palette[0].inverse_bind[3] = std::nanf("");
    CHECK(refused(s.skeleton, s.track));
    s = Slider();
    s.skeleton.nodes[0].local[0] = 1e10f;
    CHECK(refused(s.skeleton, s.track));
  }
  {
    Slider s;
    s.track.channels.push_back(s.track.channels[0]);
    CHECK(refused(s.skeleton, s.track));
    s = Slider();
    s.track.channels[0].index = 1;
    CHECK(refused(s.skeleton, s.track));
    s = Slider();
    s.track.channels[0].target = static_cast<ChannelTarget>(4);
    CHECK(refused(s.skeleton, s.track));
    s = Slider();
    s.track.channels[0] = {ChannelTarget::kMorphWeight, 0, {}, {1, 1, 1}};
    CHECK(refused(s.skeleton, s.track));
  }
  for (const float bad : {std::nanf(""), std::numeric_limits<float>::infinity(), 1e10f}) {
    Slider s;
    s.track.channels[0].offset[2] = bad;
    CHECK(refused(s.skeleton, s.track));
    s = Slider();
    s.track.channels[0].step[1] = bad;
    CHECK(refused(s.skeleton, s.track));
    s = Slider();
    s.track.rest.push_back({0, {0, bad, 0}, {0, 0, 0, 1}, {1, 1, 1}});
    CHECK(refused(s.skeleton, s.track));
  }
  {
    Slider s;
    s.track.rest.push_back({0, {}, {0, 0, 0, 0.5f}, {1, 1, 1}});
    CHECK(refused(s.skeleton, s.track));
    s.track.rest[0].rotation = {0, 0, 0, 1};
    CHECK_FALSE(refused(s.skeleton, s.track));
    s.track.rest[0].node = 1;
    CHECK(refused(s.skeleton, s.track));
  }
  const std::vector<Mesh> meshes{test::decoded_quad()};
  PoseTrackRecord vertices;
  vertices.kind = PoseKind::kVertices;
  CHECK(refused({}, vertices, meshes));
  vertices.vertex_ranges.push_back({6, {}, {1, 1, 1}});
  CHECK(refused({}, vertices, meshes));
  vertices.vertex_ranges[0].mesh_id = 7;
  CHECK_FALSE(refused({}, vertices, meshes));
  vertices.vertex_ranges[0].step[0] = 1e6f;
  CHECK(refused({}, vertices, meshes));
  vertices.kind = static_cast<PoseKind>(2);
  CHECK(refused({}, vertices, meshes));
}

TEST_CASE("a chain of scales that leaves all bounds is an error, not an infinity") {
  SkeletonRecord skeleton;
  skeleton.nodes.resize(6);
  for (std::size_t n = 0; n < 6; ++n) {
    skeleton.nodes[n].parent = static_cast<std::int32_t>(n) - 1;
    skeleton.nodes[n].local = {1e9f, 0, 0, 0, 0, 1e9f, 0, 0, 0, 0, 1e9f, 0};
  }
  skeleton.palette.push_back({5, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}});
  Result<PoseTrack> made = PoseTrack::create(skeleton, {}, {});
  REQUIRE(made);
  REQUIRE(made->add_packet(test::zstd(std::vector<std::uint8_t>{0}), 0, 1));
  Pose pose;
  const Status status = made->sample(0, pose);
  REQUIRE_FALSE(status);
  CHECK(status.error().code == ErrorCode::kCorrupt);
}

TEST_CASE("pose track checks frame counts before it allocates") {
  PoseTrack track = Slider().create();
  const auto p = packet(ramp(0, 2), PoseKind::kJoints, 1);
  CHECK_FALSE(track.add_packet(p, 0, 0).has_value());
  CHECK_FALSE(track.add_packet(p, 0, limits::kFramesPerSegment + 1).has_value());
  CHECK_FALSE(track.add_packet(p, std::numeric_limits<std::uint64_t>::max(), 2).has_value());
  CHECK_FALSE(track.add_packet(p, 0, 3).has_value());
  CHECK_FALSE(track.add_packet(p, 0, 1).has_value());
  CHECK(track.memory_bytes() == 0);

  SkeletonRecord skeleton;
  skeleton.morph_weight_count = 9000;
  PoseTrackRecord many;
  for (std::uint32_t w = 0; w < 9000; ++w) {
    many.channels.push_back({ChannelTarget::kMorphWeight, w, {}, {0, 0, 0}});
  }
  Result<PoseTrack> large = PoseTrack::create(skeleton, many, {});
  REQUIRE(large);
  // 9000 values × 65536 frames × 2 bytes exceed 1 GiB.
  const Status status = large->add_packet(p, 0, limits::kFramesPerSegment);
  REQUIRE_FALSE(status);
  CHECK(status.error().code == ErrorCode::kLimit);
}

TEST_CASE("pose packets: truncations fail, flipped bits never do harm") {
  const auto whole = packet(ramp(8, 40), PoseKind::kJoints, 1);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    PoseTrack track = Slider().create();
    CHECK_FALSE(track.add_packet(std::span(whole).first(size), 0, 40).has_value());
    CHECK(track.memory_bytes() == 0);
  }
  auto longer = whole;
  longer.push_back(0);
  CHECK_FALSE(Slider().create().add_packet(longer, 0, 40).has_value());
  std::mt19937 random(4);
  int accepted = 0;
  for (int round = 0; round < 5000; ++round) {
    auto bytes = whole;
    const std::size_t bit = random() % (8 * bytes.size());
    bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ (1u << bit % 8));
    PoseTrack track = Slider().create();
    if (!track.add_packet(bytes, 0, 40)) continue;
    ++accepted;
    const float x = slide(track, 17.3);
    CHECK((x >= 0 && x <= 65535 / 4.0f));
  }
  CHECK(accepted > 0);
}
