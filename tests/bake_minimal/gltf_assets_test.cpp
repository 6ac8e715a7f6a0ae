// SPDX-License-Identifier: MIT
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "bake_minimal/scene.hpp"
#include "tests/places.hpp"

namespace {

using relit::bake::Primitive;
using relit::bake::Scene;

std::size_t count_vertices(const Scene& scene) {
  std::size_t count = 0;
  for (const Primitive& p : scene.primitives) count += p.positions.size();
  return count;
}

std::size_t count_triangles(const Scene& scene, bool skinned_only) {
  std::size_t count = 0;
  for (const Primitive& p : scene.primitives) {
    if (!skinned_only || p.skin >= 0) count += p.indices.size() / 3;
  }
  return count;
}

void check_against_manifest(const Scene& scene, const nlohmann::json& model) {
  // Two corners coincide in four triangles of Robot.glb; the loader leaves them out with the twelve
  // vertices that nothing else uses.
  const std::size_t slivers = model["file"] == "Robot.glb" ? 4 : 0;
  CHECK(count_vertices(scene) + 3 * slivers == model["vertices"].get<std::size_t>());
  CHECK(count_triangles(scene, false) + slivers == model["triangles"].get<std::size_t>());
  const std::size_t skinned = model["skinned_triangles"];
  CHECK(count_triangles(scene, true) + (skinned > 0 ? slivers : 0) == skinned);
  CHECK(scene.primitives.size() == model["primitives"].get<std::size_t>());
  std::size_t joints = 0, targets = 0;
  std::set<int> mesh_nodes;
  for (const auto& skin : scene.skins) joints = std::max(joints, skin.joints.size());
  for (const Primitive& p : scene.primitives) {
    targets = std::max(targets, p.morph_targets.size());
    mesh_nodes.insert(p.node);
  }
  CHECK(joints == model["joints"].get<std::size_t>());
  CHECK(targets == model["morph_targets"].get<std::size_t>());
  CHECK(mesh_nodes.size() == model["meshes"].get<std::size_t>());
  REQUIRE(scene.clips.size() == model["clips"].size());
  for (std::size_t c = 0; c < scene.clips.size(); ++c) {
    CHECK(scene.clips[c].name == model["clips"][c]["name"].get<std::string>());
    // The manifest rounds to a thousandth of a second.
    CHECK(std::abs(scene.clips[c].duration_s - model["clips"][c]["seconds"].get<double>()) <=
          5.1e-4);
  }
}

}  // namespace

TEST_CASE("every sample model loads with the numbers of its manifest", "[gltf][assets]") {
  const auto manifest_path = relit::test::shared_asset("manifest.json");
  if (!manifest_path) return;
  std::ifstream manifest_file(*manifest_path);
  const auto manifest = nlohmann::json::parse(manifest_file);
  for (const auto& model : manifest["models"]) {
    const std::string file = model["file"];
    INFO(file);
    const auto scene = relit::bake::load_gltf(manifest_path->parent_path() / file);
    INFO((scene ? std::string() : scene.error().message));
    REQUIRE(scene.has_value());
    check_against_manifest(*scene, model);
    for (int clip = -1; clip < static_cast<int>(scene->clips.size()); ++clip) {
      const auto bounds = relit::bake::clip_bounds(*scene, clip, 5);
      REQUIRE(bounds.has_value());
      // All of them are figures or cloths; a pose gone wrong flings vertices far out or to one
      // point.
      const glm::vec3 size = bounds->max - bounds->min;
      UNSCOPED_INFO("clip " << clip << ": " << size.x << " " << size.y << " " << size.z);
      CHECK(std::max({size.x, size.y, size.z}) > 0.1f);
      CHECK(std::max({size.x, size.y, size.z}) < 1000.0f);
    }
  }
}

TEST_CASE("the walking figure stands on the ground, textured", "[gltf][assets]") {
  const auto path = relit::test::shared_asset("CesiumMan.glb");
  if (!path) return;
  const auto scene = relit::bake::load_gltf(*path);
  REQUIRE(scene.has_value());
  REQUIRE(scene->images.size() == 1);
  CHECK(scene->images[0].media_type == "image/jpeg");
  CHECK(scene->images[0].width == 1024);
  CHECK(scene->images[0].height == 1024);
  REQUIRE(scene->primitives.size() == 1);
  const Primitive& figure = scene->primitives[0];
  CHECK(figure.influences_per_vertex == 4);
  CHECK(scene->materials[static_cast<std::size_t>(figure.material)].base_color_texture.image == 0);
  const auto bounds = relit::bake::clip_bounds(*scene, 0, 10);
  REQUIRE(bounds.has_value());
  // 1.5 m tall and upright: +Y is up only if node and skin matrices are applied in the right order.
  CHECK(bounds->min.y == Approx(0).margin(0.05));
  CHECK(bounds->max.y == Approx(1.5).margin(0.1));
}
