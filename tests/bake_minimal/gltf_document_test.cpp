// SPDX-License-Identifier: MIT
#include "bake_minimal/gltf_document.hpp"

#include <random>

#include "bake_minimal/gltf_uri.hpp"
#include "tests/bake_minimal/gltf_loading.hpp"

using namespace relit::test;
using relit::ErrorCode;
using relit::bake::load_gltf;
using relit::bake::gltf::decode_base64;
using relit::bake::gltf::load_bytes;

namespace {

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

relit::Result<relit::bake::Scene> load_text(std::string_view text) {
  return load_bytes(bytes_of(text), "test.gltf");
}

/// A bit of everything, small enough to try each of its bytes.
GltfBuilder small_figure() {
  GltfBuilder builder;
  PrimitiveSpec spec = triangle();
  spec.joints.assign(12, 0);
  spec.weights = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
  spec.morph_positions = {{0, 0, 1, 0, 0, 1, 0, 0, 1}};
  spec.material = builder.add_material({{"pbrMetallicRoughness", {{"metallicFactor", 0}}}});
  const int mesh = builder.add_mesh({spec}, "thing");
  const int joint = builder.add_node({{"translation", {0, 0, 1}}});
  builder.add_skin({joint});
  const int node = builder.add_node({{"mesh", mesh}, {"skin", 0}});
  builder.add_animation(
      {{joint, "translation", {0, 1}, {0, 0, 0, 1, 0, 0}}, {node, "weights", {0, 1}, {0, 1}}});
  return builder;
}

}  // namespace

TEST_CASE("a glb and a gltf with a data URI or a file hold the same scene", "[gltf]") {
  const GltfBuilder builder = small_figure();
  TemporaryDirectory directory;
  const auto glb = load_gltf(directory.write("a.glb", builder.glb()));
  const auto embedded = load_gltf(directory.write("a.gltf", builder.gltf()));
  // The space and the umlaut test percent-decoding; a file may be longer than the buffer.
  std::filesystem::create_directory(directory.path() / "data");
  std::vector<std::uint8_t> longer = builder.binary;
  longer.resize(longer.size() + 100);
  directory.write("data/b \xc3\xbc.bin", longer);
  const auto external = load_gltf(directory.write("b.gltf", builder.gltf("data/b%20%C3%BC.bin")));
  for (const auto* scene : {&glb, &embedded, &external}) {
    INFO((*scene ? std::string() : scene->error().message));
    REQUIRE(scene->has_value());
    REQUIRE((*scene)->primitives.size() == 1);
    CHECK((*scene)->primitives[0].positions == glb->primitives[0].positions);
    CHECK((*scene)->clips[0].channels[0].values == glb->clips[0].channels[0].values);
  }
}

TEST_CASE("the content and not the name of a file says what it is", "[gltf]") {
  TemporaryDirectory directory;
  CHECK(load_gltf(directory.write("a.gltf", small_figure().glb())).has_value());
  CHECK(load_gltf(directory.write("a.glb", "\xef\xbb\xbf \n" + small_figure().gltf())).has_value());
}

TEST_CASE("files that are missing, directories or empty are named", "[gltf]") {
  TemporaryDirectory directory;
  check_error(load_gltf(directory.path() / "test.glb"), ErrorCode::kIo, {"does not exist"});
  std::filesystem::create_directory(directory.path() / "test.gltf");
  check_error(load_gltf(directory.path() / "test.gltf"), ErrorCode::kIo, {"regular file"});
  check_error(load_text(""), ErrorCode::kTruncated, {"empty"});
}

TEST_CASE("what is no glTF is called so", "[gltf]") {
  check_error(load_text("solid cube\nfacet normal 0 0 1"), ErrorCode::kCorrupt, {"no glTF file"});
  check_error(load_text("[1, 2, 3]"), ErrorCode::kCorrupt, {"no glTF file"});
  check_error(load_text("{}"), ErrorCode::kCorrupt, {"asset"});
  check_error(load_text("{\"asset\": 3}"), ErrorCode::kCorrupt, {"asset"});
  check_error(load_text("{\"asset\": {\"version\": \"1.0\"}}"), ErrorCode::kUnsupported,
              {"1.0", "export as glTF 2.0"});
  check_error(load_text("{\"asset\": {\"version\": \"2.0\"}}"), ErrorCode::kNotFound, {"meshes"});
  GltfBuilder version_one = small_figure();
  auto glb = version_one.glb();
  glb[4] = 1;
  check_error(load_bytes(glb, "test.glb"), ErrorCode::kUnsupported, {"version 1"});
}

TEST_CASE("every truncation of a glb is an error", "[gltf]") {
  const auto glb = small_figure().glb();
  REQUIRE(load_bytes(glb, "test.glb").has_value());
  for (std::size_t size = 0; size < glb.size(); ++size) {
    const auto scene = load_bytes(std::span(glb).first(size), "test.glb");
    if (scene.has_value()) FAIL("loaded from " << size << " bytes of " << glb.size());
    if (scene.error().code != ErrorCode::kTruncated) FAIL(size << ": " << scene.error().message);
  }
}

TEST_CASE("every truncation of a gltf is an error", "[gltf]") {
  const std::string text = small_figure().gltf();
  for (std::size_t size = 0; size < text.size(); size += 3) {
    const auto scene = load_text(std::string_view(text).substr(0, size));
    if (scene.has_value()) FAIL("loaded from " << size << " bytes of " << text.size());
  }
}

TEST_CASE("a glb that is cut and says so is an error too", "[gltf]") {
  // As a careless repair tool would leave it: the header's length corrected, the chunks cut.
  const auto glb = small_figure().glb();
  for (std::size_t size = 12; size < glb.size(); size += 5) {
    std::vector<std::uint8_t> cut(glb.begin(), glb.begin() + static_cast<std::ptrdiff_t>(size));
    for (std::size_t b = 0; b < 4; ++b)
      cut[8 + b] = static_cast<std::uint8_t>(size >> 8 * b & 0xff);
    if (load_bytes(cut, "test.glb").has_value()) FAIL("loaded from " << size << " bytes");
  }
}

TEST_CASE("bytes after a glb's end are ignored with a warning", "[gltf]") {
  auto glb = small_figure().glb();
  glb.resize(glb.size() + 40, 7);
  const auto scene = load_bytes(glb, "test.glb");
  REQUIRE(scene.has_value());
  CHECK(has_warning(*scene, "after the file's end"));
}

TEST_CASE("random damage never crashes the loader", "[gltf]") {
  const auto glb = small_figure().glb();
  std::mt19937 random(7);
  for (int round = 0; round < 1000; ++round) {
    auto damaged = glb;
    const unsigned changes = 1 + random() % 4;
    for (unsigned c = 0; c < changes; ++c) {
      // Digits stand for digits so that many of the files still parse.
      auto& byte = damaged[12 + random() % (damaged.size() - 12)];
      byte = byte >= '0' && byte <= '9' ? static_cast<std::uint8_t>('0' + random() % 10)
                                        : static_cast<std::uint8_t>(random());
    }
    const auto scene = load_bytes(damaged, "test.glb");
    if (scene) {
      // Overflow is an error of its own; that it returns is what counts.
      (void)relit::bake::clip_bounds(*scene, scene->clips.empty() ? -1 : 0, 0.01);
    } else if (scene.error().message.find("test.glb: ") != 0) {
      FAIL(scene.error().message);
    }
  }
}

TEST_CASE("JSON of another shape than glTF's is an error, not a crash", "[gltf]") {
  const Json good = Json::parse(small_figure().gltf());
  const Json values[] = {nullptr,
                         true,
                         -1,
                         99,
                         1e300,
                         "text",
                         Json::array(),
                         {{"x", 1}},
                         Json::array({-1, "a"}),
                         4294967296,
                         Json::array({nullptr})};
  const Json flat = good.flatten();
  for (const auto& [pointer, unused] : flat.items()) {
    // The value itself and every array and object above it.
    for (Json::json_pointer at(pointer); !at.empty(); at.pop_back()) {
      for (const Json& value : values) {
        Json bad = good;
        bad[at] = value;
        const auto scene = load_text(bad.dump());
        if (!scene && scene.error().message.find("test.gltf: ") != 0) FAIL(scene.error().message);
      }
      Json bad = good;
      Json& parent = bad[at.parent_pointer()];
      if (parent.is_object()) parent.erase(at.back());
      const auto scene = load_text(bad.dump());
      if (!scene && scene.error().message.find("test.gltf: ") != 0) FAIL(scene.error().message);
    }
  }
}

TEST_CASE("deeply nested JSON is refused", "[gltf]") {
  const std::string deep =
      "{\"asset\": {\"version\": \"2.0\"}, \"extras\": " + std::string(100000, '[') +
      std::string(100000, ']') + "}";
  check_error(load_text(deep), ErrorCode::kLimit, {"nested"});
  const std::string text =
      "{\"asset\": {\"version\": \"2.0\", \"generator\": \"\\\"" + std::string(1000, '[') + "\"}}";
  check_error(load_text(text), ErrorCode::kNotFound, {"meshes"});
}

TEST_CASE("required extensions that are missing here are named with a remedy", "[gltf]") {
  const std::pair<const char*, const char*> cases[] = {
      {"KHR_draco_mesh_compression", "without Draco compression"},
      {"EXT_meshopt_compression", "without meshopt compression"},
      {"KHR_texture_basisu", "PNG or JPEG"},
      {"EXT_mesh_gpu_instancing", "nodes of their own"},
      {"ACME_new_idea", "without it"},
  };
  for (const auto& [name, remedy] : cases) {
    GltfBuilder builder = small_figure();
    builder.json["extensionsUsed"] = {name};
    CHECK(has_warning(loaded(builder), name));
    builder.json["extensionsRequired"] = {name};
    check_error(load(builder), ErrorCode::kUnsupported, {name, remedy});
  }
  // A Draco file as exporters write it: accessors without data.
  GltfBuilder draco = small_figure();
  draco.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  for (Json& accessor : draco.json["accessors"]) accessor.erase("bufferView");
  check_error(load(draco), ErrorCode::kUnsupported, {"KHR_draco_mesh_compression"});
}

TEST_CASE("extensions that change nothing baked are noted", "[gltf]") {
  GltfBuilder builder = small_figure();
  builder.json["extensionsUsed"] = {"KHR_materials_unlit", "KHR_texture_transform"};
  builder.json["extensionsRequired"] = {"KHR_materials_unlit", "KHR_texture_transform"};
  const auto scene = loaded(builder);
  CHECK(has_warning(scene, "KHR_materials_unlit"));
  CHECK(!has_warning(scene, "KHR_texture_transform"));
}

TEST_CASE("buffers that are missing, short or badly encoded are named", "[gltf]") {
  const GltfBuilder builder = small_figure();
  TemporaryDirectory directory;
  check_error(load_gltf(directory.write("test.gltf", builder.gltf("gone.bin"))), ErrorCode::kIo,
              {"buffer 0", "gone.bin", "does not exist"});
  directory.write("short.bin", std::string("abc"));
  check_error(load_gltf(directory.write("test.gltf", builder.gltf("short.bin"))),
              ErrorCode::kTruncated, {"buffer 0", "3 of its"});
  check_error(load_text(builder.gltf("data:application/octet-stream;base64,AB*D")),
              ErrorCode::kCorrupt, {"buffer 0", "character 2"});
  check_error(load_text(builder.gltf("data:application/octet-stream;base64,ABCDE")),
              ErrorCode::kCorrupt, {"buffer 0", "cut off"});
  check_error(load_text(builder.gltf("data:text/plain,hello")), ErrorCode::kUnsupported,
              {"buffer 0", "base64"});
  for (const char* uri : {"http://example.org/a.bin", "file:///etc/passwd", "/etc/passwd"}) {
    check_error(load_text(builder.gltf(uri)), ErrorCode::kUnsupported, {"buffer 0", "relative"});
  }
  Json without = Json::parse(builder.gltf());
  without["buffers"][0].erase("uri");
  check_error(load_text(without.dump()), ErrorCode::kCorrupt, {"buffer 0", "no uri"});
}

TEST_CASE("base64 is decoded strictly", "[gltf]") {
  for (std::size_t size = 0; size < 20; ++size) {
    std::vector<std::uint8_t> bytes(size);
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(i * 37 + 250);
    std::string text = GltfBuilder::base64(bytes);
    REQUIRE(decode_base64(text).has_value());
    CHECK(*decode_base64(text) == bytes);
    while (!text.empty() && text.back() == '=') text.pop_back();
    CHECK(*decode_base64(text) == bytes);
  }
  for (const char* bad : {"A", "AB=C", "AB=", "A===", "AB C", "AB\nC", "====", "AAAAA"}) {
    INFO(bad);
    CHECK(!decode_base64(bad).has_value());
  }
}
