// SPDX-License-Identifier: MIT
#include "bake_minimal/gltf_materials.hpp"

#include <algorithm>
#include <cmath>

#include "bake_minimal/gltf_uri.hpp"
#include "container/base/limits.hpp"
#include "decoders/image.hpp"

namespace relit::bake::gltf {
namespace {

constexpr int kTexcoordSets = 16;

std::string image_label(const Document& document, std::size_t index) {
  return label("image", index, document.images[index].name);
}

Result<std::vector<std::uint8_t>> image_bytes(const Document& document, std::size_t index) {
  const EncodedImage& source = document.images[index];
  const std::string where = image_label(document, index);
  if (!source.uri.empty()) {
    auto bytes = resolve_uri(source.uri, document.path.parent_path());
    if (!bytes) return document.fail(bytes.error().code, where, bytes.error().message);
    return bytes;
  }
  if (source.buffer_view < 0) {
    return document.fail(ErrorCode::kCorrupt, where,
                         "it has neither a uri nor a bufferView; export the file again");
  }
  RELIT_ASSIGN(const auto view, document.view_bytes(source.buffer_view, where));
  return std::vector<std::uint8_t>(view.begin(), view.end());
}

Result<Image> read_image(Document& document, std::size_t index) {
  const EncodedImage& source = document.images[index];
  const std::string where = image_label(document, index);
  Image image;
  image.name = source.name;
  RELIT_ASSIGN(image.encoded, image_bytes(document, index));
  auto decoded = decoders::decode_image(image.encoded, source.media_type);
  if (!decoded) return document.fail(decoded.error().code, where, decoded.error().message);
  image.media_type = decoders::image_media_type(image.encoded);
  if (!source.media_type.empty() && source.media_type.starts_with("image/") &&
      source.media_type != image.media_type) {
    document.warn(where, "it is called " + source.media_type + " but is " + image.media_type);
  }
  image.width = decoded->width;
  image.height = decoded->height;
  image.rgba = std::move(decoded->rgba);
  return image;
}

/// Decodes every image that is used once.
class ImageTable {
 public:
  ImageTable(Document& document, Scene& scene)
      : document_(document), scene_(scene), to_scene_(document.images.size(), -1) {}

  /// The image's place in Scene::images.
  Result<int> use(int source, const std::string& where) {
    if (!in_range(source, to_scene_.size())) {
      return document_.fail(ErrorCode::kCorrupt, where,
                            "image " + std::to_string(source) + " does not exist; there are " +
                                std::to_string(to_scene_.size()));
    }
    int& place = to_scene_[static_cast<std::size_t>(source)];
    if (place >= 0) return place;
    RELIT_ASSIGN(Image image, read_image(document_, static_cast<std::size_t>(source)));
    texels_ += static_cast<std::uint64_t>(image.width) * static_cast<std::uint64_t>(image.height);
    if (scene_.images.size() >= limits::kImages || texels_ > 16 * limits::kImageTexels) {
      return document_.fail(ErrorCode::kLimit, where,
                            "the images have more than " +
                                std::to_string(16 * limits::kImageTexels) +
                                " texels together; scale them down");
    }
    place = static_cast<int>(scene_.images.size());
    scene_.images.push_back(std::move(image));
    return place;
  }

 private:
  Document& document_;
  Scene& scene_;
  std::vector<int> to_scene_;
  std::uint64_t texels_ = 0;
};

Result<container::Wrap> read_wrap(const Document& document, int wrap, const std::string& where) {
  switch (wrap) {
    case TINYGLTF_TEXTURE_WRAP_REPEAT:
      return container::Wrap::kRepeat;
    case TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE:
      return container::Wrap::kClamp;
    case TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT:
      return container::Wrap::kMirror;
    default:
      return document.fail(
          ErrorCode::kCorrupt, where,
          "wrap mode " + std::to_string(wrap) + " does not exist; use 10497, 33071 or 33648");
  }
}

double number_of(const tinygltf::Value& value, double otherwise) {
  return value.IsNumber() ? value.GetNumberAsDouble() : otherwise;
}

glm::dvec2 pair_of(const tinygltf::Value& object, const char* name, double otherwise) {
  glm::dvec2 out(otherwise);
  if (!object.Has(name)) return out;
  const tinygltf::Value& pair = object.Get(name);
  for (int c = 0; c < 2 && static_cast<std::size_t>(c) < pair.ArrayLen(); ++c) {
    out[c] = number_of(pair.Get(c), otherwise);
  }
  return out;
}

// Counter-clockwise in UV space, whose v points down: KhronosGroup/glTF issue 1563.
Status read_transform(const Document& document, const tinygltf::TextureInfo& info,
                      const std::string& where, TextureUse& use) {
  const auto extension = info.extensions.find("KHR_texture_transform");
  if (extension == info.extensions.end() || !extension->second.IsObject()) return {};
  const tinygltf::Value& object = extension->second;
  const glm::dvec2 offset = pair_of(object, "offset", 0);
  const glm::dvec2 scale = pair_of(object, "scale", 1);
  const double angle = object.Has("rotation") ? number_of(object.Get("rotation"), 0) : 0;
  const double c = std::cos(angle), s = std::sin(angle);
  const glm::dmat3 transform(c * scale.x, -s * scale.x, 0, s * scale.y, c * scale.y, 0, offset.x,
                             offset.y, 1);
  use.uv_transform = glm::mat3(transform);
  for (int i = 0; i < 9; ++i) {
    if (!std::isfinite(use.uv_transform[i / 3][i % 3])) {
      return document.fail(ErrorCode::kCorrupt, where,
                           "KHR_texture_transform holds a number that is not finite; write the "
                           "transform into the UVs");
    }
  }
  if (object.Has("texCoord") && object.Get("texCoord").IsNumber()) {
    use.texcoord = object.Get("texCoord").GetNumberAsInt();
  }
  return {};
}

Result<TextureUse> read_texture(Document& document, const tinygltf::TextureInfo& info,
                                const std::string& where, ImageTable& images) {
  TextureUse use;
  if (info.index < 0) return use;
  const auto& model = document.model;
  if (!in_range(info.index, model.textures.size())) {
    return document.fail(ErrorCode::kCorrupt, where,
                         "texture " + std::to_string(info.index) + " does not exist; there are " +
                             std::to_string(model.textures.size()));
  }
  const tinygltf::Texture& texture = model.textures[static_cast<std::size_t>(info.index)];
  if (texture.source < 0) {
    const std::string why = texture.extensions.empty()
                                ? "it has no image"
                                : "its image comes by " + texture.extensions.begin()->first +
                                      " alone, which is not supported";
    return document.fail(
        ErrorCode::kUnsupported,
        where + ", " + label("texture", static_cast<std::size_t>(info.index), texture.name),
        why + "; use a PNG or JPEG image");
  }
  RELIT_ASSIGN(use.image, images.use(texture.source, where));
  use.texcoord = info.texCoord;
  if (texture.sampler >= 0) {
    if (!in_range(texture.sampler, model.samplers.size())) {
      return document.fail(ErrorCode::kCorrupt, where,
                           "sampler " + std::to_string(texture.sampler) +
                               " does not exist; there are " +
                               std::to_string(model.samplers.size()));
    }
    const tinygltf::Sampler& sampler = model.samplers[static_cast<std::size_t>(texture.sampler)];
    RELIT_ASSIGN(use.wrap_u, read_wrap(document, sampler.wrapS, where));
    RELIT_ASSIGN(use.wrap_v, read_wrap(document, sampler.wrapT, where));
    use.linear_filter = sampler.magFilter != TINYGLTF_TEXTURE_FILTER_NEAREST;
  }
  RELIT_TRY(read_transform(document, info, where, use));
  if (use.texcoord < 0 || use.texcoord >= kTexcoordSets) {
    return document.fail(ErrorCode::kCorrupt, where,
                         "TEXCOORD_" + std::to_string(use.texcoord) + " is not in 0.." +
                             std::to_string(kTexcoordSets - 1));
  }
  return use;
}

float clamped_factor(Document& document, double value, const std::string& where,
                     const char* property) {
  if (!(value >= 0 && value <= 1)) {
    document.warn(where, std::string(property) + " is not in [0,1] and is clamped to it");
  }
  return static_cast<float>(std::clamp(std::isfinite(value) ? value : 1.0, 0.0, 1.0));
}

Status read_alpha(Document& document, const tinygltf::Material& source, const std::string& where,
                  Material& out) {
  if (source.alphaMode == "MASK") {
    out.alpha_mode = container::AlphaMode::kMask;
  } else if (source.alphaMode == "BLEND") {
    out.alpha_mode = container::AlphaMode::kBlend;
  } else if (source.alphaMode != "OPAQUE" && !source.alphaMode.empty()) {
    return document.fail(
        ErrorCode::kCorrupt, where,
        "alphaMode \"" + source.alphaMode + "\" does not exist; use OPAQUE, MASK or BLEND");
  }
  out.alpha_cutoff = static_cast<float>(source.alphaCutoff);
  if (!std::isfinite(out.alpha_cutoff) || out.alpha_cutoff < 0) {
    return document.fail(ErrorCode::kCorrupt, where,
                         "alphaCutoff is negative or not finite; 0.5 is usual");
  }
  return {};
}

Result<Material> read_material(Document& document, std::size_t index, bool used,
                               ImageTable& images) {
  const tinygltf::Material& source = document.model.materials[index];
  const tinygltf::PbrMetallicRoughness& pbr = source.pbrMetallicRoughness;
  const std::string where = label("material", index, source.name);
  Material out;
  out.name = source.name;
  for (int c = 0; c < 4; ++c) {
    out.base_color[c] = clamped_factor(document, pbr.baseColorFactor[static_cast<std::size_t>(c)],
                                       where, "baseColorFactor");
  }
  out.metallic = clamped_factor(document, pbr.metallicFactor, where, "metallicFactor");
  out.double_sided = source.doubleSided;
  RELIT_TRY(read_alpha(document, source, where, out));
  if (!used) return out;
  RELIT_ASSIGN(out.base_color_texture,
               read_texture(document, pbr.baseColorTexture, where + ", baseColorTexture", images));
  RELIT_ASSIGN(out.metallic_texture, read_texture(document, pbr.metallicRoughnessTexture,
                                                  where + ", metallicRoughnessTexture", images));
  if (out.metallic == 1 && out.metallic_texture.image < 0) {
    document.warn(where,
                  "it is a pure metal, so its albedo is black; set metallicFactor to 0 if "
                  "it is none");
  }
  return out;
}

void add_missing_texcoords(Document& document, const Material& material, Primitive& primitive) {
  for (const TextureUse* use : {&material.base_color_texture, &material.metallic_texture}) {
    if (use->image < 0) continue;
    const auto sets = static_cast<std::size_t>(use->texcoord) + 1;
    if (primitive.texcoords.size() >= sets) continue;
    document.warn("mesh \"" + primitive.name + "\"", "its material asks for TEXCOORD_" +
                                                         std::to_string(use->texcoord) +
                                                         ", which it has not; zeros are taken");
    primitive.texcoords.resize(sets, std::vector<glm::vec2>(primitive.positions.size()));
  }
}

}  // namespace

Status read_materials(Document& document, Scene& scene) {
  const std::size_t count = document.model.materials.size();
  if (count >= limits::kMaterials) {
    return document.fail(ErrorCode::kLimit, "materials",
                         "there are " + std::to_string(count) + "; fewer than " +
                             std::to_string(limits::kMaterials) + " are taken: merge some");
  }
  std::vector<bool> used(count + 1, false);
  for (const Primitive& primitive : scene.primitives) {
    used[static_cast<std::size_t>(primitive.material)] = true;
  }
  ImageTable images(document, scene);
  for (std::size_t m = 0; m < count; ++m) {
    RELIT_ASSIGN(Material material, read_material(document, m, used[m], images));
    scene.materials.push_back(std::move(material));
  }
  if (used[count]) {
    // glTF's default material is a pure metal, which would leave nothing to light.
    document.warn("materials", "primitives without one are taken as white and not metallic");
    scene.materials.emplace_back().name = "default";
  }
  for (Primitive& primitive : scene.primitives) {
    add_missing_texcoords(document, scene.materials[static_cast<std::size_t>(primitive.material)],
                          primitive);
  }
  return {};
}

}  // namespace relit::bake::gltf
