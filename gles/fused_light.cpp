// SPDX-License-Identifier: MIT
#include "gles/fused_light.hpp"

#include <algorithm>

#include "gles/shaders.hpp"

namespace relit::gles {
namespace {

// Vectors of the fragment shader's uniforms that are the material's, the sum's own or the
// compiler's.
constexpr int kFusedUniforms = 20;
constexpr int kFusedUnits = 16;

// Unit 1 is the material's.
int fused_unit_of(int sheet) { return sheet == 0 ? 0 : sheet + 1; }

}  // namespace

Result<std::unique_ptr<FusedLight>> FusedLight::create(const Device& device,
                                                       const PlaneSetDescription& description,
                                                       const PlaneSheets& sheets) {
  if (device.profile() == Profile::kEs2Mediump)
    return fail(ErrorCode::kUnsupported,
                "fragments are half floats on this GPU, too coarse to address the planes' texels; "
                "composite in texture space or on the CPU");
  const Capabilities& caps = device.caps();
  PlanePass::Limits limits;
  limits.units = std::min(caps.max_texture_units, kFusedUnits) - 1;
  limits.vectors = std::max(0, caps.max_fragment_uniform_vectors - kFusedUniforms);
  std::vector<PlanePass> passes = PlanePass::plan(description, sheets, limits);
  if (passes.size() > 1 || !passes.front().within(limits))
    return fail(ErrorCode::kUnsupported,
                std::to_string(description.planes.size()) +
                    " planes do not fit one shader here, which has " +
                    std::to_string(limits.units) + " texture units and " +
                    std::to_string(limits.vectors) +
                    " uniforms for them; composite in texture space or on the CPU");
  std::unique_ptr<FusedLight> fused(new FusedLight(sheets));
  fused->pass_ = std::move(passes.front());
  fused->weights_ = fused->pass_.make_weights();
  fused->variants_.emplace_back().counts = fused->pass_.all_of_one_frame();
  fused->width_ = description.width;
  fused->height_ = description.height;
  return fused;
}

Status FusedLight::set(const FoldedLight& light, const FrameSlots& frames) {
  RELIT_ASSIGN(const double normalisation, PlanePass::normalise(light, frames, sheets_));
  pass_.fill(light, frames, sheets_, normalisation, weights_);
  const auto known = std::find_if(variants_.begin(), variants_.end(), [&](const Variant& variant) {
    return variant.counts == weights_.counts;
  });
  variant_ = static_cast<std::size_t>(known - variants_.begin());
  if (known == variants_.end()) variants_.emplace_back().counts = weights_.counts;
  for (std::size_t c = 0; c < 3; ++c)
    constant_[c] = static_cast<float>(static_cast<double>(light.constant[c]) / normalisation +
                                      weights_.constant[c]);
  scale_ = static_cast<float>(normalisation);
  magnitude_ = light.magnitude;
  frames_ = frames;
  ++serial_;
  return {};
}

std::string FusedLight::text() const {
  return pass_.text(PlaneTaps::kFour, variants_[variant_].counts, sheets_) +
         std::string(shaders::composite_fused);
}

void FusedLight::locate(const Functions& gl, CharacterShader& shader) const {
  shader.planes = pass_.locate(gl, shader.program, fused_unit_of);
  shader.constant = gl.GetUniformLocation(shader.program.name(), "u_constant");
  gl.Uniform2f(gl.GetUniformLocation(shader.program.name(), "u_map_size"),
               static_cast<float>(width_), static_cast<float>(height_));
}

void FusedLight::bind(const Functions& gl) const {
  pass_.bind(gl, frames_, sheets_, fused_unit_of);
}

void FusedLight::apply(const Functions& gl, CharacterShader& shader) const {
  if (shader.fused_serial == serial_) return;
  shader.fused_serial = serial_;
  gl.Uniform3f(shader.constant, constant_[0], constant_[1], constant_[2]);
  pass_.set_weights(gl, shader.planes, weights_);
}

}  // namespace relit::gles
