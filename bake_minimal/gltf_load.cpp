// SPDX-License-Identifier: MIT
#include "bake_minimal/gltf_load.hpp"

#include <exception>
#include <new>

#include "bake_minimal/gltf_animation.hpp"
#include "bake_minimal/gltf_document.hpp"
#include "bake_minimal/gltf_instances.hpp"
#include "bake_minimal/gltf_materials.hpp"
#include "bake_minimal/gltf_nodes.hpp"

namespace relit::bake {
namespace gltf {
namespace {

Result<Scene> build_scene(std::span<const std::uint8_t> bytes, const std::filesystem::path& path) {
  RELIT_ASSIGN(Document document, parse_document(bytes, path));
  Scene scene;
  scene.path = path;
  RELIT_ASSIGN(const NodeMap nodes, read_nodes(document, scene));
  RELIT_TRY(read_skins(document, nodes, scene));
  RELIT_TRY(read_instances(document, nodes, scene));
  RELIT_TRY(read_materials(document, scene));
  RELIT_TRY(read_animations(document, nodes, scene));
  scene.warnings = std::move(document.warnings);
  return scene;
}

}  // namespace

Result<Scene> load_bytes(std::span<const std::uint8_t> bytes, const std::filesystem::path& path) {
  try {
    return build_scene(bytes, path);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kOutOfMemory,
                path.string() + ": there is not enough memory for it; split or simplify the scene");
  } catch (const std::exception& e) {
    // tinygltf and nlohmann-json throw on structures that they did not expect.
    return fail(ErrorCode::kCorrupt,
                path.string() + ": JSON: " + e.what() + "; export the file again");
  }
}

}  // namespace gltf

Result<Scene> load_gltf(const std::filesystem::path& path) {
  RELIT_ASSIGN(const auto bytes, gltf::read_file(path));
  return gltf::load_bytes(bytes, path);
}

}  // namespace relit::bake
