// SPDX-License-Identifier: MIT
#include "player/frame_normals.hpp"

#include <algorithm>
#include <cmath>

#include "gles/plane_set.hpp"

namespace relit::player {
namespace {

constexpr int kZero = 32768;
constexpr float kOne = 1 / gles::kNormalScale;

}  // namespace

Result<FrameNormals> FrameNormals::create(std::span<const decoders::Mesh> meshes,
                                          const container::ModelRecord& model) {
  RELIT_ASSIGN(decoders::TexelNormals texels,
               decoders::TexelNormals::create(meshes, model.width, model.height));
  FrameNormals normals(std::move(texels), model.width, model.height);
  std::size_t vertices = 0, most = 0, indices = 0;
  for (const decoders::Mesh& mesh : meshes) {
    vertices += mesh.positions.size(), indices += mesh.indices.size();
    most = std::max(most, mesh.positions.size());
  }
  normals.table_bytes_ = decoders::TexelNormals::memory_bytes(
      std::size_t{model.width} * model.height, vertices, most, indices);
  return normals;
}

int FrameNormals::slot_of(std::uint64_t frame, const decoders::Pose& pose, int kept) {
  for (int i = 0; i < 2; ++i) {
    const Slot& slot = slots_[static_cast<std::size_t>(i)];
    if (slot.valid && slot.frame == frame) return i;
  }
  const int free = kept >= 0 ? 1 - kept : slots_[0].valid ? 1 : 0;
  Slot& slot = slots_[static_cast<std::size_t>(free)];
  slot.full.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  texels_.compute(pose, slot.full);
  slot.valid = true, slot.has_half = false;
  slot.frame = frame;
  return free;
}

std::span<const glm::vec3> FrameNormals::normals(int index, bool half) {
  Slot& slot = slots_[static_cast<std::size_t>(index)];
  if (!half) return slot.full;
  if (!slot.has_half) {
    slot.half.clear();
    slot.half.reserve(static_cast<std::size_t>((width_ + 1) / 2) *
                      static_cast<std::size_t>((height_ + 1) / 2));
    for (int y = 0; y < height_; y += 2)
      for (int x = 0; x < width_; x += 2)
        slot.half.push_back(
            slot.full[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                      static_cast<std::size_t>(x)]);
    slot.has_half = true;
  }
  return slot.half;
}

std::array<PlaneView, 3> FrameNormals::planes(int index) {
  Slot& slot = slots_[static_cast<std::size_t>(index)];
  const std::size_t texels = slot.full.size();
  samples_.resize(3 * texels);
  for (std::size_t p = 0; p < texels; ++p)
    for (std::size_t axis = 0; axis < 3; ++axis)
      samples_[axis * texels + p] = static_cast<std::uint16_t>(
          kZero + static_cast<int>(
                      std::lround(kOne * slot.full[p][static_cast<glm::vec3::length_type>(axis)])));
  std::array<PlaneView, 3> planes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    planes[axis].mantissa = {reinterpret_cast<const std::uint8_t*>(samples_.data() + axis * texels),
                             std::ptrdiff_t{2} * width_, width_, height_, 2};
    planes[axis].mantissa_zero = kZero;
    planes[axis].scale = gles::kNormalScale;
  }
  return planes;
}

void FrameNormals::forget() {
  for (Slot& slot : slots_) slot.valid = false;
}

std::size_t FrameNormals::memory_bytes(std::span<const container::MeshRecord> meshes,
                                       const container::ModelRecord& model, bool cpu, bool gpu) {
  std::size_t vertices = 0, most = 0, indices = 0;
  for (const container::MeshRecord& mesh : meshes) {
    vertices += mesh.vertex_count, indices += mesh.index_count;
    most = std::max<std::size_t>(most, mesh.vertex_count);
  }
  const std::size_t full = std::size_t{model.width} * model.height;
  const std::size_t quarter = std::size_t{(model.width + 1u) / 2} * ((model.height + 1u) / 2);
  std::size_t a_texel = 2 * sizeof(glm::vec3);
  if (gpu) a_texel += 3 * sizeof(std::uint16_t);
  return decoders::TexelNormals::memory_bytes(full, vertices, most, indices) + full * a_texel +
         (cpu ? 2 * quarter * sizeof(glm::vec3) : 0);
}

std::size_t FrameNormals::memory_bytes() const {
  std::size_t bytes = table_bytes_ + sizeof(std::uint16_t) * samples_.capacity();
  for (const Slot& slot : slots_)
    bytes += sizeof(glm::vec3) * (slot.full.capacity() + slot.half.capacity());
  return bytes;
}

}  // namespace relit::player
