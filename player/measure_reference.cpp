// SPDX-License-Identifier: MIT
#include "player/measure_reference.hpp"

#include <algorithm>
#include <cmath>

#include "container/base/limits.hpp"

namespace relit::player {
namespace {

bool ends_in(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

std::string shape_text(std::span<const std::uint64_t> shape) {
  std::string text;
  for (const std::uint64_t side : shape) text += "[" + std::to_string(side) + "]";
  return text;
}

}  // namespace

Result<MeasureReference> MeasureReference::open(const std::string& path, const std::string& clip) {
  MeasureReference reference;
  reference.path_ = path;
  RELIT_TRY(ends_in(path, ".npy") ? reference.open_npy() : reference.open_clip(clip));
  return reference;
}

Status MeasureReference::open_npy() {
  RELIT_ASSIGN(npy_, decoders::NpyReader::open(path_));
  std::vector<std::uint64_t> shape = npy_->shape();
  if (shape.size() == 4) shape.insert(shape.begin(), 1);
  const auto refuse = [&] {
    return fail(ErrorCode::kCorrupt,
                path_ +
                    ": a reference is [frames][1, 4, 9 or 16][3][height][width], as relit-bake "
                    "--reference writes it; this one is " +
                    shape_text(npy_->shape()));
  };
  if (shape.size() != 5 || shape[2] != 3) return refuse();
  constexpr std::uint64_t kSide = limits::kLightMapSide;
  if (shape[3] > kSide || shape[4] > kSide) return refuse();
  for (shape_.order = 0; static_cast<std::uint64_t>(shape_.coefficients()) != shape[1];)
    if (++shape_.order > 3) return refuse();
  shape_.frames = shape[0];
  shape_.size = {shape[4], shape[3]};
  return {};
}

Status MeasureReference::open_clip(const std::string& clip) {
  clip_ = clip;
  RELIT_ASSIGN(frames_of_clip_, TickFrames::open(path_, {clip, -1, 1}));
  const ClipReader& reader = frames_of_clip_->reader();
  const container::ModelRecord& model = reader.model();
  shape_.frames = reader.clip().duration_ticks;
  shape_.order = model.order;
  shape_.size = {model.width, model.height};
  if (model.prediction_plane < 0) return {};
  RELIT_ASSIGN(texels_, decoders::TexelNormals::create(reader.meshes(), model.width, model.height));
  normals_.resize(shape_.size.width * shape_.size.height);
  return {};
}

Status MeasureReference::load(std::uint64_t count) {
  if (count == 0 || count > shape_.frames) count = shape_.frames;
  ticks_.clear(), frames_.clear();
  for (std::uint64_t i = 0; i < count; ++i) {
    ticks_.push_back(i * shape_.frames / count);
    std::vector<float>& frame =
        frames_.emplace_back(static_cast<std::size_t>(shape_.coefficients()) * 3 *
                             shape_.size.width * shape_.size.height);
    RELIT_TRY(npy_ ? read(ticks_.back(), frame) : decode(ticks_.back(), frame));
  }
  return {};
}

Status MeasureReference::read(std::uint64_t tick, std::vector<float>& out) {
  RELIT_TRY(npy_->read(tick * out.size(), out));
  if (std::all_of(out.begin(), out.end(), [](float v) { return std::isfinite(v); })) return {};
  return fail(ErrorCode::kCorrupt, path_ + ": frame " + std::to_string(tick) +
                                       " holds numbers that are not finite; the reference of a "
                                       "bake has none");
}

Status MeasureReference::decode(std::uint64_t tick, std::vector<float>& out) {
  RELIT_ASSIGN(const FrameMix mix, frames_of_clip_->at(tick));
  RELIT_TRY(reconstruct(*mix.from, *mix.from_pose, out));
  if (mix.to == nullptr) return {};
  std::vector<float> to(out.size());
  RELIT_TRY(reconstruct(*mix.to, *mix.to_pose, to));
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = std::lerp(out[i], to[i], mix.blend);
  return {};
}

Status MeasureReference::reconstruct(const decoders::FrameView& planes, const decoders::Pose& pose,
                                     std::span<float> out) {
  const ClipReader& reader = frames_of_clip_->reader();
  if (texels_) texels_->compute(pose, normals_);
  return decoders::reconstruct(planes.planes(), reader.model(), reader.layers(), out, normals_);
}

}  // namespace relit::player
