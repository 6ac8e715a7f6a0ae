// SPDX-License-Identifier: MIT
#include "container/references.hpp"

#include "tests/container/sample.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::container;

namespace {

/// The sample's records, to be spoiled one by one.
struct Parts {
  std::vector<ClipRecord> clips{sample::clip()};
  std::vector<ImageRecord> images{sample::image()};
  std::vector<MaterialRecord> materials{sample::material()};
  std::vector<MeshRecord> meshes{sample::mesh()};
  std::vector<SkeletonRecord> skeletons{sample::skeleton()};
  std::vector<PoseTrackRecord> poses{sample::pose_track()};
  std::vector<ModelRecord> models{sample::model()};
  std::vector<LayerRecord> layers{sample::layer(), sample::second_layer()};
};

Status check(const Parts& parts) {
  ReferenceChecker checker;
  for (const auto& r : parts.clips) RELIT_TRY(checker.add(r));
  for (const auto& r : parts.images) RELIT_TRY(checker.add(r));
  for (const auto& r : parts.materials) RELIT_TRY(checker.add(r));
  for (const auto& r : parts.meshes) RELIT_TRY(checker.add(r));
  for (const auto& r : parts.skeletons) RELIT_TRY(checker.add(r));
  for (const auto& r : parts.poses) RELIT_TRY(checker.add(r));
  for (const auto& r : parts.models) RELIT_TRY(checker.add(r));
  for (const auto& r : parts.layers) RELIT_TRY(checker.add(r));
  return checker.finish();
}

template <class Spoil>
std::string refusal(Spoil spoil) {
  Parts parts;
  spoil(parts);
  const auto status = check(parts);
  return status ? "" : status.error().message;
}

}  // namespace

TEST_CASE("records that agree are accepted") {
  CHECK(check({}));
  Parts vertices;
  vertices.poses = {sample::vertex_track()};
  CHECK(check(vertices));
}

TEST_CASE("ids are unique") {
  CHECK(refusal([](Parts& p) { p.clips.push_back(p.clips[0]); }) == "clip 7 exists twice");
  CHECK(refusal([](Parts& p) { p.images.push_back(p.images[0]); }) == "image 3 exists twice");
  CHECK(refusal([](Parts& p) { p.materials.push_back(p.materials[0]); }) ==
        "material 9 exists twice");
  CHECK(refusal([](Parts& p) { p.meshes.push_back(p.meshes[0]); }) == "mesh 11 exists twice");
  CHECK(refusal([](Parts& p) { p.models.push_back(p.models[0]); }) == "model 20 exists twice");
  CHECK(refusal([](Parts& p) { p.layers[1].id = 30; }) == "layer 30 exists twice");
  CHECK(refusal([](Parts& p) { p.layers[1].mantissa_track = 3; }) == "track 3 is used twice");
  CHECK(refusal([](Parts& p) { p.layers[1].mantissa_track = 1; }) == "track 1 is used twice");
}

TEST_CASE("what is referred to exists") {
  CHECK(refusal([](Parts& p) { p.clips.clear(); }) != "");
  CHECK(refusal([](Parts& p) { p.materials[0].image_id = 4; }) == "image 4 does not exist");
  CHECK(refusal([](Parts& p) { p.meshes[0].material_id = 1; }) == "material 1 does not exist");
  CHECK(refusal([](Parts& p) { p.poses[0].clip_id = 1; }) == "clip 1 does not exist");
  CHECK(refusal([](Parts& p) { p.models[0].clip_id = 1; }) == "clip 1 does not exist");
  CHECK(refusal([](Parts& p) { p.layers[0].model_id = 1; }) == "model 1 does not exist");
  CHECK(refusal([](Parts& p) { p.poses[0].channels[0].index = 2; }) == "node 2 does not exist");
  CHECK(refusal([](Parts& p) { p.poses[0].channels[2].index = 2; }) ==
        "morph weight 2 does not exist");
  CHECK(refusal([](Parts& p) { p.poses[0].rest[0].node = 2; }) == "node 2 does not exist");
  CHECK(refusal([](Parts& p) { p.skeletons[0].palette.clear(); }).find("palette") !=
        std::string::npos);
  CHECK(refusal([](Parts& p) { p.meshes[0].first_morph_weight = 2; }).find("morph weights") !=
        std::string::npos);
  CHECK(refusal([](Parts& p) {
          p.poses = {sample::vertex_track()};
          p.poses[0].vertex_ranges[0].mesh_id = 1;
        }) == "mesh 1 does not exist");
}

TEST_CASE("planes fit their model, and a clip has one pose track") {
  CHECK(refusal([](Parts& p) { p.models[0].width = 13; }).find("size of the light map") !=
        std::string::npos);
  CHECK(refusal([](Parts& p) {
          p.layers[1].planes[0].matrix[0].coefficient = 4;
        }).find("matrix.coefficient 4") != std::string::npos);
  CHECK(refusal([](Parts& p) { p.models[0].prediction_plane = 5; }).find("predicts from plane 5") !=
        std::string::npos);
  CHECK(refusal([](Parts& p) { p.models[0].prediction_plane = 4; }) == "");
  CHECK(refusal([](Parts& p) {
          p.poses.push_back(p.poses[0]);
          p.poses[1].track_id = 99;
        }) == "clip 7 has two pose tracks");
  CHECK(refusal([](Parts& p) {
          p.poses = {sample::vertex_track()};
          p.meshes.push_back(p.meshes[0]);
          p.meshes[1].id = 12;
        }).find("one vertex range for each mesh") != std::string::npos);
}

TEST_CASE("what all meshes together decode to is limited") {
  const auto of_meshes = [](std::uint64_t count, auto&& change) {
    return refusal([&](Parts& p) {
      MeshRecord mesh = p.meshes[0];
      change(mesh);
      p.poses.clear();
      p.meshes.clear();
      for (std::uint64_t i = 0; i < count; ++i) {
        mesh.id = static_cast<std::uint32_t>(i);
        p.meshes.push_back(mesh);
      }
    });
  };
  const auto vertices = [](MeshRecord& m) { m.vertex_count = 1u << 15; };
  CHECK(of_meshes(limits::kVertices >> 15, vertices) == "");
  CHECK(of_meshes((limits::kVertices >> 15) + 1, vertices).find("vertices of all meshes") !=
        std::string::npos);
  const auto indices = [](MeshRecord& m) { m.index_count = limits::kIndicesPerMesh; };
  const std::uint64_t most = limits::kIndices / limits::kIndicesPerMesh;
  CHECK(of_meshes(most, indices) == "");
  CHECK(of_meshes(most + 1, indices).find("indices of all meshes") != std::string::npos);
  const auto morphs = [](MeshRecord& m) {
    m.vertex_count = limits::kVerticesPerMesh;
    m.morph_targets.resize(limits::kMorphTargets);
  };
  CHECK(of_meshes(2, morphs).find("morph offsets of all meshes") != std::string::npos);
}
