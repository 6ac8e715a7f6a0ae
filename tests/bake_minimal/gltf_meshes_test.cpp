// SPDX-License-Identifier: MIT
#include "bake_minimal/gltf_meshes.hpp"

#include <limits>

#include "bake_minimal/gltf_triangles.hpp"
#include "tests/bake_minimal/gltf_loading.hpp"

using namespace relit::test;
using relit::ErrorCode;
using relit::bake::Primitive;
using relit::bake::gltf::list_triangles;
using relit::bake::gltf::Topology;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

/// Every triangle as its corners' positions, so that vertex numbers do not matter.
std::vector<glm::vec3> corners(const Primitive& p) {
  std::vector<glm::vec3> out;
  for (const std::uint32_t i : p.indices) out.push_back(p.positions[i]);
  return out;
}

bool near(const glm::vec3& a, const glm::vec3& b) {
  return glm::length(a - b) < 4 * std::numeric_limits<float>::epsilon() * (1 + glm::length(b));
}

}  // namespace

TEST_CASE("strips and fans become lists with one winding", "[gltf]") {
  const std::vector<std::uint32_t> five{10, 11, 12, 13, 14};
  CHECK(list_triangles(Topology::kStrip, five) ==
        std::vector<std::uint32_t>{10, 11, 12, 11, 13, 12, 12, 13, 14});
  CHECK(list_triangles(Topology::kFan, five) ==
        std::vector<std::uint32_t>{11, 12, 10, 12, 13, 10, 13, 14, 10});
  CHECK(list_triangles(Topology::kTriangles, five) == std::vector<std::uint32_t>{10, 11, 12});
  CHECK(list_triangles(Topology::kStrip, std::span(five).first(2)).empty());
}

TEST_CASE("strips and fans of a file face the same way as its lists", "[gltf]") {
  for (const bool fan : {false, true}) {
    PrimitiveSpec spec = quad();
    spec.mode = fan ? 6 : 5;
    spec.indices =
        fan ? std::vector<std::uint32_t>{0, 1, 2, 3} : std::vector<std::uint32_t>{0, 1, 3, 2};
    const auto scene = loaded(file_with(spec));
    const Primitive& p = scene.primitives[0];
    REQUIRE(p.indices.size() == 6);
    for (std::size_t t = 0; t < 6; t += 3) {
      const auto c = corners(p);
      CHECK(relit::bake::gltf::area_normal(c[t], c[t + 1], c[t + 2]) == glm::dvec3(0, 0, 1));
    }
  }
}

TEST_CASE("points and lines are skipped with a warning", "[gltf]") {
  for (const int mode : {0, 1, 2, 3}) {
    PrimitiveSpec lines = triangle();
    lines.mode = mode;
    GltfBuilder builder;
    builder.add_mesh_node(builder.add_mesh({lines, triangle()}, "thing"));
    const auto scene = loaded(builder);
    CHECK(scene.primitives.size() == 1);
    CHECK(has_warning(scene, "points and lines"));
    check_error(load(file_with(lines)), ErrorCode::kNotFound,
                {"no mesh that is shown has a triangle"});
  }
  PrimitiveSpec odd = triangle();
  odd.mode = 9;
  check_error(load(file_with(odd)), ErrorCode::kCorrupt, {"mesh 0", "primitive 0", "mode 9"});
}

TEST_CASE("all meshes, primitives and materials of a file are there", "[gltf]") {
  GltfBuilder builder;
  const int red = builder.add_material({{"name", "red"}});
  const int green = builder.add_material({{"name", "green"}});
  PrimitiveSpec a = triangle(), b = quad(), c = quad();
  a.material = green;
  b.material = red;
  const int first = builder.add_mesh({a, b}, "first");
  const int second = builder.add_mesh({c});
  builder.add_mesh_node(first);
  builder.add_mesh_node(second);
  const auto scene = loaded(builder);
  REQUIRE(scene.primitives.size() == 3);
  CHECK(scene.primitives[0].name == "first/0");
  CHECK(scene.primitives[1].name == "first/1");
  CHECK(scene.primitives[2].name == "mesh 1");
  CHECK(scene.materials[static_cast<std::size_t>(scene.primitives[0].material)].name == "green");
  CHECK(scene.materials[static_cast<std::size_t>(scene.primitives[1].material)].name == "red");
  CHECK(scene.materials[static_cast<std::size_t>(scene.primitives[2].material)].name == "default");
  CHECK(has_warning(scene, "primitives without one"));
}

TEST_CASE("attributes of a vertex arrive together", "[gltf]") {
  PrimitiveSpec spec = quad();
  spec.texcoords.push_back({0, 0, 2, 0, 2, 2, 0, 2});
  spec.colors = {1, 0, 0, 1, 0, 1, 0, 0.5f, 0, 0, 1, 1, 1, 1, 1, 0};
  const auto scene = loaded(file_with(spec));
  const Primitive& p = scene.primitives[0];
  REQUIRE(p.texcoords.size() == 2);
  CHECK(p.texcoords[1][2] == glm::vec2(2, 2));
  CHECK(p.colors[1] == glm::vec4(0, 1, 0, 0.5f));
  CHECK(p.normals[3] == glm::vec3(0, 0, 1));
}

TEST_CASE("colours may be RGB and bytes", "[gltf]") {
  GltfBuilder builder = file_with(triangle());
  builder.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = builder.add_accessor(
      std::vector<std::uint8_t>{255, 0, 51, 0, 255, 0, 102, 0, 255}, "VEC3", true);
  // Three bytes a vertex are not aligned as glTF asks, but their meaning is plain.
  const auto scene = loaded(builder);
  CHECK(scene.primitives[0].colors[0] == glm::vec4(1, 0, 51 / 255.0f, 1));
  CHECK(scene.primitives[0].colors[2] == glm::vec4(102 / 255.0f, 0, 1, 1));
}

TEST_CASE("vertices that no triangle uses are left out, unread", "[gltf]") {
  PrimitiveSpec spec = quad();
  spec.positions[0] = kNan;
  spec.indices = {1, 2, 3};
  const auto scene = loaded(file_with(spec));
  const Primitive& p = scene.primitives[0];
  CHECK(p.positions == std::vector<glm::vec3>{{1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  CHECK(p.texcoords[0] == std::vector<glm::vec2>{{1, 0}, {1, 1}, {0, 1}});
  CHECK(p.indices == std::vector<std::uint32_t>{0, 1, 2});
}

TEST_CASE("without normals every face is flat", "[gltf]") {
  PrimitiveSpec spec;
  spec.positions = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 2};
  spec.texcoords = {{0, 0, 1, 0, 1, 1, 0, 1}};
  spec.indices = {0, 1, 2, 0, 3, 1};
  const auto scene = loaded(file_with(spec));
  const Primitive& p = scene.primitives[0];
  REQUIRE(p.positions.size() == 6);
  for (std::size_t v = 0; v < 3; ++v) {
    CHECK(p.normals[v] == glm::vec3(0, 0, 1));
    CHECK(p.normals[3 + v] == glm::vec3(0, 1, 0));
  }
  CHECK(p.positions[4] == glm::vec3(0, 0, 2));
  CHECK(p.texcoords[0][4] == glm::vec2(0, 1));
}

TEST_CASE("faces of morph targets are flat too", "[gltf]") {
  PrimitiveSpec spec;
  spec.positions = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  spec.morph_positions = {{0, 0, 0, 0, 0, 0, 0, -1, 1}};
  spec.morph_normals = {{9, 9, 9, 9, 9, 9, 9, 9, 9}};
  const auto scene = loaded(file_with(spec));
  const Primitive& p = scene.primitives[0];
  CHECK(p.normals[0] == glm::vec3(0, 0, 1));
  // The target turns the face from +Z to -Y; the file's own deltas belong to normals it has not.
  CHECK(near(p.normals[0] + p.morph_targets[0].normals[0], {0, -1, 0}));
}

TEST_CASE("normals get unit length, and zero ones those of their faces", "[gltf]") {
  PrimitiveSpec spec = triangle();
  spec.normals = {0, 0, 3, 0, 3, 4, 0, 0, 0};
  const auto scene = loaded(file_with(spec));
  const Primitive& p = scene.primitives[0];
  CHECK(p.normals[0] == glm::vec3(0, 0, 1));
  CHECK(near(p.normals[1], {0, 0.6f, 0.8f}));
  CHECK(p.normals[2] == glm::vec3(0, 0, 1));
  CHECK(has_warning(scene, "length zero"));
}

TEST_CASE("triangles without area are left out", "[gltf]") {
  PrimitiveSpec spec = quad();
  spec.indices = {0, 1, 2, 1, 1, 3, 0, 2, 3};
  auto scene = loaded(file_with(spec));
  CHECK(scene.primitives[0].indices.size() == 6);
  CHECK(has_warning(scene, "1 triangles without area"));
  spec.positions = {0, 0, 0, 1, 1, 1, 2, 2, 2, 0, 1, 0};
  spec.indices = {0, 1, 2, 0, 1, 3};
  scene = loaded(file_with(spec));
  CHECK(scene.primitives[0].indices.size() == 3);
  CHECK(scene.primitives[0].positions.size() == 3);
  spec.indices = {0, 1, 2, 2, 1, 0};
  check_error(load(file_with(spec)), ErrorCode::kNotFound,
              {"no mesh that is shown has a triangle"});
}

TEST_CASE("triangles that a morph target opens are kept", "[gltf]") {
  PrimitiveSpec spec = triangle();
  spec.positions = {0, 0, 0, 1, 0, 0, 0, 0, 0};
  spec.morph_positions = {{0, 0, 0, 0, 0, 0, 0, 1, 0}};
  spec.normals.clear();
  const auto scene = loaded(file_with(spec));
  REQUIRE(scene.primitives[0].indices.size() == 3);
  CHECK(scene.primitives[0].normals[0] == glm::vec3(0, 0, 1));
}

TEST_CASE("morph targets bring positions and normals", "[gltf]") {
  PrimitiveSpec spec = triangle();
  spec.morph_positions = {{1, 2, 3, 4, 5, 6, 7, 8, 9}, std::vector<float>(9)};
  spec.morph_normals = {{0, 1, 0, 0, 1, 0, 0, 1, 0}};
  GltfBuilder builder;
  const int mesh = builder.add_mesh({spec, spec}, "face");
  builder.json["meshes"][0]["weights"] = {0.25, 0.5};
  builder.add_mesh_node(mesh);
  builder.add_node({{"mesh", mesh}, {"weights", {1, 2}}});
  const auto scene = loaded(builder);
  REQUIRE(scene.primitives.size() == 4);
  const Primitive& p = scene.primitives[1];
  REQUIRE(p.morph_targets.size() == 2);
  CHECK(p.morph_targets[0].positions[2] == glm::vec3(7, 8, 9));
  CHECK(p.morph_targets[0].normals[2] == glm::vec3(0, 1, 0));
  CHECK(p.morph_targets[1].normals.empty());
  // Primitives of a node share its weights; nodes do not.
  CHECK(scene.primitives[0].first_morph_weight == 0);
  CHECK(scene.primitives[1].first_morph_weight == 0);
  CHECK(scene.primitives[3].first_morph_weight == 2);
  CHECK(scene.morph_weight_count == 4);
  CHECK(scene.default_morph_weights == std::vector<float>{0.25f, 0.5f, 1, 2});
}

TEST_CASE("morph targets that do not fit are named", "[gltf]") {
  PrimitiveSpec spec = triangle();
  spec.morph_positions = {std::vector<float>(9)};
  GltfBuilder builder;
  builder.add_mesh_node(builder.add_mesh({spec, triangle()}, "face"));
  check_error(load(builder), ErrorCode::kCorrupt,
              {"mesh 0 \"face\"", "different numbers of morph"});
  builder = file_with(spec);
  builder.json["nodes"][0]["weights"] = {1, 2, 3};
  check_error(load(builder), ErrorCode::kCorrupt, {"node 0", "3 morph weights for 1"});
  spec.morph_positions = {std::vector<float>(6)};
  check_error(load(file_with(spec)), ErrorCode::kCorrupt, {"morph target 0", "2 elements for 3"});
  // Sparse targets need no bytes, so their number is limited by itself.
  builder = file_with(triangle());
  const int empty =
      builder.append("accessors", {{"componentType", 5126}, {"count", 3}, {"type", "VEC3"}});
  for (int t = 0; t < 1025; ++t) {
    builder.json["meshes"][0]["primitives"][0]["targets"].push_back({{"POSITION", empty}});
  }
  check_error(load(builder), ErrorCode::kLimit, {"1025 morph targets"});
}

TEST_CASE("indices beyond the vertices are named", "[gltf]") {
  PrimitiveSpec spec = quad();
  spec.indices = {0, 1, 2, 0, 2, 4};
  check_error(load(file_with(spec)), ErrorCode::kCorrupt,
              {"mesh 0 \"thing\"", "primitive 0", "index 5 is 4", "4 vertices"});
  spec.indices = {0, 1, 4294967295u};
  check_error(load(file_with(spec)), ErrorCode::kCorrupt, {"index 2 is 4294967295"});
}

TEST_CASE("attributes of different lengths are named", "[gltf]") {
  PrimitiveSpec spec = triangle();
  spec.normals.resize(6);
  check_error(load(file_with(spec)), ErrorCode::kCorrupt, {"NORMAL", "2 elements for 3"});
  spec = triangle();
  spec.texcoords[0].resize(4);
  check_error(load(file_with(spec)), ErrorCode::kCorrupt, {"TEXCOORD_0", "2 elements for 3"});
}

TEST_CASE("numbers that are not finite are named with their vertex", "[gltf]") {
  for (const float bad : {kNan, kInf, -kInf}) {
    PrimitiveSpec spec = triangle();
    spec.positions[5] = bad;
    check_error(load(file_with(spec)), ErrorCode::kCorrupt,
                {"primitive 0", "POSITION of vertex 1"});
    spec = triangle();
    spec.normals[8] = bad;
    check_error(load(file_with(spec)), ErrorCode::kCorrupt, {"NORMAL of vertex 2"});
    spec = triangle();
    spec.texcoords[0][0] = bad;
    check_error(load(file_with(spec)), ErrorCode::kCorrupt, {"TEXCOORD_0 of vertex 0"});
    spec = triangle();
    spec.colors.assign(12, bad);
    check_error(load(file_with(spec)), ErrorCode::kCorrupt, {"COLOR_0 of vertex 0"});
    spec = triangle();
    spec.morph_positions = {std::vector<float>(9, bad)};
    check_error(load(file_with(spec)), ErrorCode::kCorrupt,
                {"morph target 0, POSITION of vertex 0"});
  }
}

TEST_CASE("materials that do not exist are named", "[gltf]") {
  PrimitiveSpec spec = triangle();
  spec.material = 3;
  check_error(load(file_with(spec)), ErrorCode::kCorrupt,
              {"primitive 0", "material 3 does not exist"});
}

TEST_CASE("a file without meshes or without one in its scene is refused", "[gltf]") {
  GltfBuilder builder;
  builder.add_node(Json::object());
  check_error(load(builder), ErrorCode::kNotFound, {"meshes"});
  builder = file_with(triangle());
  builder.json["nodes"][0].erase("mesh");
  check_error(load(builder), ErrorCode::kNotFound, {"no node of the default scene has a mesh"});
  builder.json["nodes"][0]["mesh"] = 9;
  check_error(load(builder), ErrorCode::kCorrupt, {"node 0", "mesh 9 does not exist"});
}
