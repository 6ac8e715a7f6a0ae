// SPDX-License-Identifier: MIT
// Rigs of every kind, several clips and models, values at their limits.
#include <cfloat>
#include <limits>

#include "bake_minimal/stream_encoder.hpp"
#include "bake_minimal/vertex_quantizer.hpp"
#include "container/base/limits.hpp"
#include "tests/conformance/making.hpp"

namespace relit::conformance {

using namespace container;

namespace {

void good(Vectors& vectors, const char* name, const char* description,
          std::function<void(Draft&)> change, const FigureOptions& options = plain_figure()) {
  from_draft(vectors, name, description, whole(), std::move(change), options);
}

MorphTarget raised(float scale) {
  std::vector<std::uint8_t> bytes;
  for (const unsigned z : {0u, 100u, 65436u, 7u}) {
    for (const unsigned word : {1u, 65535u, z, 0u}) bake::append_u16(bytes, word);
  }
  return {{scale, scale, scale}, quad_stream(Semantic::kPosition, bytes)};
}

void add_rigs(Vectors& vectors) {
  good(vectors, "rig-8-influences", "two streams of joints and weights",
       [](Draft& d) { d.meshes[0] = quad(8); });
  good(vectors, "rig-translation-scale", "channels of translation and scale", [](Draft& d) {
    PoseTrackRecord pose = d.poses[0];
    const float step = 1.0f / 4096;
    pose.channels = {{ChannelTarget::kTranslation, 1, {-1, 0, 0.5f}, {step, step, 0}},
                     {ChannelTarget::kScale, 0, {0.5f, 1, 1}, {step, 0, 0}}};
    set_pose(d, pose, 6);
  });
  good(vectors, "rig-morph", "two morph targets, of which a channel moves one", [](Draft& d) {
    d.meshes[0].morph_targets = {raised(1.0f / 1024), raised(1.0f / 512)};
    d.meshes[0].first_morph_weight = 1;
    d.skeleton->morph_weight_count = 3;
    PoseTrackRecord pose = d.poses[0];
    pose.channels = {{ChannelTarget::kMorphWeight, 2, {0, 0, 0}, {1.0f / 8192, 0, 0}}};
    set_pose(d, pose, 1);
  });
  good(vectors, "rig-vertices", "a pose of vertices, without joints", [](Draft& d) {
    d.meshes[0] = quad(0);
    d.skeleton.reset();
    PoseTrackRecord pose;
    pose.track_id = d.poses[0].track_id;
    pose.clip_id = d.poses[0].clip_id;
    pose.kind = PoseKind::kVertices;
    const float step = 1.0f / 32768;
    pose.vertex_ranges = {{1, {-1, -1, -1}, {step, step, step}}};
    set_pose(d, pose, 12);
  });
  good(vectors, "rig-vertices-two-meshes", "a pose of the vertices of two meshes", [](Draft& d) {
    d.meshes = {quad(0), quad(0)};
    d.meshes[1].id = 2;
    d.skeleton.reset();
    PoseTrackRecord pose;
    pose.track_id = d.poses[0].track_id;
    pose.clip_id = d.poses[0].clip_id;
    pose.kind = PoseKind::kVertices;
    const float step = 1.0f / 32768;
    pose.vertex_ranges = {{1, {-1, -1, -1}, {step, step, step}}, {2, {0, 0, 0}, {step, 0, step}}};
    set_pose(d, pose, 24);
  });
  good(vectors, "rig-no-channels", "a pose track that moves nothing", [](Draft& d) {
    PoseTrackRecord pose = d.poses[0];
    pose.channels.clear();
    set_pose(d, pose, 0);
  });
  good(vectors, "mesh-all-streams", "normals, albedo UVs and colours", [](Draft& d) {
    const auto four = [](Semantic semantic, std::initializer_list<std::uint8_t> vertex) {
      std::vector<std::uint8_t> bytes;
      for (int v = 0; v < 4; ++v) bytes.insert(bytes.end(), vertex);
      return quad_stream(semantic, bytes);
    };
    auto& streams = d.meshes[0].streams;
    streams.push_back(
        {Semantic::kNormal, 4, {}, {1, 1, 1}, four(Semantic::kNormal, {0, 127, 0, 0})});
    streams.push_back({Semantic::kAlbedoUv,
                       4,
                       {-1, 2, 0},
                       {1e-3f, 1e-3f, 1},
                       four(Semantic::kAlbedoUv, {1, 2, 3, 4})});
    streams.push_back(
        {Semantic::kColor, 4, {}, {1, 1, 1}, four(Semantic::kColor, {255, 128, 0, 200})});
  });
  good(
      vectors, "mesh-twins", "a vertex that shares everything but its UVs with another",
      [](Draft& d) {
        // The last vertex is the first one once more, with UVs of its own: the second triangle is
        // closed.
        const std::vector<std::uint16_t> twins{decoders::kNoTwin, decoders::kNoTwin,
                                               decoders::kNoTwin, 0};
        std::vector<std::uint8_t> corners, joints;
        for (const unsigned word :
             {0u, 0u, 0u, 0u, 1024u, 0u, 9u, 0u, 1024u, 1024u, 65535u, 0u, 0u, 0u, 0u, 0u})
          bake::append_u16(corners, word);
        for (const unsigned word : {0u, 1u, 0u, 0u, 1u, 0u, 0u, 0u, 1u, 0u, 0u, 0u, 0u, 1u, 0u, 0u})
          bake::append_u16(joints, word);
        const std::vector<std::uint8_t> weights{200, 55, 0, 0, 255, 0,  0, 0,
                                                255, 0,  0, 0, 200, 55, 0, 0};
        for (auto& stream : d.meshes[0].streams) {
          if (stream.semantic == Semantic::kPosition) {
            stream.scale[2] = 1e-6f;
            stream.bytes = quad_stream(stream.semantic, corners, twins);
          }
          if (stream.semantic == Semantic::kJoints)
            stream.bytes = quad_stream(stream.semantic, joints, twins);
          if (stream.semantic == Semantic::kWeights)
            stream.bytes = quad_stream(stream.semantic, weights, twins);
        }
        d.meshes[0].streams.push_back(
            {Semantic::kTwin, 2, {}, {1, 1, 1}, bake::encode_twins(twins)});
      });
  good(vectors, "mesh-padding", "what stands in the place of zeros means nothing", [](Draft& d) {
    // A square of seven steps, and a normal along +Y.
    const std::vector<std::uint8_t> corners{0, 0, 0, 0, 0, 0, 9, 1, 7, 0, 0, 0, 0, 0, 255, 255,
                                            7, 0, 7, 0, 0, 0, 1, 0, 0, 0, 7, 0, 0, 0, 0,   128};
    const std::vector<std::uint8_t> normals{0, 127, 1,   2,   0, 127, 0, 0,
                                            0, 127, 128, 127, 0, 127, 3, 255};
    auto& streams = d.meshes[0].streams;
    for (auto& stream : streams) {
      if (stream.semantic != Semantic::kPosition) continue;
      stream.offset = {0, 0, 0};
      stream.scale = {0.125f, 0.125f, 0.125f};
      stream.bytes = quad_stream(Semantic::kPosition, corners);
    }
    streams.push_back(
        {Semantic::kNormal, 4, {}, {1, 1, 1}, quad_stream(Semantic::kNormal, normals)});
  });
}

/// Adds the parts of another clip to a file.
void append(Draft& draft, Draft parts) {
  const auto move = [](auto& to, auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  move(draft.clips, parts.clips);
  move(draft.poses, parts.poses);
  move(draft.models, parts.models);
  move(draft.layers, parts.layers);
  move(draft.segments, parts.segments);
}

void add_clips(Vectors& vectors) {
  const auto second = [](int frames, std::uint32_t first_segment) {
    FigureOptions o = plain_figure();
    o.frames = frames;
    o.ids = {2, 2, 2, 3, 4};
    return clip_parts(o, first_segment);
  };
  good(vectors, "clips-two", "two clips, one behind the other",
       [second](Draft& d) { append(d, second(4, 2)); });
  good(vectors, "clips-alternating", "two clips whose segments alternate", [second](Draft& d) {
    append(d, second(4, 2));
    std::swap(d.segments[1], d.segments[2]);
    for (std::uint32_t i = 0; i < 4; ++i) d.segments[i].record.index = i;
  });
  good(vectors, "clips-same-name", "two clips of one name, which is empty", [second](Draft& d) {
    append(d, second(1, 2));
    d.clips[0].name.clear(), d.clips[1].name.clear();
  });
  good(vectors, "models-two", "two models of one clip", [](Draft& d) {
    d.models.push_back(d.models[0]);
    d.models[1].id = 2;
    LayerRecord layer = d.layers[0];
    layer.id = 2, layer.model_id = 2, layer.mantissa_track = 3;
    d.layers.push_back(layer);
    for (DraftSegment& segment : d.segments) {
      segment.chunks.push_back(segment.chunks[1]);
      segment.chunks.back().track_id = 3;
    }
  });
  good(vectors, "model-prediction", "a plane that is both a prediction's and the matrix's",
       [](Draft& d) { d.models[0].prediction_plane = 0; });
}

void add_values(Vectors& vectors) {
  good(vectors, "ids-largest", "ids and tracks of 2^32 - 1", [](Draft& d) {
    constexpr std::uint32_t kMost = std::numeric_limits<std::uint32_t>::max();
    d.clips[0].id = d.poses[0].clip_id = d.models[0].clip_id = kMost;
    d.images[0].id = 0x7FFFFFFF;
    d.materials[0].image_id = 0x7FFFFFFF;
    d.materials[0].id = d.meshes[0].material_id = kMost;
    d.meshes[0].id = d.models[0].id = d.layers[0].model_id = d.layers[0].id = kMost;
    d.poses[0].track_id = kMost;
    d.layers[0].mantissa_track = kMost - 1;
    for (DraftSegment& segment : d.segments) {
      segment.record.clip_id = kMost;
      segment.chunks[0].track_id = kMost;
      segment.chunks[1].track_id = kMost - 1;
    }
  });
  good(vectors, "ids-zero", "ids and tracks of 0", [](Draft& d) {
    d.clips[0].id = d.poses[0].clip_id = d.models[0].clip_id = 0;
    d.images[0].id = d.materials[0].id = d.meshes[0].material_id = d.meshes[0].id = 0;
    d.materials[0].image_id = 0;
    d.models[0].id = d.layers[0].model_id = d.layers[0].id = 0;
    d.poses[0].track_id = 0;
    for (DraftSegment& segment : d.segments) {
      segment.record.clip_id = 0;
      segment.chunks[0].track_id = 0;
    }
  });
  good(vectors, "tick-rate-largest", "2^31 - 1 ticks a second", [](Draft& d) {
    d.clips[0].tick_rate = {limits::kRational, 1};
    d.models.clear(), d.layers.clear();
    for (DraftSegment& segment : d.segments) segment.chunks.resize(1);
  });
  good(vectors, "tick-rate-smallest", "a tick of 2^31 - 1 seconds", [](Draft& d) {
    d.clips[0].tick_rate = {1, limits::kRational};
  });
  good(
      vectors, "duration-largest", "a frame of 2^32 - 1 ticks",
      [](Draft& d) { set_durations(d, {0xFFFFFFFF}); },
      [] {
        FigureOptions o = plain_figure();
        o.frames = 1;
        return o;
      }());
  good(vectors, "segment-index-largest", "segments numbered to 2^24 - 1",
       [](Draft& d) { d.segments[1].record.index = limits::kSegments - 1; });
  vectors.back().findings = {"SEGM_INDEX_GAP"};
  good(vectors, "bounds-largest", "bounds of the largest floats", [](Draft& d) {
    d.clips[0].bounds_min = {-FLT_MAX, -FLT_MAX, -FLT_MIN};
    d.clips[0].bounds_max = {FLT_MAX, 0, FLT_MIN};
  });
  good(vectors, "bounds-subnormal", "bounds of subnormal floats and -0", [](Draft& d) {
    d.clips[0].bounds_min = {-1.4e-45f, -0.0f, 0};
    d.clips[0].bounds_max = {1.4e-45f, 0, -0.0f};
  });
  good(vectors, "strings-empty", "strings without a byte", [](Draft& d) {
    d.header.writer.clear(), d.clips[0].name.clear();
    d.materials[0].name.clear(), d.meshes[0].name.clear();
  });
  good(vectors, "strings-unicode", "names of one to four bytes a letter, and control characters",
       [](Draft& d) {
         d.clips[0].name = "a\xC3\xA4\xE2\x82\xAC\xF0\x9F\x92\xA1";
         d.meshes[0].name = "\x1B[31m\n\t\x7F\xC2\x85";
         d.materials[0].name = "\"\\/";
       });
  good(vectors, "string-longest", "a name of 4096 bytes",
       [](Draft& d) { d.meshes[0].name.assign(4096, 'm'); });
  good(vectors, "material-enumerators", "mirrored, clamped, nearest, blended", [](Draft& d) {
    d.materials[0].wrap_u = Wrap::kMirror;
    d.materials[0].wrap_v = Wrap::kClamp;
    d.materials[0].linear_filter = false;
    d.materials[0].alpha_mode = AlphaMode::kBlend;
    d.materials[0].base_color = {0, 1, 0.5f, 0};
    d.materials[0].alpha_cutoff = 0;
  });
  good(vectors, "plane-empty-column", "a plane that contributes to nothing",
       [](Draft& d) { d.layers[0].planes[0].matrix.clear(); });
}

void add_exponent_values(Vectors& vectors) {
  FigureOptions options = plain_figure();
  options.coding.exponent_block = 4;
  // The exponent picture stays as it is; what is small is made smaller by its neighbours' scale.
  from_draft(
      vectors, "exponents-shared", "two planes that share an exponent rectangle", whole(),
      [](Draft& d) {
        LayerRecord& layer = d.layers[0];
        layer.planes[1].exponent_rect = layer.planes[0].exponent_rect;
      },
      [options] {
        FigureOptions o = options;
        o.coding.chroma = Chroma::k444;
        return o;
      }());
}

}  // namespace

void add_extremes(Vectors& vectors) {
  add_rigs(vectors);
  add_clips(vectors);
  add_values(vectors);
  add_exponent_values(vectors);
}

}  // namespace relit::conformance
