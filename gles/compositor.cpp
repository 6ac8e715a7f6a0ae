// SPDX-License-Identifier: MIT
#include "gles/compositor.hpp"

#include <algorithm>
#include <cmath>

namespace relit::gles {
namespace {

// Texels on a grid by which a square-root light map finds its peak.
constexpr int kSampleSide = 16;
constexpr std::size_t kSamples = std::size_t{kSampleSide} * kSampleSide;
// Room above the sampled peak: the brightest texel lies between the samples.
constexpr double kPeakMargin = 1.5;
// Sums are scaled to at most 2^6: far from half floats' overflow at 2^16, and products of a
// thousandth of a thousandth of that are still above their subnormals.
constexpr int kSumExponent = 6;
// Vectors of a fragment shader's uniforms that are not planes' (constants of the compiler
// included).
constexpr int kReservedUniforms = 12;
constexpr int kMediumpLookups = 16;

double value_at(const PlaneView& plane, int x, int y) {
  const double mantissa = plane.mantissa.at(x >> plane.mantissa_shift, y >> plane.mantissa_shift);
  int exponent = plane.exponent_zero;
  if (!plane.exponent.empty()) {
    exponent = plane.exponent.at(x >> plane.exponent_shift, y >> plane.exponent_shift);
    if (exponent == 0) return 0;
  }
  return std::ldexp(plane.scale * (mantissa - plane.mantissa_zero), exponent - plane.exponent_zero);
}

bool is_zero(const Rgb& rgb) { return rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0; }

bool is_finite(const Rgb& rgb) {
  return std::isfinite(rgb[0]) && std::isfinite(rgb[1]) && std::isfinite(rgb[2]);
}

}  // namespace

bool Compositor::Batch::same_kind(const Batch& other) const {
  return planes_per_group == other.planes_per_group && sheets == other.sheets &&
         exponent_sheet == other.exponent_sheet && wide == other.wide;
}

Result<std::unique_ptr<Compositor>> Compositor::create(const Device& device,
                                                       const PlaneSetDescription& description) {
  std::unique_ptr<Compositor> compositor(new Compositor(device));
  Compositor& c = *compositor;
  RELIT_ASSIGN(c.storage_, choose_light_map_storage(device, description.format, true));
  StateGuard guard(device);
  RELIT_ASSIGN(c.sheets_, PlaneSheets::create(device, description));
  c.width_ = description.width;
  c.height_ = description.height;
  c.split_into_passes(c.group_planes(description));
  const bool can_add = c.storage_.format == LightMapFormat::kHalfFloat ||
                       (c.storage_.format == LightMapFormat::kFloat && device.caps().float_blend);
  if (c.passes_.size() > 1 && !can_add)
    return fail(ErrorCode::kUnsupported,
                std::to_string(description.planes.size()) + " planes need " +
                    std::to_string(c.passes_.size()) +
                    " passes on this GPU, which cannot add them up in the light map's format; "
                    "composite on the CPU (--backend cpu)");
  for (Pass& pass : c.passes_) RELIT_TRY(c.build_pass(pass));

  c.target_ = make_texture(device, c.storage_.texture, c.width_, c.height_);
  c.framebuffer_ = FramebufferObject(device.gl());
  device.gl().BindFramebuffer(GL_FRAMEBUFFER, c.framebuffer_.name());
  device.gl().FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D,
                                   c.target_.name(), 0);
  if (device.gl().CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    return fail(ErrorCode::kUnsupported, "the GPU refuses to draw into a light map of " +
                                             std::to_string(c.width_) + "x" +
                                             std::to_string(c.height_) + " texels");
  if (c.storage_.format == LightMapFormat::kSquareRoot8)
    c.samples_.resize(description.planes.size() * kSamples);
  RELIT_TRY(device.check("creating the compositor"));
  return compositor;
}

// Neighbours that share their exponents become groups of three, the others stand alone.
std::vector<Compositor::Batch> Compositor::group_planes(const PlaneSetDescription& d) const {
  std::vector<Batch> batches;
  auto add = [&](std::size_t first, int count) {
    Batch kind;
    Group group;
    kind.planes_per_group = count > 1 ? 3 : 1;
    kind.wide = d.planes[first].bit_depth > 8;
    kind.exponent_sheet = sheets_.exponent(first).sheet;
    for (int slot = 0; slot < kind.planes_per_group; ++slot) {
      const std::size_t plane = first + static_cast<std::size_t>(std::min(slot, count - 1));
      kind.sheets[static_cast<std::size_t>(slot)] = sheets_.mantissa(plane).sheet;
      if (slot < count) group.planes[static_cast<std::size_t>(slot)] = static_cast<int>(plane);
    }
    auto at = std::find_if(batches.begin(), batches.end(),
                           [&](const Batch& batch) { return batch.same_kind(kind); });
    if (at == batches.end()) at = batches.insert(batches.end(), kind);
    at->groups.push_back(group);
  };
  for (std::size_t k = 0; k < d.planes.size();) {
    int count = 1;
    const int tile = sheets_.exponent(k).tile;
    while (tile >= 0 && count < 3 && k + static_cast<std::size_t>(count) < d.planes.size()) {
      const std::size_t next = k + static_cast<std::size_t>(count);
      if (sheets_.exponent(next).tile != tile || d.planes[next].bit_depth != d.planes[k].bit_depth)
        break;
      ++count;
    }
    add(k, count);
    k += static_cast<std::size_t>(count);
  }
  return batches;
}

void Compositor::split_into_passes(std::vector<Batch> batches) {
  const bool mediump = device_.profile() == Profile::kEs2Mediump;
  const Capabilities& caps = device_.caps();
  const int units = std::min(caps.max_texture_units, 8);
  const int vectors = std::max(0, caps.max_fragment_uniform_vectors - kReservedUniforms);
  // Two vec2 share a varying vector: packing is part of the language (GLSL ES 1.00, appendix A.7).
  const int lookups = std::min({kMediumpLookups, 2 * caps.max_varying_vectors,
                                caps.max_vertex_uniform_vectors - kReservedUniforms});
  int vectors_left = vectors;
  passes_.emplace_back();
  for (Batch& batch : batches) {
    std::size_t taken = 0;
    while (taken < batch.groups.size()) {
      std::vector<int> needed = passes_.back().sheets;
      for (const int sheet :
           {batch.sheets[0], batch.sheets[1], batch.sheets[2], batch.exponent_sheet})
        if (sheet >= 0 && std::find(needed.begin(), needed.end(), sheet) == needed.end())
          needed.push_back(sheet);
      const bool empty = passes_.back().batches.empty();
      int room = mediump ? lookups / batch.lookups() : vectors_left / batch.stride();
      if (mediump && !empty) room = 0;
      if (static_cast<int>(needed.size()) > units) room = 0;
      if (room < 1 && !empty) {
        passes_.emplace_back();
        vectors_left = vectors;
        continue;
      }
      Batch part = batch;
      const std::size_t count =
          std::min(batch.groups.size() - taken, static_cast<std::size_t>(std::max(room, 1)));
      const auto begin = batch.groups.begin() + static_cast<std::ptrdiff_t>(taken);
      part.groups.assign(begin, begin + static_cast<std::ptrdiff_t>(count));
      taken += count;
      vectors_left -= static_cast<int>(count) * part.stride();
      passes_.back().sheets = needed;
      passes_.back().batches.push_back(std::move(part));
    }
  }
  std::size_t longest = 0;
  for (const Pass& pass : passes_)
    for (const Batch& batch : pass.batches)
      longest = std::max(longest, batch.groups.size() * static_cast<std::size_t>(batch.stride()));
  uniforms_.resize(4 * longest);
  if (mediump) places_.resize(4 * kMediumpLookups);
}

Status Compositor::upload(std::span<const PlaneView> planes) {
  StateGuard guard(device_);
  RELIT_TRY(sheets_.upload(planes));
  if (!samples_.empty()) sample_planes(planes);
  return device_.check("uploading planes");
}

void Compositor::sample_planes(std::span<const PlaneView> planes) {
  for (std::size_t k = 0; k < planes.size(); ++k) {
    float* out = samples_.data() + k * kSamples;
    if (planes[k].mantissa.empty()) {
      std::fill(out, out + kSamples, 0.0f);
      continue;
    }
    for (int j = 0; j < kSampleSide; ++j)
      for (int i = 0; i < kSampleSide; ++i)
        *out++ = static_cast<float>(value_at(planes[k], (2 * i + 1) * width_ / (2 * kSampleSide),
                                             (2 * j + 1) * height_ / (2 * kSampleSide)));
  }
}

double Compositor::sampled_peak(const FoldedLight& light) const {
  double peak = 0;
  for (std::size_t i = 0; i < kSamples; ++i) {
    double sum[3] = {light.constant[0], light.constant[1], light.constant[2]};
    for (std::size_t k = 0; k < light.weights.size(); ++k) {
      const double value = samples_[k * kSamples + i];
      for (std::size_t c = 0; c < 3; ++c) sum[c] += light.weights[k][c] * value;
    }
    peak = std::max({peak, sum[0], sum[1], sum[2]});
  }
  return peak > 1e-30 ? kPeakMargin * peak : 1.0;
}

Status Compositor::check_light(const FoldedLight& light) const {
  if (light.prediction_plane >= 0)
    return fail(ErrorCode::kUnsupported,
                "models with a prediction plane are composited on the CPU (--backend cpu)");
  if (!is_finite(light.constant) || !(light.magnitude > 0) || !std::isfinite(light.magnitude))
    return fail(ErrorCode::kInvalid, "the folded light is not finite");
  if (light.weights.size() != sheets_.plane_count())
    return fail(ErrorCode::kInvalid,
                std::to_string(light.weights.size()) + " weights in the folded light; " +
                    std::to_string(sheets_.plane_count()) + " planes were described");
  for (std::size_t k = 0; k < light.weights.size(); ++k) {
    if (!is_finite(light.weights[k]))
      return fail(ErrorCode::kInvalid,
                  "the weight of plane " + std::to_string(k) + " is not finite");
    if (!is_zero(light.weights[k]) && !sheets_.state(k).present)
      return fail(ErrorCode::kInvalid,
                  "plane " + std::to_string(k) + " has a weight but was not uploaded");
  }
  return {};
}

Result<LightMap> Compositor::composite(const FoldedLight& light) {
  RELIT_TRY(check_light(light));
  double bound[3] = {std::abs(light.constant[0]), std::abs(light.constant[1]),
                     std::abs(light.constant[2])};
  for (std::size_t k = 0; k < light.weights.size(); ++k)
    for (std::size_t c = 0; c < 3; ++c)
      bound[c] += std::abs(light.weights[k][c] * sheets_.state(k).factor);
  const double largest = std::max({bound[0], bound[1], bound[2]});
  if (!(largest < 1e30))
    return fail(ErrorCode::kInvalid, "the planes' scales and exponents exceed the range of floats");
  int exponent = 0;
  if (largest > 1e-30) std::frexp(largest, &exponent);
  normalisation_ = std::ldexp(1.0, exponent - kSumExponent);

  result_ = {target_.name(),
             width_,
             height_,
             false,
             storage_.linear_filter,
             static_cast<float>(normalisation_),
             light.magnitude};
  if (storage_.format == LightMapFormat::kSquareRoot8) {
    result_.square_root = true;
    result_.scale = static_cast<float>(sampled_peak(light));
  }
  const Functions& gl = device_.gl();
  StateGuard guard(device_, std::min(8, std::max(1, sheets_.sheet_count())));
  gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  gl.Viewport(0, 0, width_, height_);
  bool first = true;
  for (const Pass& pass : passes_)
    if (draw_pass(pass, light, first)) first = false;
  RELIT_TRY(device_.check("compositing"));
  return result_;
}

bool Compositor::is_active(const Group& group, const FoldedLight& light) const {
  return std::any_of(group.planes.begin(), group.planes.end(), [&](int plane) {
    return plane >= 0 && !is_zero(light.weights[static_cast<std::size_t>(plane)]);
  });
}

bool Compositor::draw_pass(const Pass& pass, const FoldedLight& light, bool first) {
  const Functions& gl = device_.gl();
  bool any = false;
  for (const Batch& batch : pass.batches)
    for (const Group& group : batch.groups) any = any || is_active(group, light);
  // Only one pass need run where nothing has a weight: somebody has to write the constant.
  if (!any && (!first || &pass != &passes_.back())) return false;

  gl.UseProgram(pass.program.name());
  for (std::size_t unit = pass.sheets.size(); unit-- > 0;) {
    gl.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
    gl.BindTexture(GL_TEXTURE_2D, sheets_.texture(pass.sheets[unit]));
  }
  const double scale = first ? 1 / normalisation_ : 0;
  gl.Uniform3f(pass.constant, static_cast<float>(light.constant[0] * scale),
               static_cast<float>(light.constant[1] * scale),
               static_cast<float>(light.constant[2] * scale));
  if (pass.to_unit >= 0)
    gl.Uniform1f(pass.to_unit, static_cast<float>(normalisation_ / result_.scale));
  if (device_.profile() == Profile::kEs2Mediump) {
    draw_unrolled(pass, light);
  } else {
    for (const Batch& batch : pass.batches) gl.Uniform1i(batch.count, fill_batch(batch, light));
  }
  if (!first) {
    gl.Enable(GL_BLEND);
    gl.BlendFunc(GL_ONE, GL_ONE);
  }
  device_.draw_fullscreen();
  return true;
}

std::array<float, 4> Compositor::weight_of(int plane, const FoldedLight& light) const {
  if (plane < 0) return {};
  const auto k = static_cast<std::size_t>(plane);
  const PlaneSheets::PlaneState& state = sheets_.state(k);
  const double factor = state.factor / normalisation_;
  return {static_cast<float>(light.weights[k][0] * factor),
          static_cast<float>(light.weights[k][1] * factor),
          static_cast<float>(light.weights[k][2] * factor), 0.0f};
}

int Compositor::fill_batch(const Batch& batch, const FoldedLight& light) {
  float* out = uniforms_.data();
  auto put = [&](const std::array<float, 4>& v) { out = std::copy(v.begin(), v.end(), out); };
  int count = 0;
  for (const Group& group : batch.groups) {
    if (!is_active(group, light)) continue;
    ++count;
    const auto lead = static_cast<std::size_t>(group.planes[0]);
    float reference = 0;
    for (const int plane : group.planes)
      if (plane >= 0)
        reference = std::max(
            reference,
            static_cast<float>(sheets_.state(static_cast<std::size_t>(plane)).exponent_reference));
    for (int slot = 0; slot < batch.planes_per_group; ++slot) {
      const int plane = group.planes[static_cast<std::size_t>(slot)];
      const std::size_t at = plane >= 0 ? static_cast<std::size_t>(plane) : lead;
      put(sheets_.coordinates(sheets_.mantissa(at)));
      std::array<float, 4> weight = weight_of(plane, light);
      if (slot == 0) weight[3] = reference;
      put(weight);
    }
    if (batch.exponent_sheet >= 0) put(sheets_.coordinates(sheets_.exponent(lead)));
  }
  if (count > 0) device_.gl().Uniform4fv(batch.data, count * batch.stride(), uniforms_.data());
  return count;
}

// Active groups take the first varyings; the rest repeat the first place with no weight.
void Compositor::draw_unrolled(const Pass& pass, const FoldedLight& light) {
  if (pass.batches.empty()) return;
  const Batch& batch = pass.batches.front();
  const auto planes = static_cast<std::size_t>(batch.planes_per_group);
  const auto lookups = static_cast<std::size_t>(batch.lookups());
  const std::size_t slots = batch.groups.size();
  std::fill(uniforms_.begin(), uniforms_.end(), 0.0f);
  const int count = fill_batch(batch, light);
  // fill_batch() left [place, weight]… per group; here places and weights go to different stages.
  const std::vector<float>& mixed = uniforms_;
  const auto stride = static_cast<std::size_t>(batch.stride());
  std::array<float, 4 * kMediumpLookups> weights{};
  // E_ref of the unused ones: 2^(E - 255) is at most 1, and never an infinity that 0 would not
  // cancel.
  for (std::size_t i = 3; i < weights.size(); i += 4) weights[i] = 255;
  for (std::size_t g = 0; g < slots; ++g) {
    const bool used = g < static_cast<std::size_t>(count);
    const float* group = mixed.data() + (used ? 4 * g * stride : 0);
    for (std::size_t slot = 0; slot < lookups; ++slot) {
      const float* place = group + (slot < planes ? 8 * slot : 4 * (stride - 1));
      std::copy(place, place + 4,
                places_.begin() + static_cast<std::ptrdiff_t>(4 * (g * lookups + slot)));
      if (slot < planes && used)
        std::copy(place + 4, place + 8,
                  weights.begin() + static_cast<std::ptrdiff_t>(4 * (g * planes + slot)));
    }
  }
  const Functions& gl = device_.gl();
  gl.Uniform4fv(pass.place, static_cast<GLsizei>(slots * lookups), places_.data());
  gl.Uniform4fv(pass.weight, static_cast<GLsizei>(slots * planes), weights.data());
}

Status Compositor::read_back(std::span<float> out) {
  const std::size_t texels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  if (result_.texture == 0 || out.size() != 3 * texels)
    return fail(ErrorCode::kInvalid,
                "reading back a light map needs a composite first and room for " +
                    std::to_string(3 * texels) + " floats");
  const Functions& gl = device_.gl();
  StateGuard guard(device_);
  pixels_.resize(4 * texels);
  gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  const bool bytes = storage_.format == LightMapFormat::kSquareRoot8;
  if (bytes) {
    gl.ReadPixels(0, 0, width_, height_, GL_RGBA, GL_UNSIGNED_BYTE, pixels_.data());
    RELIT_TRY(device_.check("reading a light map back"));
  } else {
    RELIT_TRY(read_float_pixels(device_, width_, height_, pixels_));
  }
  const auto* byte_pixels = reinterpret_cast<const std::uint8_t*>(pixels_.data());
  for (std::size_t i = 0; i < texels; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      float value = 0;
      if (bytes) {
        value = static_cast<float>(byte_pixels[4 * i + c]) / 255.0f;
        value *= value;
      } else {
        value = pixels_[4 * i + c];
      }
      out[c * texels + i] = value * result_.scale;
    }
  }
  return {};
}

std::size_t Compositor::gpu_bytes() const {
  return sheets_.gpu_bytes() + static_cast<std::size_t>(width_) *
                                   static_cast<std::size_t>(height_) *
                                   static_cast<std::size_t>(storage_.texture.bytes_per_texel);
}

std::size_t Compositor::cpu_bytes() const {
  return sheets_.cpu_bytes() +
         sizeof(float) * (uniforms_.size() + places_.size() + samples_.size() + pixels_.capacity());
}

}  // namespace relit::gles
