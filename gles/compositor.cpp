// SPDX-License-Identifier: MIT
#include "gles/compositor.hpp"

#include <algorithm>
#include <cmath>

#include "gles/shaders.hpp"

namespace relit::gles {
namespace {

// Texels on a grid by which a square-root light map finds its peak.
constexpr int kSampleSide = 16;
constexpr std::size_t kSamples = std::size_t{kSampleSide} * kSampleSide;
// Room above the sampled peak: the brightest texel lies between the samples.
constexpr double kPeakMargin = 1.5;
// Vectors of a fragment shader's uniforms that are not planes' (constants of the compiler
// included).
constexpr int kReservedUniforms = 12;
constexpr int kMediumpLookups = 16;
constexpr int kMostUnits = 8;

int unit_of(int sheet) { return sheet; }

double value_at(const PlaneView& plane, int x, int y) {
  const double mantissa = plane.mantissa.at(x >> plane.mantissa_shift, y >> plane.mantissa_shift);
  int exponent = plane.exponent_zero;
  if (!plane.exponent.empty()) {
    exponent = plane.exponent.at(x >> plane.exponent_shift, y >> plane.exponent_shift);
    if (exponent == 0) return 0;
  }
  return std::ldexp(static_cast<double>(plane.scale) * (mantissa - plane.mantissa_zero),
                    exponent - plane.exponent_zero);
}

PlanePass::Limits limits_of(const Device& device) {
  const Capabilities& caps = device.caps();
  PlanePass::Limits limits;
  limits.units = std::min(caps.max_texture_units, kMostUnits);
  limits.vectors = std::max(0, caps.max_fragment_uniform_vectors - kReservedUniforms);
  // Two vec2 share a varying vector: packing is part of the language (GLSL ES 1.00, appendix A.7).
  if (device.profile() == Profile::kEs2Mediump)
    limits.lookups = std::min({kMediumpLookups, 2 * caps.max_varying_vectors,
                               caps.max_vertex_uniform_vectors - kReservedUniforms});
  return limits;
}

}  // namespace

Result<std::unique_ptr<Compositor>> Compositor::create(const Device& device,
                                                       const PlaneSetDescription& description) {
  RELIT_TRY(device.ready("creating the compositor"));
  std::unique_ptr<Compositor> compositor(new Compositor(device));
  Compositor& c = *compositor;
  RELIT_ASSIGN(c.storage_, choose_light_map_storage(device, description.format, true));
  StateGuard guard(device);
  RELIT_ASSIGN(c.sheets_, PlaneSheets::create(device, description));
  c.description_ = description;
  for (PlanePass& planes : PlanePass::plan(description, c.sheets_, limits_of(device)))
    c.passes_.emplace_back().planes = std::move(planes);
  c.can_add_ = c.storage_.format == LightMapFormat::kHalfFloat ||
               (c.storage_.format == LightMapFormat::kFloat && device.caps().float_blend);
  if (c.pass_count() > 1 && !c.can_add_)
    return fail(ErrorCode::kUnsupported,
                std::to_string(description.planes.size()) + " planes need " +
                    std::to_string(c.pass_count()) +
                    " passes on this GPU, which cannot add them up in the light map's format; "
                    "composite on the CPU (--composite cpu)");
  for (Pass& pass : c.passes_) RELIT_TRY(c.build_pass(pass));
  RELIT_TRY(c.make_target(c.targets_[0], description.width, description.height));
  if (c.storage_.format == LightMapFormat::kSquareRoot8)
    c.samples_.resize(static_cast<std::size_t>(c.sheets_.slot_count()) * description.planes.size() *
                      kSamples);
  RELIT_TRY(device.check("creating the compositor"));
  return compositor;
}

Status Compositor::build_pass(Pass& pass) {
  pass.uniforms = pass.planes.make_uniforms();
  const bool unrolled = limits_of(device_).lookups > 0;
  const auto lookups =
      unrolled
          ? static_cast<std::size_t>(pass.planes.group_count() * pass.planes.lookups_per_group())
          : std::size_t{0};
  std::string varyings, assignments, defines;
  for (std::size_t i = 0; i < lookups; ++i) {
    const std::string v = "v" + std::to_string(i);
    varyings += "VARYING vec2 " + v + ";\n";
    assignments += v + " = PLACE(" + std::to_string(i) + "); ";
  }
  if (lookups > 0)
    defines += "LOOKUPS " + std::to_string(lookups) + "\nASSIGN_PLACES " + assignments + "\n";
  if (storage_.format == LightMapFormat::kSquareRoot8) defines += "SQUARE_ROOT 1\n";
  std::string sum;
  if (storage_.format == LightMapFormat::kSquareRoot8) sum = "uniform float u_to_unit;\n";
  if (unrolled) {
    sum += pass.planes.samplers() + pass.planes.unrolled_uniforms() +
           "void main() {\n  vec3 sum = u_constant;\n" + pass.planes.unrolled_statements();
  } else {
    sum += pass.planes.text(PlaneTaps::kOne) +
           "VARYING vec2 v_texel;\nvoid main() {\n  tap_at = v_texel;\n  vec3 sum = plane_sum();\n";
  }
  const std::string_view vertex[] = {varyings, shaders::composite_vert};
  const std::string_view fragment[] = {varyings, shaders::dither, sum, shaders::composite_tail};
  const std::string_view attributes[] = {"a_position"};
  RELIT_ASSIGN(pass.program, build_program(device_.gl(), device_.profile(),
                                           {"composite", defines, vertex, fragment, attributes}));
  const Functions& gl = device_.gl();
  const GLuint program = pass.program.name();
  pass.constant = gl.GetUniformLocation(program, "u_constant");
  pass.texels = gl.GetUniformLocation(program, "u_texels");
  pass.to_unit = gl.GetUniformLocation(program, "u_to_unit");
  pass.place = gl.GetUniformLocation(program, "u_place");
  pass.weight = gl.GetUniformLocation(program, "u_weight");
  gl.UseProgram(program);
  pass.locations = pass.planes.locate(gl, pass.program, unit_of);
  if (!unrolled) return {};
  places_.resize(std::max(places_.size(), 4 * lookups));
  weights_.resize(std::max(
      weights_.size(),
      4 * static_cast<std::size_t>(pass.planes.group_count() * pass.planes.planes_per_group())));
  return {};
}

Status Compositor::make_target(Target& target, int width, int height) const {
  const Functions& gl = device_.gl();
  target.width = width;
  target.height = height;
  target.texture = make_texture(device_, storage_.texture, width, height);
  target.framebuffer = FramebufferObject(gl);
  gl.BindFramebuffer(GL_FRAMEBUFFER, target.framebuffer.name());
  gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D,
                          target.texture.name(), 0);
  if (gl.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    return fail(ErrorCode::kUnsupported, "the GPU refuses to draw into a light map of " +
                                             std::to_string(width) + "x" + std::to_string(height) +
                                             " texels");
  return device_.check("creating a light map");
}

Status Compositor::upload(std::span<const PlaneView> planes, int slot,
                          std::span<const std::uint8_t> wanted, bool keep) {
  RELIT_TRY(device_.ready("uploading planes"));
  StateGuard guard(device_);
  RELIT_TRY(sheets_.upload(planes, slot, wanted, keep));
  last_slot_ = slot;
  if (!samples_.empty()) sample_planes(planes, slot);
  return device_.check("uploading planes");
}

Status Compositor::upload(std::span<const PlaneView> planes) {
  return upload(planes, (last_slot_ + 1) % sheets_.slot_count());
}

void Compositor::sample_planes(std::span<const PlaneView> planes, int slot) {
  const int width = description_.width, height = description_.height;
  for (std::size_t k = 0; k < planes.size(); ++k) {
    float* out = samples_.data() + (static_cast<std::size_t>(slot) * planes.size() + k) * kSamples;
    if (planes[k].mantissa.empty() || !holds(k, slot)) {
      std::fill(out, out + kSamples, 0.0f);
      continue;
    }
    for (int j = 0; j < kSampleSide; ++j)
      for (int i = 0; i < kSampleSide; ++i)
        *out++ = static_cast<float>(value_at(planes[k], (2 * i + 1) * width / (2 * kSampleSide),
                                             (2 * j + 1) * height / (2 * kSampleSide)));
  }
}

double Compositor::sampled_peak(const FoldedLight& light, const FrameSlots& frames) const {
  double peak = 0;
  const std::size_t planes = light.weights.size();
  for (std::size_t i = 0; i < kSamples; ++i) {
    double sum[3] = {};
    for (std::size_t c = 0; c < 3; ++c) sum[c] = static_cast<double>(light.constant[c]);
    for (int role = 0; role < FrameSlots::kRoles; ++role) {
      const auto share = static_cast<double>(frames.weight(role));
      if (share == 0) continue;
      const float* samples =
          samples_.data() + static_cast<std::size_t>(frames.slot(role)) * planes * kSamples + i;
      for (std::size_t k = 0; k < planes; ++k)
        for (std::size_t c = 0; c < 3; ++c)
          sum[c] += share * static_cast<double>(light.weights[k][c]) *
                    static_cast<double>(samples[k * kSamples]);
    }
    peak = std::max({peak, sum[0], sum[1], sum[2]});
  }
  return peak > 1e-30 ? kPeakMargin * peak : 1.0;
}

Result<LightMap> Compositor::composite(const FoldedLight& light) {
  return composite(light, {last_slot_, -1, 0});
}

Result<LightMap> Compositor::composite(const FoldedLight& light, const FrameSlots& frames,
                                       bool half_size) {
  RELIT_TRY(device_.ready("compositing"));
  if (last_slot_ < 0) return fail(ErrorCode::kInvalid, "no planes have been uploaded yet");
  const bool blend = frames.weight(0) > 0 && frames.weight(1) > 0;
  if (blend && !can_add_ && passes_.size() > 1) return composite_apart(light, frames, half_size);
  mixed_ = nullptr;
  return composite_into(targets_[half_size ? 1 : 0], light, frames, half_size);
}

// Where a blend takes several passes that the target cannot add up: each frame by itself, then
// both.
Result<LightMap> Compositor::composite_apart(const FoldedLight& light, const FrameSlots& frames,
                                             bool half_size) {
  const std::size_t half = half_size ? 1 : 0;
  RELIT_ASSIGN(const LightMap from,
               composite_into(targets_[half], light, {frames.from, -1, 0}, half_size));
  RELIT_ASSIGN(const LightMap to,
               composite_into(targets_[2 + half], light, {frames.to, -1, 0}, half_size));
  std::unique_ptr<LightMapMixer>& mixer = mixers_[half];
  if (!mixer) {
    RELIT_ASSIGN(LightMapMixer made,
                 LightMapMixer::create(device_, from.width, from.height, storage_.format));
    mixer = std::make_unique<LightMapMixer>(std::move(made));
  }
  RELIT_ASSIGN(result_, mixer->mix(from, to, frames.blend));
  mixed_ = mixer.get();
  return result_;
}

Result<LightMap> Compositor::composite_into(Target& target, const FoldedLight& light,
                                            const FrameSlots& frames, bool half_size) {
  RELIT_ASSIGN(const double normalisation, PlanePass::normalise(light, frames, sheets_));
  StateGuard guard(device_, kMostUnits);
  const int width = description_.width, height = description_.height;
  if (!target.texture)
    RELIT_TRY(make_target(target, half_size ? half_side(width) : width,
                          half_size ? half_side(height) : height));
  result_ = {};
  result_.texture = target.texture.name();
  result_.width = target.width;
  result_.height = target.height;
  result_.linear_filter = storage_.linear_filter;
  result_.scale = static_cast<float>(normalisation);
  result_.magnitude = light.magnitude;
  if (half_size) result_.place = half_place(width, height);
  if (storage_.format == LightMapFormat::kSquareRoot8) {
    result_.square_root = true;
    result_.scale = static_cast<float>(sampled_peak(light, frames));
  }
  Drawing drawing{
      light, frames, normalisation, {static_cast<float>(width), static_cast<float>(height), 0, 0}};
  if (half_size)
    drawing.texels = {2 * static_cast<float>(target.width), 2 * static_cast<float>(target.height),
                      -0.5f, -0.5f};
  const Functions& gl = device_.gl();
  gl.BindFramebuffer(GL_FRAMEBUFFER, target.framebuffer.name());
  gl.Viewport(0, 0, target.width, target.height);
  bool first = true;
  for (Pass& pass : passes_)
    if (draw_pass(pass, drawing, first)) first = false;
  drawn_ = &target;
  RELIT_TRY(device_.check("compositing"));
  return result_;
}

bool Compositor::draw_pass(Pass& pass, const Drawing& drawing, bool first) {
  const bool any = pass.planes.fill(drawing.light, drawing.frames, sheets_, drawing.normalisation,
                                    pass.uniforms);
  // Only one pass need run where nothing has a weight: somebody has to write the constant.
  if (!any && (!first || &pass != &passes_.back())) return false;

  const Functions& gl = device_.gl();
  gl.UseProgram(pass.program.name());
  pass.planes.bind(gl, drawing.frames, sheets_, unit_of);
  const double scale = first ? 1 / drawing.normalisation : 0;
  std::array<float, 3> constant{};
  for (std::size_t c = 0; c < 3; ++c)
    constant[c] = static_cast<float>(static_cast<double>(drawing.light.constant[c]) * scale);
  gl.Uniform3f(pass.constant, constant[0], constant[1], constant[2]);
  gl.Uniform4f(pass.texels, drawing.texels[0], drawing.texels[1], drawing.texels[2],
               drawing.texels[3]);
  if (pass.to_unit >= 0)
    gl.Uniform1f(pass.to_unit,
                 static_cast<float>(drawing.normalisation / static_cast<double>(result_.scale)));
  if (pass.place >= 0) {
    set_lookups(pass);
  } else {
    pass.planes.set_uniforms(gl, pass.locations, pass.uniforms);
  }
  if (!first) {
    gl.Enable(GL_BLEND);
    gl.BlendFunc(GL_ONE, GL_ONE);
  }
  device_.draw_fullscreen();
  return true;
}

// Groups with a weight take the first varyings; the rest repeat the first place with no weight.
// PlanePass left [place, weight]… per group; here places and weights go to different stages.
void Compositor::set_lookups(const Pass& pass) {
  const auto planes = static_cast<std::size_t>(pass.planes.planes_per_group());
  const auto lookups = static_cast<std::size_t>(pass.planes.lookups_per_group());
  const auto stride = static_cast<std::size_t>(pass.planes.stride());
  const auto groups = static_cast<std::size_t>(pass.planes.group_count());
  const PlanePass::Uniforms::Part& part = pass.uniforms.parts.front();
  std::fill(weights_.begin(), weights_.end(), 0.0f);
  // E_ref of the unused ones: 2^(E - 255) is at most 1, and never an infinity that 0 would not
  // cancel.
  for (std::size_t i = 3; i < weights_.size(); i += 4) weights_[i] = 255;
  for (std::size_t g = 0; g < groups; ++g) {
    const bool used = g < static_cast<std::size_t>(part.count);
    const float* group = part.data.data() + (used ? 4 * g * stride : 0);
    for (std::size_t i = 0; i < lookups; ++i) {
      const float* place = group + (i < planes ? 8 * i : 4 * (stride - 1));
      std::copy(place, place + 4,
                places_.begin() + static_cast<std::ptrdiff_t>(4 * (g * lookups + i)));
      if (i < planes && used)
        std::copy(place + 4, place + 8,
                  weights_.begin() + static_cast<std::ptrdiff_t>(4 * (g * planes + i)));
    }
  }
  const Functions& gl = device_.gl();
  gl.Uniform4fv(pass.place, static_cast<GLsizei>(groups * lookups), places_.data());
  gl.Uniform4fv(pass.weight, static_cast<GLsizei>(groups * planes), weights_.data());
}

Status Compositor::prepare_fused() {
  if (fused_) return {};
  RELIT_ASSIGN(fused_, FusedLight::create(device_, description_, sheets_));
  return {};
}

Result<FusedLight*> Compositor::fuse(const FoldedLight& light, const FrameSlots& frames) {
  RELIT_TRY(prepare_fused());
  if (last_slot_ < 0) return fail(ErrorCode::kInvalid, "no planes have been uploaded yet");
  RELIT_TRY(fused_->set(light, frames));
  return fused_.get();
}

Status Compositor::read_back(std::span<float> out) {
  RELIT_TRY(device_.ready("reading a light map back"));
  const std::size_t texels =
      static_cast<std::size_t>(result_.width) * static_cast<std::size_t>(result_.height);
  if (drawn_ == nullptr || out.size() != 3 * texels)
    return fail(ErrorCode::kInvalid,
                "reading back a light map needs a composite first and room for " +
                    std::to_string(3 * texels) + " floats");
  if (mixed_ != nullptr) return mixed_->read_back(out);
  StateGuard guard(device_);
  pixels_.resize(4 * texels);
  device_.gl().BindFramebuffer(GL_FRAMEBUFFER, drawn_->framebuffer.name());
  return read_light_map(device_, result_, pixels_, out);
}

int Compositor::pass_count() const {
  return static_cast<int>(std::count_if(passes_.begin(), passes_.end(), [](const Pass& pass) {
    return pass.planes.has_role(0) || pass.planes.unit_count() == 0;
  }));
}

std::size_t Compositor::gpu_bytes() const {
  std::size_t bytes = sheets_.gpu_bytes();
  for (const Target& target : targets_)
    if (target.texture)
      bytes += static_cast<std::size_t>(target.width) * static_cast<std::size_t>(target.height) *
               static_cast<std::size_t>(storage_.texture.bytes_per_texel);
  for (const auto& mixer : mixers_)
    if (mixer) bytes += mixer->gpu_bytes();
  return bytes;
}

std::size_t Compositor::cpu_bytes() const {
  return sheets_.cpu_bytes() +
         sizeof(float) * (places_.size() + weights_.size() + samples_.size() + pixels_.capacity());
}

}  // namespace relit::gles
