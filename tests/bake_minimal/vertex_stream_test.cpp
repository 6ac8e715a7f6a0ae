// SPDX-License-Identifier: MIT
// The coding of vertex streams: what the writer predicts is what the reader predicts.
#include <algorithm>
#include <map>
#include <random>
#include <vector>

#include "bake_minimal/influence_slots.hpp"
#include "bake_minimal/stream_encoder.hpp"
#include "bake_minimal/vertex_quantizer.hpp"
#include "decoders/mesh.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::bake;
using container::Semantic;
using container::VertexStream;

namespace {

struct Drawn {
  container::MeshRecord record;  ///< streams not yet coded
  std::vector<std::uint16_t> indices, twins;
};

std::size_t draw(std::mt19937& random, std::size_t below) { return random() % below; }

std::vector<std::uint8_t> noise(std::mt19937& random, std::size_t size) {
  std::vector<std::uint8_t> out(size);
  for (std::uint8_t& b : out) b = static_cast<std::uint8_t>(random() & 255);
  return out;
}

/// Vertices in no order, triangles that name one twice, twins of twins, and noise for values: every
/// case of the prediction and every wrap of its arithmetic.
Drawn drawn_mesh(std::mt19937& random, bool with_twins) {
  Drawn out;
  const std::size_t count = 3 + draw(random, 60);
  for (std::size_t i = 0; i < 6 * count; ++i) {
    // Mostly near the last ones, so that triangles share edges.
    const std::size_t at =
        i < 3 || draw(random, 4) == 0 ? draw(random, count) : out.indices[i - 1 - draw(random, 3)];
    out.indices.push_back(static_cast<std::uint16_t>(at));
  }
  if (with_twins) out.twins.assign(count, decoders::kNoTwin);
  for (std::size_t v = 1; v < out.twins.size(); ++v) {
    if (draw(random, 3) == 0) out.twins[v] = static_cast<std::uint16_t>(draw(random, v));
  }
  container::MeshRecord& record = out.record;
  record.vertex_count = static_cast<std::uint32_t>(count);
  record.index_count = static_cast<std::uint32_t>(out.indices.size());
  for (const Semantic semantic : {Semantic::kPosition, Semantic::kNormal, Semantic::kLightMapUv,
                                  Semantic::kAlbedoUv, Semantic::kColor}) {
    const std::uint8_t stride = decoders::form_of(semantic).stride;
    record.streams.push_back({semantic, stride, {}, {1, 1, 1}, noise(random, count * stride)});
  }
  record.streams[2].scale = {1.0f / 65535, 1.0f / 65535, 1};
  record.morph_targets.push_back({{1, 1, 1}, noise(random, count * 8)});
  return out;
}

/// As the reader sees them, vertices with a twin have the twin's values.
void copy_twins(std::vector<std::uint8_t>& bytes, std::size_t stride,
                const std::vector<std::uint16_t>& twins) {
  for (std::size_t v = 0; v < twins.size(); ++v) {
    if (twins[v] != decoders::kNoTwin)
      std::copy_n(&bytes[twins[v] * stride], stride, &bytes[v * stride]);
  }
}

float word(const std::vector<std::uint8_t>& bytes, std::size_t i) {
  return static_cast<float>(bytes[2 * i] | bytes[2 * i + 1] << 8);
}

}  // namespace

TEST_CASE("vertex streams of any values and any triangles come back to the bit") {
  std::mt19937 random(5);
  for (int round = 0; round < 60; ++round) {
    Drawn drawn = drawn_mesh(random, round % 2 == 0);
    container::MeshRecord record = drawn.record;
    const std::vector<std::uint32_t> indices(drawn.indices.begin(), drawn.indices.end());
    record.indices = encode_index_stream(indices, record.vertex_count);
    const decoders::VertexLinks links =
        decoders::link_vertices(drawn.indices, record.vertex_count, drawn.twins);
    for (VertexStream& s : drawn.record.streams) {
      if (decoders::form_of(s.semantic).of_points) copy_twins(s.bytes, s.stride, drawn.twins);
    }
    copy_twins(drawn.record.morph_targets[0].bytes, 8, drawn.twins);
    for (std::size_t i = 0; i < record.streams.size(); ++i) {
      VertexStream& s = record.streams[i];
      s.bytes =
          encode_vertex_stream(drawn.record.streams[i].bytes, decoders::form_of(s.semantic), links);
    }
    record.morph_targets[0].bytes = encode_vertex_stream(drawn.record.morph_targets[0].bytes,
                                                         decoders::morph_target_form(), links);
    if (!drawn.twins.empty())
      record.streams.push_back({Semantic::kTwin, 2, {}, {1, 1, 1}, encode_twins(drawn.twins)});

    const Result<decoders::Mesh> mesh = decoders::decode_mesh(record, 1, 1);
    REQUIRE(mesh);
    const auto& streams = drawn.record.streams;
    int wrong = 0;
    for (std::size_t v = 0; v < record.vertex_count; ++v) {
      for (int c = 0; c < 3; ++c) {
        const auto axis = static_cast<std::size_t>(c);
        wrong += mesh->positions[v][c] != word(streams[0].bytes, 4 * v + axis);
        const float offset = word(drawn.record.morph_targets[0].bytes, 4 * v + axis);
        wrong += mesh->morph_targets[0][v][c] != (offset < 32768 ? offset : offset - 65536);
      }
      for (int c = 0; c < 2; ++c) {
        const auto axis = static_cast<std::size_t>(c);
        wrong += mesh->albedo_uv[v][c] != word(streams[3].bytes, 2 * v + axis);
        wrong += mesh->lightmap_uv[v][c] !=
                 std::min(1.0f, word(streams[2].bytes, 2 * v + axis) * (1.0f / 65535));
      }
      for (int c = 0; c < 4; ++c) {
        wrong += mesh->colors[v][c] != streams[4].bytes[4 * v + static_cast<std::size_t>(c)];
      }
      // Octahedral bytes 0..127 and 129..255 differ in their normals; equal normals of equal bytes.
      wrong += !(glm::length(mesh->normals[v]) > 0.9f);
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("matching slots moves influences and changes none") {
  std::mt19937 random(6);
  constexpr std::size_t kVertices = 40;
  std::vector<std::uint16_t> indices;
  for (std::uint16_t v = 0; v + 2u < kVertices; ++v) {
    for (std::uint16_t c = 0; c < 3; ++c) indices.push_back(static_cast<std::uint16_t>(v + c));
  }
  const decoders::VertexLinks links = decoders::link_vertices(indices, kVertices, {});
  std::vector<VertexStream> streams;
  for (int s = 0; s < 2; ++s) {
    streams.push_back(
        {Semantic::kJoints, 8, {}, {1, 1, 1}, std::vector<std::uint8_t>(8 * kVertices)});
    streams.push_back(
        {Semantic::kWeights, 4, {}, {1, 1, 1}, std::vector<std::uint8_t>(4 * kVertices)});
  }
  const auto influences = [&](std::size_t v) {
    std::map<int, int> out;
    for (std::size_t i = 0; i < 8; ++i) {
      const int weight = streams[2 * (i / 4) + 1].bytes[4 * v + i % 4];
      if (weight > 0)
        out[static_cast<int>(word(streams[2 * (i / 4)].bytes, 4 * v + i % 4))] += weight;
    }
    return out;
  };
  for (std::size_t v = 0; v < kVertices; ++v) {
    const std::size_t used = 1 + draw(random, 8);
    for (std::size_t i = 0; i < used; ++i) {
      streams[2 * (i / 4)].bytes[8 * v + 2 * (i % 4)] = static_cast<std::uint8_t>((v / 8 + i) % 9);
      streams[2 * (i / 4) + 1].bytes[4 * v + i % 4] =
          static_cast<std::uint8_t>(1 + draw(random, 30));
    }
  }
  std::vector<std::map<int, int>> before;
  for (std::size_t v = 0; v < kVertices; ++v) before.push_back(influences(v));
  match_influence_slots(streams, links);
  for (std::size_t v = 0; v < kVertices; ++v) CHECK(influences(v) == before[v]);
}

TEST_CASE("matching slots keeps joints where the vertex before has them") {
  const std::vector<std::uint16_t> indices{0, 1, 2};
  const decoders::VertexLinks links = decoders::link_vertices(indices, 3, {});
  std::vector<VertexStream> streams{
      {Semantic::kJoints, 8, {}, {1, 1, 1}, {3, 0, 5, 0, 0, 0, 0, 0, 5, 0, 3, 0, 0, 0, 0, 0,  //
                                             7, 0, 0, 0, 0, 0, 0, 0}},
      {Semantic::kWeights, 4, {}, {1, 1, 1}, {155, 100, 0, 0, 200, 55, 0, 0, 255, 0, 0, 0}}};
  match_influence_slots(streams, links);
  CHECK(streams[0].bytes == std::vector<std::uint8_t>{3, 0, 5, 0, 0, 0, 0, 0, 3, 0, 5, 0,
                                                      0, 0, 0, 0, 3, 0, 5, 0, 0, 0, 7, 0});
  CHECK(streams[1].bytes == std::vector<std::uint8_t>{155, 100, 0, 0, 55, 200, 0, 0, 0, 0, 0, 255});
}

TEST_CASE("texture coordinates take the bits that their texels need") {
  CHECK(uv_bits(1) == 10);
  CHECK(uv_bits(1024) == 10);
  CHECK(uv_bits(1025) == 11);
  CHECK(uv_bits(kLightMapSteps * 128) == 11);
  CHECK(uv_bits(kAlbedoSteps * 1024) == 12);
  CHECK(uv_bits(1e9) == 16);
}
