// SPDX-License-Identifier: MIT
#include "decoders/mesh.hpp"

#include <cmath>
#include <limits>
#include <random>

#include "container/base/limits.hpp"
#include "decoders/inflate.hpp"
#include "tests/decoders/mesh_fixture.hpp"
#include "tests/test.hpp"

using namespace relit;
using container::MeshRecord;
using container::Semantic;
using decoders::decode_mesh;
using decoders::Mesh;

namespace {

ErrorCode failure(const MeshRecord& record, std::size_t palette = 2, std::size_t weights = 4) {
  const Result<Mesh> mesh = decode_mesh(record, palette, weights);
  REQUIRE_FALSE(mesh.has_value());
  CHECK_FALSE(mesh.error().message.empty());
  return mesh.error().code;
}

container::VertexStream& find(MeshRecord& record, Semantic semantic) {
  for (container::VertexStream& s : record.streams) {
    if (s.semantic == semantic) return s;
  }
  throw std::runtime_error("no such stream");
}

MeshRecord morphed_quad() {
  MeshRecord record = test::quad();
  record.first_morph_weight = 1;
  std::vector<std::uint16_t> deltas(16, 0);
  deltas[0] = 0xffff;  // -1
  deltas[5] = 0x7fff;
  record.morph_targets.push_back(
      {{0.5f, 2.0f, 1.0f}, test::vertex_bytes(test::bytes_of(deltas), 8)});
  return record;
}

/// The quad whose vertex 3 shares all but its UVs with an earlier vertex; `words` are those of the
/// twin stream. What is stored for three points is written out by hand.
MeshRecord quad_of_three_points(const std::vector<std::uint8_t>& words) {
  MeshRecord record = test::quad(0);
  // x of the points 0, 2, 2 and y of 0, 0, 4: 2 is 2 from its near vertex 0; 4 from its near vertex
  // 1. Zeros in z, in the padding, and in the planes of high bytes.
  std::vector<std::uint8_t> positions(24, 0);
  positions[1] = 4;
  positions[5] = 8;
  find(record, Semantic::kPosition).bytes = test::zstd(positions);
  record.streams.push_back({Semantic::kTwin, 2, {}, {1, 1, 1}, test::zstd(words)});
  return record;
}

/// What decode_mesh promises of any success.
void check_invariants(const Mesh& mesh, std::size_t palette) {
  for (const std::uint16_t i : mesh.indices) CHECK(i < mesh.positions.size());
  for (const std::uint16_t j : mesh.joints) CHECK(j < palette);
  for (const glm::vec3& p : mesh.positions) {
    CHECK(std::abs(p.x) <= decoders::kMaxCoordinate);
    CHECK(std::abs(p.y) <= decoders::kMaxCoordinate);
    CHECK(std::abs(p.z) <= decoders::kMaxCoordinate);
  }
  const auto influences = static_cast<std::size_t>(mesh.influences_per_vertex);
  CHECK(mesh.joints.size() == influences * mesh.positions.size());
  CHECK(mesh.weights.size() == influences * mesh.positions.size());
}

}  // namespace

TEST_CASE("decode_mesh dequantises every stream") {
  MeshRecord record = test::quad();
  const std::vector<std::uint16_t> uv{0, 0, 8, 0, 8, 16, 0, 16};
  record.streams.push_back(test::stream(Semantic::kAlbedoUv, 4, uv, {-1, 2, 0}, {0.25f, 0.5f, 0}));
  const std::vector<std::uint8_t> colors{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 255};
  record.streams.push_back(test::stream(Semantic::kColor, 4, colors));
  const Result<Mesh> mesh = decode_mesh(record, 1, 0);
  REQUIRE(mesh);
  CHECK(mesh->id == 7);
  CHECK(mesh->name == "quad");
  CHECK(mesh->positions == std::vector<glm::vec3>{{1, 2, 3}, {2, 2, 3}, {2, 3, 3}, {1, 3, 15}});
  CHECK(mesh->lightmap_uv == std::vector<glm::vec2>{{0, 0}, {1, 0}, {1, 1}, {0, 1}});
  CHECK(mesh->albedo_uv == std::vector<glm::vec2>{{-1, 2}, {1, 2}, {1, 10}, {-1, 10}});
  CHECK(mesh->colors[3] == glm::u8vec4(13, 14, 15, 255));
  CHECK(mesh->influences_per_vertex == 4);
  CHECK(mesh->weights[0] == 1.0f);
  CHECK(mesh->weights[1] == 0.0f);
  REQUIRE(mesh->indices.size() == 6);
  check_invariants(*mesh, 1);
}

TEST_CASE("decode_mesh leaves absent attributes empty") {
  const Result<Mesh> mesh = decode_mesh(test::quad(0), 0, 0);
  REQUIRE(mesh);
  CHECK(mesh->influences_per_vertex == 0);
  CHECK(mesh->joints.empty());
  CHECK(mesh->albedo_uv.empty());
  CHECK(mesh->colors.empty());
  CHECK(mesh->normals.empty());
  CHECK(mesh->morph_targets.empty());
}

TEST_CASE("decode_mesh interleaves two influence streams") {
  const Result<Mesh> mesh = decode_mesh(test::quad(2), 2, 0);
  REQUIRE(mesh);
  REQUIRE(mesh->influences_per_vertex == 8);
  for (std::size_t v = 0; v < 4; ++v) {
    CHECK(mesh->joints[8 * v + 1] == 0);
    CHECK(mesh->joints[8 * v + 5] == 1);
    CHECK(mesh->weights[8 * v + 1] == 55 / 255.0f);
    CHECK(mesh->weights[8 * v + 5] == 200 / 255.0f);
  }
}

TEST_CASE("decode_mesh reads signed morph offsets") {
  const Result<Mesh> mesh = decode_mesh(morphed_quad(), 1, 2);
  REQUIRE(mesh);
  CHECK(mesh->first_morph_weight == 1);
  REQUIRE(mesh->morph_targets.size() == 1);
  CHECK(mesh->morph_targets[0][0] == glm::vec3(-0.5f, 0, 0));
  CHECK(mesh->morph_targets[0][1] == glm::vec3(0, 65534, 0));
}

TEST_CASE("decode_mesh unfolds octahedral normals") {
  MeshRecord record = test::quad();
  const auto octahedron = [](int x, int y) {
    return std::vector<std::uint8_t>{static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y), 0,
                                     0};
  };
  std::vector<std::uint8_t> bytes;
  // +Z is the middle, -Z every corner, -128 counts as -127; (64, -63) lies on the plane z = 0.
  for (const auto& n :
       {octahedron(0, 0), octahedron(127, 127), octahedron(-128, 0), octahedron(64, -63)}) {
    bytes.insert(bytes.end(), n.begin(), n.end());
  }
  record.streams.push_back(test::stream(Semantic::kNormal, 4, bytes));
  const Result<Mesh> mesh = decode_mesh(record, 1, 0);
  REQUIRE(mesh);
  const std::vector<glm::vec3> expected{
      {0, 0, 1}, {0, 0, -1}, {-1, 0, 0}, glm::normalize(glm::vec3(64, -63, 0))};
  // Float rounding of a few operations on values of at most 1.
  for (std::size_t v = 0; v < 4; ++v) CHECK(glm::length(mesh->normals[v] - expected[v]) < 1e-6f);
}

TEST_CASE("decode_mesh gives twins everything but texture coordinates") {
  // 3 is 2 more than the last twin (0 at first): folded 4, and 1 for having one.
  const Result<Mesh> mesh = decode_mesh(quad_of_three_points({0, 0, 0, 5, 0, 0, 0, 0}), 0, 0);
  REQUIRE(mesh);
  CHECK(mesh->positions == std::vector<glm::vec3>{{1, 2, 3}, {2, 2, 3}, {2, 3, 3}, {2, 3, 3}});
  CHECK(mesh->lightmap_uv == std::vector<glm::vec2>{{0, 0}, {1, 0}, {1, 1}, {0, 1}});
}

TEST_CASE("decode_mesh predicts points across the twins that stand for them") {
  // Vertex 2 is vertex 0 once more, so the second triangle is (0, 0, 3) of points: 3 has 0 near it,
  // twice, and nothing across. UVs do not know of twins.
  MeshRecord record = quad_of_three_points({0, 0, 1, 0, 0, 0, 0, 0});
  const Result<Mesh> mesh = decode_mesh(record, 0, 0);
  REQUIRE(mesh);
  CHECK(mesh->positions == std::vector<glm::vec3>{{1, 2, 3}, {2, 2, 3}, {1, 2, 3}, {1, 3, 3}});
  CHECK(mesh->lightmap_uv == std::vector<glm::vec2>{{0, 0}, {1, 0}, {1, 1}, {0, 1}});
}

TEST_CASE("decode_mesh rejects twins that are not before their vertex") {
  for (const std::uint8_t word : {std::uint8_t{7}, std::uint8_t{9}, std::uint8_t{2}}) {
    CHECK(failure(quad_of_three_points({0, 0, 0, word, 0, 0, 0, 0}), 0, 0) == ErrorCode::kCorrupt);
  }
  CHECK(failure(quad_of_three_points({1, 0, 0, 0, 0, 0, 0, 0}), 0, 0) == ErrorCode::kCorrupt);
  // Too few words, and a stream of four points where three are stored.
  CHECK(failure(quad_of_three_points({0, 0, 0, 5}), 0, 0) == ErrorCode::kCorrupt);
  MeshRecord record = quad_of_three_points({0, 0, 0, 0, 0, 0, 0, 0});
  CHECK(failure(record, 0, 0) == ErrorCode::kCorrupt);
  record = quad_of_three_points({0, 0, 0, 5, 0, 0, 0, 0});
  record.streams.push_back(record.streams.back());
  CHECK(failure(record, 0, 0) == ErrorCode::kCorrupt);
}

TEST_CASE("decode_mesh rejects indices and joints out of range") {
  MeshRecord record = test::quad();
  const std::vector<std::uint32_t> indices{0, 1, 2, 0, 2, 4};
  record.indices = test::index_bytes(indices, 5);
  CHECK(failure(record) == ErrorCode::kCorrupt);
  // 65536 would wrap to 0 in 16 bits.
  const std::vector<std::uint32_t> wide{0, 1, 2, 0, 2, 65536};
  record.indices = test::index_bytes(wide, 65537);
  CHECK(failure(record) == ErrorCode::kCorrupt);
  CHECK(failure(test::quad(), 0) == ErrorCode::kCorrupt);
  CHECK(failure(test::quad(2), 1) == ErrorCode::kCorrupt);
}

TEST_CASE("decode_mesh rejects weights that do not sum to 255") {
  for (const std::uint8_t first : {std::uint8_t{254}, std::uint8_t{0}}) {
    MeshRecord record = test::quad();
    std::vector<std::uint8_t> weights{255, 0, 0, 0, 255, 0, 0, 0, first, 0, 0, 0, 255, 0, 0, 0};
    find(record, Semantic::kWeights) = test::stream(Semantic::kWeights, 4, weights);
    CHECK(failure(record) == ErrorCode::kCorrupt);
  }
}

TEST_CASE("decode_mesh rejects missing, repeated and misshapen streams") {
  for (const Semantic missing :
       {Semantic::kPosition, Semantic::kLightMapUv, Semantic::kJoints, Semantic::kWeights}) {
    MeshRecord record = test::quad();
    std::erase_if(record.streams, [&](const auto& s) { return s.semantic == missing; });
    CHECK(failure(record) == ErrorCode::kCorrupt);
  }
  MeshRecord repeated = test::quad();
  repeated.streams.push_back(repeated.streams[0]);
  CHECK(failure(repeated) == ErrorCode::kCorrupt);
  MeshRecord many = test::quad(2);
  many.streams.push_back(find(many, Semantic::kJoints));
  CHECK(failure(many) == ErrorCode::kCorrupt);
  MeshRecord stride = test::quad();
  stride.streams[0].stride = 12;
  CHECK(failure(stride) == ErrorCode::kCorrupt);
  MeshRecord unknown = test::quad();
  unknown.streams[0].semantic = static_cast<Semantic>(8);
  CHECK(failure(unknown) == ErrorCode::kUnsupported);
}

TEST_CASE("decode_mesh checks counts before it allocates") {
  MeshRecord record = test::quad();
  record.vertex_count = 0;
  CHECK(failure(record) == ErrorCode::kLimit);
  record.vertex_count = limits::kVerticesPerMesh + 1;
  CHECK(failure(record) == ErrorCode::kLimit);
  record = test::quad();
  record.index_count = limits::kIndicesPerMesh + 3;
  CHECK(failure(record) == ErrorCode::kLimit);
  for (const std::uint32_t count : {0u, 5u}) {
    record.index_count = count;
    CHECK(failure(record) == ErrorCode::kCorrupt);
  }
  record = test::quad();
  record.morph_targets.resize(limits::kMorphTargets + 1);
  CHECK(failure(record) == ErrorCode::kLimit);
}

TEST_CASE("decode_mesh rejects morph weights that the skeleton lacks") {
  MeshRecord record = morphed_quad();
  CHECK(failure(record, 1, 1) == ErrorCode::kCorrupt);
  record.first_morph_weight = std::numeric_limits<std::uint32_t>::max();
  CHECK(failure(record, 1, 2) == ErrorCode::kCorrupt);
}

TEST_CASE("decode_mesh rejects ranges that are not finite or out of bounds") {
  const float bad[] = {std::numeric_limits<float>::quiet_NaN(),
                       std::numeric_limits<float>::infinity(), 1e30f};
  for (const float value : bad) {
    for (const Semantic semantic : {Semantic::kPosition, Semantic::kLightMapUv}) {
      MeshRecord record = test::quad();
      find(record, semantic).scale[1] = value;
      CHECK(failure(record) == ErrorCode::kCorrupt);
      record = test::quad();
      find(record, semantic).offset[0] = value;
      CHECK(failure(record) == ErrorCode::kCorrupt);
    }
    MeshRecord record = morphed_quad();
    record.morph_targets[0].scale[2] = value;
    CHECK(failure(record) == ErrorCode::kCorrupt);
  }
}

TEST_CASE("decode_mesh clamps light-map coordinates to the unit square") {
  MeshRecord record = test::quad();
  find(record, Semantic::kLightMapUv).offset = {-0.5f, 0.5f, 0};
  const Result<Mesh> mesh = decode_mesh(record, 1, 0);
  REQUIRE(mesh);
  for (const glm::vec2& uv : mesh->lightmap_uv) CHECK(uv == glm::clamp(uv, 0.0f, 1.0f));
}

TEST_CASE("decode_mesh rejects every truncation of every stream") {
  const MeshRecord whole = morphed_quad();
  const auto check = [&](auto&& bytes_of_record) {
    MeshRecord record = whole;
    const std::vector<std::uint8_t> original = bytes_of_record(record);
    for (std::size_t size = 0; size < original.size(); ++size) {
      bytes_of_record(record).assign(original.begin(),
                                     original.begin() + static_cast<std::ptrdiff_t>(size));
      CHECK_FALSE(decode_mesh(record, 1, 2).has_value());
    }
    bytes_of_record(record) = original;
    bytes_of_record(record).push_back(0);
    CHECK_FALSE(decode_mesh(record, 1, 2).has_value());
  };
  for (std::size_t s = 0; s < whole.streams.size(); ++s) {
    check([s](MeshRecord & r) -> auto& { return r.streams[s].bytes; });
  }
  check([](MeshRecord & r) -> auto& { return r.indices; });
  check([](MeshRecord & r) -> auto& { return r.morph_targets[0].bytes; });
}

TEST_CASE("decode_mesh keeps its promises whatever bits are flipped") {
  std::mt19937 random(1);
  const MeshRecord whole = morphed_quad();
  int accepted = 0;
  for (int round = 0; round < 4000; ++round) {
    MeshRecord record = whole;
    const std::size_t which = random() % (record.streams.size() + 2);
    std::vector<std::uint8_t>& bytes = which < record.streams.size() ? record.streams[which].bytes
                                       : which == record.streams.size()
                                           ? record.indices
                                           : record.morph_targets[0].bytes;
    const std::size_t flips = 1 + random() % 3;
    for (std::size_t i = 0; i < flips; ++i) {
      const std::size_t bit = random() % (8 * bytes.size());
      bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ (1u << bit % 8));
    }
    const Result<Mesh> mesh = decode_mesh(record, 1, 2);
    if (!mesh) continue;
    ++accepted;
    check_invariants(*mesh, 1);
  }
  CHECK(accepted > 0);  // else the checks above saw nothing
}

TEST_CASE("inflate refuses a large stated size before it allocates") {
  const std::vector<std::uint8_t> zeros(1 << 20, 0);
  const std::vector<std::uint8_t> bomb = test::zstd(zeros);
  REQUIRE(bomb.size() < 200);
  const auto result = decoders::inflate(bomb, 1000, "bomb");
  REQUIRE_FALSE(result);
  CHECK(result.error().code == ErrorCode::kLimit);
  CHECK(decoders::inflate(bomb, zeros.size(), "bomb").has_value());
  CHECK_FALSE(decoders::inflate_exact(bomb, zeros.size() - 1, "bomb").has_value());
}

TEST_CASE("inflate wants exactly one frame that states its size") {
  const std::vector<std::uint8_t> data(100, 3);
  std::vector<std::uint8_t> two = test::zstd(data);
  const std::vector<std::uint8_t> one = two;
  two.insert(two.end(), one.begin(), one.end());
  CHECK_FALSE(decoders::inflate(two, 1000, "two").has_value());
  std::vector<std::uint8_t> skippable = one;
  skippable.insert(skippable.end(), {0x50, 0x2a, 0x4d, 0x18, 0, 0, 0, 0});
  CHECK_FALSE(decoders::inflate(skippable, 1000, "skippable").has_value());

  ZSTD_CCtx* context = ZSTD_createCCtx();
  ZSTD_CCtx_setParameter(context, ZSTD_c_contentSizeFlag, 0);
  std::vector<std::uint8_t> unsized(ZSTD_compressBound(data.size()));
  unsized.resize(ZSTD_compress2(context, unsized.data(), unsized.size(), data.data(), data.size()));
  ZSTD_freeCCtx(context);
  CHECK_FALSE(decoders::inflate(unsized, 1000, "unsized").has_value());
}
