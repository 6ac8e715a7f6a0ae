// SPDX-License-Identifier: MIT
#include "tests/fuzz/playing.hpp"

#include <utility>

#include "decoders/image.hpp"
#include "decoders/pose.hpp"

namespace relit::fuzz {
namespace {

constexpr std::uint64_t kMostFrames = 12;

void check_view(const SampleView& view) {
  if (view.empty()) return;
  unsigned sum = 0;
  for (int y = 0; y < view.height; ++y)
    for (int x = 0; x < view.width * view.bytes_per_sample; ++x)
      sum += view.data[y * view.stride_bytes + x];
  volatile unsigned read = sum;
  (void)read;
}

void check_planes(const player::ClipReader& clip, const decoders::FrameView& frame) {
  for (const PlaneView& plane : frame.planes()) {
    check_view(plane.mantissa);
    check_view(plane.exponent);
    if (plane.mantissa.empty()) continue;
    const int right = clip.model().width - 1, bottom = clip.model().height - 1;
    for (const int x : {0, right})
      for (const int y : {0, bottom}) require(std::isfinite(decoders::plane_value(plane, x, y)));
  }
}

void check_pose(const player::ClipReader& clip, const decoders::Pose& pose) {
  require_finite(pose.palette);
  require_finite(pose.morph_weights);
  for (std::size_t m = 0; m < clip.meshes().size(); ++m) {
    const decoders::Mesh& mesh = clip.meshes()[m];
    std::vector<glm::vec3> positions(mesh.positions.size()), normals(positions.size());
    decoders::pose_mesh(mesh, m, pose, positions, normals);
    require_finite(positions);
    require_finite(normals);
  }
}

Status play_frame(player::ClipReader& clip, std::uint64_t index, player::ClipFrame& frame) {
  RELIT_TRY(clip.frame(index, frame));
  check_planes(clip, frame.planes);
  check_pose(clip, frame.pose);
  require(clip.ticks_of(index) > 0);
  return {};
}

Status play_ticks(player::ClipReader& clip, player::ClipFrame& frame) {
  const std::uint64_t end = std::min(clip.clip().duration_ticks, kMostFrames);
  for (std::uint64_t tick = 0; tick < end; ++tick) {
    RELIT_ASSIGN(const std::uint64_t index, clip.frame_at(tick));
    require(index < clip.clip().frame_count);
    RELIT_TRY(play_frame(clip, index, frame));
  }
  return {};
}

bool quick(const container::FileContents& contents) {
  constexpr unsigned kSide = 256, kVertices = 4096;
  for (const auto& model : contents.models)
    if (model.width > kSide || model.height > kSide) return false;
  for (const auto& layer : contents.layers)
    if (std::max({layer.coded_width, layer.coded_height, layer.exponent_width,
                  layer.exponent_height}) > 2 * kSide)
      return false;
  for (const auto& mesh : contents.meshes)
    if (mesh.vertex_count > kVertices) return false;
  return contents.layers.size() <= 8 && contents.meshes.size() <= 16;
}

}  // namespace

bool quick_to_play(Input file) {
  auto reader = container::Reader::open(std::make_unique<container::MemorySource>(file));
  if (!reader) return true;
  const auto contents = container::load_static(*reader);
  return !contents || quick(*contents);
}

Status play(Input file, const Playing& how) {
  player::ClipOptions options;
  options.planes = how.planes;
  options.layers = how.layers;
  RELIT_ASSIGN(auto clip, player::ClipReader::open(std::make_unique<container::MemorySource>(file),
                                                   "fuzz", options));
  player::ClipFrame frame;
  if (how.ticks) return play_ticks(clip, frame);
  const std::uint64_t end = std::min(clip.clip().frame_count, kMostFrames);
  Status first;
  for (std::uint64_t i = 0; i < end; ++i) {
    Status status = play_frame(clip, how.backwards ? end - 1 - i : i, frame);
    if (!status && first) first = std::move(status);
  }
  return first;
}

}  // namespace relit::fuzz
