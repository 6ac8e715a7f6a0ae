// SPDX-License-Identifier: MIT
#include <cstdint>

#include "bake_minimal/gltf_load.hpp"
#include "tests/fuzz/fuzz.hpp"

/// Hostile .gltf and .glb files. The path is one beside which no file can lie. What is accepted has
/// indices in range and finite positions.
namespace {

using namespace relit;
using namespace relit::fuzz;

/// Models come from users and not from the network: what the baker cannot use may be called an
/// invalid input, and a missing file is one.
bool check_model(const Result<bake::Scene>& scene) {
  if (scene) return true;
  require(!scene.error().message.empty());
  require(scene.error().code != ErrorCode::kCancelled);
  return false;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto scene = bake::gltf::load_bytes({data, size}, "/dev/null/model.gltf");
  if (!check_model(scene)) return 0;
  for (const auto& primitive : scene->primitives) {
    require_finite(primitive.positions);
    for (const auto index : primitive.indices) require(index < primitive.positions.size());
  }
  return 0;
}
