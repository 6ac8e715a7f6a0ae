// SPDX-License-Identifier: MIT
// in_between light REFERENCE.npy STEP TRUE.npy HELD.npy BLENDED.npy: of every STEP frames all but
// the first are taken away; writes them, and what playing without them shows in their place: the
// frame before, or that and the one after blended. Light maps are linear in the transfer, as they
// are in planes, so a blend of transfer is the blend of light maps under every light.
//
// in_between pose TRUE.relit SPARSE.relit STEP: prints by how much the vertices of SPARSE, whose
// frame k is frame STEP·k of TRUE, are off in between, held and interpolated.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "container/reader.hpp"
#include "decoders/npy.hpp"
#include "decoders/pose.hpp"

namespace {

using namespace relit;

template <class T>
T take(Result<T> result) {
  if (result) return std::move(*result);
  std::fprintf(stderr, "in_between: %s\n", result.error().message.c_str());
  std::exit(1);
}

void check(const Status& status) {
  if (status) return;
  std::fprintf(stderr, "in_between: %s\n", status.error().message.c_str());
  std::exit(1);
}

// What an array of some of the frames is written to.
class Frames {
 public:
  Frames(const char* path, const decoders::NpyArray& like, std::size_t count)
      : writer_(take(decoders::NpyWriter::create(path, decoders::NpyWriter::Type::kFloat32,
                                                 shape_of(like, count)))) {}
  void write(std::span<const float> frame) { check(writer_.write(frame)); }
  void commit() { check(writer_.commit()); }

 private:
  static std::vector<std::uint64_t> shape_of(const decoders::NpyArray& like, std::size_t count) {
    std::vector<std::uint64_t> shape = like.shape;
    shape[0] = count;
    return shape;
  }
  decoders::NpyWriter writer_;
};

int light(char** argv) {
  const decoders::NpyArray reference = take(decoders::read_npy(argv[2]));
  const auto step = static_cast<std::size_t>(std::atoi(argv[3]));
  const std::size_t frames = reference.shape.at(0), size = reference.values.size() / frames;
  const std::size_t gaps = (frames - 1) / step;  // with a frame on both sides
  Frames truth(argv[4], reference, gaps * (step - 1));
  Frames held(argv[5], reference, gaps * (step - 1));
  Frames blended(argv[6], reference, gaps * (step - 1));
  const auto frame = [&](std::size_t k) {
    return std::span(reference.values).subspan(k * size, size);
  };
  std::vector<float> blend(size);
  for (std::size_t gap = 0; gap < gaps; ++gap) {
    const auto from = frame(gap * step), to = frame((gap + 1) * step);
    for (std::size_t i = 1; i < step; ++i) {
      const float t = static_cast<float>(i) / static_cast<float>(step);
      for (std::size_t v = 0; v < size; ++v) blend[v] = (1 - t) * from[v] + t * to[v];
      truth.write(frame(gap * step + i));
      held.write(from);
      blended.write(blend);
    }
  }
  truth.commit();
  held.commit();
  blended.commit();
  return 0;
}

// The first clip's meshes and poses, all of them decoded.
struct Poses {
  container::FileContents contents;
  std::vector<decoders::Mesh> meshes;
  std::optional<decoders::PoseTrack> track;

  explicit Poses(const char* path) {
    container::Reader reader =
        take(container::Reader::open(take(container::FileSource::open(path))));
    contents = take(container::load_static(reader));
    for (const container::MeshRecord& mesh : contents.meshes) {
      meshes.push_back(take(decoders::decode_mesh(mesh, contents.skeleton.palette.size(),
                                                  contents.skeleton.morph_weight_count)));
    }
    const container::PoseTrackRecord& record = contents.pose_tracks.at(0);
    track = take(decoders::PoseTrack::create(contents.skeleton, record, meshes));
    container::SegmentRecord segment;
    while (auto next = take(reader.next())) {
      if (auto* found = std::get_if<container::SegmentRecord>(&next->body)) segment = *found;
      auto* chunk = std::get_if<container::ChunkRecord>(&next->body);
      if (chunk == nullptr || chunk->track_id != record.track_id) continue;
      const container::Packet& packet = chunk->packets.at(0);
      check(track->add_packet(std::span(chunk->data).subspan(packet.offset, packet.size),
                              segment.first_frame, segment.frame_count));
    }
  }

  [[nodiscard]] std::uint64_t frames() const { return contents.clips.at(0).frame_count; }

  [[nodiscard]] std::vector<glm::vec3> vertices(double frame) const {
    decoders::Pose pose;
    check(track->sample(frame, pose));
    std::vector<glm::vec3> all, one;
    for (std::size_t m = 0; m < meshes.size(); ++m) {
      one.resize(meshes[m].positions.size());
      decoders::pose_mesh(meshes[m], m, pose, one, {});
      all.insert(all.end(), one.begin(), one.end());
    }
    return all;
  }
};

struct Error {
  double squares = 0, largest = 0;
  std::size_t count = 0;
  void add(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
    for (std::size_t i = 0; i < a.size(); ++i) {
      const auto distance = static_cast<double>(glm::length(a[i] - b[i]));
      squares += distance * distance;
      largest = std::max(largest, distance);
    }
    count += a.size();
  }
  void print(const char* name) const {
    std::printf("  %s vertices: RMS %.2f mm, largest %.1f mm\n", name,
                1000 * std::sqrt(squares / static_cast<double>(count)), 1000 * largest);
  }
};

int pose(char** argv) {
  const Poses truth(argv[2]), sparse(argv[3]);
  const auto step = static_cast<std::uint64_t>(std::atoi(argv[4]));
  if (truth.vertices(0).size() != sparse.vertices(0).size()) {
    std::fprintf(stderr, "in_between: the files hold different meshes\n");
    return 1;
  }
  Error held, blended;
  for (std::uint64_t gap = 0; gap < (truth.frames() - 1) / step; ++gap) {
    for (std::uint64_t i = 1; i < step; ++i) {
      const auto expected = truth.vertices(static_cast<double>(gap * step + i));
      const double at =
          static_cast<double>(gap) + static_cast<double>(i) / static_cast<double>(step);
      held.add(sparse.vertices(static_cast<double>(gap)), expected);
      blended.add(sparse.vertices(at), expected);
    }
  }
  held.print("held");
  blended.print("blended");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  if (what == "light" && argc == 7 && std::atoi(argv[3]) > 1) return light(argv);
  if (what == "pose" && argc == 5 && std::atoi(argv[4]) > 1) return pose(argv);
  std::fprintf(stderr,
               "usage: in_between light REFERENCE.npy STEP TRUE.npy HELD.npy BLENDED.npy\n"
               "       in_between pose TRUE.relit SPARSE.relit STEP\n");
  return 2;
}
