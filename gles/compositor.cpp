// SPDX-License-Identifier: MIT
#include "gles/compositor.hpp"

#include <algorithm>
#include <cfloat>
#include <cmath>

#include "gles/prediction.hpp"
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

// llvmpipe gathers each number of a uniform again for every eight pixels, which takes as long as a
// third of a texel's lookup. On a GPU uniforms cost nothing, and inputs do.
int flat_vectors(const Device& device) {
  const Capabilities& caps = device.caps();
  const bool worth = caps.renderer.find("llvmpipe") != std::string::npos;
  return device.profile() == Profile::kEs3 && worth ? caps.max_varying_vectors - 1 : 0;
}

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
  for (Pass& pass : c.passes_) pass.weights = pass.planes.make_weights();
  // One shader to begin with, so that what a driver refuses comes out here.
  RELIT_TRY(c.build_first_shader());
  RELIT_TRY(c.make_target(c.targets_[0], description.width, description.height));
  if (c.storage_.format == LightMapFormat::kSquareRoot8)
    c.samples_.resize(static_cast<std::size_t>(c.sheets_.slot_count()) * description.planes.size() *
                      kSamples);
  RELIT_TRY(device.check("creating the compositor"));
  return compositor;
}

bool Compositor::has_lookups() const { return device_.profile() == Profile::kEs2Mediump; }

// All planes of one frame.
Status Compositor::build_first_shader() {
  Pass& pass = passes_.front();
  RELIT_ASSIGN(Shader shader, build_shader(pass, pass.planes.all_of_one_frame()));
  pass.shaders.push_back(std::move(shader));
  return {};
}

Result<Compositor::Shader*> Compositor::shader_for(Pass& pass) {
  for (Shader& shader : pass.shaders)
    if (has_lookups() || shader.counts == pass.weights.counts) return &shader;
  RELIT_ASSIGN(Shader shader, build_shader(pass, pass.weights.counts));
  return &pass.shaders.emplace_back(std::move(shader));
}

Result<Compositor::Shader> Compositor::build_shader(const Pass& pass,
                                                    std::span<const int> counts) const {
  const bool roots = storage_.format == LightMapFormat::kSquareRoot8;
  std::string vertex_text, sum = roots ? "uniform float u_to_unit;\n" : "";
  if (has_lookups()) {
    const PlanePass::LookupText text = pass.planes.lookup_text(sheets_);
    vertex_text =
        text.varyings + std::string(shaders::composite_lookup_vert) + text.assignments + "}\n";
    sum += text.varyings + text.uniforms + "void main() {\n  vec3 sum = u_constant;\n" +
           text.statements;
  } else {
    FlatWeights flat(flat_vectors(device_));
    const std::string planes = pass.planes.text(PlaneTaps::kOne, counts, sheets_, &flat);
    vertex_text = pass.planes.weight_declarations(counts) + flat.outputs() +
                  std::string(shaders::composite_vert);
    sum += flat.inputs() + planes +
           "VARYING vec2 v_texel;\nvoid main() {\n  tap_at = v_texel;\n  vec3 sum = plane_sum();\n";
  }
  const std::string_view vertex[] = {vertex_text};
  const std::string_view fragment[] = {shaders::dither, sum, shaders::composite_tail};
  const std::string_view attributes[] = {"a_position"};
  const Functions& gl = device_.gl();
  Shader shader;
  shader.counts.assign(counts.begin(), counts.end());
  RELIT_ASSIGN(shader.program, build_program(gl, device_.profile(),
                                             {"composite", roots ? "SQUARE_ROOT 1\n" : "", vertex,
                                              fragment, attributes}));
  const GLuint program = shader.program.name();
  shader.constant = gl.GetUniformLocation(program, "u_constant");
  shader.texels = gl.GetUniformLocation(program, "u_texels");
  shader.to_unit = gl.GetUniformLocation(program, "u_to_unit");
  gl.UseProgram(program);
  shader.locations = pass.planes.locate(gl, shader.program, unit_of);
  return shader;
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
    if (!holds(k, slot)) {
      std::fill(out, out + kSamples, 0.0f);
      continue;
    }
    if (planes[k].mantissa.empty()) continue;  // kept, with its samples
    for (int j = 0; j < kSampleSide; ++j)
      for (int i = 0; i < kSampleSide; ++i)
        *out++ = static_cast<float>(value_at(planes[k], (2 * i + 1) * width / (2 * kSampleSide),
                                             (2 * j + 1) * height / (2 * kSampleSide)));
  }
}

double Compositor::sampled_peak(const FoldedLight& light, const FrameSlots& frames) const {
  double peak = 0;
  for (std::size_t i = 0; i < kSamples; ++i) {
    double sum[3] = {};
    for (std::size_t c = 0; c < 3; ++c) sum[c] = static_cast<double>(light.constant[c]);
    for (int role = 0; role < FrameSlots::kRoles; ++role) {
      const auto share = static_cast<double>(frames.weight(role));
      if (share == 0) continue;
      const std::array<double, 3> frame = sampled_sum(light, frames.slot(role), i);
      for (std::size_t c = 0; c < 3; ++c) sum[c] += share * frame[c];
    }
    peak = std::max({peak, sum[0], sum[1], sum[2]});
  }
  return peak > double{FLT_MIN} ? kPeakMargin * peak : 1.0;
}

// Without the constant.
std::array<double, 3> Compositor::sampled_sum(const FoldedLight& light, int slot,
                                              std::size_t sample) const {
  const std::size_t planes = light.weights.size();
  const float* samples =
      samples_.data() + static_cast<std::size_t>(slot) * planes * kSamples + sample;
  const auto value = [&](std::size_t k) { return static_cast<double>(samples[k * kSamples]); };
  std::array<double, 3> sum{};
  for (std::size_t k = 0; k < planes; ++k)
    for (std::size_t c = 0; c < 3; ++c)
      sum[c] += static_cast<double>(light.weights[k][c]) * value(k);
  if (!sheets_.can_predict(slot)) return sum;
  const auto normal = static_cast<std::size_t>(description_.normal_planes);
  const std::array<double, 3> irradiance =
      predicted_irradiance(light, {value(normal), value(normal + 1), value(normal + 2)});
  const double s = value(static_cast<std::size_t>(description_.prediction_plane));
  for (std::size_t c = 0; c < 3; ++c) sum[c] += s * irradiance[c];
  return sum;
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
  for (Pass& pass : passes_) {
    RELIT_ASSIGN(const bool drawn, draw_pass(pass, drawing, first));
    if (drawn) first = false;
  }
  drawn_ = &target;
  RELIT_TRY(device_.check("compositing"));
  return result_;
}

Result<bool> Compositor::draw_pass(Pass& pass, const Drawing& drawing, bool first) {
  pass.planes.fill(drawing.light, drawing.frames, sheets_, drawing.normalisation, pass.weights);
  // Only one pass need run where nothing has a weight: somebody has to write the constant.
  if (!pass.weights.any && (!first || &pass != &passes_.back())) return false;

  const Functions& gl = device_.gl();
  RELIT_ASSIGN(const Shader* shader, shader_for(pass));
  gl.UseProgram(shader->program.name());
  pass.planes.bind(gl, drawing.frames, sheets_, unit_of);
  const double scale = first ? 1 / drawing.normalisation : 0;
  std::array<float, 3> constant{};
  for (std::size_t c = 0; c < 3; ++c)
    constant[c] = static_cast<float>(static_cast<double>(drawing.light.constant[c]) * scale +
                                     pass.weights.constant[c]);
  gl.Uniform3f(shader->constant, constant[0], constant[1], constant[2]);
  gl.Uniform4f(shader->texels, drawing.texels[0], drawing.texels[1], drawing.texels[2],
               drawing.texels[3]);
  if (shader->to_unit >= 0)
    gl.Uniform1f(shader->to_unit,
                 static_cast<float>(drawing.normalisation / static_cast<double>(result_.scale)));
  pass.planes.set_weights(gl, shader->locations, pass.weights);
  if (!first) {
    gl.Enable(GL_BLEND);
    gl.BlendFunc(GL_ONE, GL_ONE);
  }
  device_.draw_fullscreen();
  return true;
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
    return pass.planes.serves_one_frame();
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
  return sheets_.cpu_bytes() + sizeof(float) * (samples_.size() + pixels_.capacity());
}

}  // namespace relit::gles
