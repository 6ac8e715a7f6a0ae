// SPDX-License-Identifier: MIT
#include "bake_minimal/gltf_materials.hpp"

#include <cmath>

#include "tests/bake_minimal/gltf_loading.hpp"
#include "tests/decoders/image_samples.hpp"

using namespace relit::test;
using relit::ErrorCode;
using relit::bake::Material;
using relit::bake::Scene;
using relit::bake::TextureUse;
using relit::container::AlphaMode;
using relit::container::Wrap;

namespace {

const Bytes kTexels{255, 0, 0, 255, 0, 255, 0, 128, 0, 0, 255, 255, 10, 20, 30, 0};

/// A triangle with material 0.
GltfBuilder with_material(const Json& material) {
  PrimitiveSpec spec = triangle();
  spec.material = 0;
  GltfBuilder builder = file_with(spec);
  builder.add_material(material);
  return builder;
}

Json textured(const Json& info) { return {{"pbrMetallicRoughness", {{"baseColorTexture", info}}}}; }

/// With a PNG of two by two texels as texture 0.
GltfBuilder with_texture(const Json& info, const Json& sampler = nullptr) {
  GltfBuilder builder = with_material(textured(info));
  builder.add_texture(make_rgba_png(2, 2, kTexels), "image/png", sampler);
  return builder;
}

glm::vec2 transformed(const TextureUse& use, const glm::vec2& uv) {
  return glm::vec2(use.uv_transform * glm::vec3(uv, 1));
}

}  // namespace

TEST_CASE("factors, sides and alpha of a material are read", "[gltf]") {
  const Material m =
      loaded(
          with_material({{"name", "glass"},
                         {"doubleSided", true},
                         {"alphaMode", "MASK"},
                         {"alphaCutoff", 0.25},
                         {"pbrMetallicRoughness",
                          {{"baseColorFactor", {0.1, 0.2, 0.3, 0.4}}, {"metallicFactor", 0.75}}}}))
          .materials[0];
  CHECK(m.name == "glass");
  CHECK(m.double_sided);
  CHECK(m.alpha_mode == AlphaMode::kMask);
  CHECK(m.alpha_cutoff == 0.25f);
  CHECK(m.base_color == glm::vec4(0.1f, 0.2f, 0.3f, 0.4f));
  CHECK(m.metallic == 0.75f);
  CHECK(m.base_color_texture.image == -1);

  const Scene plain = loaded(with_material(Json::object()));
  CHECK(plain.materials[0].base_color == glm::vec4(1));
  CHECK(plain.materials[0].metallic == 1);
  CHECK(plain.materials[0].alpha_mode == AlphaMode::kOpaque);
  CHECK(plain.materials[0].alpha_cutoff == 0.5f);
  CHECK(has_warning(plain, "pure metal"));
  CHECK(loaded(with_material({{"alphaMode", "BLEND"}})).materials[0].alpha_mode ==
        AlphaMode::kBlend);
}

TEST_CASE("materials that make no sense are named or clamped", "[gltf]") {
  check_error(load(with_material({{"name", "odd"}, {"alphaMode", "GLOW"}})), ErrorCode::kCorrupt,
              {"material 0 \"odd\"", "GLOW"});
  check_error(load(with_material({{"alphaCutoff", -1}})), ErrorCode::kCorrupt,
              {"material 0", "alphaCutoff"});
  CHECK(
      !load(with_material({{"pbrMetallicRoughness", {{"baseColorFactor", {1, 1}}}}})).has_value());
  const Scene scene = loaded(with_material(
      {{"pbrMetallicRoughness", {{"baseColorFactor", {2, -1, 0.5, 1}}, {"metallicFactor", 7}}}}));
  CHECK(scene.materials[0].base_color == glm::vec4(1, 0, 0.5f, 1));
  CHECK(scene.materials[0].metallic == 1);
  CHECK(has_warning(scene, "baseColorFactor is not in [0,1]"));
}

TEST_CASE("an embedded PNG is decoded and kept as it was", "[gltf]") {
  const Scene scene = loaded(with_texture({{"index", 0}}));
  REQUIRE(scene.images.size() == 1);
  CHECK(scene.images[0].rgba == kTexels);
  CHECK(scene.images[0].encoded == make_rgba_png(2, 2, kTexels));
  CHECK(scene.images[0].media_type == "image/png");
  const TextureUse& use = scene.materials[0].base_color_texture;
  CHECK(use.image == 0);
  CHECK(use.texcoord == 0);
  CHECK(use.wrap_u == Wrap::kRepeat);
  CHECK(use.linear_filter);
  CHECK(use.uv_transform == glm::mat3(1));
}

TEST_CASE("images may be files and data URIs, and JPEG", "[gltf]") {
  const Bytes jpeg = make_flat_jpeg({200});
  TemporaryDirectory directory;
  directory.write("a b.jpg", jpeg);
  for (const std::string& uri :
       {std::string("a%20b.jpg"), "data:image/jpeg;base64," + GltfBuilder::base64(jpeg)}) {
    GltfBuilder builder = with_texture({{"index", 0}});
    builder.json["images"][0] = {{"uri", uri}, {"name", "skin"}};
    const auto scene = relit::bake::load_gltf(directory.write("a.glb", builder.glb()));
    INFO((scene ? std::string() : scene.error().message));
    REQUIRE(scene.has_value());
    CHECK(scene->images[0].media_type == "image/jpeg");
    CHECK(scene->images[0].name == "skin");
    CHECK(scene->images[0].rgba[0] == 200);
  }
}

TEST_CASE("samplers set wrapping and filter", "[gltf]") {
  TextureUse use = loaded(with_texture({{"index", 0}},
                                       {{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}}))
                       .materials[0]
                       .base_color_texture;
  CHECK(use.wrap_u == Wrap::kClamp);
  CHECK(use.wrap_v == Wrap::kMirror);
  CHECK(!use.linear_filter);
  use = loaded(with_texture({{"index", 0}}, {{"magFilter", 9729}})).materials[0].base_color_texture;
  CHECK(use.wrap_v == Wrap::kRepeat);
  CHECK(use.linear_filter);
  check_error(load(with_texture({{"index", 0}}, {{"wrapS", 1}})), ErrorCode::kCorrupt,
              {"material 0", "wrap mode 1"});
}

TEST_CASE("KHR_texture_transform turns counter-clockwise with v downwards", "[gltf]") {
  const auto with = [](const Json& transform) {
    GltfBuilder builder =
        with_texture({{"index", 0}, {"extensions", {{"KHR_texture_transform", transform}}}});
    return loaded(builder).materials[0].base_color_texture;
  };
  TextureUse use = with({{"offset", {0.5, 0.25}}, {"scale", {2, 3}}});
  CHECK(transformed(use, {1, 1}) == glm::vec2(2.5f, 3.25f));
  use = with({{"rotation", std::acos(-1.0) / 2}});
  // A quarter turn takes +u to -v, which is up in the picture. cos(π/2) is 6e-17 as a double.
  CHECK(glm::length(transformed(use, {1, 0}) - glm::vec2(0, -1)) < 1e-6f);
  CHECK(glm::length(transformed(use, {0, 1}) - glm::vec2(1, 0)) < 1e-6f);
  use = with({{"rotation", std::acos(-1.0) / 2}, {"offset", {0, 1}}, {"scale", {0.5, 0.25}}});
  // Scaled first, then turned, then moved: the specification's matrix T · R · S.
  CHECK(glm::length(transformed(use, {1, 1}) - glm::vec2(0.25f, 0.5f)) < 1e-6f);
}

TEST_CASE("KHR_texture_transform may choose another UV set", "[gltf]") {
  GltfBuilder builder =
      with_texture({{"index", 0},
                    {"texCoord", 0},
                    {"extensions", {{"KHR_texture_transform", {{"texCoord", 1}}}}}});
  const Scene scene = loaded(builder);
  CHECK(scene.materials[0].base_color_texture.texcoord == 1);
  // The mesh has only one set; it gets a second, of zeros, so that nobody reads beyond.
  REQUIRE(scene.primitives[0].texcoords.size() == 2);
  CHECK(scene.primitives[0].texcoords[1] == std::vector<glm::vec2>(3));
  CHECK(has_warning(scene, "TEXCOORD_1"));
  check_error(load(with_texture({{"index", 0}, {"texCoord", 2000000000}})), ErrorCode::kCorrupt,
              {"material 0", "TEXCOORD_2000000000"});
}

TEST_CASE("the metallic texture is read as well, a shared image once", "[gltf]") {
  GltfBuilder builder = with_material(
      {{"pbrMetallicRoughness",
        {{"baseColorTexture", {{"index", 0}}}, {"metallicRoughnessTexture", {{"index", 1}}}}}});
  builder.add_texture(make_rgba_png(2, 2, kTexels), "image/png");
  builder.append("textures", {{"source", 0}});
  const Scene scene = loaded(builder);
  CHECK(scene.images.size() == 1);
  CHECK(scene.materials[0].metallic_texture.image == 0);
  CHECK(!has_warning(scene, "pure metal"));
}

TEST_CASE("images that no shown surface needs are not touched", "[gltf]") {
  GltfBuilder builder = with_texture({{"index", 0}});
  builder.append("images", {{"uri", "gone.png"}});
  builder.append("textures", {{"source", 1}});
  builder.add_material(textured({{"index", 1}}));
  builder.json["materials"][0]["normalTexture"] = {{"index", 1}};
  CHECK(loaded(builder).images.size() == 1);
}

TEST_CASE("images that cannot be had are named", "[gltf]") {
  const auto with_image = [](const Json& image) {
    GltfBuilder builder = with_texture({{"index", 0}});
    builder.json["images"][0] = image;
    return load(builder);
  };
  check_error(with_image({{"uri", "gone.png"}, {"name", "skin"}}), ErrorCode::kIo,
              {"image 0 \"skin\"", "gone.png", "does not exist"});
  check_error(with_image({{"uri", "data:image/png;base64,@@@@"}}), ErrorCode::kCorrupt,
              {"image 0", "base64"});
  check_error(with_image(Json::object()), ErrorCode::kCorrupt, {"image 0", "neither a uri"});
  check_error(with_image({{"bufferView", 99}}), ErrorCode::kCorrupt,
              {"image 0", "bufferView 99 does not exist"});
  check_error(with_image({{"uri", "data:image/png;base64,aGVsbG8="}}), ErrorCode::kUnsupported,
              {"image 0", "neither PNG nor JPEG"});
  Bytes cut = make_rgba_png(2, 2, kTexels);
  cut.resize(cut.size() - 20);
  check_error(with_image({{"uri", "data:image/png;base64," + GltfBuilder::base64(cut)}}),
              ErrorCode::kTruncated, {"image 0"});
  const std::string ktx = "\xabKTX 20\xbb\r\n\x1a\n........";
  check_error(with_image({{"uri", "data:image/ktx2;base64," +
                                      GltfBuilder::base64({ktx.begin(), ktx.end()})}}),
              ErrorCode::kUnsupported, {"image 0", "image/ktx2", "convert"});
}

TEST_CASE("a name that lies about an image's type is only a warning", "[gltf]") {
  GltfBuilder builder = with_texture({{"index", 0}});
  builder.json["images"][0]["mimeType"] = "image/jpeg";
  const Scene scene = loaded(builder);
  CHECK(scene.images[0].media_type == "image/png");
  CHECK(has_warning(scene, "called image/jpeg"));
}

TEST_CASE("textures, samplers and images that do not exist are named", "[gltf]") {
  check_error(load(with_texture({{"index", 4}})), ErrorCode::kCorrupt,
              {"material 0", "baseColorTexture", "texture 4 does not exist"});
  GltfBuilder builder = with_texture({{"index", 0}});
  builder.json["textures"][0]["source"] = 8;
  check_error(load(builder), ErrorCode::kCorrupt, {"material 0", "image 8 does not exist"});
  builder = with_texture({{"index", 0}});
  builder.json["textures"][0]["sampler"] = 8;
  check_error(load(builder), ErrorCode::kCorrupt, {"material 0", "sampler 8 does not exist"});
  builder = with_texture({{"index", 0}});
  builder.json["textures"][0] = {{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}};
  check_error(load(builder), ErrorCode::kUnsupported,
              {"material 0", "texture 0", "KHR_texture_basisu", "PNG or JPEG"});
}
