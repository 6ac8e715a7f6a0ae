// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <span>

#include "media/figure.hpp"
#include "media/sash.hpp"

namespace relit::media {
namespace {

using nlohmann::json;

constexpr int kByte = 5121, kShort = 5123, kFloat = 5126;
constexpr int kArrayBuffer = 34962, kElementBuffer = 34963;

// Collects the binary chunk and the accessors into it.
class Writer {
 public:
  json root = {{"asset", {{"version", "2.0"}, {"generator", "relit-media"}}}, {"scene", 0}};

  Writer() {
    for (const char* key : {"accessors", "bufferViews", "meshes", "nodes"})
      root[key] = json::array();
  }

  int view(std::span<const std::uint8_t> bytes, int target) {
    json entry = {{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes.size()}};
    if (target != 0) entry["target"] = target;
    binary_.insert(binary_.end(), bytes.begin(), bytes.end());
    binary_.resize((binary_.size() + 3) / 4 * 4, 0);
    return append("bufferViews", entry);
  }

  template <class T>
  int accessor(const std::vector<T>& values, const char* type, int component, int count,
               int target) {
    std::vector<std::uint8_t> bytes(values.size() * sizeof(T));
    std::memcpy(bytes.data(), values.data(), bytes.size());
    return append("accessors", {{"bufferView", view(bytes, target)},
                                {"componentType", component},
                                {"count", count},
                                {"type", type}});
  }

  int floats(const std::vector<float>& values, int width, int target = 0) {
    static constexpr std::array<const char*, 17> kTypes{
        "", "SCALAR", "VEC2", "VEC3", "VEC4", "", "", "", "", "", "", "", "", "", "", "", "MAT4"};
    const int index = accessor(values, kTypes[static_cast<std::size_t>(width)], kFloat,
                               static_cast<int>(values.size()) / width, target);
    json low = json::array(), high = json::array();
    for (int c = 0; c < width; ++c) {
      float a = std::numeric_limits<float>::max(), b = -a;
      for (std::size_t k = static_cast<std::size_t>(c); k < values.size();
           k += static_cast<std::size_t>(width)) {
        a = std::min(a, values[k]);
        b = std::max(b, values[k]);
      }
      low.push_back(a);
      high.push_back(b);
    }
    root["accessors"].back()["min"] = low;
    root["accessors"].back()["max"] = high;
    return index;
  }

  int append(const char* key, const json& entry) {
    root[key].push_back(entry);
    return static_cast<int>(root[key].size()) - 1;
  }

  std::vector<std::uint8_t> finish() {
    root["buffers"] = json::array({{{"byteLength", binary_.size()}}});
    std::string text = root.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::vector<std::uint8_t> out;
    const auto word = [&](std::size_t value) {
      for (int k = 0; k < 4; ++k) out.push_back(static_cast<std::uint8_t>(value >> (8 * k) & 0xff));
    };
    word(0x46546C67);
    word(2);
    word(12 + 8 + text.size() + 8 + binary_.size());
    word(text.size());
    word(0x4E4F534A);
    out.insert(out.end(), text.begin(), text.end());
    word(binary_.size());
    word(0x004E4942);
    out.insert(out.end(), binary_.begin(), binary_.end());
    return out;
  }

 private:
  std::vector<std::uint8_t> binary_;
};

// Triangles of one joint and one material, with the vertices they use.
struct Bundle {
  std::vector<Vertex> vertices;
  std::vector<std::uint16_t> indices;
};

using Bundles = std::map<Matter, Bundle>;

void gather(const Patch& patch, Bundles& bundles) {
  std::map<Matter, std::map<std::uint32_t, std::uint16_t>> moved;
  for (std::size_t t = 0; t < patch.triangles.size(); ++t) {
    Bundle& bundle = bundles[patch.matter[t]];
    auto& map = moved[patch.matter[t]];
    for (const std::uint32_t v : patch.triangles[t]) {
      const auto [it, fresh] =
          map.try_emplace(v, static_cast<std::uint16_t>(bundle.vertices.size()));
      if (fresh) bundle.vertices.push_back(patch.vertices[v]);
      bundle.indices.push_back(it->second);
    }
  }
}

template <class Get>
int attribute(Writer& writer, const Bundle& bundle, int width, Get get) {
  std::vector<float> values;
  for (const Vertex& vertex : bundle.vertices) {
    for (int c = 0; c < width; ++c) values.push_back(get(vertex)[c]);
  }
  return writer.floats(values, width, kArrayBuffer);
}

json write_primitive(Writer& writer, Matter matter, const Bundle& bundle, bool skinned) {
  json attributes = {
      {"POSITION", attribute(writer, bundle, 3, [](const Vertex& v) { return v.position; })},
      {"NORMAL", attribute(writer, bundle, 3, [](const Vertex& v) { return v.normal; })},
      {"TEXCOORD_0", attribute(writer, bundle, 2, [](const Vertex& v) { return v.wood; })},
      {"TEXCOORD_1", attribute(writer, bundle, 2, [](const Vertex& v) { return v.lightmap; })}};
  const int count = static_cast<int>(bundle.vertices.size());
  if (skinned) {
    std::vector<std::uint8_t> joints;
    for (const Vertex& v : bundle.vertices) {
      joints.insert(joints.end(), v.influence.joints.begin(), v.influence.joints.end());
    }
    attributes["JOINTS_0"] = writer.accessor(joints, "VEC4", kByte, count, kArrayBuffer);
    attributes["WEIGHTS_0"] =
        attribute(writer, bundle, 4, [](const Vertex& v) { return v.influence.weights.data(); });
  }
  return {{"attributes", attributes},
          {"indices", writer.accessor(bundle.indices, "SCALAR", kShort,
                                      static_cast<int>(bundle.indices.size()), kElementBuffer)},
          {"material", static_cast<int>(matter)}};
}

int write_mesh(Writer& writer, const std::string& name, const Bundles& bundles, bool skinned) {
  json primitives = json::array();
  for (const auto& [matter, bundle] : bundles)
    primitives.push_back(write_primitive(writer, matter, bundle, skinned));
  return writer.append("meshes", {{"name", name}, {"primitives", primitives}});
}

void write_materials(Writer& writer, const std::vector<std::uint8_t>& wood_png) {
  writer.root["images"] = json::array(
      {{{"name", "wood"}, {"mimeType", "image/png"}, {"bufferView", writer.view(wood_png, 0)}}});
  writer.root["samplers"] =
      json::array({{{"magFilter", 9729}, {"minFilter", 9987}, {"wrapS", 10497}, {"wrapT", 10497}}});
  writer.root["textures"] = json::array({{{"sampler", 0}, {"source", 0}}});
  const auto material = [&](const char* name, std::array<double, 3> colour, bool wood,
                            double roughness) {
    json pbr = {{"baseColorFactor", {colour[0], colour[1], colour[2], 1.0}},
                {"metallicFactor", 0.0},
                {"roughnessFactor", roughness}};
    if (wood) pbr["baseColorTexture"] = {{"index", 0}};
    writer.append("materials", {{"name", name}, {"pbrMetallicRoughness", pbr}});
  };
  writer.root["materials"] = json::array();
  material("beech", {1.0, 1.0, 1.0}, true, 0.55);
  material("walnut", {0.21, 0.155, 0.13}, true, 0.45);
  material("cloth", {0.47, 0.022, 0.030}, false, 0.95);
  material("trim", {0.66, 0.36, 0.075}, false, 0.8);
  material("plaster", {0.70, 0.675, 0.635}, false, 0.95);
}

// Node 0 is the model, the joints follow in their order, then the base and the sash.
void write_nodes(Writer& writer, int sash_mesh, const std::map<int, int>& meshes) {
  const auto& joints = skeleton();
  const int base = kJointCount + 1, sash = kJointCount + 2;
  writer.append("nodes", {{"name", "mannequin"}, {"children", {base, 1, sash}}});
  for (std::size_t j = 0; j < joints.size(); ++j) {
    json node = {{"name", joints[j].name},
                 {"translation", {joints[j].offset.x, joints[j].offset.y, joints[j].offset.z}}};
    json children = json::array();
    for (std::size_t k = 0; k < joints.size(); ++k) {
      if (joints[k].parent == static_cast<int>(j)) children.push_back(k + 1);
    }
    if (!children.empty()) node["children"] = children;
    if (const auto it = meshes.find(static_cast<int>(j)); it != meshes.end())
      node["mesh"] = it->second;
    writer.append("nodes", node);
  }
  writer.append("nodes", {{"name", "base"}, {"mesh", meshes.at(-1)}});
  writer.append("nodes", {{"name", "sash"}, {"mesh", sash_mesh}, {"skin", 0}});
  writer.root["scenes"] = json::array({{{"nodes", {0}}}});
  std::vector<float> inverse_bind;
  json skin_joints = json::array();
  const WorldPose rest = to_world(rest_pose());
  for (const int j : sash_joints()) {
    skin_joints.push_back(j + 1);
    const glm::dvec3 o = rest.origin[static_cast<std::size_t>(j)];
    for (const double v :
         {1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -o.x, -o.y, -o.z, 1.0}) {
      inverse_bind.push_back(static_cast<float>(v));
    }
  }
  writer.root["skins"] = json::array({{{"name", "sash"},
                                       {"joints", skin_joints},
                                       {"skeleton", 1},
                                       {"inverseBindMatrices", writer.floats(inverse_bind, 16)}}});
}

void write_clip(Writer& writer, const Figure& figure) {
  std::vector<float> times, places;
  for (std::size_t k = 0; k < figure.keys.size(); ++k) {
    times.push_back(static_cast<float>(static_cast<double>(k) / figure.walk.rate_hz));
    for (int c = 0; c < 3; ++c) places.push_back(static_cast<float>(figure.keys[k].pelvis[c]));
  }
  const int input = writer.floats(times, 1);
  json samplers = json::array(), channels = json::array();
  const auto channel = [&](std::size_t joint, const char* path, int output) {
    channels.push_back(
        {{"sampler", samplers.size()}, {"target", {{"node", joint + 1}, {"path", path}}}});
    samplers.push_back({{"input", input}, {"output", output}, {"interpolation", "LINEAR"}});
  };
  channel(kPelvis, "translation", writer.floats(places, 3));
  for (std::size_t j = 0; j < kJointCount; ++j) {
    std::vector<float> turns;
    for (const Pose& key : figure.keys) {
      const glm::dquat& q = key.local[j];
      for (const double v : {q.x, q.y, q.z, q.w}) turns.push_back(static_cast<float>(v));
    }
    channel(j, "rotation", writer.floats(turns, 4));
  }
  writer.root["animations"] =
      json::array({{{"name", "walk"}, {"samplers", samplers}, {"channels", channels}}});
}

}  // namespace

std::vector<std::uint8_t> write_glb(const Figure& figure,
                                    const std::vector<std::uint8_t>& wood_png) {
  Writer writer;
  std::map<int, Bundles> rigid;
  Bundles sash;
  for (const Patch& patch : figure.patches)
    gather(patch, patch.skinned ? sash : rigid[patch.joint]);
  std::map<int, int> meshes;
  for (const auto& [joint, bundles] : rigid) {
    const std::string name = joint < 0 ? "base" : skeleton()[static_cast<std::size_t>(joint)].name;
    meshes[joint] = write_mesh(writer, name, bundles, false);
  }
  const int sash_mesh = write_mesh(writer, "sash", sash, true);
  write_materials(writer, wood_png);
  write_nodes(writer, sash_mesh, meshes);
  write_clip(writer, figure);
  return writer.finish();
}

}  // namespace relit::media
