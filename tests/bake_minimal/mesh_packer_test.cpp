// SPDX-License-Identifier: MIT
#include "bake_minimal/mesh_packer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "bake_minimal/triangle_order.hpp"
#include "bake_minimal/vertex_quantizer.hpp"
#include "container/base/limits.hpp"
#include "tests/bake_minimal/scene_fixture.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::bake;
using container::Semantic;

namespace {

PackedScene packed(const Scene& scene, const PackOptions& options = {}) {
  Result<PackedScene> result = pack_scene(scene, options);
  if (!result) FAIL(result.error().message);
  return std::move(*result);
}

const container::VertexStream* find(const container::MeshRecord& record, Semantic semantic) {
  for (const container::VertexStream& s : record.streams) {
    if (s.semantic == semantic) return &s;
  }
  return nullptr;
}

/// Every packed triangle has the corners of the primitive's triangle, in the same rotational order
/// (reversed where `turned`), and every triangle of the primitive is there `times` times.
void check_triangles(const Scene& scene, const PackedScene& packed, bool turned = false,
                     bool all = true) {
  std::vector<std::multiset<std::uint32_t>> seen(scene.primitives.size());
  std::size_t number = 0;
  for (std::size_t m = 0; m < packed.meshes.size(); ++m) {
    const decoders::Mesh& mesh = packed.meshes[m];
    const PackedMeshSource& source = packed.sources[m];
    CHECK(source.first_triangle == number);
    REQUIRE(source.source_vertex.size() == mesh.positions.size());
    const Primitive& p = scene.primitives[source.primitive];
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3, ++number) {
      const PackedTriangle& t = packed.triangles.at(number);
      CHECK(t.mesh == m);
      CHECK(t.primitive == source.primitive);
      CHECK(t.material == p.material);
      seen[t.primitive].insert(t.triangle);
      glm::vec3 got[3], expected[3];
      for (std::size_t c = 0; c < 3; ++c) {
        got[c] = p.positions[source.source_vertex[mesh.indices[i + c]]];
        expected[c] = p.positions[p.indices[3 * std::size_t{t.triangle} + c]];
      }
      if (turned) std::swap(expected[1], expected[2]);
      bool same = false;
      for (std::size_t r = 0; r < 3; ++r) {
        same = same || (got[0] == expected[r] && got[1] == expected[(r + 1) % 3] &&
                        got[2] == expected[(r + 2) % 3]);
      }
      CHECK(same);
    }
  }
  CHECK(number == packed.triangles.size());
  if (!all) return;
  for (std::size_t p = 0; p < seen.size(); ++p) {
    CHECK(seen[p].size() == scene.primitives[p].indices.size() / 3);
    CHECK(std::set<std::uint32_t>(seen[p].begin(), seen[p].end()).size() == seen[p].size());
  }
}

Image flat_image(const std::string& name, int width, int height, std::uint8_t value) {
  Image image;
  image.name = name;
  image.media_type = "image/png";
  image.encoded = {1, 2, 3, value};
  image.width = width;
  image.height = height;
  image.rgba.assign(4 * static_cast<std::size_t>(width * height), value);
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 255;
  return image;
}

}  // namespace

TEST_CASE("packed positions and texture coordinates are off by half a step at most") {
  const Scene scene = test::still_scene(20, 15);
  for (const int bits : {10, 14, 16}) {
    PackOptions options;
    options.position_bits = options.lightmap_uv_bits = options.albedo_uv_bits = bits;
    const PackedScene out = packed(scene, options);
    REQUIRE(out.meshes.size() == 1);
    check_triangles(scene, out);
    const decoders::Mesh& mesh = out.meshes[0];
    const Primitive& p = scene.primitives[0];
    // The sheet is 2 long; floats of magnitude 2 add 2.4e-7.
    const float step = 2.0f / static_cast<float>((1 << bits) - 1);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      const std::uint32_t s = out.sources[0].source_vertex[v];
      for (int c = 0; c < 3; ++c) {
        CHECK(std::abs(mesh.positions[v][c] - p.positions[s][c]) < step / 2 + 5e-7f);
      }
      for (int c = 0; c < 2; ++c) {
        CHECK(std::abs(mesh.lightmap_uv[v][c] - p.lightmap_uv[s][c]) < step / 4 + 2e-7f);
      }
      CHECK(mesh.normals[v] == p.normals[s]);
    }
  }
}

TEST_CASE("packing is deterministic") {
  const Scene scene = test::chain_scene(5);
  const PackedScene a = packed(scene), b = packed(scene);
  REQUIRE(a.mesh_records.size() == b.mesh_records.size());
  for (std::size_t m = 0; m < a.mesh_records.size(); ++m) {
    CHECK(a.mesh_records[m].indices == b.mesh_records[m].indices);
    for (std::size_t s = 0; s < a.mesh_records[m].streams.size(); ++s) {
      CHECK(a.mesh_records[m].streams[s].bytes == b.mesh_records[m].streams[s].bytes);
    }
  }
}

TEST_CASE("unused vertices go, equal ones merge, triangles that name one twice go") {
  Scene scene = test::still_scene(2, 2);
  Primitive& p = scene.primitives[0];
  const std::size_t before = p.positions.size();
  const auto duplicate = [&](std::uint32_t v) {
    p.positions.push_back(p.positions[v]);
    p.normals.push_back(p.normals[v]);
    p.texcoords[0].push_back(p.texcoords[0][v]);
    p.lightmap_uv.push_back(p.lightmap_uv[v]);
    return static_cast<std::uint32_t>(p.positions.size() - 1);
  };
  const std::uint32_t twin = duplicate(0);
  const std::uint32_t other_normal = duplicate(4);
  p.normals[other_normal] = {1, 0, 0};
  const std::uint32_t unused = duplicate(8);
  (void)unused;
  p.indices.insert(p.indices.end(), {0, twin, 5});          // one vertex twice, once merged
  p.indices.insert(p.indices.end(), {3, other_normal, 4});  // no area, but three vertices
  p.indices[0] = twin;
  const PackedScene out = packed(scene);
  REQUIRE(out.meshes.size() == 1);
  CHECK(out.meshes[0].positions.size() == before + 1);
  CHECK(out.triangles.size() == 9);
  CHECK(std::none_of(out.triangles.begin(), out.triangles.end(),
                     [](const PackedTriangle& t) { return t.triangle == 8; }));
  CHECK(std::count_if(out.triangles.begin(), out.triangles.end(),
                      [](const PackedTriangle& t) { return t.triangle == 9; }) == 1);
  check_triangles(scene, out, false, false);
}

TEST_CASE("a primitive of more than 65535 vertices becomes several meshes without cracks") {
  const Scene scene = test::still_scene(299, 299);  // 90000 vertices
  const PackedScene out = packed(scene);
  REQUIRE(out.meshes.size() == 2);
  std::size_t triangles = 0;
  std::vector<glm::vec3> position_of(90000, glm::vec3(9));
  bool apart = false;
  for (std::size_t m = 0; m < out.meshes.size(); ++m) {
    const decoders::Mesh& mesh = out.meshes[m];
    CHECK(mesh.positions.size() <= limits::kVerticesPerMesh);
    triangles += mesh.indices.size() / 3;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      glm::vec3& known = position_of[out.sources[m].source_vertex[v]];
      apart = apart || (known != glm::vec3(9) && known != mesh.positions[v]);
      known = mesh.positions[v];
    }
  }
  CHECK_FALSE(apart);
  CHECK(triangles == scene.primitives[0].indices.size() / 3);
  std::vector<int> seen(triangles, 0);
  for (const PackedTriangle& t : out.triangles) ++seen[t.triangle];
  CHECK(std::all_of(seen.begin(), seen.end(), [](int n) { return n == 1; }));
}

TEST_CASE("parts never exceed either limit and keep every triangle once") {
  const Primitive p = test::sheet(10, 10);
  for (const std::size_t max_vertices : {3u, 7u, 50u}) {
    std::multiset<std::uint32_t> seen;
    for (const MeshPart& part : order_triangles(p.indices, p.positions.size(), max_vertices, 20)) {
      CHECK(part.vertices.size() <= max_vertices);
      CHECK(part.triangles.size() <= 20);
      for (std::size_t t = 0; t < part.triangles.size(); ++t) {
        seen.insert(part.triangles[t]);
        for (std::size_t c = 0; c < 3; ++c) {
          CHECK(part.vertices[part.indices[3 * t + c]] ==
                p.indices[3 * std::size_t{part.triangles[t]} + c]);
        }
      }
    }
    CHECK(seen.size() == 200);
    CHECK(std::set<std::uint32_t>(seen.begin(), seen.end()).size() == 200);
  }
}

TEST_CASE("primitives of one node share a grid, so that common borders stay together") {
  Scene scene = test::still_scene();
  scene.primitives.push_back(scene.primitives[0]);
  for (glm::vec3& v : scene.primitives[1].positions) {
    v = v * 0.37f + glm::vec3(1.37f, 0.1f, 0);  // another size, touching at some points
  }
  scene.primitives[1].positions[3] = scene.primitives[0].positions[10];
  const PackedScene out = packed(scene);
  REQUIRE(out.meshes.size() == 2);
  const auto position = [&](std::size_t m, std::uint32_t source) {
    const auto& sources = out.sources[m].source_vertex;
    const auto at = std::find(sources.begin(), sources.end(), source) - sources.begin();
    return out.meshes[m].positions[static_cast<std::size_t>(at)];
  };
  CHECK(position(1, 3) == position(0, 10));
}

TEST_CASE("a flat or point-like primitive has defined steps") {
  Scene scene = test::still_scene();
  for (glm::vec3& v : scene.primitives[0].positions) v = glm::vec3(3, 4, 5);
  const PackedScene out = packed(scene);
  REQUIRE(out.meshes.size() == 1);
  for (const glm::vec3& v : out.meshes[0].positions) CHECK(v == glm::vec3(3, 4, 5));
}

TEST_CASE("weights round to a sum of 255 and each is off by less than one") {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (int round = 0; round < 2000; ++round) {
    std::vector<Influence> raw(8);
    float sum = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      raw[i] = {static_cast<std::uint16_t>(i), round % 3 == 0 && i > 2 ? 0 : uniform(random)};
      sum += raw[i].weight;
    }
    float total = 0;
    float last = 255;
    for (const Influence& q : quantize_weights(raw)) {
      total += q.weight;
      CHECK(q.weight > 0);
      CHECK(q.weight <= last);
      last = q.weight;
      CHECK(std::abs(q.weight - 255 * raw[q.joint].weight / sum) < 1.001f);
    }
    CHECK(total == 255);
  }
}

TEST_CASE(
    "weights: repeated joints add up, order does not matter, none at all is the first joint") {
  const std::vector<Influence> repeated{{3, 0.25f}, {5, 0.5f}, {3, 0.25f}};
  const auto a = quantize_weights(repeated);
  REQUIRE(a.size() == 2);
  CHECK(a[0].joint == 3);  // 127.5 each: the tie goes to the lower joint
  CHECK(a[0].weight == 128);
  const std::vector<Influence> reversed{{5, 0.5f}, {3, 0.5f}};
  CHECK(quantize_weights(reversed)[0].joint == 3);
  const std::vector<Influence> none{{4, 0}, {2, 0}};
  REQUIRE(quantize_weights(none).size() == 1);
  CHECK(quantize_weights(none)[0].joint == 4);
  CHECK(quantize_weights(none)[0].weight == 255);
}

TEST_CASE("octahedral normals are off by less than a degree") {
  std::mt19937 random(2);
  std::normal_distribution<float> normal;
  for (int round = 0; round < 2000; ++round) {
    const glm::vec3 n = glm::normalize(glm::vec3(normal(random), normal(random), normal(random)));
    const auto o = encode_octahedral(n);
    float x = static_cast<float>(o[0]) / 127, y = static_cast<float>(o[1]) / 127;
    glm::vec3 back(x, y, 1 - std::abs(x) - std::abs(y));
    if (back.z < 0) {
      back.x = (1 - std::abs(y)) * (x < 0 ? -1.0f : 1.0f);
      back.y = (1 - std::abs(x)) * (y < 0 ? -1.0f : 1.0f);
    }
    // Half a step h = 1/254 on both axes moves a point of the octahedron by (h, h, -2h) at most,
    // √6·h, and the octahedron is 1/√3 away at least: √18/254 = 0.0167 radians.
    CHECK(glm::dot(glm::normalize(back), n) > std::cos(0.0168f));
  }
}

TEST_CASE("skinned vertices keep up to eight influences, and streams only as many as needed") {
  const PackedScene four = packed(test::chain_scene(4));
  CHECK(four.meshes[0].influences_per_vertex == 4);
  const PackedScene eight = packed(test::chain_scene(8, 8));
  CHECK(eight.meshes[0].influences_per_vertex == 8);
  CHECK(eight.skeleton.palette.size() == 8);
  CHECK(eight.skeleton.nodes.size() == 9);
  const PackedScene few = packed(test::chain_scene(3, 8));  // the other five have no weight
  CHECK(few.meshes[0].influences_per_vertex == 4);
}

TEST_CASE("the skeleton holds what poses vertices and its ancestors, parents first") {
  Scene scene = test::chain_scene(4);
  scene.nodes.emplace_back();  // nobody's
  scene.nodes.back().parent = 2;
  const PackedScene out = packed(scene);
  CHECK(out.node_source == std::vector<std::uint32_t>{0, 1, 2, 3, 4});
  for (std::size_t n = 0; n < out.skeleton.nodes.size(); ++n) {
    CHECK(out.skeleton.nodes[n].parent == static_cast<int>(n) - 1);
  }
  CHECK(out.skeleton.nodes[0].local ==
        container::Affine{1.5f, 0, 0, 0.5f, 0, 1.5f, 0, -0.25f, 0, 0, 1.5f, 2});
}

TEST_CASE("skins that agree share palette entries") {
  Scene scene = test::chain_scene(4);
  scene.skins.push_back(scene.skins[0]);
  scene.skins[1].inverse_bind[2][3].y = 1;
  scene.primitives.push_back(scene.primitives[0]);
  scene.primitives[1].skin = 1;
  CHECK(packed(scene).skeleton.palette.size() == 5);
}

TEST_CASE("a rigid primitive that moves follows its node, a still one is in model space") {
  Scene scene = test::still_scene();
  scene.nodes[0].local.translation = {3, 0, 0};
  scene.nodes[0].local.scale = {1, 2, 1};
  scene.nodes.emplace_back();
  scene.nodes[1].parent = 0;
  scene.primitives.push_back(scene.primitives[0]);
  scene.primitives[1].node = 1;
  Clip clip;
  clip.duration_s = 1;
  clip.channels.push_back(test::channel(Path::kTranslation, 1, {0, 1}, {0, 0, 0, 1, 0, 0}));
  scene.clips.push_back(clip);
  const PackedScene out = packed(scene);
  REQUIRE(out.meshes.size() == 2);
  CHECK(out.meshes[0].influences_per_vertex == 0);
  CHECK(out.meshes[1].influences_per_vertex == 4);
  CHECK(out.skeleton.nodes.size() == 2);
  REQUIRE(out.skeleton.palette.size() == 1);
  CHECK(out.skeleton.palette[0].node == 1);
  const Primitive& p = scene.primitives[0];
  for (std::size_t v = 0; v < out.meshes[0].positions.size(); ++v) {
    const std::uint32_t s = out.sources[0].source_vertex[v];
    const glm::vec3 expected = p.positions[s] * glm::vec3(1, 2, 1) + glm::vec3(3, 0, 0);
    // Half of 4 / 4095, in three dimensions.
    CHECK(glm::length(out.meshes[0].positions[v] - expected) < 8.5e-4f);
    const glm::vec3 n = glm::normalize(p.normals[s] * glm::vec3(2, 1, 2));
    CHECK(glm::length(out.meshes[0].normals[v] - n) < 1e-6f);
  }
}

TEST_CASE("a node that its clip's first frame mirrors has its triangles turned") {
  Scene scene = test::still_scene();
  Clip clip;
  clip.duration_s = 1;
  clip.channels.push_back(test::channel(Path::kScale, 0, {0, 1}, {-1, 1, 1, -2, 1, 1}));
  scene.clips.push_back(clip);
  PackOptions options;
  options.clip = 0;
  check_triangles(scene, packed(scene, options), true);
  check_triangles(scene, packed(scene), false);
  // Mirrored at rest as well: the scene comes wound for that.
  scene.nodes[0].local.scale = {-1, 1, 1};
  check_triangles(scene, packed(scene, options), false);
}

TEST_CASE("the two sides of a double-sided surface know each other") {
  Scene scene = test::still_scene(4, 3);
  Primitive& p = scene.primitives[0];
  const auto count = static_cast<std::uint32_t>(p.positions.size());
  const std::size_t indices = p.indices.size();
  for (std::uint32_t v = 0; v < count; ++v) {
    p.positions.push_back(p.positions[v]);
    p.normals.push_back(-p.normals[v]);
    p.texcoords[0].push_back(p.texcoords[0][v]);
    p.lightmap_uv[v].x *= 0.5f;
    p.lightmap_uv.push_back(p.lightmap_uv[v] + glm::vec2(0.5f, 0));
  }
  const auto triangles = static_cast<std::uint32_t>(indices / 3);
  for (std::size_t i = 0; i < indices; i += 3) {
    const std::uint32_t a = p.indices[i], b = p.indices[i + 1], c = p.indices[i + 2];
    p.indices.insert(p.indices.end(), {a + count, c + count, b + count});
  }
  for (std::uint32_t t = 0; t < 2 * triangles; ++t) {
    p.other_side.push_back((t + triangles) % (2 * triangles));
  }
  const PackedScene out = packed(scene);
  check_triangles(scene, out);
  for (std::size_t i = 0; i < out.triangles.size(); ++i) {
    const PackedTriangle& t = out.triangles[i];
    REQUIRE(t.other_side < out.triangles.size());
    CHECK(out.triangles[t.other_side].triangle == p.other_side[t.triangle]);
    CHECK(out.triangles[t.other_side].other_side == i);
  }
}

TEST_CASE("morph targets keep half a step and share it with the positions") {
  Scene scene = test::still_scene();
  Primitive& p = scene.primitives[0];
  scene.morph_weight_count = 2;
  scene.default_morph_weights = {0, 0};
  p.morph_targets.resize(2);
  for (std::size_t v = 0; v < p.positions.size(); ++v) {
    const auto f = static_cast<float>(v);
    p.morph_targets[0].positions.emplace_back(0.01f * std::sin(f), 0.3f, -0.2f * std::cos(f));
    p.morph_targets[1].positions.emplace_back(20 * std::sin(f), 0, 0);
    p.morph_targets[1].normals.emplace_back(0, std::sin(f), 0);
  }
  const PackedScene out = packed(scene);
  const decoders::Mesh& mesh = out.meshes[0];
  REQUIRE(mesh.morph_targets.size() == 2);
  REQUIRE(mesh.morph_normals.size() == 2);
  // Steps: 2/4095 of the positions, and 20/32767 where 15 bits are too few for that.
  const float half[2] = {1.0f / 4095, 10.0f / 32767};
  for (std::size_t k = 0; k < 2; ++k) {
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      const std::uint32_t s = out.sources[0].source_vertex[v];
      for (int c = 0; c < 3; ++c) {
        CHECK(std::abs(mesh.morph_targets[k][v][c] - p.morph_targets[k].positions[s][c]) <
              half[k] * 1.001f);
      }
    }
  }
  CHECK(mesh.morph_normals[0][5] == glm::vec3(0));
  CHECK(mesh.morph_normals[1][5] == p.morph_targets[1].normals[out.sources[0].source_vertex[5]]);
}

TEST_CASE("streams that say nothing are left out") {
  Scene scene = test::still_scene();
  scene.images.push_back(flat_image("a", 2, 2, 9));
  Primitive& p = scene.primitives[0];
  p.colors.assign(p.positions.size(), glm::vec4(1));
  {
    const PackedScene out = packed(scene);
    CHECK(find(out.mesh_records[0], Semantic::kColor) == nullptr);
    CHECK(find(out.mesh_records[0], Semantic::kAlbedoUv) == nullptr);
    CHECK(find(out.mesh_records[0], Semantic::kNormal) == nullptr);
    CHECK(find(out.mesh_records[0], Semantic::kJoints) == nullptr);
    CHECK(out.materials.images.empty());
  }
  scene.materials[0].base_color_texture.image = 0;
  CHECK(find(packed(scene).mesh_records[0], Semantic::kAlbedoUv) == nullptr);
  scene.materials[0].base_color_texture.uv_transform[2] = glm::vec3(0.5f, -3, 1);
  p.colors[4] = {0.5f, 1, 1, 0.25f};
  PackOptions options;
  options.normals = true;
  const PackedScene out = packed(scene, options);
  REQUIRE(find(out.mesh_records[0], Semantic::kAlbedoUv) != nullptr);
  CHECK(find(out.mesh_records[0], Semantic::kNormal) != nullptr);
  REQUIRE(out.meshes[0].colors.size() == out.meshes[0].positions.size());
  for (std::size_t v = 0; v < out.meshes[0].positions.size(); ++v) {
    const std::uint32_t s = out.sources[0].source_vertex[v];
    const glm::vec2 expected = p.texcoords[0][s] + glm::vec2(0.5f, -3);
    // A picture of two texels needs the fewest bits: half of 1/1023 on both axes.
    CHECK(glm::length(out.meshes[0].albedo_uv[v] - expected) < 7.0e-4f);
    if (s == 4) CHECK(out.meshes[0].colors[v] == glm::u8vec4(128, 255, 255, 64));
  }
}

TEST_CASE("materials: metallic goes into the factor, unused ones and their images go") {
  Scene scene = test::still_scene();
  scene.images = {flat_image("unused", 1, 1, 1), flat_image("used", 2, 2, 200)};
  scene.materials.resize(2);
  scene.materials[0].base_color_texture.image = 0;
  Material& m = scene.materials[1];
  m.name = "half metal";
  m.base_color = {0.5f, 0.25f, 1, 0.75f};
  m.metallic = 0.5f;
  m.alpha_mode = container::AlphaMode::kMask;
  m.alpha_cutoff = 0.25f;
  m.base_color_texture.image = 1;
  m.base_color_texture.wrap_u = container::Wrap::kMirror;
  m.base_color_texture.linear_filter = false;
  scene.primitives[0].material = 1;
  const PackedScene out = packed(scene);
  REQUIRE(out.materials.materials.size() == 1);
  const container::MaterialRecord& r = out.materials.materials[0];
  CHECK(r.name == "half metal");
  CHECK(r.base_color == std::array<float, 4>{0.25f, 0.125f, 0.5f, 0.75f});
  CHECK(r.alpha_mode == container::AlphaMode::kMask);
  CHECK(r.alpha_cutoff == 0.25f);
  CHECK(r.wrap_u == container::Wrap::kMirror);
  CHECK_FALSE(r.linear_filter);
  CHECK(r.image_id == 0);
  REQUIRE(out.materials.images.size() == 1);
  CHECK(out.materials.images[0].bytes == scene.images[1].encoded);  // byte for byte
  CHECK(out.materials.packed_index == std::vector<int>{-1, 0});
  CHECK(out.triangles[0].material == 1);
  CHECK(out.mesh_records[0].material_id == 0);
}

TEST_CASE("materials: a metallic texture is multiplied into the picture in linear light") {
  Scene scene = test::still_scene();
  scene.images = {flat_image("base", 4, 4, 188), flat_image("metal", 4, 4, 0)};
  for (std::size_t i = 0; i < 8; ++i) scene.images[1].rgba[4 * i + 2] = 255;  // the upper half
  Material& m = scene.materials[0];
  m.metallic = 0.5f;
  m.base_color_texture.image = 0;
  m.metallic_texture.image = 1;
  const PackedScene out = packed(scene);
  REQUIRE(out.materials.images.size() == 1);
  CHECK(out.materials.images[0].media_type == "image/png");
  const std::vector<std::uint8_t> magic{0x89, 'P', 'N', 'G'};
  REQUIRE(out.materials.images[0].bytes.size() > 8);
  CHECK(std::equal(magic.begin(), magic.end(), out.materials.images[0].bytes.begin()));
  const Image& texels = out.materials.texels[0];
  // 188 is 0.5029 in linear light; half of that is 0.2514 or 137.2 of sRGB.
  CHECK(int{texels.rgba[0]} == 137);
  CHECK(int{texels.rgba[4 * 15]} == 188);
  CHECK(out.materials.materials[0].base_color == std::array<float, 4>{1, 1, 1, 1});
  CHECK(out.warnings.empty());
}

TEST_CASE("materials: without a base colour picture the metallic one makes it") {
  Scene scene = test::still_scene();
  scene.images = {flat_image("metal", 2, 1, 0)};
  scene.images[0].rgba[2] = 255;
  Material& m = scene.materials[0];
  m.metallic = 1;
  m.metallic_texture.image = 0;
  const PackedScene out = packed(scene);
  REQUIRE(out.materials.texels.size() == 1);
  CHECK(int{out.materials.texels[0].rgba[0]} == 0);
  CHECK(int{out.materials.texels[0].rgba[4]} == 255);
}

TEST_CASE("materials: a constant metallic texture needs no new picture") {
  Scene scene = test::still_scene();
  scene.images = {flat_image("base", 2, 2, 188), flat_image("metal", 2, 2, 51)};
  Material& m = scene.materials[0];
  m.metallic = 1;
  m.base_color_texture.image = 0;
  m.metallic_texture.image = 1;
  m.metallic_texture.texcoord = 3;
  const PackedScene out = packed(scene);
  REQUIRE(out.materials.images.size() == 1);
  CHECK(out.materials.images[0].bytes == scene.images[0].encoded);
  CHECK(out.materials.materials[0].base_color[0] == Approx(0.8));
  CHECK(out.warnings.empty());
}

TEST_CASE("materials: metallic textures on other coordinates give their mean and a warning") {
  Scene scene = test::still_scene();
  scene.images = {flat_image("base", 2, 2, 188), flat_image("metal", 2, 1, 0)};
  scene.images[1].rgba[2] = 255;
  Material& m = scene.materials[0];
  m.metallic = 1;
  m.base_color_texture.image = 0;
  m.metallic_texture.image = 1;
  m.metallic_texture.uv_transform[0].x = 2;
  const PackedScene out = packed(scene);
  CHECK(out.materials.materials[0].base_color[0] == Approx(0.5));
  CHECK(out.warnings.size() == 1);
}

TEST_CASE("packing refuses what is not finite, out of range or without light-map UVs") {
  const auto code = [](const Scene& scene) {
    const auto result = pack_scene(scene, {});
    REQUIRE_FALSE(result);
    CHECK_FALSE(result.error().message.empty());
    return result.error().code;
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Scene scene = test::still_scene();
  scene.primitives[0].positions[3].y = nan;
  CHECK(code(scene) == ErrorCode::kInvalid);
  scene = test::still_scene();
  scene.primitives[0].lightmap_uv.clear();
  CHECK(code(scene) == ErrorCode::kInvalid);
  scene = test::still_scene();
  scene.primitives[0].lightmap_uv[0].x = 1.5f;
  CHECK(code(scene) == ErrorCode::kInvalid);
  scene = test::still_scene();
  scene.primitives[0].indices[7] = 1000;
  CHECK(code(scene) == ErrorCode::kInvalid);
  scene = test::still_scene();
  scene.primitives[0].material = 4;
  CHECK(code(scene) == ErrorCode::kInvalid);
  scene = test::chain_scene(3);
  scene.primitives[0].joints[5] = 3;
  CHECK(code(scene) == ErrorCode::kInvalid);
  scene = test::chain_scene(3);
  scene.primitives[0].weights[5] = nan;
  CHECK(code(scene) == ErrorCode::kInvalid);
}

TEST_CASE("drop_rig leaves what a vertex track needs") {
  PackedScene out = packed(test::chain_scene(4));
  drop_rig(out);
  CHECK(out.skeleton.palette.empty());
  CHECK(find(out.mesh_records[0], Semantic::kJoints) == nullptr);
  const auto mesh = decoders::decode_mesh(out.mesh_records[0], 0, 0);
  REQUIRE(mesh);
  CHECK(mesh->positions == out.meshes[0].positions);
}
