// SPDX-License-Identifier: MIT
#include "bake_minimal/gltf_document.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "bake_minimal/gltf_uri.hpp"

namespace relit::bake::gltf {
namespace {

using Json = nlohmann::json;

constexpr std::uint64_t kFileBytes = (1ull << 32) - 1;  ///< what a .glb can say of its length
constexpr int kJsonDepth = 128;  ///< tinygltf and the JSON writer recurse; real files need 12

struct Supported {
  std::string_view name;
  bool changes_nothing_baked;  ///< only how light is reflected, or what is not drawn at all
};

constexpr std::array kSupportedExtensions{
    Supported{"KHR_texture_transform", false},
    Supported{"KHR_mesh_quantization", false},
    Supported{"KHR_materials_anisotropy", true},
    Supported{"KHR_materials_clearcoat", true},
    Supported{"KHR_materials_dispersion", true},
    Supported{"KHR_materials_emissive_strength", true},
    Supported{"KHR_materials_ior", true},
    Supported{"KHR_materials_iridescence", true},
    Supported{"KHR_materials_sheen", true},
    Supported{"KHR_materials_specular", true},
    Supported{"KHR_materials_transmission", true},
    Supported{"KHR_materials_unlit", true},
    Supported{"KHR_materials_variants", true},
    Supported{"KHR_materials_volume", true},
    Supported{"KHR_lights_punctual", true},
    Supported{"KHR_xmp_json_ld", true},
};

std::string remedy_for_extension(const std::string& name) {
  if (name == "KHR_draco_mesh_compression") {
    return "export again without Draco compression, or decode with "
           "`gltf-transform copy IN.glb OUT.glb`";
  }
  if (name == "EXT_meshopt_compression" || name == "KHR_meshopt_compression") {
    return "export again without meshopt compression (gltfpack without -c), or decode with "
           "`gltf-transform copy IN.glb OUT.glb`";
  }
  if (name == "KHR_texture_basisu" || name == "EXT_texture_webp" || name == "EXT_texture_avif" ||
      name == "MSFT_texture_dds") {
    return "convert the textures to PNG or JPEG";
  }
  if (name == "KHR_materials_pbrSpecularGlossiness") {
    return "convert the materials with `gltf-transform metalrough IN.glb OUT.glb`";
  }
  if (name == "EXT_mesh_gpu_instancing") return "export the instances as nodes of their own";
  return "export again without it";
}

struct Parts {
  std::string_view json;
  std::span<const std::uint8_t> binary;
  bool is_glb = false;
};

std::uint32_t little_endian_32(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint32_t>(bytes[at]) | static_cast<std::uint32_t>(bytes[at + 1]) << 8 |
         static_cast<std::uint32_t>(bytes[at + 2]) << 16 |
         static_cast<std::uint32_t>(bytes[at + 3]) << 24;
}

std::string_view as_text(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// glTF 2.0, section 4.4.
Result<Parts> split_glb(std::span<const std::uint8_t> bytes, Document& document) {
  if (bytes.size() < 12) {
    return document.fail(ErrorCode::kTruncated, "GLB header",
                         "the file ends within it; copy or export the file again");
  }
  const std::uint32_t version = little_endian_32(bytes, 4);
  if (version != 2) {
    return document.fail(
        ErrorCode::kUnsupported, "GLB header",
        "version " + std::to_string(version) + " is not supported; export as glTF 2.0");
  }
  const std::uint32_t length = little_endian_32(bytes, 8);
  if (length > bytes.size()) {
    return document.fail(ErrorCode::kTruncated, "GLB header",
                         "the file has " + std::to_string(bytes.size()) + " of the " +
                             std::to_string(length) +
                             " bytes it should have; copy or export the file again");
  }
  if (length < bytes.size()) document.warn("GLB header", "bytes after the file's end ignored");
  bytes = bytes.first(length);
  Parts parts;
  parts.is_glb = true;
  constexpr std::uint32_t kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
  std::size_t at = 12;
  for (std::size_t chunk = 0; bytes.size() - std::min(at, bytes.size()) >= 8; ++chunk) {
    const std::uint32_t chunk_bytes = little_endian_32(bytes, at);
    const std::uint32_t type = little_endian_32(bytes, at + 4);
    at += 8;
    if (chunk_bytes > bytes.size() - at) {
      return document.fail(ErrorCode::kTruncated, label("GLB chunk", chunk, ""),
                           "it has " + std::to_string(chunk_bytes) +
                               " bytes, more than the file holds; export the file again");
    }
    if (chunk == 0 && type == kJsonChunk) parts.json = as_text(bytes.subspan(at, chunk_bytes));
    if (chunk == 1 && type == kBinaryChunk) parts.binary = bytes.subspan(at, chunk_bytes);
    at += chunk_bytes;
    at = (at + 3) / 4 * 4;
  }
  if (parts.json.empty()) {
    return document.fail(ErrorCode::kCorrupt, "GLB chunk 0",
                         "it is not the JSON chunk that must come first; export the file again");
  }
  return parts;
}

Result<Parts> split(std::span<const std::uint8_t> bytes, Document& document) {
  std::string_view text = as_text(bytes);
  const std::string_view magic = "glTF";
  if (text.empty()) {
    return document.fail(ErrorCode::kTruncated, "byte 0", "the file is empty; export it again");
  }
  if (text.starts_with(magic) || magic.starts_with(text)) return split_glb(bytes, document);
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos || text[first] != '{') {
    return document.fail(ErrorCode::kCorrupt, "byte 0",
                         "this is no glTF file: it begins neither with \"glTF\" nor with JSON; "
                         "give a .glb or .gltf of glTF 2.0");
  }
  return Parts{text, {}, false};
}

bool is_too_deep(std::string_view json) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (in_string) {
      if (c == '\\') {
        ++i;
      } else if (c == '"') {
        in_string = false;
      }
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      if (++depth > kJsonDepth) return true;
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return false;
}

Result<Json> parse_json(std::string_view text, const Document& document) {
  if (is_too_deep(text)) {
    return document.fail(ErrorCode::kLimit, "JSON",
                         "it is nested deeper than " + std::to_string(kJsonDepth) +
                             " levels; no glTF needs that: export the file again");
  }
  Json json;
  try {
    json = Json::parse(text);
  } catch (const Json::exception& e) {
    return document.fail(ErrorCode::kCorrupt, "JSON",
                         std::string(e.what()) + "; copy or export the file again");
  }
  if (!json.is_object()) {
    return document.fail(ErrorCode::kCorrupt, "JSON", "it is no object; export the file again");
  }
  return json;
}

const Json* member(const Json& object, const char* name) {
  if (!object.is_object()) return nullptr;
  const auto it = object.find(name);
  return it == object.end() ? nullptr : &*it;
}

std::string string_member(const Json& object, const char* name) {
  const Json* value = member(object, name);
  return value != nullptr && value->is_string() ? value->get<std::string>() : std::string();
}

Status check_version(const Json& json, const Document& document) {
  const Json* asset = member(json, "asset");
  const std::string version = asset == nullptr ? "" : string_member(*asset, "version");
  const std::string least = asset == nullptr ? "" : string_member(*asset, "minVersion");
  if (version.empty()) {
    return document.fail(ErrorCode::kCorrupt, "asset",
                         "there is no asset.version, so this is no glTF; export as glTF 2.0");
  }
  if (!version.starts_with("2.") || (!least.empty() && least != "2.0")) {
    return document.fail(
        ErrorCode::kUnsupported, "asset",
        "glTF " + (least.empty() ? version : least) + " is not supported; export as glTF 2.0");
  }
  return {};
}

std::set<std::string> string_set(const Json& json, const char* name) {
  std::set<std::string> out;
  if (const Json* list = member(json, name); list != nullptr && list->is_array()) {
    for (const Json& entry : *list) {
      if (entry.is_string()) out.insert(entry.get<std::string>());
    }
  }
  return out;
}

Status check_extensions(const Json& json, Document& document) {
  const std::set<std::string> required = string_set(json, "extensionsRequired");
  for (const std::string& name : required) {
    const bool supported = std::any_of(kSupportedExtensions.begin(), kSupportedExtensions.end(),
                                       [&](const Supported& s) { return s.name == name; });
    if (!supported) {
      return document.fail(ErrorCode::kUnsupported, "extensionsRequired",
                           name + " is not supported; " + remedy_for_extension(name));
    }
  }
  for (const std::string& name : string_set(json, "extensionsUsed")) {
    const auto found = std::find_if(kSupportedExtensions.begin(), kSupportedExtensions.end(),
                                    [&](const Supported& s) { return s.name == name; });
    if (found == kSupportedExtensions.end()) {
      document.warn("extensionsUsed", name +
                                          " is not supported and ignored; if the result looks "
                                          "wrong, " +
                                          remedy_for_extension(name));
    } else if (found->changes_nothing_baked) {
      document.warn("extensionsUsed", name + " has no part in relightable transfer and is ignored");
    }
  }
  return {};
}

Result<std::vector<std::uint8_t>> fetch_buffer(const Json& buffer, std::size_t index,
                                               const Parts& parts, const Document& document) {
  const std::string where = label("buffer", index, string_member(buffer, "name"));
  const Json* length = member(buffer, "byteLength");
  if (length == nullptr || !length->is_number_unsigned()) {
    return document.fail(ErrorCode::kCorrupt, where,
                         "byteLength is missing or no positive integer; export the file again");
  }
  const auto byte_length = length->get<std::uint64_t>();
  const Json* uri = member(buffer, "uri");
  std::vector<std::uint8_t> bytes;
  if (uri != nullptr && uri->is_string()) {
    auto resolved = resolve_uri(uri->get_ref<const std::string&>(), document.path.parent_path());
    if (!resolved) return document.fail(resolved.error().code, where, resolved.error().message);
    bytes = std::move(*resolved);
  } else if (index == 0 && parts.is_glb) {
    bytes.assign(parts.binary.begin(), parts.binary.end());
  } else {
    return document.fail(ErrorCode::kCorrupt, where,
                         "it has no uri and is not the first buffer of a .glb; export the file "
                         "again");
  }
  if (bytes.size() < byte_length) {
    return document.fail(ErrorCode::kTruncated, where,
                         "it has " + std::to_string(bytes.size()) + " of its " +
                             std::to_string(byte_length) + " bytes; copy or export the file again");
  }
  bytes.resize(static_cast<std::size_t>(byte_length));
  return bytes;
}

Status fetch_buffers(const Json& json, const Parts& parts, Document& document) {
  const Json* buffers = member(json, "buffers");
  if (buffers == nullptr || !buffers->is_array()) return {};
  for (const Json& buffer : *buffers) {
    RELIT_ASSIGN(auto bytes, fetch_buffer(buffer, document.buffers.size(), parts, document));
    document.buffers.push_back(std::move(bytes));
  }
  return {};
}

void list_images(const Json& json, Document& document) {
  const Json* images = member(json, "images");
  if (images == nullptr || !images->is_array()) return;
  for (const Json& entry : *images) {
    EncodedImage image{string_member(entry, "name"), string_member(entry, "mimeType"),
                       string_member(entry, "uri"), -1};
    if (image.media_type.empty()) image.media_type = data_uri_media_type(image.uri);
    const Json* view = member(entry, "bufferView");
    if (view != nullptr && view->is_number_unsigned()) {
      image.buffer_view = static_cast<int>(
          std::min<std::uint64_t>(view->get<std::uint64_t>(), std::numeric_limits<int>::max()));
    }
    document.images.push_back(std::move(image));
  }
}

// glTF says to ignore such channels; tinygltf would report an error for each.
void drop_channels_without_node(Json& json, Document& document) {
  const auto animations = json.find("animations");
  if (animations == json.end() || !animations->is_array()) return;
  for (std::size_t a = 0; a < animations->size(); ++a) {
    Json& animation = (*animations)[a];
    if (!animation.is_object() || !animation.contains("channels")) continue;
    Json& channels = animation["channels"];
    if (!channels.is_array()) continue;
    Json kept = Json::array();
    for (Json& channel : channels) {
      const Json* target = member(channel, "target");
      if (target == nullptr || !target->is_object() || target->contains("node")) {
        kept.push_back(std::move(channel));
      }
    }
    if (kept.size() != channels.size()) {
      document.warn(label("animation", a, string_member(animation, "name")),
                    std::to_string(channels.size() - kept.size()) +
                        " channels that move no node are ignored");
      if (kept.empty()) document.emptied_animations.insert(a);
    }
    channels = std::move(kept);
  }
}

// Optional in glTF, but tinygltf reports an error where it is missing.
void name_missing_inverse_bind(Json& json) {
  const auto skins = json.find("skins");
  if (skins == json.end() || !skins->is_array()) return;
  for (Json& skin : *skins) {
    if (skin.is_object() && !skin.contains("inverseBindMatrices")) skin["inverseBindMatrices"] = -1;
  }
}

// Buffers and images stay out of tinygltf's hands: it trusts the offsets of images, compares file
// sizes for equality and reads files from the working directory.
Status parse_model(Json json, Document& document) {
  for (const char* name : {"buffers", "images", "cameras", "extensions", "extras"}) {
    json.erase(name);
  }
  drop_channels_without_node(json, document);
  name_missing_inverse_bind(json);
  const std::string text = json.dump();
  json = nullptr;
  if (text.size() > std::numeric_limits<unsigned>::max()) {
    return document.fail(ErrorCode::kLimit, "JSON", "it has 4 GiB or more; keep the data in .bin");
  }
  tinygltf::TinyGLTF loader;
  std::string errors, warnings;
  const bool loaded = loader.LoadASCIIFromString(&document.model, &errors, &warnings, text.data(),
                                                 static_cast<unsigned>(text.size()), "");
  while (!errors.empty() && (errors.back() == '\n' || errors.back() == '.')) errors.pop_back();
  std::replace(errors.begin(), errors.end(), '\n', ' ');
  if (!loaded || !errors.empty()) {
    if (errors.empty()) errors = "the structure is not that of glTF";
    return document.fail(ErrorCode::kCorrupt, "JSON", errors + "; export the file again");
  }
  if (!warnings.empty()) document.warn("JSON", warnings);
  return {};
}

}  // namespace

Unexpected Document::fail(ErrorCode code, const std::string& where, const std::string& what) const {
  return relit::fail(code, path.string() + ": " + where + ": " + what);
}

void Document::warn(const std::string& where, const std::string& what) {
  std::string text = where + ": " + what;
  if (std::find(warnings.begin(), warnings.end(), text) == warnings.end()) {
    warnings.push_back(std::move(text));
  }
}

Result<std::span<const std::uint8_t>> Document::view_bytes(int buffer_view,
                                                           const std::string& where) const {
  if (!in_range(buffer_view, model.bufferViews.size())) {
    return fail(ErrorCode::kCorrupt, where,
                "bufferView " + std::to_string(buffer_view) + " does not exist; there are " +
                    std::to_string(model.bufferViews.size()));
  }
  const tinygltf::BufferView& view = model.bufferViews[static_cast<std::size_t>(buffer_view)];
  const std::string view_label =
      label("bufferView", static_cast<std::size_t>(buffer_view), view.name);
  if (!in_range(view.buffer, buffers.size())) {
    return fail(ErrorCode::kCorrupt, view_label,
                "buffer " + std::to_string(view.buffer) + " does not exist; there are " +
                    std::to_string(buffers.size()));
  }
  const auto& bytes = buffers[static_cast<std::size_t>(view.buffer)];
  if (view.byteOffset > bytes.size() || view.byteLength > bytes.size() - view.byteOffset) {
    return fail(ErrorCode::kCorrupt, view_label,
                "its " + std::to_string(view.byteLength) + " bytes from " +
                    std::to_string(view.byteOffset) + " leave buffer " +
                    std::to_string(view.buffer) + " of " + std::to_string(bytes.size()) +
                    " bytes; export the file again");
  }
  return std::span(bytes).subspan(view.byteOffset, view.byteLength);
}

std::string label(const char* kind, std::size_t index, const std::string& name) {
  std::string out = std::string(kind) + " " + std::to_string(index);
  return name.empty() ? out : out + " \"" + name + "\"";
}

Result<std::vector<std::uint8_t>> read_file(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    return relit::fail(ErrorCode::kIo, path.string() + " does not exist; check the path");
  }
  if (!std::filesystem::is_regular_file(status)) {
    return relit::fail(ErrorCode::kIo, path.string() + " is no regular file; name one");
  }
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const auto size = file ? static_cast<std::int64_t>(file.tellg()) : -1;
  if (size < 0) {
    return relit::fail(ErrorCode::kIo, path.string() + " cannot be read; check its permissions");
  }
  if (static_cast<std::uint64_t>(size) > kFileBytes) {
    return relit::fail(ErrorCode::kLimit, path.string() + " has 4 GiB or more; split the scene");
  }
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size));
  file.seekg(0);
  if (size > 0 && !file.read(reinterpret_cast<char*>(bytes.data()), size)) {
    return relit::fail(ErrorCode::kIo, path.string() + ": reading failed");
  }
  return bytes;
}

Result<Document> parse_document(std::span<const std::uint8_t> bytes,
                                const std::filesystem::path& path) {
  Document document;
  document.path = path;
  RELIT_ASSIGN(const Parts parts, split(bytes, document));
  RELIT_ASSIGN(Json json, parse_json(parts.json, document));
  RELIT_TRY(check_version(json, document));
  RELIT_TRY(check_extensions(json, document));
  RELIT_TRY(fetch_buffers(json, parts, document));
  list_images(json, document);
  RELIT_TRY(parse_model(std::move(json), document));
  return document;
}

}  // namespace relit::bake::gltf
