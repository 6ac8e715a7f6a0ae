// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "player/relighter.hpp"

namespace relit::player {

void Relighter::FrameKey::set(const decoders::FrameView& view) {
  valid = true;
  frame = view.frame();
  samples.clear();
  for (const PlaneView& plane : view.planes()) {
    samples.push_back(plane.mantissa.data);
    samples.push_back(plane.exponent.data);
  }
}

// A frame that came with fewer planes before, or with more, is still the same frame.
bool Relighter::FrameKey::matches(const decoders::FrameView& view) const {
  const std::span<const PlaneView> planes = view.planes();
  if (!valid || frame != view.frame() || samples.size() != 2 * planes.size()) return false;
  const auto agree = [](const std::uint8_t* a, const std::uint8_t* b) {
    return a == b || a == nullptr || b == nullptr;
  };
  for (std::size_t k = 0; k < planes.size(); ++k) {
    if (!agree(samples[2 * k], planes[k].mantissa.data) ||
        !agree(samples[2 * k + 1], planes[k].exponent.data)) {
      return false;
    }
  }
  return true;
}

// What is left of a mix whose one frame has no share.
Result<FrameMix> Relighter::simplify(const FrameMix& mix) {
  if (mix.from == nullptr || !(mix.blend >= 0) || mix.blend > 1) {
    return fail(ErrorCode::kInvalid, "a composite needs a frame, and a blend from 0 to 1");
  }
  if (mix.to == nullptr || mix.blend == 0 || mix.to == mix.from)
    return FrameMix{mix.from, nullptr, 0, mix.from_pose};
  if (mix.blend == 1) return FrameMix{mix.to, nullptr, 0, mix.to_pose};
  return mix;
}

bool Relighter::is_done(const FrameMix& mix) const {
  if (!done_.valid || done_.light != light_serial_ || done_.path != path_ ||
      done_.blend != mix.blend || done_.to.valid != (mix.to != nullptr)) {
    return false;
  }
  // A plane that has come in since has to be added.
  const auto complete = [&](const FrameKey& key, const decoders::FrameView& frame) {
    if (!key.matches(frame)) return false;
    for (std::size_t k = 0; k < frame.planes().size(); ++k) {
      const bool new_one = key.samples[2 * k] == nullptr && !frame.planes()[k].mantissa.empty();
      if (new_one && needs_.planes()[k] != 0) return false;
    }
    return true;
  };
  return complete(done_.from, *mix.from) && (mix.to == nullptr || complete(done_.to, *mix.to));
}

void Relighter::note_done(const FrameMix& mix) {
  done_.valid = true;
  done_.from.set(*mix.from);
  done_.to.valid = false;
  if (mix.to != nullptr) done_.to.set(*mix.to);
  done_.blend = mix.blend;
  done_.light = light_serial_;
  done_.path = path_;
}

void Relighter::count_missing(const decoders::FrameView& frame) {
  for (std::size_t k = 0; k < frame.planes().size(); ++k) {
    if (needs_.planes()[k] != 0 && frame.planes()[k].mantissa.empty()) ++stats_.planes_missing;
  }
}

Status Relighter::composite(const FrameMix& given) {
  faded_.reset();
  has_faded_ = false;
  RELIT_ASSIGN(const FrameMix mix, simplify(given));
  if (!has_light_) return fail(ErrorCode::kInvalid, "a composite needs a light first");
  for (const decoders::FrameView* frame : {mix.from, mix.to}) {
    if (frame != nullptr && frame->planes().size() != weights_.size()) {
      return fail(ErrorCode::kInvalid, "a frame of " + std::to_string(frame->planes().size()) +
                                           " planes; the model has " +
                                           std::to_string(weights_.size()));
    }
  }
  RELIT_TRY(check_poses(mix));
  if (is_done(mix)) {
    ++stats_.skipped;
    return {};
  }
  done_.valid = false;
  map_.reset();
  count_missing(*mix.from);
  if (mix.to != nullptr) count_missing(*mix.to);
  RELIT_TRY(path_ == CompositePath::kCpu ? composite_on_cpu(mix) : composite_on_gpu(mix));
  ++stats_.composites;
  note_done(mix);
  return {};
}

Status Relighter::check_poses(const FrameMix& mix) const {
  if (!predicts_ || (mix.from_pose != nullptr && (mix.to == nullptr || mix.to_pose != nullptr)))
    return {};
  return fail(ErrorCode::kInvalid, "a model that predicts from normals needs its frames' poses");
}

Status Relighter::composite_on_cpu(const FrameMix& mix) {
  job_planes_.clear();
  job_weights_.clear();
  const auto add = [&](const decoders::FrameView& frame, double share) {
    for (std::size_t k = 0; k < weights_.size(); ++k) {
      const PlaneView& plane = frame.planes()[k];
      Rgb weight{};
      for (std::size_t c = 0; c < 3 && !plane.mantissa.empty(); ++c) {
        weight[c] = static_cast<float>(share * static_cast<double>(weights_[k][c]));
      }
      job_planes_.push_back(plane);
      job_weights_.push_back(weight);
    }
  };
  const auto blend = static_cast<double>(mix.blend);
  add(*mix.from, mix.to != nullptr ? 1 - blend : 1);
  if (mix.to != nullptr) add(*mix.to, blend);
  decoders::CompositeJob job;
  job.planes = job_planes_;
  job.light = light_;
  job.light.weights = job_weights_;
  job.width = model_->width, job.height = model_->height;
  job.every = half_size_ ? 2 : 1;
  if (predicts_) {
    const auto s = static_cast<std::size_t>(light_.prediction_plane);
    const int from = normals_->slot_of(mix.from->frame(), *mix.from_pose, -1);
    job.predictions[0] = {static_cast<int>(s), normals_->normals(from, half_size_),
                          mix.to != nullptr ? 1 - mix.blend : 1};
    if (mix.to != nullptr) {
      const int to = normals_->slot_of(mix.to->frame(), *mix.to_pose, from);
      job.predictions[1] = {static_cast<int>(weights_.size() + s),
                            normals_->normals(to, half_size_), mix.blend};
    }
  }
  job.out = std::span(composite_)
                .first(std::size_t{3} * static_cast<std::size_t>(width()) *
                       static_cast<std::size_t>(height()));
  RELIT_TRY(job.validate());
  job.run();
  if (options_.device == nullptr) return {};
  RELIT_ASSIGN(map_, upload_map(composite_));
  return {};
}

Result<gles::LightMap> Relighter::upload_map(std::span<const float> values) {
  const std::size_t half = half_size_ ? 1 : 0;
  RELIT_TRY(prepare_uploader(half));
  const auto size = static_cast<std::size_t>(width()) * static_cast<std::size_t>(height());
  RELIT_ASSIGN(gles::LightMap map,
               uploaders_[half]->upload(values.first(3 * size), light_.magnitude));
  if (half_size_) map.place = gles::half_place(model_->width, model_->height);
  return map;
}

int Relighter::slot_of(const decoders::FrameView& frame) const {
  for (std::size_t slot = 0; slot < slots_.size(); ++slot) {
    if (slots_[slot].matches(frame)) return static_cast<int>(slot);
  }
  return -1;
}

// Into the slot that has it, or the one that nobody needs: not `other_slot`.
Result<int> Relighter::upload(const decoders::FrameView& frame, const decoders::Pose* pose,
                              int other_slot) {
  int slot = slot_of(frame);
  const bool keep = slot >= 0;
  if (!keep) slot = other_slot >= 0 ? 1 - other_slot : 1 - frames_.from;
  std::uint64_t planes = 0;
  for (std::size_t k = 0; k < frame.planes().size(); ++k) {
    const bool there = keep && compositor_->holds(k, slot);
    if (needs_.planes()[k] != 0 && !frame.planes()[k].mantissa.empty() && !there) ++planes;
  }
  const std::size_t first_normal = frame.planes().size();
  const bool needs_normals = predicts_ && !(keep && compositor_->holds(first_normal, slot));
  FrameKey& key = slots_[static_cast<std::size_t>(slot)];
  if (keep && planes == 0 && !needs_normals) return slot;
  key.valid = false;
  gpu_planes_.assign(frame.planes().begin(), frame.planes().end());
  gpu_needs_.assign(needs_.planes().begin(), needs_.planes().end());
  if (normals_) {
    std::array<PlaneView, 3> normals;
    // Slots are the frames' own, as theirs on the GPU are: the other frame's normals stay.
    if (needs_normals) normals = normals_->planes(normals_->slot_of(frame.frame(), *pose, -1));
    gpu_planes_.insert(gpu_planes_.end(), normals.begin(), normals.end());
    gpu_needs_.insert(gpu_needs_.end(), 3, static_cast<std::uint8_t>(needs_normals));
  }
  RELIT_TRY(compositor_->upload(gpu_planes_, slot, gpu_needs_, keep));
  key.set(frame);
  ++stats_.uploads;
  stats_.planes_uploaded += planes;
  return slot;
}

// With weights for the planes of the normals too.
FoldedLight Relighter::gpu_light() const {
  FoldedLight light = light_;
  light.weights = gpu_weights_;
  return light;
}

Status Relighter::composite_on_gpu(const FrameMix& mix) {
  // Whichever frame is there already keeps its slot.
  const int to_slot = mix.to != nullptr ? slot_of(*mix.to) : -1;
  RELIT_ASSIGN(const int from, upload(*mix.from, mix.from_pose, to_slot));
  gles::FrameSlots frames{from, -1, 0};
  if (mix.to != nullptr) {
    RELIT_ASSIGN(frames.to, upload(*mix.to, mix.to_pose, from));
    frames.blend = mix.blend;
  }
  frames_ = frames;
  fused_ = nullptr;
  gpu_weights_.assign(weights_.begin(), weights_.end());
  if (normals_) gpu_weights_.insert(gpu_weights_.end(), 3, Rgb{});
  if (path_ == CompositePath::kFused) {
    RELIT_ASSIGN(fused_, compositor_->fuse(gpu_light(), frames_));
    return {};
  }
  RELIT_ASSIGN(map_, compositor_->composite(gpu_light(), frames_, half_size_));
  return {};
}

Result<gles::LightMap> Relighter::texture() {
  if (faded_) return *faded_;
  if (!done_.valid || options_.device == nullptr) {
    return fail(ErrorCode::kInvalid, "no light map has been composited on a GL device");
  }
  if (!map_) {
    RELIT_ASSIGN(map_, compositor_->composite(gpu_light(), frames_, half_size_));
  }
  return *map_;
}

Status Relighter::read(std::span<float> out) {
  const std::size_t size =
      std::size_t{3} * static_cast<std::size_t>(width()) * static_cast<std::size_t>(height());
  if (!done_.valid || out.size() != size) {
    return fail(ErrorCode::kInvalid,
                "a light map is read after a composite, into " + std::to_string(size) + " floats");
  }
  if (has_faded_) {
    std::copy_n(faded_on_cpu_.begin(), size, out.begin());
  } else if (faded_) {
    RELIT_TRY(mixer_->read_back(out));
  } else if (done_.path == CompositePath::kCpu) {
    std::copy_n(composite_.begin(), size, out.begin());
  } else {
    RELIT_TRY(texture());
    RELIT_TRY(compositor_->read_back(out));
  }
  for (float& value : out) value *= light_.magnitude;
  return {};
}

Status Relighter::fade(Relighter& to, float weight) {
  faded_.reset();
  has_faded_ = false;
  if (!(weight >= 0) || weight > 1 || &to == this || to.options_.device != options_.device) {
    return fail(ErrorCode::kInvalid,
                "a fade needs another light map of the same device, and a weight from 0 to 1");
  }
  if (!done_.valid || !to.done_.valid) {
    return fail(ErrorCode::kInvalid, "a fade needs both light maps composited");
  }
  if (weight == 0) return {};
  if (done_.path == CompositePath::kCpu && to.done_.path == CompositePath::kCpu) {
    RELIT_TRY(fade_on_cpu(to, weight));
    has_faded_ = true;
    if (options_.device == nullptr) return {};
    RELIT_ASSIGN(faded_, upload_map(faded_on_cpu_));
    return {};
  }
  RELIT_ASSIGN(const gles::LightMap mine, texture());
  RELIT_ASSIGN(const gles::LightMap other, to.texture());
  if (!mixer_ || mixer_->width() != width() || mixer_->height() != height()) {
    RELIT_ASSIGN(auto made,
                 gles::LightMapMixer::create(*options_.device, width(), height(), options_.format));
    mixer_ = std::make_unique<gles::LightMapMixer>(std::move(made));
  }
  RELIT_ASSIGN(faded_, mixer_->mix(mine, other, weight));
  return {};
}

// As the GPU does it: `to`'s map at the places of this one's texels, filtered bilinearly.
Status Relighter::fade_on_cpu(Relighter& to, float weight) {
  const int w = width(), h = height(), other_w = to.width(), other_h = to.height();
  const double step = half_size_ ? 2 : 1, other_step = to.half_size_ ? 2 : 1;
  const double ratio = static_cast<double>(weight) * static_cast<double>(to.light_.magnitude) /
                       static_cast<double>(light_.magnitude);
  faded_on_cpu_.resize(composite_.size());
  const auto texels = static_cast<std::size_t>(w) * static_cast<std::size_t>(h);
  const auto other_texels = static_cast<std::size_t>(other_w) * static_cast<std::size_t>(other_h);
  struct Taps {
    std::size_t low, high;
    double share;  // of high
  };
  // Texel i of a map lies at (i·step + ½) of its model's sides.
  const auto taps = [&](int i, int side, int other_side, int other_count) {
    const double place = (i * step + 0.5) * other_side / side;
    const double at = std::clamp((place - 0.5) / other_step, 0.0, other_count - 1.0);
    const auto low = static_cast<std::size_t>(at);
    return Taps{low, std::min(low + 1, static_cast<std::size_t>(other_count) - 1),
                at - static_cast<double>(low)};
  };
  std::size_t texel = 0;
  for (int y = 0; y < h; ++y) {
    const Taps row = taps(y, model_->height, to.model_->height, other_h);
    for (int x = 0; x < w; ++x, ++texel) {
      const Taps column = taps(x, model_->width, to.model_->width, other_w);
      for (std::size_t c = 0; c < 3; ++c) {
        const float* map = to.composite_.data() + c * other_texels;
        const auto at = [&](std::size_t j, std::size_t i) {
          return static_cast<double>(map[j * static_cast<std::size_t>(other_w) + i]);
        };
        const double low =
            std::lerp(at(row.low, column.low), at(row.low, column.high), column.share);
        const double high =
            std::lerp(at(row.high, column.low), at(row.high, column.high), column.share);
        faded_on_cpu_[c * texels + texel] =
            static_cast<float>((1 - static_cast<double>(weight)) *
                                   static_cast<double>(composite_[c * texels + texel]) +
                               ratio * std::lerp(low, high, row.share));
      }
    }
  }
  return {};
}

}  // namespace relit::player
