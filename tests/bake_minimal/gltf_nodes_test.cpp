// SPDX-License-Identifier: MIT
#include "bake_minimal/gltf_nodes.hpp"

#include <limits>

#include "tests/bake_minimal/gltf_loading.hpp"

using namespace relit::test;
using relit::ErrorCode;
using relit::bake::Scene;
using relit::bake::ScenePose;

namespace {

std::vector<glm::vec3> rest_positions(const Scene& scene, std::size_t primitive) {
  ScenePose pose;
  std::vector<glm::mat4> world;
  scene.sample(-1, 0, pose);
  scene.world_matrices(pose, world);
  const auto& p = scene.primitives[primitive];
  std::vector<glm::vec3> positions(p.positions.size());
  scene.pose_primitive(p, pose, world, positions, {});
  return positions;
}

/// A skinned triangle; node 0 carries it, nodes 1 and 2 are the joints.
GltfBuilder skinned(const PrimitiveSpec& spec) {
  GltfBuilder builder = file_with(spec);
  const int a = builder.add_node({{"name", "hip"}});
  const int b = builder.add_node({{"translation", {0, 2, 0}}});
  builder.add_skin({a, b});
  builder.json["nodes"][0]["skin"] = 0;
  return builder;
}

PrimitiveSpec weighted() {
  PrimitiveSpec spec = triangle();
  spec.joints = {0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0};
  spec.weights = {1, 0, 0, 0, 0.5f, 0.5f, 0, 0, 0, 2, 0, 0};
  return spec;
}

}  // namespace

TEST_CASE("parents come first whatever their order in the file", "[gltf]") {
  GltfBuilder builder;
  const int mesh = builder.add_mesh({triangle()});
  const int leaf = builder.add_node({{"mesh", mesh}, {"translation", {1, 0, 0}}});
  const int middle = builder.add_node({{"scale", {2, 2, 2}}});
  const int root = builder.add_node({{"translation", {0, 10, 0}}});
  builder.add_child(root, middle);
  builder.add_child(middle, leaf);
  const Scene scene = loaded(builder);
  for (std::size_t n = 0; n < scene.nodes.size(); ++n) {
    CHECK(scene.nodes[n].parent < static_cast<int>(n));
  }
  CHECK(rest_positions(scene, 0)[1] == glm::vec3(4, 10, 0));
}

TEST_CASE("a mesh is there once for every node that shows it", "[gltf]") {
  GltfBuilder builder;
  const int mesh = builder.add_mesh({triangle()}, "twin");
  builder.add_mesh_node(mesh);
  builder.add_node({{"mesh", mesh}, {"translation", {5, 0, 0}}});
  const Scene scene = loaded(builder);
  REQUIRE(scene.primitives.size() == 2);
  CHECK(rest_positions(scene, 0)[0] == glm::vec3(0, 0, 0));
  CHECK(rest_positions(scene, 1)[0] == glm::vec3(5, 0, 0));
}

TEST_CASE("only the default scene is shown", "[gltf]") {
  GltfBuilder builder;
  const int a = builder.add_mesh_node(builder.add_mesh({triangle()}, "a"));
  const int b = builder.add_node(Json::object());
  const int c = builder.add_mesh_node(builder.add_mesh({triangle()}, "c"));
  builder.add_child(b, c);
  builder.json["scenes"] = {{{"nodes", {a}}}, {{"nodes", {b}}}};
  Scene scene = loaded(builder);
  REQUIRE(scene.primitives.size() == 1);
  CHECK(scene.primitives[0].name == "a");
  CHECK(has_warning(scene, "1 nodes with meshes are outside"));
  builder.json["scene"] = 1;
  scene = loaded(builder);
  REQUIRE(scene.primitives.size() == 1);
  CHECK(scene.primitives[0].name == "c");
  builder.json["scene"] = 2;
  check_error(load(builder), ErrorCode::kCorrupt, {"scene 2 does not exist"});
  builder.json["scene"] = 0;
  builder.json["scenes"][0]["nodes"] = {77};
  check_error(load(builder), ErrorCode::kCorrupt, {"scene 0", "node 77 does not exist"});
}

TEST_CASE("without scenes every node is shown", "[gltf]") {
  GltfBuilder builder = file_with(triangle());
  Json document = Json::parse(builder.gltf());
  document.erase("scenes");
  document.erase("scene");
  const std::string text = document.dump();
  const auto scene = relit::bake::gltf::load_bytes(
      {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, "test.gltf");
  REQUIRE(scene.has_value());
  CHECK(scene->primitives.size() == 1);
}

TEST_CASE("cycles and second parents are named", "[gltf]") {
  GltfBuilder builder = file_with(triangle());
  const int a = builder.add_node({{"name", "a"}});
  const int b = builder.add_node({{"name", "b"}});
  builder.add_child(a, b);
  builder.add_child(b, a);
  check_error(load(builder), ErrorCode::kCorrupt, {"node 1 \"a\"", "cycle"});
  builder.json["scenes"] = {{{"nodes", {a}}}};
  check_error(load(builder), ErrorCode::kCorrupt, {"cycle"});
  builder = file_with(triangle());
  builder.add_child(0, 0);
  check_error(load(builder), ErrorCode::kCorrupt, {"node 0", "cycle"});
  builder = file_with(triangle());
  const int child = builder.add_node({{"name", "shared"}});
  builder.add_child(0, child);
  builder.add_child(builder.add_node(Json::object()), child);
  check_error(load(builder), ErrorCode::kCorrupt, {"node 1 \"shared\"", "two parents"});
  builder = file_with(triangle());
  builder.add_child(0, 12);
  check_error(load(builder), ErrorCode::kCorrupt, {"node 0", "child 12 does not exist"});
}

TEST_CASE("transforms that make no sense are named", "[gltf]") {
  const auto with = [](const char* property, const Json& value) {
    GltfBuilder builder = file_with(triangle());
    builder.json["nodes"][0][property] = value;
    return load(builder);
  };
  const auto corrupt = ErrorCode::kCorrupt;
  check_error(with("matrix", {1, 2, 3}), corrupt, {"node 0", "matrix has 3 numbers"});
  check_error(with("translation", {1, 2}), corrupt, {"node 0", "translation"});
  check_error(with("translation", {1e300, 0, 0}), corrupt, {"node 0", "translation", "range"});
  check_error(with("rotation", {0, 0, 0, 0}), corrupt, {"node 0", "rotation"});
  check_error(with("matrix", {1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}), corrupt,
              {"node 0", "affine"});
}

TEST_CASE("a node's matrix is column-major, as glTF has it", "[gltf]") {
  GltfBuilder builder = file_with(triangle());
  builder.json["nodes"][0]["matrix"] = {0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1};
  const Scene scene = loaded(builder);
  CHECK(rest_positions(scene, 0)[1] == glm::vec3(7, 9, 9));
  CHECK(rest_positions(scene, 0)[2] == glm::vec3(6, 8, 9));
}

TEST_CASE("skins bind by joints and inverse bind matrices", "[gltf]") {
  GltfBuilder builder = skinned(weighted());
  // The node's own transform is ignored where there is a skin.
  builder.json["nodes"][0]["translation"] = {100, 100, 100};
  const Scene scene = loaded(builder);
  const auto& p = scene.primitives[0];
  CHECK(p.influences_per_vertex == 4);
  CHECK(p.weights[8] == 1);  // 2, normalised; weights of zero are moved to the end
  CHECK(p.joints[8] == 1);
  REQUIRE(scene.skins.size() == 1);
  CHECK(scene.skins[0].inverse_bind[1] == glm::mat4(1.0f));
  const auto posed = rest_positions(scene, 0);
  CHECK(posed[0] == glm::vec3(0, 0, 0));
  CHECK(posed[1] == glm::vec3(1, 1, 0));
  CHECK(posed[2] == glm::vec3(0, 3, 0));

  std::vector<float> matrices(32);
  for (std::size_t i = 0; i < 4; ++i) matrices[i * 5] = matrices[16 + i * 5] = 1;
  matrices[16 + 13] = -2;
  GltfBuilder bound = skinned(weighted());
  bound.json["skins"][0]["inverseBindMatrices"] = bound.add_accessor(matrices, "MAT4");
  const auto unmoved = rest_positions(loaded(bound), 0);
  CHECK(unmoved[1] == glm::vec3(1, 0, 0));
  CHECK(unmoved[2] == glm::vec3(0, 1, 0));
}

TEST_CASE("joints and weights may be bytes, shorts and floats", "[gltf]") {
  GltfBuilder builder = skinned(weighted());
  Json& attributes = builder.json["meshes"][0]["primitives"][0]["attributes"];
  attributes["JOINTS_0"] =
      builder.add_accessor(std::vector<std::uint8_t>{0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0}, "VEC4");
  attributes["WEIGHTS_0"] = builder.add_accessor(
      std::vector<std::uint8_t>{255, 0, 0, 0, 51, 204, 0, 0, 0, 255, 0, 0}, "VEC4", true);
  Scene scene = loaded(builder);
  CHECK(scene.primitives[0].weights[4] == Approx(0.2).epsilon(1e-6));
  attributes["WEIGHTS_0"] = builder.add_accessor(
      std::vector<std::uint16_t>{65535, 0, 0, 0, 13107, 52428, 0, 0, 0, 65535, 0, 0}, "VEC4", true);
  scene = loaded(builder);
  CHECK(scene.primitives[0].weights[5] == Approx(0.8).epsilon(1e-6));
}

TEST_CASE("more than four joints move a vertex", "[gltf]") {
  PrimitiveSpec spec = weighted();
  GltfBuilder builder = skinned(spec);
  std::vector<int> joints{1, 2};
  for (int j = 0; j < 8; ++j) joints.push_back(builder.add_node({{"translation", {0, 0, j + 1}}}));
  builder.json["skins"][0]["joints"] = joints;
  Json& attributes = builder.json["meshes"][0]["primitives"][0]["attributes"];
  const auto add_set = [&](const char* number, std::vector<std::uint16_t> j, std::vector<float> w) {
    attributes[std::string("JOINTS_") + number] = builder.add_accessor(j, "VEC4");
    attributes[std::string("WEIGHTS_") + number] = builder.add_accessor(w, "VEC4");
  };
  // Joint 2 + k is moved by k + 1 along z, so the mean of z is Σ w (k + 1).
  add_set("0", {2, 3, 4, 5, 2, 3, 4, 5, 2, 0, 0, 0},
          {.1f, .1f, .1f, .1f, .1f, .1f, .1f, .1f, 1, 0, 0, 0});
  add_set("1", {6, 7, 8, 9, 6, 7, 8, 9, 0, 0, 0, 0},
          {.1f, .1f, .1f, .3f, .6f, 0, 0, 0, 0, 0, 0, 0});
  Scene scene = loaded(builder);
  CHECK(scene.primitives[0].influences_per_vertex == 8);
  CHECK(rest_positions(scene, 0)[0].z == Approx(0.1 * 28 + 0.3 * 8).epsilon(1e-6));
  CHECK(rest_positions(scene, 0)[1].z == Approx(0.1 * 10 + 0.6 * 5).epsilon(1e-6));
  CHECK(rest_positions(scene, 0)[2].z == Approx(1).epsilon(1e-6));

  // A third set: nine joints for vertex 0, of which the lightest goes.
  add_set("2", {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, {.05f, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  scene = loaded(builder);
  CHECK(has_warning(scene, "only the 8 of largest weight"));
  CHECK(rest_positions(scene, 0)[0].z == Approx(0.1 * 28 + 0.3 * 8).epsilon(1e-6));

  // A second set that no vertex uses costs nothing.
  add_set("1", std::vector<std::uint16_t>(12), std::vector<float>(12));
  attributes.erase("JOINTS_2");
  attributes.erase("WEIGHTS_2");
  CHECK(loaded(builder).primitives[0].influences_per_vertex == 4);
}

TEST_CASE("weights that make no sense are named with their vertex", "[gltf]") {
  const auto with = [](std::size_t index, float weight) {
    PrimitiveSpec spec = weighted();
    spec.weights[index] = weight;
    return load(skinned(spec));
  };
  const auto corrupt = ErrorCode::kCorrupt;
  check_error(with(0, 0), corrupt, {"mesh 0 \"thing\"", "primitive 0", "vertex 0", "all zero"});
  check_error(with(9, 0), corrupt, {"vertex 2", "all zero"});
  check_error(with(4, -0.5f), corrupt, {"vertex 1", "negative"});
  check_error(with(4, std::numeric_limits<float>::quiet_NaN()), corrupt, {"vertex 1", "finite"});
  check_error(with(4, std::numeric_limits<float>::infinity()), corrupt, {"vertex 1", "finite"});
}

TEST_CASE("joints beyond the skin are named, unless their weight is zero", "[gltf]") {
  PrimitiveSpec spec = weighted();
  spec.joints[5] = 2;
  check_error(load(skinned(spec)), ErrorCode::kCorrupt,
              {"primitive 0", "vertex 1", "joint 2 does not exist", "2 joints"});
  spec = weighted();
  spec.joints[7] = 65535;
  CHECK(load(skinned(spec)).has_value());
}

TEST_CASE("skins that do not fit are named", "[gltf]") {
  GltfBuilder builder = skinned(weighted());
  builder.json["nodes"][0]["skin"] = 1;
  check_error(load(builder), ErrorCode::kCorrupt, {"node 0", "skin 1 does not exist"});
  builder = skinned(weighted());
  builder.json["skins"][0]["joints"] = {1, 44};
  check_error(load(builder), ErrorCode::kCorrupt, {"skin 0", "joint node 44 does not exist"});
  builder.json["skins"][0]["joints"] = Json::array();
  check_error(load(builder), ErrorCode::kCorrupt, {"skin 0", "0 joints"});
  builder = skinned(weighted());
  builder.json["skins"][0]["inverseBindMatrices"] =
      builder.add_accessor(std::vector<float>(16, 1), "MAT4");
  check_error(load(builder), ErrorCode::kCorrupt, {"skin 0", "1 matrices for 2 joints"});
  std::vector<float> bad(32, 1);
  bad[20] = std::numeric_limits<float>::infinity();
  builder.json["skins"][0]["inverseBindMatrices"] = builder.add_accessor(bad, "MAT4");
  check_error(load(builder), ErrorCode::kCorrupt, {"skin 0", "matrix 1", "not finite"});
  PrimitiveSpec no_weights = weighted();
  no_weights.weights.clear();
  check_error(load(skinned(no_weights)), ErrorCode::kCorrupt, {"JOINTS_0 comes without WEIGHTS_0"});
}

TEST_CASE("a mesh without joints moves with its node though that has a skin", "[gltf]") {
  GltfBuilder builder = skinned(triangle());
  builder.json["nodes"][0]["translation"] = {3, 0, 0};
  const Scene scene = loaded(builder);
  CHECK(scene.primitives[0].skin == -1);
  CHECK(has_warning(scene, "no JOINTS_0"));
  CHECK(rest_positions(scene, 0)[0] == glm::vec3(3, 0, 0));
}

TEST_CASE("joints without a skin are ignored", "[gltf]") {
  PrimitiveSpec spec = weighted();
  spec.weights.assign(12, 0);
  const Scene scene = loaded(file_with(spec));
  CHECK(scene.primitives[0].influences_per_vertex == 0);
  CHECK(scene.primitives[0].joints.empty());
}

TEST_CASE("mirrored nodes keep their outside outside", "[gltf]") {
  for (const bool skin : {false, true}) {
    INFO(skin);
    GltfBuilder builder = skin ? skinned(weighted()) : file_with(triangle());
    for (Json& node : builder.json["nodes"]) node["scale"] = {-1, 1, 1};
    const Scene scene = loaded(builder);
    const auto& p = scene.primitives[0];
    ScenePose pose;
    std::vector<glm::mat4> world;
    scene.sample(-1, 0, pose);
    scene.world_matrices(pose, world);
    std::vector<glm::vec3> positions(3), normals(3);
    scene.pose_primitive(p, pose, world, positions, normals);
    const glm::vec3 face = glm::cross(positions[p.indices[1]] - positions[p.indices[0]],
                                      positions[p.indices[2]] - positions[p.indices[0]]);
    CHECK(face.z > 0);
    CHECK(normals[0] == glm::vec3(0, 0, 1));
    CHECK(normals[2] == glm::vec3(0, 0, 1));
  }
}

TEST_CASE("instances are limited in all", "[gltf]") {
  GltfBuilder builder;
  const int mesh = builder.add_mesh({triangle()});
  for (int n = 0; n < 4097; ++n) builder.add_mesh_node(mesh);
  check_error(load(builder), ErrorCode::kLimit, {"4096 primitives"});
}
