// SPDX-License-Identifier: MIT
#include "bake_minimal/scene.hpp"

#include <cmath>
#include <numbers>

#include "tests/test.hpp"

using namespace relit::bake;

namespace {

// Results are floats computed from doubles: one rounding of a number near 1.
constexpr float kFloat = 2.4e-7f;

Channel channel(Path path, Interpolation interpolation, std::vector<float> times,
                std::vector<float> values) {
  Channel c;
  c.path = path;
  c.node = 0;
  c.interpolation = interpolation;
  c.times = std::move(times);
  c.values = std::move(values);
  return c;
}

/// One node, one clip with that channel.
Scene scene_with(const Channel& c) {
  Scene scene;
  scene.path = "made.glb";
  scene.nodes.resize(1);
  scene.clips.push_back({"clip", static_cast<double>(c.times.back()), {c}});
  return scene;
}

Trs sampled(const Channel& c, double time) {
  ScenePose pose;
  scene_with(c).sample(0, time, pose);
  return pose.local[0];
}

glm::quat about_z(double degrees) {
  const double half = degrees * std::numbers::pi / 360;
  return {static_cast<float>(std::cos(half)), 0, 0, static_cast<float>(std::sin(half))};
}

/// How far apart two rotations are, whatever their signs: the sine of half the angle between them.
double apart(const glm::quat& a, const glm::quat& b) {
  const glm::dquat d = glm::dquat(a) * glm::conjugate(glm::dquat(b));
  return std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
}

void append(std::vector<float>& values, const glm::quat& q) {
  values.insert(values.end(), {q.x, q.y, q.z, q.w});
}

Primitive lone_triangle() {
  Primitive p;
  p.name = "triangle";
  p.node = 0;
  p.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  p.normals.assign(3, {0, 0, 1});
  p.indices = {0, 1, 2};
  return p;
}

struct Posed {
  std::vector<glm::vec3> positions{3};
  std::vector<glm::vec3> normals{3};
};

Posed posed(const Scene& scene, const ScenePose& pose) {
  std::vector<glm::mat4> world;
  scene.world_matrices(pose, world);
  Posed out;
  scene.pose_primitive(scene.primitives[0], pose, world, out.positions, out.normals);
  return out;
}

ScenePose rest(const Scene& scene) {
  ScenePose pose;
  scene.sample(-1, 0, pose);
  return pose;
}

}  // namespace

TEST_CASE("keys are held before the first and after the last", "[scene]") {
  for (const auto interpolation : {Interpolation::kStep, Interpolation::kLinear}) {
    const Channel c = channel(Path::kTranslation, interpolation, {1, 2}, {1, 2, 3, 4, 5, 6});
    for (const double t : {-5.0, 0.0, 1.0}) CHECK(sampled(c, t).translation == glm::vec3(1, 2, 3));
    for (const double t : {2.0, 9.0}) CHECK(sampled(c, t).translation == glm::vec3(4, 5, 6));
  }
  const Channel one = channel(Path::kScale, Interpolation::kLinear, {0.5f}, {2, 3, 4});
  for (const double t : {0.0, 0.5, 1.0}) CHECK(sampled(one, t).scale == glm::vec3(2, 3, 4));
}

TEST_CASE("steps hold and lines interpolate", "[scene]") {
  Channel c =
      channel(Path::kTranslation, Interpolation::kStep, {0, 1, 3}, {0, 0, 0, 1, 0, 0, 3, 0, 4});
  CHECK(sampled(c, 0.999).translation == glm::vec3(0));
  CHECK(sampled(c, 1).translation == glm::vec3(1, 0, 0));
  CHECK(sampled(c, 2.9).translation == glm::vec3(1, 0, 0));
  c.interpolation = Interpolation::kLinear;
  CHECK(sampled(c, 0.25).translation == glm::vec3(0.25f, 0, 0));
  CHECK(sampled(c, 2).translation == glm::vec3(2, 0, 2));
}

TEST_CASE("cubic splines follow Hermite's polynomial with tangents per second", "[scene]") {
  // x(t) = t³ on keys 1 and 3 is reproduced exactly by its own tangents 3 t²; y is constant 5 and z
  // has tangents that only count on the other side of a key.
  const std::vector<float> values{3,  0, 9, 1,  5, 0, 3,  0, 0,  //
                                  27, 0, 0, 27, 5, 0, 27, 0, 7};
  const Channel c = channel(Path::kTranslation, Interpolation::kCubicSpline, {1, 3}, values);
  for (const double t : {1.0, 1.3, 2.0, 2.77, 3.0}) {
    const glm::vec3 p = sampled(c, t).translation;
    CHECK(p.x == Approx(t * t * t).epsilon(kFloat));
    CHECK(p.y == Approx(5).epsilon(kFloat));
    CHECK(p.z == Approx(0).margin(1e-12));
  }
  CHECK(sampled(c, 0).translation == glm::vec3(1, 5, 0));
  CHECK(sampled(c, 4).translation == glm::vec3(27, 5, 0));
}

TEST_CASE("rotations turn evenly on the shorter arc", "[scene]") {
  for (const double sign : {1.0, -1.0}) {
    std::vector<float> values;
    append(values, about_z(0));
    append(values, about_z(120) * static_cast<float>(sign));
    const Channel c = channel(Path::kRotation, Interpolation::kLinear, {0, 1}, values);
    for (const double t : {0.0, 0.1, 0.25, 0.5, 0.9, 1.0}) {
      CHECK(apart(sampled(c, t).rotation, about_z(120 * t)) < kFloat);
      CHECK(glm::length(glm::dquat(sampled(c, t).rotation)) == Approx(1).epsilon(kFloat));
    }
  }
  // Nearly equal keys, where the sine of the angle vanishes.
  std::vector<float> close;
  append(close, about_z(10));
  append(close, about_z(10.001));
  CHECK(
      apart(sampled(channel(Path::kRotation, Interpolation::kLinear, {0, 1}, close), 0.5).rotation,
            about_z(10.0005)) < kFloat);
  // 10-degree steps against the exact angle tell slerp from a normalised lerp, which is off by up
  // to 0.8 degrees over 120.
  std::vector<float> wide;
  append(wide, about_z(-60));
  append(wide, about_z(60));
  CHECK(
      apart(sampled(channel(Path::kRotation, Interpolation::kLinear, {0, 1}, wide), 0.25).rotation,
            about_z(-30)) < kFloat);
}

TEST_CASE("rotations come out of unit length", "[scene]") {
  std::vector<float> values(4);
  append(values, about_z(0));
  values.resize(16);
  append(values, about_z(90));
  values.resize(24);
  const Channel spline = channel(Path::kRotation, Interpolation::kCubicSpline, {0, 1}, values);
  // With tangents of zero the polynomial is 1/2 at the middle: half way between the keys' chords.
  CHECK(glm::length(glm::dquat(sampled(spline, 0.5).rotation)) == Approx(1).epsilon(kFloat));
  CHECK(apart(sampled(spline, 0.5).rotation, about_z(45)) < kFloat);
  const Channel longer = channel(Path::kRotation, Interpolation::kStep, {0}, {0, 0, 3, 4});
  CHECK(sampled(longer, 0).rotation.z == 0.6f);
  CHECK(sampled(longer, 0).rotation.w == 0.8f);
}

TEST_CASE("the rest pose has nothing of the clips", "[scene]") {
  Scene scene = scene_with(channel(Path::kTranslation, Interpolation::kStep, {0}, {7, 7, 7}));
  scene.nodes[0].local.translation = {1, 2, 3};
  ScenePose pose;
  scene.sample(0, 0, pose);
  CHECK(pose.local[0].translation == glm::vec3(7));
  scene.sample(-1, 0, pose);
  CHECK(pose.local[0].translation == glm::vec3(1, 2, 3));
}

TEST_CASE("world matrices are translation, rotation, scale down the tree", "[scene]") {
  Scene scene;
  scene.nodes.resize(3);
  scene.nodes[0].local = {{10, 0, 0}, about_z(90), {2, 3, 4}};
  scene.nodes[1].parent = 0;
  scene.nodes[1].local = {{0, 1, 0}, about_z(0), {1, 1, 1}};
  scene.nodes[2].parent = 1;
  scene.nodes[2].matrix = glm::mat4(1);
  (*scene.nodes[2].matrix)[3] = glm::vec4(0, 0, 5, 1);
  std::vector<glm::mat4> world;
  scene.world_matrices(rest(scene), world);
  const auto at = [&](std::size_t n, glm::vec3 p) { return glm::vec3(world[n] * glm::vec4(p, 1)); };
  // (1,1,1) scaled to (2,3,4), turned to (-3,2,4), moved to (7,2,4).
  CHECK(glm::length(at(0, {1, 1, 1}) - glm::vec3(7, 2, 4)) < 1e-6f);
  CHECK(glm::length(at(1, {1, 0, 1}) - glm::vec3(7, 2, 4)) < 1e-6f);
  CHECK(glm::length(at(2, {1, 0, -4}) - glm::vec3(7, 2, 4)) < 1e-6f);
}

TEST_CASE("normals stay at right angles under uneven and negative scales", "[scene]") {
  for (const glm::vec3 scale : {glm::vec3(1, 1, 4), glm::vec3(-1, 2, 3), glm::vec3(-1, -2, -3)}) {
    Scene scene;
    scene.nodes.resize(1);
    scene.nodes[0].local = {{1, 2, 3}, about_z(33), scale};
    Primitive p = lone_triangle();
    p.positions = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    p.normals.assign(3, glm::normalize(glm::vec3(1, 1, 1)));
    scene.primitives.push_back(p);
    const Posed out = posed(scene, rest(scene));
    const glm::vec3 n = out.normals[0];
    CHECK(glm::length(n) == Approx(1).epsilon(kFloat));
    CHECK(glm::dot(n, out.positions[1] - out.positions[0]) == Approx(0).margin(1e-5));
    CHECK(glm::dot(n, out.positions[2] - out.positions[0]) == Approx(0).margin(1e-5));
    // Outside stays outside: away from the transformed origin.
    CHECK(glm::dot(n, out.positions[0] - glm::vec3(1, 2, 3)) > 0);
  }
}

TEST_CASE("a node scaled to nothing keeps finite normals", "[scene]") {
  Scene scene;
  scene.nodes.resize(1);
  scene.nodes[0].local.scale = glm::vec3(0);
  scene.primitives.push_back(lone_triangle());
  const Posed out = posed(scene, rest(scene));
  CHECK(out.positions[1] == glm::vec3(0));
  CHECK(out.normals[1] == glm::vec3(0, 0, 1));
}

TEST_CASE("skinning blends matrices and ignores the node", "[scene]") {
  Scene scene;
  scene.nodes.resize(3);
  scene.nodes[0].local.translation = {50, 50, 50};
  scene.nodes[1].local.translation = {0, 0, 1};
  scene.nodes[2].local.rotation = about_z(90);
  Skin skin;
  skin.joints = {1, 2};
  skin.inverse_bind = {glm::mat4(1), glm::mat4(1)};
  skin.inverse_bind[0][3] = glm::vec4(0, 0, -1, 1);
  scene.skins.push_back(skin);
  Primitive p = lone_triangle();
  p.skin = 0;
  p.influences_per_vertex = 4;
  p.joints = {0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0};
  p.weights = {1, 0, 0, 0, 0.25f, 0.75f, 0, 0, 1, 0, 0, 0};
  p.normals.assign(3, {1, 0, 0});
  scene.primitives.push_back(p);
  const Posed out = posed(scene, rest(scene));
  CHECK(out.positions[0] == glm::vec3(0, 0, 0));
  CHECK(glm::length(out.positions[1] - glm::vec3(0.25f, 0.75f, 0)) < kFloat);
  CHECK(glm::length(out.positions[2] - glm::vec3(-1, 0, 0)) < kFloat);
  CHECK(out.normals[0] == glm::vec3(1, 0, 0));
  // The blend of both matrices is (¼, -¾; ¾, ¼) in the plane, a turn with a scale, so its inverse
  // transpose turns the normal as it turns the point.
  CHECK(glm::length(out.normals[1] - glm::normalize(glm::vec3(0.25f, 0.75f, 0))) < kFloat);
  CHECK(glm::length(out.normals[2] - glm::vec3(0, 1, 0)) < kFloat);
}

TEST_CASE("morphing comes before skinning and moves normals", "[scene]") {
  Scene scene;
  scene.nodes.resize(1);
  scene.nodes[0].local.rotation = about_z(90);
  scene.morph_weight_count = 3;
  scene.default_morph_weights = {9, 0.5f, -1};
  Primitive p = lone_triangle();
  p.first_morph_weight = 1;
  p.morph_targets.resize(2);
  p.morph_targets[0].positions.assign(3, {2, 0, 0});
  p.morph_targets[0].normals.assign(3, {2, 0, -2});
  p.morph_targets[1].positions.assign(3, {0, 0, 3});
  scene.primitives.push_back(p);
  const Posed out = posed(scene, rest(scene));
  CHECK(glm::length(out.positions[0] - glm::vec3(0, 1, -3)) < 3 * kFloat);
  CHECK(glm::length(out.normals[0] - glm::vec3(0, 1, 0)) < kFloat);
}

TEST_CASE("either output of a posed primitive may be left out", "[scene]") {
  Scene scene;
  scene.nodes.resize(1);
  scene.primitives.push_back(lone_triangle());
  const ScenePose pose = rest(scene);
  std::vector<glm::mat4> world;
  scene.world_matrices(pose, world);
  std::vector<glm::vec3> only(3);
  scene.pose_primitive(scene.primitives[0], pose, world, only, {});
  CHECK(only[1] == glm::vec3(1, 0, 0));
  scene.pose_primitive(scene.primitives[0], pose, world, {}, only);
  CHECK(only[1] == glm::vec3(0, 0, 1));
}

TEST_CASE("a clip's bounds cover its frames and no others", "[scene]") {
  Scene scene =
      scene_with(channel(Path::kTranslation, Interpolation::kLinear, {0, 1}, {0, 0, 0, 10, 0, 0}));
  scene.primitives.push_back(lone_triangle());
  auto bounds = clip_bounds(scene, 0, 4);
  REQUIRE(bounds.has_value());
  CHECK(bounds->min == glm::vec3(0));
  // Frames at 0, 1/4, 1/2, 3/4: the end of the clip is the first frame of its repetition.
  CHECK(bounds->max == glm::vec3(8.5f, 1, 0));
  bounds = clip_bounds(scene, -1, 4);
  CHECK(bounds->max == glm::vec3(1, 1, 0));
  CHECK(clip_bounds(scene, 0, 0).error().code == relit::ErrorCode::kInvalid);
  scene.clips[0].channels[0].values[3] = 3e38f;
  scene.nodes[0].local.scale = glm::vec3(3e38f);
  scene.primitives[0].positions[1].x = 2;
  const auto overflow = clip_bounds(scene, 0, 4);
  REQUIRE(!overflow.has_value());
  CHECK(overflow.error().message.find("\"triangle\"") != std::string::npos);
}
