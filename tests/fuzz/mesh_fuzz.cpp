// SPDX-License-Identifier: MIT
#include <zstd.h>

#include <cstdint>

#include "container/record_codec.hpp"
#include "decoders/mesh.hpp"
#include "tests/fuzz/fuzz.hpp"

/// Hostile meshes: a byte of flags, sizes of palette and morph weights, the payload of a MESH
/// record. With flag 1 the streams stand uncompressed in the input, so that mutations reach
/// the prediction and meshoptimizer's index decoder behind zstd.
namespace {

using namespace relit;
using namespace relit::fuzz;

void compress(Bytes& bytes) {
  Bytes out(ZSTD_compressBound(bytes.size()));
  out.resize(ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 1));
  bytes = std::move(out);
}

void check_mesh(const decoders::Mesh& mesh, std::size_t palette, std::size_t weights) {
  const std::size_t count = mesh.positions.size();
  require(count > 0 && mesh.lightmap_uv.size() == count);
  for (const std::size_t size : {mesh.normals.size(), mesh.albedo_uv.size(), mesh.colors.size()})
    require(size == 0 || size == count);
  const auto influences = static_cast<std::size_t>(mesh.influences_per_vertex);
  require(influences == 0 || influences == 4 || influences == 8);
  require(mesh.joints.size() == count * influences && mesh.weights.size() == mesh.joints.size());
  require(!mesh.indices.empty() && mesh.indices.size() % 3 == 0);
  for (const std::uint16_t index : mesh.indices) require(index < count);
  for (const std::uint16_t joint : mesh.joints) require(joint < palette);
  require(mesh.morph_targets.empty() ||
          mesh.first_morph_weight + mesh.morph_targets.size() <= weights);
  require_finite(mesh.positions);
  require_finite(mesh.normals);
  require_finite(mesh.lightmap_uv);
  require_finite(mesh.albedo_uv);
  require_finite(mesh.weights);
  for (const auto& target : mesh.morph_targets) {
    require(target.size() == count);
    require_finite(target);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Cursor input({data, size});
  const bool plain = (input.u8() & 1) != 0;
  const std::size_t palette = input.u8(), weights = input.u8();
  auto record = container::parse_mesh(input.rest());
  if (!check(record)) return 0;
  if (plain) {
    for (auto& stream : record->streams) compress(stream.bytes);
    for (auto& target : record->morph_targets) compress(target.bytes);
    compress(record->indices);
  }
  const auto mesh = decoders::decode_mesh(*record, palette, weights);
  if (check(mesh)) check_mesh(*mesh, palette, weights);
  return 0;
}
