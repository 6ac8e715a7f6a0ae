// SPDX-License-Identifier: MIT
#include "bake_minimal/gltf_animation.hpp"

#include <limits>

#include "tests/bake_minimal/gltf_loading.hpp"

using namespace relit::test;
using relit::ErrorCode;
using relit::bake::find_clip;
using relit::bake::Interpolation;
using relit::bake::Path;
using relit::bake::Scene;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

GltfBuilder animated(const std::vector<ChannelSpec>& channels) {
  GltfBuilder builder = file_with(triangle());
  builder.add_animation(channels, "move");
  return builder;
}

ChannelSpec slide() { return {0, "translation", {0, 2}, {0, 0, 0, 1, 0, 0}, "LINEAR"}; }

}  // namespace

TEST_CASE("a file without animation has its rest pose only", "[gltf]") {
  CHECK(loaded(file_with(triangle())).clips.empty());
}

TEST_CASE("clips, channels and keys are read as they are", "[gltf]") {
  GltfBuilder builder = animated({slide(), {0, "scale", {0, 5}, {1, 1, 1, 2, 2, 2}, "STEP"}});
  builder.add_animation({{0, "rotation", {1}, {0, 0, 0, 1}, "LINEAR"}});
  const Scene scene = loaded(builder);
  REQUIRE(scene.clips.size() == 2);
  CHECK(scene.clips[0].name == "move");
  CHECK(scene.clips[0].duration_s == 5);
  CHECK(scene.clips[1].name == "1");
  CHECK(scene.clips[1].duration_s == 1);
  REQUIRE(scene.clips[0].channels.size() == 2);
  const auto& channel = scene.clips[0].channels[0];
  CHECK(channel.path == Path::kTranslation);
  CHECK(channel.times == std::vector<float>{0, 2});
  CHECK(channel.values == std::vector<float>{0, 0, 0, 1, 0, 0});
  CHECK(scene.clips[0].channels[1].interpolation == Interpolation::kStep);
}

TEST_CASE("clips are found by name, then by number", "[gltf]") {
  GltfBuilder builder = animated({slide()});
  builder.add_animation({slide()}, "jump");
  builder.add_animation({slide()}, "0");
  builder.add_animation({slide()}, "jump");
  const Scene scene = loaded(builder);
  CHECK(*find_clip(scene, "move") == 0);
  CHECK(*find_clip(scene, "jump") == 1);
  CHECK(*find_clip(scene, "0") == 2);
  CHECK(*find_clip(scene, "1") == 1);
  CHECK(*find_clip(scene, "3") == 3);
  CHECK(has_warning(scene, "same name"));
  for (const char* bad : {"4", "-1", "run", "", "1x", "99999999999999999999"}) {
    const auto clip = find_clip(scene, bad);
    REQUIRE(!clip.has_value());
    CHECK(clip.error().code == ErrorCode::kNotFound);
    CHECK(clip.error().message.find("1 \"jump\"") != std::string::npos);
  }
  CHECK(find_clip(loaded(file_with(triangle())), "0").error().message.find("no animation") !=
        std::string::npos);
}

TEST_CASE("weights animate the morph targets of their node", "[gltf]") {
  PrimitiveSpec spec = triangle();
  spec.morph_positions = {std::vector<float>(9, 1), std::vector<float>(9, 2)};
  GltfBuilder builder;
  const int mesh = builder.add_mesh({spec});
  builder.add_mesh_node(mesh);
  builder.add_mesh_node(mesh);
  builder.add_animation({{1, "weights", {0, 1}, {0, 1, 0.5f, 0}, "LINEAR"}});
  const Scene scene = loaded(builder);
  REQUIRE(scene.clips.size() == 1);
  CHECK(scene.clips[0].channels[0].first_morph_weight == 2);
  relit::bake::ScenePose pose;
  scene.sample(0, 0.5, pose);
  CHECK(pose.morph_weights == std::vector<float>{0, 0, 0.25f, 0.5f});
}

TEST_CASE("values may be normalised integers", "[gltf]") {
  GltfBuilder builder = animated({{0, "rotation", {0, 1}, {0, 0, 0, 1, 0, 0, 1, 0}, "LINEAR"}});
  builder.json["animations"][0]["samplers"][0]["output"] =
      builder.add_accessor(std::vector<std::int16_t>{0, 0, 0, 32767, 0, 0, 32767, 0}, "VEC4", true);
  CHECK(loaded(builder).clips[0].channels[0].values == std::vector<float>{0, 0, 0, 1, 0, 0, 1, 0});
}

TEST_CASE("key times that do not increase are named", "[gltf]") {
  for (const std::vector<float>& times :
       {std::vector<float>{1, 1}, {2, 1}, {0, kNan}, {kNan, 1}, {0, kInf}, {-1, 0}}) {
    ChannelSpec channel = slide();
    channel.times = times;
    check_error(load(animated({channel})), ErrorCode::kCorrupt,
                {"animation 0 \"move\"", "channel 0", "the time of key"});
  }
  ChannelSpec channel = slide();
  channel.times = {0, 100000};
  check_error(load(animated({channel})), ErrorCode::kLimit, {"channel 0", "frames instead"});
}

TEST_CASE("values that are not finite or not rotations are named", "[gltf]") {
  for (const float bad : {kNan, kInf}) {
    ChannelSpec channel = slide();
    channel.values[4] = bad;
    check_error(load(animated({slide(), {0, "scale", {0, 2}, channel.values, "LINEAR"}})),
                ErrorCode::kCorrupt, {"animation 0", "channel 1", "key 1 is not finite"});
  }
  check_error(load(animated({{0, "rotation", {0, 1}, {0, 0, 0, 1, 0, 0, 0, 0}, "LINEAR"}})),
              ErrorCode::kCorrupt, {"channel 0", "rotation of key 1", "quaternion"});
  // The tangents of a spline may be zero, its values not.
  std::vector<float> spline(12);
  check_error(load(animated({{0, "rotation", {0}, spline, "CUBICSPLINE"}})), ErrorCode::kCorrupt,
              {"channel 0", "rotation of key 0"});
  spline[7] = 1;
  CHECK(load(animated({{0, "rotation", {0}, spline, "CUBICSPLINE"}})).has_value());
}

TEST_CASE("keys and values must agree in number", "[gltf]") {
  ChannelSpec channel = slide();
  channel.values.resize(3);
  check_error(load(animated({channel})), ErrorCode::kCorrupt,
              {"channel 0", "1 values for 2 keys", "must be 2"});
  channel = slide();
  channel.interpolation = "CUBICSPLINE";
  check_error(load(animated({channel})), ErrorCode::kCorrupt, {"2 values for 2 keys", "must be 6"});
  channel = slide();
  channel.path = "rotation";
  channel.values.resize(8, 1);
  GltfBuilder builder = animated({channel});
  builder.json["animations"][0]["channels"][0]["target"]["path"] = "scale";
  check_error(load(builder), ErrorCode::kCorrupt, {"channel 0, output", "3 components"});
}

TEST_CASE("empty clips are named", "[gltf]") {
  check_error(load(animated({})), ErrorCode::kCorrupt,
              {"animation 0 \"move\"", "no channels", "remove it"});
  GltfBuilder builder = animated({slide()});
  const int empty =
      builder.append("accessors", {{"componentType", 5126}, {"count", 0}, {"type", "SCALAR"}});
  builder.json["animations"][0]["samplers"][0]["input"] = empty;
  check_error(load(builder), ErrorCode::kCorrupt, {"animation 0", "channel 0", "no keys"});
}

TEST_CASE("references of a clip to what does not exist are named", "[gltf]") {
  const auto with = [](const char* part, const Json& change) {
    GltfBuilder builder = animated({slide()});
    builder.json["animations"][0][part][0].merge_patch(change);
    return load(builder);
  };
  const auto corrupt = ErrorCode::kCorrupt;
  check_error(with("channels", {{"sampler", 5}}), corrupt,
              {"channel 0", "sampler 5 does not exist"});
  check_error(with("channels", {{"target", {{"node", 5}}}}), corrupt,
              {"channel 0", "node 5 does not exist"});
  check_error(with("samplers", {{"input", 99}}), corrupt, {"channel 0", "accessor 99"});
  check_error(with("samplers", {{"output", 99}}), corrupt, {"channel 0", "accessor 99"});
  check_error(with("samplers", {{"interpolation", "BEZIER"}}), corrupt, {"channel 0", "BEZIER"});
  GltfBuilder builder = animated({slide()});
  builder.json["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  check_error(load(builder), corrupt, {"channel 0", "matrix"});
}

TEST_CASE("channels that move no node or nothing known are ignored", "[gltf]") {
  GltfBuilder builder = animated({slide(), slide(), slide()});
  Json& channels = builder.json["animations"][0]["channels"];
  channels[1]["target"] = {{"path", "pointer"}};
  channels[2]["target"]["path"] = "visibility";
  Scene scene = loaded(builder);
  CHECK(scene.clips[0].channels.size() == 1);
  CHECK(has_warning(scene, "1 channels that move no node"));
  CHECK(has_warning(scene, "visibility"));

  // A clip of which nothing is left makes way, and the others stay.
  builder.add_animation({slide()}, "other");
  channels = Json::array({channels[1]});
  builder.json["animations"][0]["channels"] = channels;
  scene = loaded(builder);
  REQUIRE(scene.clips.size() == 1);
  CHECK(scene.clips[0].name == "other");
  CHECK(has_warning(scene, "nothing that can be baked"));
}

TEST_CASE("of two channels for one thing the first counts", "[gltf]") {
  ChannelSpec other = slide();
  other.values[3] = 9;
  const Scene scene = loaded(animated({slide(), other}));
  REQUIRE(scene.clips[0].channels.size() == 1);
  CHECK(scene.clips[0].channels[0].values[3] == 1);
  CHECK(has_warning(scene, "another channel moves the same"));
}

TEST_CASE("weights of a node without morph targets are ignored", "[gltf]") {
  const Scene scene = loaded(animated({slide(), {0, "weights", {0, 1}, {0, 1}, "LINEAR"}}));
  CHECK(scene.clips[0].channels.size() == 1);
  CHECK(has_warning(scene, "no morph targets"));
}
