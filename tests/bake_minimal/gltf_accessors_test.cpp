// SPDX-License-Identifier: MIT
#include "bake_minimal/gltf_accessors.hpp"

#include <limits>

#include "tests/bake_minimal/gltf_loading.hpp"

using namespace relit::test;
using relit::ErrorCode;

namespace {

Json& attributes(GltfBuilder& builder) {
  return builder.json["meshes"][0]["primitives"][0]["attributes"];
}

Json& accessor(GltfBuilder& builder, const Json& index) {
  return builder.json["accessors"][index.get<std::size_t>()];
}

}  // namespace

TEST_CASE("interleaved attributes are read by their stride", "[gltf]") {
  GltfBuilder builder = file_with(triangle());
  // Position, then normal, then UV: 32 bytes a vertex.
  const std::vector<float> vertices{0, 0, 0, 0, 0, 1, 0.25f, 0.5f,  //
                                    2, 0, 0, 0, 0, 1, 1,     0,     //
                                    0, 3, 0, 0, 0, 1, 0,     1};
  const int view = builder.add_view(vertices, 32);
  const char* names[] = {"POSITION", "NORMAL", "TEXCOORD_0"};
  const char* types[] = {"VEC3", "VEC3", "VEC2"};
  for (std::size_t a = 0; a < 3; ++a) {
    attributes(builder)[names[a]] = builder.append("accessors", {{"bufferView", view},
                                                                 {"byteOffset", 12 * a},
                                                                 {"componentType", 5126},
                                                                 {"count", 3},
                                                                 {"type", types[a]}});
  }
  const auto scene = loaded(builder);
  const auto& p = scene.primitives[0];
  CHECK(p.positions[1] == glm::vec3(2, 0, 0));
  CHECK(p.positions[2] == glm::vec3(0, 3, 0));
  CHECK(p.normals[2] == glm::vec3(0, 0, 1));
  CHECK(p.texcoords[0][0] == glm::vec2(0.25f, 0.5f));
  CHECK(p.texcoords[0][2] == glm::vec2(0, 1));
}

TEST_CASE("normalised integers follow glTF's formulas", "[gltf]") {
  GltfBuilder builder = file_with(triangle());
  attributes(builder)["TEXCOORD_0"] =
      builder.add_accessor(std::vector<std::uint8_t>{0, 255, 51, 102, 1, 254}, "VEC2", true);
  attributes(builder)["TEXCOORD_1"] =
      builder.add_accessor(std::vector<std::uint16_t>{0, 65535, 13107, 1, 2, 3}, "VEC2", true);
  attributes(builder)["TEXCOORD_2"] =
      builder.add_accessor(std::vector<std::int8_t>{-128, 127, -127, 0, 1, -1}, "VEC2", true);
  attributes(builder)["TEXCOORD_3"] = builder.add_accessor(
      std::vector<std::int16_t>{-32768, 32767, -32767, 0, 1, -1}, "VEC2", true);
  const auto scene = loaded(builder);
  const auto& uv = scene.primitives[0].texcoords;
  REQUIRE(uv.size() == 4);
  CHECK(uv[0][0] == glm::vec2(0, 1));
  CHECK(uv[0][1] == glm::vec2(51 / 255.0f, 102 / 255.0f));
  CHECK(uv[1][0] == glm::vec2(0, 1));
  CHECK(uv[1][1] == glm::vec2(13107 / 65535.0f, 1 / 65535.0f));
  CHECK(uv[2][0] == glm::vec2(-1, 1));
  CHECK(uv[2][1] == glm::vec2(-1, 0));
  CHECK(uv[2][2] == glm::vec2(1 / 127.0f, -1 / 127.0f));
  CHECK(uv[3][0] == glm::vec2(-1, 1));
  CHECK(uv[3][2] == glm::vec2(1 / 32767.0f, -1 / 32767.0f));
}

TEST_CASE("quantised positions stand for themselves", "[gltf]") {
  GltfBuilder builder = file_with(triangle());
  builder.json["extensionsRequired"] = {"KHR_mesh_quantization"};
  // Three 16-bit components padded to 8 bytes, as vertex buffers must be.
  const std::vector<std::int16_t> positions{0, 0, 0, 99, 300, 0, 0, 99, 0, -400, 7, 99};
  attributes(builder)["POSITION"] =
      builder.append("accessors", {{"bufferView", builder.add_view(positions, 8)},
                                   {"componentType", 5122},
                                   {"count", 3},
                                   {"type", "VEC3"}});
  const auto scene = loaded(builder);
  CHECK(scene.primitives[0].positions[1] == glm::vec3(300, 0, 0));
  CHECK(scene.primitives[0].positions[2] == glm::vec3(0, -400, 7));
}

TEST_CASE("8-, 16- and 32-bit indices and no indices give the same triangles", "[gltf]") {
  const auto with = [](auto indices) {
    GltfBuilder builder = file_with(quad());
    Json& primitive = builder.json["meshes"][0]["primitives"][0];
    primitive["indices"] = builder.add_accessor(indices, "SCALAR");
    return loaded(builder).primitives[0];
  };
  const std::vector<std::uint32_t> expected{0, 1, 2, 0, 2, 3};
  CHECK(with(std::vector<std::uint8_t>{0, 1, 2, 0, 2, 3}).indices == expected);
  CHECK(with(std::vector<std::uint16_t>{0, 1, 2, 0, 2, 3}).indices == expected);
  CHECK(with(std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3}).indices == expected);
  PrimitiveSpec bare = triangle();
  bare.indices.clear();
  CHECK(loaded(file_with(bare)).primitives[0].indices == std::vector<std::uint32_t>{0, 1, 2});
}

TEST_CASE("sparse accessors replace elements, with and without a base", "[gltf]") {
  GltfBuilder builder = file_with(quad());
  const int indices = builder.add_view(std::vector<std::uint16_t>{1, 3});
  const int values = builder.add_view(std::vector<float>{5, 6, 7, 8, 9, 10});
  const Json sparse = {{"count", 2},
                       {"indices", {{"bufferView", indices}, {"componentType", 5123}}},
                       {"values", {{"bufferView", values}}}};
  accessor(builder, attributes(builder)["POSITION"])["sparse"] = sparse;
  const int target = builder.append(
      "accessors", {{"componentType", 5126}, {"count", 4}, {"type", "VEC3"}, {"sparse", sparse}});
  builder.json["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", target}}};
  const auto scene = loaded(builder);
  const auto& p = scene.primitives[0];
  CHECK(p.positions == std::vector<glm::vec3>{{0, 0, 0}, {5, 6, 7}, {1, 1, 0}, {8, 9, 10}});
  CHECK(p.morph_targets[0].positions ==
        std::vector<glm::vec3>{{0, 0, 0}, {5, 6, 7}, {0, 0, 0}, {8, 9, 10}});
}

TEST_CASE("bad sparse accessors are named", "[gltf]") {
  const auto with = [](std::vector<std::uint16_t> indices, int count, Json change) {
    GltfBuilder builder = file_with(quad());
    Json sparse = {
        {"count", count},
        {"indices", {{"bufferView", builder.add_view(indices)}, {"componentType", 5123}}},
        {"values", {{"bufferView", builder.add_view(std::vector<float>(6))}}}};
    sparse.merge_patch(change);
    accessor(builder, attributes(builder)["POSITION"])["sparse"] = sparse;
    return load(builder);
  };
  check_error(with({1, 4}, 2, Json::object()), ErrorCode::kCorrupt,
              {"mesh 0", "POSITION", "sparse", "index 4"});
  check_error(with({2, 2}, 2, Json::object()), ErrorCode::kCorrupt, {"sparse", "index 2"});
  check_error(with({1, 2}, 5, Json::object()), ErrorCode::kCorrupt, {"sparse", "count 5"});
  check_error(with({1, 2}, -1, Json::object()), ErrorCode::kCorrupt, {"sparse", "count -1"});
  check_error(with({1, 2}, 3, Json::object()), ErrorCode::kCorrupt, {"sparse", "bufferView"});
  check_error(with({1, 2}, 2, {{"indices", {{"componentType", 5126}}}}), ErrorCode::kCorrupt,
              {"sparse", "5126"});
  check_error(with({1, 2}, 2, {{"values", {{"bufferView", 77}}}}), ErrorCode::kCorrupt,
              {"sparse values", "bufferView 77"});
  check_error(with({1, 2}, 2, {{"values", {{"byteOffset", -4}}}}), ErrorCode::kCorrupt,
              {"sparse", "negative"});
}

TEST_CASE("accessors that leave their bufferView are named", "[gltf]") {
  const auto with = [](const Json& change) {
    GltfBuilder builder = file_with(triangle());
    accessor(builder, attributes(builder)["POSITION"]).merge_patch(change);
    return load(builder);
  };
  const auto corrupt = ErrorCode::kCorrupt;
  check_error(with({{"count", 4}}), corrupt,
              {"mesh 0 \"thing\"", "POSITION", "accessor 0", "48 bytes"});
  check_error(with({{"byteOffset", 4}}), corrupt, {"accessor 0", "from 4"});
  check_error(with({{"byteOffset", 1ull << 63}}), corrupt, {"accessor 0"});
  check_error(with({{"count", 1ull << 62}}), ErrorCode::kLimit, {"accessor 0"});
  check_error(with({{"count", 1ull << 26}}), corrupt, {"accessor 0"});
  check_error(with({{"bufferView", 50}}), corrupt, {"bufferView 50 does not exist"});
  check_error(with({{"type", "VEC2"}}), corrupt, {"POSITION", "3 components"});
  check_error(with({{"type", "SCALAR"}}), corrupt, {"POSITION", "3 components"});
  // Types that nothing uses are no match for "no other number of components".
  check_error(with({{"type", "MAT2"}}), corrupt, {"POSITION", "3 components"});
  check_error(with({{"type", "MAT3"}}), corrupt, {"POSITION", "3 components"});
  check_error(with({{"componentType", 5125}}), corrupt, {"POSITION", "not normalized"});
  check_error(with({{"componentType", 5130}}), corrupt, {"POSITION"});
}

TEST_CASE("buffer views that leave their buffer are named", "[gltf]") {
  const auto with = [](const Json& change) {
    GltfBuilder builder = file_with(triangle());
    builder.json["bufferViews"][0].merge_patch(change);
    return load(builder);
  };
  const auto corrupt = ErrorCode::kCorrupt;
  check_error(with({{"byteLength", 100000}}), corrupt, {"bufferView 0", "leave buffer 0"});
  check_error(with({{"byteOffset", 100000}}), corrupt, {"bufferView 0", "leave buffer 0"});
  check_error(with({{"byteOffset", ~0ull}}), corrupt, {"bufferView 0", "leave buffer 0"});
  check_error(with({{"buffer", 1}}), corrupt, {"bufferView 0", "buffer 1 does not exist"});
  check_error(with({{"buffer", -1}}), corrupt, {"bufferView 0"});
  check_error(with({{"byteStride", 8}}), corrupt, {"byteStride 8"});
  check_error(with({{"byteStride", 7}}), corrupt, {"byteStride"});
}

TEST_CASE("accessors that do not exist are named by their user", "[gltf]") {
  GltfBuilder builder = file_with(triangle());
  attributes(builder)["NORMAL"] = 99;
  check_error(load(builder), ErrorCode::kCorrupt, {"NORMAL", "accessor 99 does not exist"});
  builder = file_with(triangle());
  attributes(builder)["POSITION"] = -7;
  CHECK(!load(builder).has_value());
  builder = file_with(triangle());
  builder.json["meshes"][0]["primitives"][0]["indices"] = 99;
  CHECK(!load(builder).has_value());
}
