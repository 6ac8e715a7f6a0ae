// SPDX-License-Identifier: MIT
#include "player/relighter.hpp"

#include <array>
#include <bit>

namespace relit::player {
namespace {

struct BackendName {
  Backend backend;
  const char* name;
};
constexpr std::array<BackendName, 5> kBackends{{{Backend::kEgl, "egl"},
                                                {Backend::kEglEs2, "egl-es2"},
                                                {Backend::kEglEs2Mediump, "egl-es2-mediump"},
                                                {Backend::kOsmesa, "osmesa"},
                                                {Backend::kCpu, "cpu"}}};

gles::PlaneDescription describe(const container::LayerRecord& layer,
                                const container::PlaneRecord& plane, int layer_number) {
  gles::PlaneDescription out;
  out.bit_depth = layer.bit_depth;
  out.mantissa_shift = layer.chroma == container::Chroma::k420 && plane.component > 0 ? 1 : 0;
  out.mantissa = {3 * layer_number + plane.component, plane.mantissa_rect.x >> out.mantissa_shift,
                  plane.mantissa_rect.y >> out.mantissa_shift};
  out.has_exponent = layer.has_exponents;
  if (layer.has_exponents) {
    out.exponent_shift = std::countr_zero(static_cast<unsigned>(layer.exponent_block));
    out.exponent = {layer_number, plane.exponent_rect.x, plane.exponent_rect.y};
  }
  return out;
}

Result<GlBackend> open_kind(gles::OffscreenKind kind, std::optional<gles::Profile> profile) {
  GlBackend backend;
  RELIT_ASSIGN(backend.context, gles::OffscreenContext::create(kind));
  gles::DeviceOptions options;
  options.get_proc_address = backend.context->get_proc_address();
  options.profile = profile;
  RELIT_ASSIGN(backend.device, gles::Device::create(options));
  return backend;
}

}  // namespace

Result<Backend> parse_backend(const std::string& name) {
  for (const BackendName& known : kBackends) {
    if (name == known.name) return known.backend;
  }
  return fail(ErrorCode::kInvalid,
              "--backend " + name + ": it must be egl, egl-es2, egl-es2-mediump, osmesa or cpu");
}

const char* backend_name(Backend backend) {
  for (const BackendName& known : kBackends) {
    if (backend == known.backend) return known.name;
  }
  return "?";
}

Result<GlBackend> open_backend(Backend backend) {
  switch (backend) {
    case Backend::kEgl:
      return open_kind(gles::OffscreenKind::kEglEs3, gles::Profile::kEs3);
    case Backend::kEglEs2:
      return open_kind(gles::OffscreenKind::kEglEs2, gles::Profile::kEs2);
    case Backend::kEglEs2Mediump:
      return open_kind(gles::OffscreenKind::kEglEs2, gles::Profile::kEs2Mediump);
    case Backend::kOsmesa:
      return open_kind(gles::OffscreenKind::kOsmesa, std::nullopt);
    case Backend::kCpu:
      break;
  }
  auto egl = open_kind(gles::OffscreenKind::kEglEs3, std::nullopt);
  if (egl) return egl;
  auto es2 = open_kind(gles::OffscreenKind::kEglEs2, gles::Profile::kEs2);
  if (es2) return es2;
  auto osmesa = open_kind(gles::OffscreenKind::kOsmesa, std::nullopt);
  if (osmesa) return osmesa;
  return fail(ErrorCode::kEnvironment, egl.error().message + "; " + osmesa.error().message);
}

Result<std::unique_ptr<Relighter>> Relighter::create(const container::ModelRecord& model,
                                                     std::span<const container::LayerRecord> layers,
                                                     const gles::Device* device, bool on_gpu) {
  std::unique_ptr<Relighter> relighter(new Relighter);
  relighter->model_ = &model;
  relighter->layers_ = layers;
  if (device != nullptr && on_gpu) {
    gles::PlaneSetDescription description;
    description.width = model.width, description.height = model.height;
    for (std::size_t l = 0; l < layers.size(); ++l) {
      for (const container::PlaneRecord& plane : layers[l].planes) {
        description.planes.push_back(describe(layers[l], plane, static_cast<int>(l)));
      }
    }
    RELIT_ASSIGN(relighter->compositor_, gles::Compositor::create(*device, description));
    return relighter;
  }
  relighter->composite_.resize(std::size_t{3} * model.width * model.height);
  if (device != nullptr) {
    RELIT_ASSIGN(auto uploader, gles::LightMapUploader::create(*device, model.width, model.height));
    relighter->uploader_ = std::make_unique<gles::LightMapUploader>(std::move(uploader));
  }
  return relighter;
}

Status Relighter::set_light(const decoders::Light& light, std::span<const std::uint8_t> decoded) {
  RELIT_TRY(decoders::fold_light(*model_, layers_, light, folded_));
  std::size_t plane = 0;
  for (std::size_t l = 0; l < layers_.size(); ++l) {
    const bool missing = l < decoded.size() && decoded[l] == 0;
    for (std::size_t k = 0; k < layers_[l].planes.size(); ++k, ++plane) {
      if (missing) folded_.weights[plane] = {0, 0, 0};
    }
  }
  folded_.view.weights = folded_.weights;
  return {};
}

Status Relighter::composite(const decoders::FrameView& frame) {
  if (compositor_) {
    RELIT_TRY(compositor_->upload(frame.planes()));
    RELIT_ASSIGN(light_map_, compositor_->composite(folded_.view));
    return {};
  }
  decoders::CompositeJob job;
  job.planes = frame.planes();
  job.light = folded_.view;
  job.width = model_->width, job.height = model_->height;
  job.out = composite_;
  RELIT_TRY(job.validate());
  job.run();
  if (!uploader_) return {};
  RELIT_ASSIGN(light_map_, uploader_->upload(composite_, folded_.view.magnitude));
  return {};
}

Result<gles::LightMap> Relighter::texture() {
  if (light_map_.texture == 0)
    return fail(ErrorCode::kInvalid, "no light map has been composited on a GL device");
  return light_map_;
}

Status Relighter::read(std::span<float> out) {
  if (compositor_) {
    RELIT_TRY(compositor_->read_back(out));
  } else if (out.size() == composite_.size()) {
    std::copy(composite_.begin(), composite_.end(), out.begin());
  } else {
    return fail(ErrorCode::kInvalid, "light map: a span of the wrong size");
  }
  for (float& value : out) value *= folded_.view.magnitude;
  return {};
}

}  // namespace relit::player
