// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

/// Writes small glTF files for tests: add_*() return glTF indexes, and everything stays open to
/// change through `json` and `binary` before glb() or gltf().
namespace relit::test {

using Json = nlohmann::json;

template <class T>
constexpr int kComponentType = std::is_same_v<T, float>           ? 5126
                               : std::is_same_v<T, std::uint32_t> ? 5125
                               : std::is_same_v<T, std::uint16_t> ? 5123
                               : std::is_same_v<T, std::int16_t>  ? 5122
                               : std::is_same_v<T, std::uint8_t>  ? 5121
                                                                  : 5120;

/// Vertex data as flat numbers; what is empty is left out.
struct PrimitiveSpec {
  std::vector<float> positions;               ///< xyz
  std::vector<float> normals;                 ///< xyz
  std::vector<std::vector<float>> texcoords;  ///< uv, by set
  std::vector<float> colors;                  ///< rgba
  std::vector<std::uint16_t> joints;          ///< 4 a vertex
  std::vector<float> weights;                 ///< 4 a vertex
  std::vector<std::uint32_t> indices;
  std::vector<std::vector<float>> morph_positions;  ///< xyz offsets, by target
  std::vector<std::vector<float>> morph_normals;    ///< by target, or none at all
  int material = -1;
  int mode = 4;
};

struct ChannelSpec {
  int node = 0;
  std::string path = "translation";
  std::vector<float> times;
  std::vector<float> values;
  std::string interpolation = "LINEAR";
};

class GltfBuilder {
 public:
  Json json = {{"asset", {{"version", "2.0"}}}};
  std::vector<std::uint8_t> binary;

  /// Appends to the only buffer, 4-byte aligned.
  int add_view(const void* data, std::size_t bytes, int stride = 0) {
    binary.resize((binary.size() + 3) / 4 * 4);
    Json view = {{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes}};
    if (stride != 0) view["byteStride"] = stride;
    const auto* p = static_cast<const std::uint8_t*>(data);
    binary.insert(binary.end(), p, p + bytes);
    return append("bufferViews", view);
  }

  template <class T>
  int add_view(const std::vector<T>& data, int stride = 0) {
    return add_view(data.data(), data.size() * sizeof(T), stride);
  }

  template <class T>
  int add_accessor(const std::vector<T>& data, const std::string& type, bool normalized = false) {
    Json accessor = {{"bufferView", add_view(data)},
                     {"componentType", kComponentType<T>},
                     {"count", data.size() / components_of(type)},
                     {"type", type}};
    if (normalized) accessor["normalized"] = true;
    return append("accessors", accessor);
  }

  Json primitive(const PrimitiveSpec& spec) {
    Json attributes = {{"POSITION", add_accessor(spec.positions, "VEC3")}};
    if (!spec.normals.empty()) attributes["NORMAL"] = add_accessor(spec.normals, "VEC3");
    for (std::size_t set = 0; set < spec.texcoords.size(); ++set) {
      attributes["TEXCOORD_" + std::to_string(set)] = add_accessor(spec.texcoords[set], "VEC2");
    }
    if (!spec.colors.empty()) attributes["COLOR_0"] = add_accessor(spec.colors, "VEC4");
    if (!spec.joints.empty()) attributes["JOINTS_0"] = add_accessor(spec.joints, "VEC4");
    if (!spec.weights.empty()) attributes["WEIGHTS_0"] = add_accessor(spec.weights, "VEC4");
    Json out = {{"attributes", attributes}, {"mode", spec.mode}};
    if (!spec.indices.empty()) out["indices"] = add_accessor(spec.indices, "SCALAR");
    if (spec.material >= 0) out["material"] = spec.material;
    for (std::size_t t = 0; t < spec.morph_positions.size(); ++t) {
      Json target = {{"POSITION", add_accessor(spec.morph_positions[t], "VEC3")}};
      if (t < spec.morph_normals.size()) {
        target["NORMAL"] = add_accessor(spec.morph_normals[t], "VEC3");
      }
      out["targets"].push_back(target);
    }
    return out;
  }

  int add_mesh(const std::vector<PrimitiveSpec>& primitives, const std::string& name = "") {
    Json mesh = {{"primitives", Json::array()}};
    if (!name.empty()) mesh["name"] = name;
    for (const PrimitiveSpec& spec : primitives) mesh["primitives"].push_back(primitive(spec));
    return append("meshes", mesh);
  }

  /// Also a root of the only scene, unless add_child() takes it.
  int add_node(const Json& node) { return append("nodes", node); }
  int add_mesh_node(int mesh) { return add_node({{"mesh", mesh}}); }
  void add_child(int parent, int child) {
    json["nodes"][static_cast<std::size_t>(parent)]["children"].push_back(child);
  }

  /// Without matrices: no inverseBindMatrices at all.
  int add_skin(const std::vector<int>& joints, const std::vector<float>& inverse_bind = {}) {
    Json skin = {{"joints", joints}};
    if (!inverse_bind.empty()) {
      skin["inverseBindMatrices"] = add_accessor(inverse_bind, "MAT4");
    }
    return append("skins", skin);
  }

  int add_animation(const std::vector<ChannelSpec>& channels, const std::string& name = "") {
    Json animation = {{"channels", Json::array()}, {"samplers", Json::array()}};
    if (!name.empty()) animation["name"] = name;
    for (const ChannelSpec& spec : channels) {
      const std::string type = spec.path == "weights"    ? "SCALAR"
                               : spec.path == "rotation" ? "VEC4"
                                                         : "VEC3";
      const int input = add_accessor(spec.times, "SCALAR");
      const int output = add_accessor(spec.values, type);
      animation["channels"].push_back({{"sampler", animation["samplers"].size()},
                                       {"target", {{"node", spec.node}, {"path", spec.path}}}});
      animation["samplers"].push_back(
          {{"input", input}, {"output", output}, {"interpolation", spec.interpolation}});
    }
    return append("animations", animation);
  }

  int add_material(const Json& material) { return append("materials", material); }

  /// An image in the buffer, and a texture of it.
  int add_texture(const std::vector<std::uint8_t>& file, const std::string& media_type,
                  const Json& sampler = nullptr) {
    const int image = append("images", {{"bufferView", add_view(file)}, {"mimeType", media_type}});
    Json texture = {{"source", image}};
    if (!sampler.is_null()) texture["sampler"] = append("samplers", sampler);
    return append("textures", texture);
  }

  /// The file, with a scene of all nodes that are nobody's children unless `json` has scenes
  /// already.
  std::vector<std::uint8_t> glb() const {
    Json document = finished();
    std::string text = document.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::vector<std::uint8_t> data = binary;
    data.resize((data.size() + 3) / 4 * 4);
    std::vector<std::uint8_t> out{'g', 'l', 'T', 'F'};
    const std::size_t binary_bytes = data.empty() ? 0 : 8 + data.size();
    for (const std::size_t v :
         {std::size_t{2}, 20 + text.size() + binary_bytes, text.size(), std::size_t{0x4E4F534A}}) {
      append_le32(out, v);
    }
    out.insert(out.end(), text.begin(), text.end());
    if (data.empty()) return out;
    append_le32(out, data.size());
    append_le32(out, 0x004E4942);
    out.insert(out.end(), data.begin(), data.end());
    return out;
  }

  /// JSON alone, with `buffer_uri` for the buffer (default: the buffer itself as a data URI).
  std::string gltf(const std::string& buffer_uri = "") const {
    Json document = finished();
    if (document.contains("buffers") && !document["buffers"][0].contains("uri")) {
      document["buffers"][0]["uri"] = buffer_uri.empty()
                                          ? "data:application/octet-stream;base64," + base64(binary)
                                          : buffer_uri;
    }
    return document.dump();
  }

  static std::string base64(const std::vector<std::uint8_t>& bytes) {
    static constexpr std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
      std::uint32_t group = 0;
      for (std::size_t k = 0; k < 3; ++k)
        group = group << 8 | (i + k < bytes.size() ? bytes[i + k] : 0u);
      for (std::size_t k = 0; k < 4; ++k) {
        out += i + k > bytes.size() ? '=' : kDigits[group >> (18 - 6 * k) & 63];
      }
    }
    return out;
  }

  /// Appends to a top-level array; returns the index.
  int append(const char* array, const Json& value) {
    json[array].push_back(value);
    return static_cast<int>(json[array].size()) - 1;
  }

 private:
  static std::size_t components_of(const std::string& type) {
    return type == "SCALAR" ? 1 : type == "VEC2" ? 2 : type == "VEC3" ? 3 : type == "VEC4" ? 4 : 16;
  }

  static void append_le32(std::vector<std::uint8_t>& out, std::size_t v) {
    for (int shift = 0; shift < 32; shift += 8)
      out.push_back(static_cast<std::uint8_t>(v >> shift & 0xff));
  }

  Json finished() const {
    Json document = json;
    if (!binary.empty() && !document.contains("buffers")) {
      document["buffers"] = Json::array({{{"byteLength", binary.size()}}});
    }
    if (document.contains("scenes") || !document.contains("nodes")) return document;
    std::vector<bool> is_child(document["nodes"].size(), false);
    for (const Json& node : document["nodes"]) {
      if (!node.contains("children")) continue;
      for (const Json& child : node["children"]) {
        const auto index = child.get<std::size_t>();
        if (index < is_child.size()) is_child[index] = true;
      }
    }
    Json roots = Json::array();
    for (std::size_t n = 0; n < is_child.size(); ++n) {
      if (!is_child[n]) roots.push_back(n);
    }
    document["scenes"] = Json::array({{{"nodes", roots}}});
    document["scene"] = 0;
    return document;
  }
};

/// The triangle (0,0,0), (1,0,0), (0,1,0), which faces +Z.
inline PrimitiveSpec triangle() {
  PrimitiveSpec spec;
  spec.positions = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  spec.normals = {0, 0, 1, 0, 0, 1, 0, 0, 1};
  spec.texcoords = {{0, 0, 1, 0, 0, 1}};
  spec.indices = {0, 1, 2};
  return spec;
}

/// The unit square in the plane z = 0, facing +Z, of two triangles, with UVs that fill [0,1]².
inline PrimitiveSpec quad() {
  PrimitiveSpec spec;
  spec.positions = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
  spec.normals = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
  spec.texcoords = {{0, 0, 1, 0, 1, 1, 0, 1}};
  spec.indices = {0, 1, 2, 0, 2, 3};
  return spec;
}

/// A file with one node that shows `spec`.
inline GltfBuilder file_with(const PrimitiveSpec& spec) {
  GltfBuilder builder;
  builder.add_mesh_node(builder.add_mesh({spec}, "thing"));
  return builder;
}

/// A fresh directory that goes away with the object.
class TemporaryDirectory {
 public:
  TemporaryDirectory() {
    std::string pattern = (std::filesystem::temp_directory_path() / "relit_test_XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) std::abort();
    path_ = pattern;
  }
  ~TemporaryDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  /// Writes a file into the directory and returns its path.
  template <class Bytes>
  std::filesystem::path write(const std::string& name, const Bytes& bytes) const {
    const auto file = path_ / name;
    std::ofstream out(file, std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()),
              static_cast<std::streamsize>(bytes.size()));
    return file;
  }

 private:
  std::filesystem::path path_;
};

}  // namespace relit::test
