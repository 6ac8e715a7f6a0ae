// SPDX-License-Identifier: MIT
#include "gles/plane_pass.hpp"

#include <algorithm>
#include <cmath>

#include "gles/prediction.hpp"

namespace relit::gles {
namespace {

constexpr int kSumExponent = 6;
// What a sum may reach: 2^127 is the largest value of a plane of scale 1, and half of what a float
// holds is left for the margin over the peak of square roots. Below the least, 2^-120, everything
// is black: normalised as it is there, with scales that are floats.
constexpr double kLargestSum = 0x1p127, kLeastSum = 0x1p-120;

bool is_finite(const Rgb& rgb) {
  return std::isfinite(rgb[0]) && std::isfinite(rgb[1]) && std::isfinite(rgb[2]);
}

bool is_zero(const Rgb& rgb) { return rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0; }

Status check_folded_light(const FoldedLight& light, const PlaneSheets& sheets) {
  if (light.prediction_plane != sheets.prediction_plane())
    return fail(ErrorCode::kInvalid, "the folded light predicts by plane " +
                                         std::to_string(light.prediction_plane) +
                                         ", described was plane " +
                                         std::to_string(sheets.prediction_plane()) + " (-1: none)");
  if (!is_finite(light.constant) || !(light.magnitude > 0) || !std::isfinite(light.magnitude) ||
      !std::all_of(light.irradiance.begin(), light.irradiance.end(),
                   [](const Rgb& row) { return is_finite(row); }))
    return fail(ErrorCode::kInvalid, "the folded light is not finite");
  if (light.weights.size() != sheets.plane_count())
    return fail(ErrorCode::kInvalid,
                std::to_string(light.weights.size()) + " weights in the folded light; " +
                    std::to_string(sheets.plane_count()) + " planes were described");
  for (std::size_t k = 0; k < light.weights.size(); ++k) {
    if (!is_finite(light.weights[k]))
      return fail(ErrorCode::kInvalid,
                  "the weight of plane " + std::to_string(k) + " is not finite");
    if (sheets.is_normal(k) && !is_zero(light.weights[k]))
      return fail(ErrorCode::kInvalid,
                  "plane " + std::to_string(k) + " is of the normals and has a weight");
    for (std::size_t c = 0; c < 3; ++c)
      if (light.weights[k][c] != 0 && (sheets.channels(k) >> c & 1u) == 0)
        return fail(
            ErrorCode::kInvalid,
            "plane " + std::to_string(k) + " has a weight for a channel it was described without");
  }
  return {};
}

// At most so much is any channel's Σ |terms|.
double sum_bound(const FoldedLight& light, const FrameSlots& frames, const PlaneSheets& sheets) {
  double bound[3];
  for (std::size_t c = 0; c < 3; ++c) bound[c] = std::abs(static_cast<double>(light.constant[c]));
  const std::array<double, 3> irradiance = irradiance_bound(light);
  for (int role = 0; role < FrameSlots::kRoles; ++role) {
    for (std::size_t k = 0; k < light.weights.size(); ++k) {
      const double most = std::abs(static_cast<double>(frames.weight(role)) *
                                   sheets.state(k, frames.slot(role)).factor);
      const bool predicts = static_cast<int>(k) == light.prediction_plane;
      for (std::size_t c = 0; c < 3; ++c)
        bound[c] += most * (std::abs(static_cast<double>(light.weights[k][c])) +
                            (predicts ? irradiance[c] : 0));
    }
  }
  return std::max({bound[0], bound[1], bound[2]});
}

}  // namespace

bool PlanePass::Batch::same_kind(const Batch& other) const {
  return role == other.role && planes_per_group == other.planes_per_group &&
         sheets == other.sheets && exponent_sheet == other.exponent_sheet && wide == other.wide;
}

int PlanePass::Batch::vectors() const {
  return predicts ? static_cast<int>(kHarmonics) : planes_per_group;
}

// Neighbours that share their exponents become groups of three, the others stand alone. s is not
// among them: a weight of its own is part of E(N)'s constant harmonic.
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
      group.channels[static_cast<std::size_t>(slot)] = d.planes[plane].channels;
      if (slot < count) group.planes[static_cast<std::size_t>(slot)] = static_cast<int>(plane);
    }
    auto at = std::find_if(batches.begin(), batches.end(),
                           [&](const Batch& batch) { return batch.same_kind(kind); });
    if (at == batches.end()) at = batches.insert(batches.end(), kind);
    at->groups.push_back(group);
  };
  const auto predicts = [&](std::size_t plane) {
    return static_cast<int>(plane) == d.prediction_plane || sheets.is_normal(plane);
  };
  for (std::size_t k = 0; k < d.planes.size();) {
    if (predicts(k)) {
      ++k;
      continue;
    }
    int count = 1;
    const int tile = sheets.exponent(k).tile;
    while (tile >= 0 && count < 3 && k + static_cast<std::size_t>(count) < d.planes.size()) {
      const std::size_t next = k + static_cast<std::size_t>(count);
      if (sheets.exponent(next).tile != tile || predicts(next) ||
          d.planes[next].bit_depth != d.planes[k].bit_depth)
        break;
      ++count;
    }
    add(k, count);
    k += static_cast<std::size_t>(count);
  }
  if (d.prediction_plane >= 0) batches.push_back(prediction(d, sheets));
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

PlanePass::Batch PlanePass::prediction(const PlaneSetDescription& d, const PlaneSheets& sheets) {
  Batch batch;
  batch.predicts = true;
  batch.planes_per_group = 4;
  const auto s = static_cast<std::size_t>(d.prediction_plane);
  batch.wide = d.planes[s].bit_depth > 8;
  batch.exponent_sheet = sheets.exponent(s).sheet;
  Group group;
  group.planes = {d.prediction_plane, d.normal_planes, d.normal_planes + 1, d.normal_planes + 2};
  for (int i = 0; i < batch.planes_per_group; ++i)
    batch.sheets[static_cast<std::size_t>(i)] = sheets.mantissa(plane_of(group, i)).sheet;
  batch.groups.push_back(group);
  return batch;
}

std::vector<int> PlanePass::sheets_with(const Batch& batch) const {
  std::vector<int> needed = sheets_;
  const auto add = [&](int sheet) {
    if (sheet >= 0 && std::find(needed.begin(), needed.end(), sheet) == needed.end())
      needed.push_back(sheet);
  };
  for (const int sheet : batch.sheets) add(sheet);
  add(batch.exponent_sheet);
  return needed;
}

std::vector<PlanePass> PlanePass::plan(const PlaneSetDescription& description,
                                       const PlaneSheets& sheets, const Limits& limits) {
  std::vector<PlanePass> passes(1);
  int vectors_left = limits.vectors, lookups_left = limits.lookups;
  for (const Batch& batch : group_planes(description, sheets)) {
    std::size_t taken = 0;
    while (taken < batch.groups.size()) {
      std::vector<int> needed = passes.back().sheets_with(batch);
      const bool empty = passes.back().batches_.empty();
      int room = vectors_left / batch.vectors();
      if (limits.lookups > 0) {
        room = std::min(room, lookups_left / batch.lookups());
        // All its lookups are made whenever it is drawn: for one frame, the other's would be in
        // vain.
        if (!empty && passes.back().batches_.front().role != batch.role) room = 0;
      }
      if (static_cast<int>(needed.size()) > limits.units) room = 0;
      if (room < 1 && !empty) {
        passes.emplace_back();
        vectors_left = limits.vectors;
        lookups_left = limits.lookups;
        continue;
      }
      Batch part = batch;
      const std::size_t count =
          std::min(batch.groups.size() - taken, static_cast<std::size_t>(std::max(room, 1)));
      const auto begin = batch.groups.begin() + static_cast<std::ptrdiff_t>(taken);
      part.groups.assign(begin, begin + static_cast<std::ptrdiff_t>(count));
      taken += count;
      vectors_left -= part.count() * part.vectors();
      lookups_left -= part.count() * part.lookups();
      passes.back().sheets_ = std::move(needed);
      passes.back().batches_.push_back(std::move(part));
    }
  }
  for (PlanePass& pass : passes) pass.lookups_ = limits.lookups > 0;
  return passes;
}

bool PlanePass::within(const Limits& limits) const {
  int vectors = 0;
  for (const Batch& batch : batches_) vectors += batch.count() * batch.vectors();
  return vectors <= limits.vectors && unit_count() <= limits.units;
}

bool PlanePass::serves_one_frame() const {
  return batches_.empty() || std::any_of(batches_.begin(), batches_.end(),
                                         [](const Batch& batch) { return batch.role == 0; });
}

std::vector<int> PlanePass::all_of_one_frame() const {
  std::vector<int> counts;
  for (const Batch& batch : batches_) counts.push_back(batch.role == 0 ? batch.count() : 0);
  return counts;
}

// A group of one or two planes repeats its first one, without a weight.
std::size_t PlanePass::plane_of(const Group& group, int slot) {
  const int plane = group.planes[static_cast<std::size_t>(slot)];
  return static_cast<std::size_t>(plane >= 0 ? plane : group.planes[0]);
}

Result<double> PlanePass::normalise(const FoldedLight& light, const FrameSlots& frames,
                                    const PlaneSheets& sheets) {
  RELIT_TRY(check_folded_light(light, sheets));
  if (frames.from < 0 || std::max(frames.from, frames.to) >= sheets.slot_count() ||
      !(frames.blend >= 0) || frames.blend > 1)
    return fail(ErrorCode::kInvalid, "frames that are not there, or a blend outside 0 to 1");
  const double largest = sum_bound(light, frames, sheets);
  if (!(largest <= kLargestSum))
    return fail(ErrorCode::kInvalid, "the planes' scales and exponents exceed the range of floats");
  int exponent = 0;
  std::frexp(std::max(largest, kLeastSum), &exponent);
  return std::ldexp(1.0, exponent - kSumExponent);
}

PlanePass::Weights PlanePass::make_weights() const {
  Weights weights;
  for (const Batch& batch : batches_) {
    weights.data.emplace_back(4 * batch.groups.size() * static_cast<std::size_t>(batch.vectors()));
    weights.counts.push_back(0);
  }
  return weights;
}

void PlanePass::fill(const FoldedLight& light, const FrameSlots& frames, const PlaneSheets& sheets,
                     double normalisation, Weights& out) const {
  constexpr int kShades = 4;  // of a batch, besides none of it
  out.any = false;
  out.constant = {};
  for (std::size_t b = 0; b < batches_.size(); ++b) {
    const Batch& batch = batches_[b];
    const double share = static_cast<double>(frames.weight(batch.role)) / normalisation;
    const int needed = batch.predicts ? fill_prediction(b, light, frames, sheets, share, out)
                                      : fill_batch(b, light, frames, sheets, share, out);
    const int step = (batch.count() + kShades - 1) / kShades;
    out.counts[b] =
        lookups_ ? batch.count() : std::min(batch.count(), (needed + step - 1) / step * step);
    out.any = out.any || needed > 0;
  }
}

// Returns up to which group there is a weight.
int PlanePass::fill_batch(std::size_t index, const FoldedLight& light, const FrameSlots& frames,
                          const PlaneSheets& sheets, double share, Weights& weights) const {
  const Batch& batch = batches_[index];
  const int slot = frames.slot(batch.role);
  // A raw sample is (mantissa + 1) · mantissa zero / 255.
  const bool raw = is_raw(batch);
  const double scale = !raw ? 1 : batch.wide ? 255.0 / 512 : 255.0 / 128;
  int needed = 0;
  auto out = weights.data[index].begin();
  for (int g = 0; g < batch.count(); ++g) {
    const Group& group = batch.groups[static_cast<std::size_t>(g)];
    const auto first = out;
    // Of a group without a weight: 2^(E - 255) is at most 1, and never an infinity that 0 would not
    // cancel.
    int reference = 255;
    bool any = false;
    for (int i = 0; i < batch.planes_per_group; ++i, out += 4) {
      const std::size_t k = plane_of(group, i);
      const PlaneSheets::PlaneState& state = sheets.state(k, slot);
      std::fill_n(out, 4, 0.0f);
      if (group.planes[static_cast<std::size_t>(i)] < 0 || is_zero(light.weights[k]) ||
          !state.present || share == 0)
        continue;
      reference = any ? std::max(reference, state.exponent_reference) : state.exponent_reference;
      any = true;
      for (std::size_t c = 0; c < 3; ++c) {
        const double weight = static_cast<double>(light.weights[k][c]) * state.factor * share;
        out[static_cast<std::ptrdiff_t>(c)] = static_cast<float>(weight * scale);
        if (raw) weights.constant[c] -= weight;
      }
    }
    first[3] = static_cast<float>(reference);
    if (any) needed = g + 1;
  }
  return needed;
}

// The bias of s is not in the constant: what s is multiplied by is another at every texel.
int PlanePass::fill_prediction(std::size_t index, const FoldedLight& light,
                               const FrameSlots& frames, const PlaneSheets& sheets, double share,
                               Weights& weights) const {
  const int slot = frames.slot(batches_[index].role);
  const auto s = static_cast<std::size_t>(light.prediction_plane);
  const PlaneSheets::PlaneState& state = sheets.state(s, slot);
  std::vector<float>& out = weights.data[index];
  std::fill(out.begin(), out.end(), 0.0f);
  out[3] = 255;
  if (!state.present || share == 0) return 0;
  const bool predicts = sheets.can_predict(slot);
  bool any = false;
  for (std::size_t n = 0; n < kHarmonics; ++n) {
    for (std::size_t c = 0; c < 3; ++c) {
      double factor =
          predicts ? kHarmonicFactors[n] * static_cast<double>(light.irradiance[n][c]) : 0;
      if (n == 0) factor += static_cast<double>(light.weights[s][c]);
      out[4 * n + c] = static_cast<float>(factor * state.factor * share);
      any = any || factor != 0;
    }
  }
  if (!any) return 0;
  out[3] = static_cast<float>(state.exponent_reference);
  return 1;
}

PlanePass::Locations PlanePass::locate(const Functions& gl, const Program& program,
                                       int (*unit_of)(int)) const {
  Locations at;
  for (std::size_t b = 0; b < batches_.size(); ++b)
    at.push_back(gl.GetUniformLocation(program.name(), ("u_weight" + std::to_string(b)).c_str()));
  for (int i = 0; i < unit_count(); ++i)
    gl.Uniform1i(gl.GetUniformLocation(program.name(), ("u_sheet" + std::to_string(i)).c_str()),
                 unit_of(i));
  return at;
}

void PlanePass::set_weights(const Functions& gl, const Locations& at,
                            const Weights& weights) const {
  for (std::size_t b = 0; b < batches_.size(); ++b)
    if (weights.counts[b] > 0)
      gl.Uniform4fv(at[b], weights.counts[b] * batches_[b].vectors(), weights.data[b].data());
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
