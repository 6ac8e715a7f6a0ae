// SPDX-License-Identifier: MIT
#include "gles/plane_pass.hpp"

#include <algorithm>
#include <cmath>

namespace relit::gles {
namespace {

constexpr int kSumExponent = 6;

bool is_finite(const Rgb& rgb) {
  return std::isfinite(rgb[0]) && std::isfinite(rgb[1]) && std::isfinite(rgb[2]);
}

bool is_zero(const Rgb& rgb) { return rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0; }

}  // namespace

bool PlanePass::Batch::same_kind(const Batch& other) const {
  return role == other.role && planes_per_group == other.planes_per_group &&
         sheets == other.sheets && exponent_sheet == other.exponent_sheet && wide == other.wide;
}

// Neighbours that share their exponents become groups of three, the others stand alone.
std::vector<PlanePass::Batch> PlanePass::group_planes(const PlaneSetDescription& d,
                                                      const PlaneSheets& sheets) {
  std::vector<Batch> batches;
  auto add = [&](std::size_t first, int count) {
    Batch kind;
    Group group;
    kind.planes_per_group = count > 1 ? 3 : 1;
    kind.wide = d.planes[first].bit_depth > 8;
    kind.exponent_sheet = sheets.exponent(first).sheet;
    for (int slot = 0; slot < kind.planes_per_group; ++slot) {
      const std::size_t plane = first + static_cast<std::size_t>(std::min(slot, count - 1));
      kind.sheets[static_cast<std::size_t>(slot)] = sheets.mantissa(plane).sheet;
      if (slot < count) group.planes[static_cast<std::size_t>(slot)] = static_cast<int>(plane);
    }
    auto at = std::find_if(batches.begin(), batches.end(),
                           [&](const Batch& batch) { return batch.same_kind(kind); });
    if (at == batches.end()) at = batches.insert(batches.end(), kind);
    at->groups.push_back(group);
  };
  for (std::size_t k = 0; k < d.planes.size();) {
    int count = 1;
    const int tile = sheets.exponent(k).tile;
    while (tile >= 0 && count < 3 && k + static_cast<std::size_t>(count) < d.planes.size()) {
      const std::size_t next = k + static_cast<std::size_t>(count);
      if (sheets.exponent(next).tile != tile || d.planes[next].bit_depth != d.planes[k].bit_depth)
        break;
      ++count;
    }
    add(k, count);
    k += static_cast<std::size_t>(count);
  }
  if (sheets.slot_count() < FrameSlots::kRoles) return batches;
  const std::size_t count = batches.size();
  for (std::size_t b = 0; b < count; ++b) {
    Batch second = batches[b];
    second.role = 1;
    for (int& sheet : second.sheets)
      if (sheet >= 0) sheet += sheets.sheet_count();
    if (second.exponent_sheet >= 0) second.exponent_sheet += sheets.sheet_count();
    batches.push_back(std::move(second));
  }
  return batches;
}

std::vector<int> PlanePass::sheets_with(const Batch& batch) const {
  std::vector<int> needed = sheets_;
  for (const int sheet : {batch.sheets[0], batch.sheets[1], batch.sheets[2], batch.exponent_sheet})
    if (sheet >= 0 && std::find(needed.begin(), needed.end(), sheet) == needed.end())
      needed.push_back(sheet);
  return needed;
}

std::vector<PlanePass> PlanePass::plan(const PlaneSetDescription& description,
                                       const PlaneSheets& sheets, const Limits& limits) {
  std::vector<PlanePass> passes(1);
  int vectors_left = limits.vectors;
  for (const Batch& batch : group_planes(description, sheets)) {
    std::size_t taken = 0;
    while (taken < batch.groups.size()) {
      std::vector<int> needed = passes.back().sheets_with(batch);
      const bool empty = passes.back().batches_.empty();
      int room =
          limits.lookups > 0 ? limits.lookups / batch.lookups() : vectors_left / batch.stride();
      if (limits.lookups > 0 && !empty) room = 0;
      if (static_cast<int>(needed.size()) > limits.units) room = 0;
      if (room < 1 && !empty) {
        passes.emplace_back();
        vectors_left = limits.vectors;
        continue;
      }
      Batch part = batch;
      const std::size_t count =
          std::min(batch.groups.size() - taken, static_cast<std::size_t>(std::max(room, 1)));
      const auto begin = batch.groups.begin() + static_cast<std::ptrdiff_t>(taken);
      part.groups.assign(begin, begin + static_cast<std::ptrdiff_t>(count));
      taken += count;
      vectors_left -= static_cast<int>(count) * part.stride();
      passes.back().sheets_ = std::move(needed);
      passes.back().batches_.push_back(std::move(part));
    }
  }
  return passes;
}

bool PlanePass::within(const Limits& limits) const {
  int vectors = 0;
  for (const Batch& batch : batches_)
    vectors += static_cast<int>(batch.groups.size()) * batch.stride();
  return vectors <= limits.vectors && unit_count() <= limits.units;
}

bool PlanePass::has_role(int role) const {
  return std::any_of(batches_.begin(), batches_.end(),
                     [&](const Batch& batch) { return batch.role == role; });
}

int PlanePass::planes_per_group() const {
  return batches_.empty() ? 0 : batches_.front().planes_per_group;
}
int PlanePass::lookups_per_group() const {
  return batches_.empty() ? 0 : batches_.front().lookups();
}
int PlanePass::group_count() const {
  return batches_.empty() ? 0 : static_cast<int>(batches_.front().groups.size());
}
int PlanePass::stride() const { return batches_.empty() ? 0 : batches_.front().stride(); }

Result<double> PlanePass::normalise(const FoldedLight& light, const FrameSlots& frames,
                                    const PlaneSheets& sheets) {
  if (light.prediction_plane >= 0)
    return fail(ErrorCode::kUnsupported,
                "models with a prediction plane are composited on the CPU (--composite cpu)");
  if (!is_finite(light.constant) || !(light.magnitude > 0) || !std::isfinite(light.magnitude))
    return fail(ErrorCode::kInvalid, "the folded light is not finite");
  if (light.weights.size() != sheets.plane_count())
    return fail(ErrorCode::kInvalid,
                std::to_string(light.weights.size()) + " weights in the folded light; " +
                    std::to_string(sheets.plane_count()) + " planes were described");
  if (frames.from < 0 || std::max(frames.from, frames.to) >= sheets.slot_count() ||
      !(frames.blend >= 0) || frames.blend > 1)
    return fail(ErrorCode::kInvalid, "frames that are not there, or a blend outside 0 to 1");
  double bound[3] = {};
  for (std::size_t c = 0; c < 3; ++c) bound[c] = std::abs(static_cast<double>(light.constant[c]));
  for (std::size_t k = 0; k < light.weights.size(); ++k) {
    if (!is_finite(light.weights[k]))
      return fail(ErrorCode::kInvalid,
                  "the weight of plane " + std::to_string(k) + " is not finite");
    for (int role = 0; role < FrameSlots::kRoles; ++role)
      for (std::size_t c = 0; c < 3; ++c)
        bound[c] += std::abs(static_cast<double>(frames.weight(role)) *
                             static_cast<double>(light.weights[k][c]) *
                             sheets.state(k, frames.slot(role)).factor);
  }
  const double largest = std::max({bound[0], bound[1], bound[2]});
  if (!(largest < 1e30))
    return fail(ErrorCode::kInvalid, "the planes' scales and exponents exceed the range of floats");
  int exponent = 0;
  if (largest > 1e-30) std::frexp(largest, &exponent);
  return std::ldexp(1.0, exponent - kSumExponent);
}

PlanePass::Uniforms PlanePass::make_uniforms() const {
  Uniforms uniforms;
  for (const Batch& batch : batches_) {
    Uniforms::Part& part = uniforms.parts.emplace_back();
    part.data.resize(4 * batch.groups.size() * static_cast<std::size_t>(batch.stride()));
  }
  return uniforms;
}

bool PlanePass::fill(const FoldedLight& light, const FrameSlots& frames, const PlaneSheets& sheets,
                     double normalisation, Uniforms& out) const {
  bool any = false;
  for (std::size_t b = 0; b < batches_.size(); ++b) {
    Uniforms::Part& part = out.parts[b];
    part.count = fill_batch(batches_[b], light, frames, sheets, normalisation, part.data);
    any = any || part.count > 0;
  }
  return any;
}

// Groups with a weight come first; the shader stops after them.
int PlanePass::fill_batch(const Batch& batch, const FoldedLight& light, const FrameSlots& frames,
                          const PlaneSheets& sheets, double normalisation,
                          std::vector<float>& data) const {
  const double share = static_cast<double>(frames.weight(batch.role)) / normalisation;
  if (share == 0) return 0;
  const int slot_of_frame = frames.slot(batch.role);
  auto weighs = [&](int plane) {
    const auto k = static_cast<std::size_t>(plane);
    return plane >= 0 && !is_zero(light.weights[k]) && sheets.state(k, slot_of_frame).present;
  };
  auto out = data.begin();
  auto put = [&](const std::array<float, 4>& v) { out = std::copy(v.begin(), v.end(), out); };
  int count = 0;
  for (const Group& group : batch.groups) {
    if (std::none_of(group.planes.begin(), group.planes.end(), weighs)) continue;
    ++count;
    const auto lead = static_cast<std::size_t>(group.planes[0]);
    int reference = 0;
    for (const int plane : group.planes)
      if (plane >= 0)
        reference = std::max(
            reference,
            sheets.state(static_cast<std::size_t>(plane), slot_of_frame).exponent_reference);
    for (int i = 0; i < batch.planes_per_group; ++i) {
      const int plane = group.planes[static_cast<std::size_t>(i)];
      const std::size_t at = plane >= 0 ? static_cast<std::size_t>(plane) : lead;
      put(sheets.coordinates(sheets.mantissa(at)));
      std::array<float, 4> weight{};
      if (weighs(plane)) {
        const double factor = sheets.state(at, slot_of_frame).factor * share;
        for (std::size_t c = 0; c < 3; ++c)
          weight[c] = static_cast<float>(static_cast<double>(light.weights[at][c]) * factor);
      }
      if (i == 0) weight[3] = static_cast<float>(reference);
      put(weight);
    }
    if (batch.exponent_sheet >= 0) put(sheets.coordinates(sheets.exponent(lead)));
  }
  return count;
}

PlanePass::Locations PlanePass::locate(const Functions& gl, const Program& program,
                                       int (*unit_of)(int)) const {
  Locations at;
  for (std::size_t b = 0; b < batches_.size(); ++b)
    at.parts.push_back(
        {gl.GetUniformLocation(program.name(), ("u_batch" + std::to_string(b)).c_str()),
         gl.GetUniformLocation(program.name(), ("u_count" + std::to_string(b)).c_str())});
  for (int i = 0; i < unit_count(); ++i)
    gl.Uniform1i(gl.GetUniformLocation(program.name(), ("u_sheet" + std::to_string(i)).c_str()),
                 unit_of(i));
  return at;
}

void PlanePass::set_uniforms(const Functions& gl, const Locations& at,
                             const Uniforms& uniforms) const {
  for (std::size_t b = 0; b < batches_.size(); ++b) {
    const Uniforms::Part& part = uniforms.parts[b];
    gl.Uniform1i(at.parts[b].count, part.count);
    if (part.count > 0)
      gl.Uniform4fv(at.parts[b].data, part.count * batches_[b].stride(), part.data.data());
  }
}

void PlanePass::bind(const Functions& gl, const FrameSlots& frames, const PlaneSheets& sheets,
                     int (*unit_of)(int)) const {
  for (int i = 0; i < unit_count(); ++i) {
    const int sheet = sheets_[static_cast<std::size_t>(i)];
    const int role = sheet / sheets.sheet_count();
    gl.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit_of(i)));
    gl.BindTexture(GL_TEXTURE_2D, sheets.texture(sheet % sheets.sheet_count(), frames.slot(role)));
  }
  gl.ActiveTexture(GL_TEXTURE0);
}

}  // namespace relit::gles
