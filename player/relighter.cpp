// SPDX-License-Identifier: MIT
#include "player/relighter.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>

namespace relit::player {
namespace {

gles::PlaneDescription describe(const container::LayerRecord& layer,
                                const container::PlaneRecord& plane, int layer_number) {
  gles::PlaneDescription out;
  out.bit_depth = layer.bit_depth;
  out.mantissa_shift = layer.chroma == container::Chroma::k420 && plane.component > 0 ? 1 : 0;
  out.mantissa = {3 * layer_number + plane.component, plane.mantissa_rect.x >> out.mantissa_shift,
                  plane.mantissa_rect.y >> out.mantissa_shift};
  out.channels = 0;
  for (const container::MatrixEntry& entry : plane.matrix) out.channels |= 1u << entry.channel;
  out.has_exponent = layer.has_exponents;
  if (layer.has_exponents) {
    out.exponent_shift = std::countr_zero(static_cast<unsigned>(layer.exponent_block));
    out.exponent = {layer_number, plane.exponent_rect.x, plane.exponent_rect.y};
  }
  return out;
}

}  // namespace

gles::PlaneSetDescription describe_planes(const container::ModelRecord& model,
                                          std::span<const container::LayerRecord> layers) {
  gles::PlaneSetDescription description;
  description.width = model.width, description.height = model.height;
  for (std::size_t l = 0; l < layers.size(); ++l) {
    for (const container::PlaneRecord& plane : layers[l].planes) {
      description.planes.push_back(describe(layers[l], plane, static_cast<int>(l)));
    }
  }
  if (model.prediction_plane < 0) return description;
  description.prediction_plane = model.prediction_plane;
  description.normal_planes = static_cast<int>(description.planes.size());
  for (int axis = 0; axis < 3; ++axis) {
    gles::PlaneDescription normals;
    normals.bit_depth = 16;
    normals.channels = 0;
    normals.mantissa = {3 * static_cast<int>(layers.size()), 0, axis * model.height};
    description.planes.push_back(normals);
  }
  return description;
}

Result<std::unique_ptr<Relighter>> Relighter::create(const container::ModelRecord& model,
                                                     std::span<const container::LayerRecord> layers,
                                                     const RelightOptions& options) {
  std::unique_ptr<Relighter> relighter(new Relighter);
  relighter->model_ = &model;
  relighter->layers_ = layers;
  relighter->options_ = options;
  relighter->needs_ = PlaneNeeds(layers);
  if (model.prediction_plane >= 0) {
    if (options.meshes.empty())
      return fail(ErrorCode::kInvalid, "a model that predicts from normals needs the meshes");
    RELIT_ASSIGN(relighter->normals_, FrameNormals::create(options.meshes, model));
  }
  RELIT_TRY(relighter->set_path(options.path));
  return relighter;
}

Status Relighter::set_path(CompositePath path) {
  if (path != CompositePath::kAuto) {
    RELIT_TRY(prepare(path));
    measuring_.reset();
    path_ = path;
    options_.path = path;
    return {};
  }
  std::array<bool, kCompositePaths> available{};
  if (options_.device != nullptr) {
    const bool on_gpu = prepare(CompositePath::kTexture).has_value();
    available[static_cast<std::size_t>(CompositePath::kTexture)] = on_gpu;
    available[static_cast<std::size_t>(CompositePath::kFused)] =
        on_gpu && prepare(CompositePath::kFused).has_value();
  }
  PathChooser chooser(available);
  RELIT_TRY(prepare(chooser.path()));
  chooser_ = chooser;
  measuring_.reset();
  path_ = chooser_.path();
  options_.path = path;
  return {};
}

Status Relighter::prepare(CompositePath path) {
  if (path == CompositePath::kCpu) return prepare_cpu();
  if (options_.device == nullptr)
    return fail(ErrorCode::kInvalid,
                std::string("the path \"") + composite_path_name(path) + "\" needs a GL device");
  RELIT_TRY(prepare_gpu());
  return path == CompositePath::kFused ? compositor_->prepare_fused() : Status();
}

Status Relighter::prepare_cpu() {
  if (composite_.empty()) composite_.resize(std::size_t{3} * model_->width * model_->height);
  job_planes_.reserve(2 * needs_.planes().size());
  job_weights_.reserve(2 * needs_.planes().size());
  return options_.device != nullptr ? prepare_uploader(0) : Status();
}

Status Relighter::prepare_uploader(std::size_t half) {
  std::unique_ptr<gles::LightMapUploader>& uploader = uploaders_[half];
  if (uploader) return {};
  const auto side = [&](int full) { return half != 0 ? gles::half_side(full) : full; };
  RELIT_ASSIGN(auto made, gles::LightMapUploader::create(*options_.device, side(model_->width),
                                                         side(model_->height), options_.format));
  uploader = std::make_unique<gles::LightMapUploader>(std::move(made));
  return {};
}

Status Relighter::prepare_gpu() {
  if (compositor_) return {};
  gles::PlaneSetDescription description = describe_planes(*model_, layers_);
  description.format = options_.format;
  RELIT_ASSIGN(compositor_, gles::Compositor::create(*options_.device, description));
  for (FrameKey& slot : slots_) slot = {};
  return {};
}

Status Relighter::set_light(const decoders::Light& light, std::span<const std::uint8_t> decoded) {
  const Status folded = decoders::fold_light(*model_, layers_, light, folded_);
  if (!folded) {
    folded_.weights.assign(needs_.planes().size(), Rgb{});
    folded_.view = {};
    folded_.view.prediction_plane = model_->prediction_plane;
  }
  std::size_t plane = 0;
  for (std::size_t l = 0; l < layers_.size(); ++l) {
    const bool missing = l < decoded.size() && decoded[l] == 0;
    for (std::size_t k = 0; k < layers_[l].planes.size(); ++k, ++plane) {
      if (missing) folded_.weights[plane] = {0, 0, 0};
    }
  }
  folded_.view.weights = folded_.weights;
  has_light_ = true;
  change_light();
  return folded;
}

bool Relighter::set_quality(const RelightQuality& quality) {
  if (quality == quality_) return false;
  quality_ = quality;
  change_light();
  return true;
}

void Relighter::set_exposure(float exposure) {
  if (exposure == exposure_) return;
  exposure_ = exposure;
  change_light();
}

// The weights of the moment. Only where they differ from those before is there anything to do.
void Relighter::change_light() {
  if (!has_light_) return;
  needs_.update(folded_.view, quality_, exposure_);
  FoldedLight light = folded_.view;
  bool same = quality_.half_size == half_size_ && weights_.size() == light.weights.size() &&
              light.constant == light_.constant && light.magnitude == light_.magnitude &&
              (!predicts_ || light.irradiance == light_.irradiance);
  weights_.resize(light.weights.size());
  for (std::size_t k = 0; k < weights_.size(); ++k) {
    const Rgb weight = needs_.planes()[k] != 0 ? light.weights[k] : Rgb{};
    same = same && weight == weights_[k];
    weights_[k] = weight;
  }
  light.weights = weights_;
  light_ = light;
  const bool predicts = light.prediction_plane >= 0 &&
                        needs_.planes()[static_cast<std::size_t>(light.prediction_plane)] != 0;
  same = same && predicts == predicts_;
  predicts_ = predicts;
  if (!predicts_) light_.irradiance = {};
  half_size_ = quality_.half_size;
  if (!same) ++light_serial_;
}

void Relighter::forget() {
  done_.valid = false;
  if (normals_) normals_->forget();
  for (FrameKey& slot : slots_) slot.valid = false;
}

int Relighter::width() const {
  return half_size_ ? gles::half_side(model_->width) : static_cast<int>(model_->width);
}
int Relighter::height() const {
  return half_size_ ? gles::half_side(model_->height) : static_cast<int>(model_->height);
}

std::string Relighter::why() const {
  if (options_.path == CompositePath::kAuto) return chooser_.why();
  return std::string(composite_path_name(path_)) + ": asked for";
}

// Of what was composited: another path may have been set since.
Status Relighter::draw(gles::CharacterRenderer& renderer, const gles::View& view) {
  if (!faded_ && done_.valid && done_.path == CompositePath::kFused)
    return renderer.draw(view, *fused_);
  RELIT_ASSIGN(const gles::LightMap map, texture());
  return renderer.draw(view, map);
}

bool Relighter::wants_measuring(double covered_pixels) {
  return options_.path == CompositePath::kAuto &&
         (chooser_.wants_measuring(covered_pixels) || measuring_.has_value());
}

// The least of three, after one that compiles and allocates: what disturbs a measurement adds to
// it. Paths take turns, so that what goes on beside disturbs them all.
Result<bool> Relighter::measure(const FrameMix& mix, gles::CharacterRenderer& renderer,
                                const gles::View& view) {
  constexpr std::size_t kRounds = 4, kPaths = kCompositePaths;
  if (!measuring_) {
    measuring_ = Measuring{};
    measuring_->before = path_;
  }
  Measuring& m = *measuring_;
  const auto skip = [&] {
    while (m.step < kRounds * kPaths &&
           (m.failed[m.step % kPaths] || !chooser_.available(CompositePath(m.step % kPaths))))
      ++m.step;
  };
  bool drawn = false;
  for (skip(); !drawn && m.step < kRounds * kPaths; skip()) {
    const bool counts = m.step >= kPaths;
    const std::size_t path = m.step++ % kPaths;
    const Result<double> cost_s = time_path(CompositePath(path), mix, renderer, view);
    drawn = cost_s.has_value();
    double& least_s = m.least_s[path];
    if (drawn && counts && (least_s == 0 || *cost_s < least_s)) least_s = *cost_s;
    if (drawn) continue;
    if (CompositePath(path) == m.before) {
      measuring_.reset();
      return Unexpected{cost_s.error()};
    }
    m.failed[path] = true;
    least_s = 0;
  }
  if (m.step < kRounds * kPaths) return false;
  RELIT_TRY(end_measuring(mix));
  if (!drawn) RELIT_TRY(draw(renderer, view));
  return true;
}

Status Relighter::end_measuring(const FrameMix& mix) {
  chooser_.take(measuring_->least_s);
  measuring_.reset();
  path_ = chooser_.path();
  return composite(mix);
}

Result<double> Relighter::time_path(CompositePath path, const FrameMix& mix,
                                    gles::CharacterRenderer& renderer, const gles::View& view) {
  using Clock = std::chrono::steady_clock;
  RELIT_TRY(prepare(path));
  path_ = path;
  forget();
  options_.device->gl().Finish();
  const Clock::time_point start = Clock::now();
  RELIT_TRY(composite(mix));
  RELIT_TRY(draw(renderer, view));
  options_.device->gl().Finish();
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::size_t Relighter::gpu_bytes() const {
  std::size_t bytes = compositor_ ? compositor_->gpu_bytes() : 0;
  for (const auto& uploader : uploaders_)
    if (uploader) bytes += uploader->gpu_bytes();
  return bytes + (mixer_ ? mixer_->gpu_bytes() : 0);
}

std::size_t Relighter::cpu_bytes() const {
  std::size_t bytes = sizeof(float) * (composite_.size() + faded_on_cpu_.size());
  if (normals_) bytes += normals_->memory_bytes();
  if (compositor_) bytes += compositor_->cpu_bytes();
  for (const auto& uploader : uploaders_)
    if (uploader) bytes += uploader->cpu_bytes();
  return bytes;
}

}  // namespace relit::player
