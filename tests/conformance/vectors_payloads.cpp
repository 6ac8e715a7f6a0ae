// SPDX-License-Identifier: MIT
// Fields of single records out of their range: static records.
#include <cmath>
#include <limits>

#include "container/base/limits.hpp"
#include "tests/conformance/making.hpp"

namespace relit::conformance {

using namespace container;

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A vector whose first record of a kind has one bad field.
struct Fault {
  const char* name;
  const char* description;
  const char* finding;
  std::function<void(Draft&)> change;
};

void add_faults(Vectors& vectors, const std::vector<Fault>& faults) {
  for (const Fault& f : faults)
    from_static_draft(vectors, f.name, f.description, f.finding, f.change);
}

/// Overwrites bytes of every payload of a type.
void add_raw(Vectors& vectors, const char* name, const char* description, const char* finding,
             RecordType type, std::function<void(Bytes&)> change) {
  from_pieces(vectors, name, description, refused({finding}),
              [type, change](std::vector<Piece>& p) { each_payload(p, type, change); });
}

void add_scene(Vectors& vectors) {
  add_faults(vectors, {
                          {"head-string-limit", "writer of 4097 bytes", "HEAD_LIMIT",
                           [](Draft& d) { d.header.writer.assign(4097, 'w'); }},
                          {"head-not-utf8", "writer that is no UTF-8", "HEAD_CORRUPT",
                           [](Draft& d) { d.header.writer = "\xFF\xFE"; }},
                          {"clip-rate-zero", "no ticks a second", "CLIP_CORRUPT",
                           [](Draft& d) { d.clips[0].tick_rate.num = 0; }},
                          {"clip-rate-den-zero", "a tick rate over 0", "CLIP_CORRUPT",
                           [](Draft& d) { d.clips[0].tick_rate.den = 0; }},
                          {"clip-rate-large", "a numerator of 2^31", "CLIP_CORRUPT",
                           [](Draft& d) { d.clips[0].tick_rate.num = 0x80000000; }},
                          {"clip-no-frames", "a clip without frames", "CLIP_CORRUPT",
                           [](Draft& d) { d.clips[0].frame_count = 0; }},
                          {"clip-frames-limit", "more than 2^32 frames", "CLIP_LIMIT",
                           [](Draft& d) {
                             d.clips[0].frame_count = d.clips[0].duration_ticks =
                                 limits::kFrames + 1;
                           }},
                          {"clip-too-short", "fewer ticks than frames", "CLIP_CORRUPT",
                           [](Draft& d) { d.clips[0].duration_ticks = 2; }},
                          {"clip-bounds-nan", "bounds that are no number", "CLIP_CORRUPT",
                           [](Draft& d) { d.clips[0].bounds_min[1] = kNan; }},
                          {"clip-bounds-infinite", "infinite bounds", "CLIP_CORRUPT",
                           [](Draft& d) { d.clips[0].bounds_max[2] = kInfinity; }},
                          {"clip-bounds-reversed", "bounds_min above bounds_max", "CLIP_CORRUPT",
                           [](Draft& d) { d.clips[0].bounds_min[0] = 2; }},
                          {"clip-name-zero", "a name with U+0000", "CLIP_CORRUPT",
                           [](Draft& d) { d.clips[0].name = std::string("a\0b", 3); }},
                          {"clip-name-overlong", "a name in overlong UTF-8", "CLIP_CORRUPT",
                           [](Draft& d) { d.clips[0].name = "\xC0\xAF"; }},
                          {"clip-name-surrogate", "a surrogate in UTF-8", "CLIP_CORRUPT",
                           [](Draft& d) { d.clips[0].name = "\xED\xA0\x80"; }},
                          {"image-type", "a media type of no version", "IMAG_UNSUPPORTED",
                           [](Draft& d) { d.images[0].media_type = "image/webp"; }},
                          {"image-empty", "an image without bytes", "IMAG_CORRUPT",
                           [](Draft& d) { d.images[0].bytes.clear(); }},
                          {"image-type-limit", "a media type of 5000 bytes", "IMAG_LIMIT",
                           [](Draft& d) { d.images[0].media_type.assign(5000, 'i'); }},
                          {"material-color-large", "a base colour above 1", "MATL_CORRUPT",
                           [](Draft& d) { d.materials[0].base_color[0] = 1.5f; }},
                          {"material-color-negative", "a negative base colour", "MATL_CORRUPT",
                           [](Draft& d) { d.materials[0].base_color[3] = -0.5f; }},
                          {"material-image-negative", "image -2", "MATL_CORRUPT",
                           [](Draft& d) { d.materials[0].image_id = -2; }},
                          {"material-wrap", "an unknown way to wrap", "MATL_UNSUPPORTED",
                           [](Draft& d) { d.materials[0].wrap_v = Wrap{3}; }},
                          {"material-alpha-mode", "an unknown alpha mode", "MATL_UNSUPPORTED",
                           [](Draft& d) { d.materials[0].alpha_mode = AlphaMode{3}; }},
                          {"material-cutoff", "a negative alpha cutoff", "MATL_CORRUPT",
                           [](Draft& d) { d.materials[0].alpha_cutoff = -1; }},
                          {"material-name-limit", "a name of 4097 bytes", "MATL_LIMIT",
                           [](Draft& d) { d.materials[0].name.assign(4097, 'm'); }},
                      });
  add_raw(vectors, "head-reserved", "a reserved field that is not 0", "HEAD_CORRUPT",
          types::kHeader, [](Bytes& b) { put_u32(b, 4, 1); });
  add_raw(vectors, "clip-loop-two", "a bool of 2", "CLIP_CORRUPT", types::kClip,
          [](Bytes& b) { b.at(b.size() - 25) = 2; });
  add_raw(vectors, "clip-short", "a payload that ends inside a field", "CLIP_CORRUPT", types::kClip,
          [](Bytes& b) { b.pop_back(); });
  add_raw(vectors, "clip-long", "a payload longer than its fields", "CLIP_CORRUPT", types::kClip,
          [](Bytes& b) { b.push_back(0); });
}

void add_mesh(Vectors& vectors) {
  add_faults(vectors,
             {
                 {"mesh-no-vertices", "no vertices", "MESH_CORRUPT",
                  [](Draft& d) { d.meshes[0].vertex_count = 0; }},
                 {"mesh-vertices-limit", "65536 vertices", "MESH_LIMIT",
                  [](Draft& d) { d.meshes[0].vertex_count = 65536; }},
                 {"mesh-indices-limit", "more than 3·2^20 indices", "MESH_LIMIT",
                  [](Draft& d) { d.meshes[0].index_count = limits::kIndicesPerMesh + 3; }},
                 {"mesh-indices-not-triangles", "seven indices", "MESH_CORRUPT",
                  [](Draft& d) { d.meshes[0].index_count = 7; }},
                 {"mesh-no-indices", "no bytes of indices", "MESH_CORRUPT",
                  [](Draft& d) { d.meshes[0].indices.clear(); }},
                 {"mesh-no-position", "no position stream", "MESH_CORRUPT",
                  [](Draft& d) { d.meshes[0].streams.erase(d.meshes[0].streams.begin()); }},
                 {"mesh-two-positions", "two position streams", "MESH_CORRUPT",
                  [](Draft& d) { d.meshes[0].streams.push_back(d.meshes[0].streams[0]); }},
                 {"mesh-no-lightmap-uv", "no light-map UVs", "MESH_CORRUPT",
                  [](Draft& d) { d.meshes[0].streams.erase(d.meshes[0].streams.begin() + 1); }},
                 {"mesh-joints-without-weights", "joints without weights", "MESH_CORRUPT",
                  [](Draft& d) { d.meshes[0].streams.pop_back(); }},
                 {"mesh-stride", "positions of stride 12", "MESH_CORRUPT",
                  [](Draft& d) { d.meshes[0].streams[0].stride = 12; }},
                 {"mesh-scale-negative", "a negative scale", "MESH_CORRUPT",
                  [](Draft& d) { d.meshes[0].streams[0].scale[1] = -1; }},
                 {"mesh-offset-nan", "an offset that is no number", "MESH_CORRUPT",
                  [](Draft& d) { d.meshes[0].streams[0].offset[1] = kNan; }},
                 {"mesh-stream-empty", "a stream without bytes", "MESH_CORRUPT",
                  [](Draft& d) { d.meshes[0].streams[0].bytes.clear(); }},
                 {"mesh-semantic", "an unknown semantic", "MESH_UNSUPPORTED",
                  [](Draft& d) { d.meshes[0].streams[0].semantic = Semantic{8}; }},
                 {"mesh-two-twins", "two streams of twins", "MESH_CORRUPT",
                  [](Draft& d) {
                    d.meshes[0].streams.resize(d.meshes[0].streams.size() + 2,
                                               {Semantic::kTwin, 2, {}, {1, 1, 1}, {1}});
                  }},
                 {"mesh-streams-limit", "seventeen streams", "MESH_LIMIT",
                  [](Draft& d) { d.meshes[0].streams.resize(17, d.meshes[0].streams[0]); }},
                 {"mesh-morph-scale", "a morph target of negative scale", "MESH_CORRUPT",
                  [](Draft& d) {
                    d.meshes[0].morph_targets = {{{-1, 1, 1}, {1}}};
                  }},
                 {"skeleton-own-parent", "a node that is its own parent", "SKEL_CORRUPT",
                  [](Draft& d) { d.skeleton->nodes[1].parent = 1; }},
                 {"skeleton-later-parent", "a parent behind its child", "SKEL_CORRUPT",
                  [](Draft& d) { d.skeleton->nodes[0].parent = 1; }},
                 {"skeleton-parent", "parent -2", "SKEL_CORRUPT",
                  [](Draft& d) { d.skeleton->nodes[0].parent = -2; }},
                 {"skeleton-palette", "a palette entry of a node that is not there", "SKEL_CORRUPT",
                  [](Draft& d) { d.skeleton->palette[1].node = 2; }},
                 {"skeleton-matrix-nan", "a matrix with a NaN", "SKEL_CORRUPT",
                  [](Draft& d) { d.skeleton->nodes[1].local[3] = kNan; }},
                 {"skeleton-weights-limit", "65536 morph weights", "SKEL_LIMIT",
                  [](Draft& d) { d.skeleton->morph_weight_count = 65536; }},
                 {"pose-kind", "an unknown kind", "POSE_UNSUPPORTED",
                  [](Draft& d) { d.poses[0].kind = PoseKind{2}; }},
                 {"pose-rotation", "a rest rotation that is not of unit length", "POSE_CORRUPT",
                  [](Draft& d) { d.poses[0].rest[0].rotation[3] = 0.5f; }},
                 {"pose-rest-twice", "two rests of one node", "POSE_CORRUPT",
                  [](Draft& d) { d.poses[0].rest.push_back(d.poses[0].rest[0]); }},
                 {"pose-channel-twice", "two channels of one rotation", "POSE_CORRUPT",
                  [](Draft& d) { d.poses[0].channels.push_back(d.poses[0].channels[0]); }},
                 {"pose-step-negative", "a negative step", "POSE_CORRUPT",
                  [](Draft& d) { d.poses[0].channels[0].step[0] = -1; }},
                 {"pose-target", "an unknown target", "POSE_UNSUPPORTED",
                  [](Draft& d) { d.poses[0].channels[0].target = ChannelTarget{4}; }},
                 {"pose-joints-with-ranges", "vertex ranges in a track of joints", "POSE_CORRUPT",
                  [](Draft& d) {
                    d.poses[0].vertex_ranges = {{1, {}, {1, 1, 1}}};
                  }},
                 {"pose-vertices-with-channels", "channels in a track of vertices", "POSE_CORRUPT",
                  [](Draft& d) { d.poses[0].kind = PoseKind::kVertices; }},
             });
  add_raw(vectors, "pose-rest-limit", "65536 rests", "POSE_LIMIT", types::kPoseTrack,
          [](Bytes& b) { put_u32(b, 9, 65536); });
}

void add_model(Vectors& vectors) {
  add_faults(vectors, {
                          {"model-kind", "an unknown kind of model", "MODL_UNSUPPORTED",
                           [](Draft& d) { d.models[0].kind = ModelKind{1}; }},
                          {"model-order-limit", "order 4", "MODL_LIMIT",
                           [](Draft& d) { d.models[0].order = 4; }},
                          {"model-no-width", "a light map without width", "MODL_CORRUPT",
                           [](Draft& d) { d.models[0].width = 0; }},
                          {"model-width-limit", "a light map 4097 texels wide", "MODL_LIMIT",
                           [](Draft& d) { d.models[0].width = 4097; }},
                          {"model-mean-count", "a mean too many", "MODL_CORRUPT",
                           [](Draft& d) { d.models[0].mean.push_back({}); }},
                          {"model-mean-nan", "a mean that is no number", "MODL_CORRUPT",
                           [](Draft& d) { d.models[0].mean[0][2] = kNan; }},
                          {"model-prediction-negative", "prediction plane -2", "MODL_CORRUPT",
                           [](Draft& d) { d.models[0].prediction_plane = -2; }},
                      });
}

}  // namespace

void add_payloads(Vectors& vectors) {
  add_scene(vectors);
  add_mesh(vectors);
  add_model(vectors);
  add_layer_payloads(vectors);
  add_segment_payloads(vectors);
}

}  // namespace relit::conformance
