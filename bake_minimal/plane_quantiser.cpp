// SPDX-License-Identifier: MIT
#include "bake_minimal/plane_quantiser.hpp"

#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <utility>

#include "bake_minimal/plane_layout.hpp"

namespace relit::bake {
namespace {

/// The least E with |round(largest / 2^(E−E₀))| ≤ top, for scale 1. Rounding is half away from
/// zero, so the quotient has to stay below top + ½.
std::uint8_t least_exponent(double largest, int bit_depth) {
  if (largest < double{FLT_MIN}) return 0;
  int power = 0;
  std::frexp(largest, &power);  // largest = f·2^power, ½ ≤ f < 1
  int shift = power - (bit_depth - 1);
  if (std::ldexp(largest, -shift) >= mantissa_top(bit_depth) + 0.5) ++shift;
  // check_transfer() has seen to it that 255 is never reached.
  return static_cast<std::uint8_t>(
      std::clamp(shift + exponent_zero(bit_depth), exponent_least(bit_depth), 255));
}

}  // namespace

PlaneQuantiser::PlaneQuantiser(const TransferShape& shape, const CodingOptions& o)
    : shape_(shape),
      halves_(*o.chroma == container::Chroma::k420),
      bit_depth_(*o.bit_depth),
      block_(std::max(o.exponent_block, 1)),
      inverse_power_(256) {
  for (int e = 1; e < 256; ++e) {
    inverse_power_[static_cast<std::size_t>(e)] = std::ldexp(1.0, exponent_zero(bit_depth_) - e);
  }
}

std::size_t PlaneQuantiser::block_of(int x, int y) const {
  return static_cast<std::size_t>(y / block_ * blocks_x() + x / block_);
}

void PlaneQuantiser::halve_chroma(Components& components) const {
  components.half.resize(components.full.size());
  for (std::size_t c = 1; c < components.full.size() && halves_; ++c)
    halve(components.full[c], components.half[c]);
}

void PlaneQuantiser::halve(const std::vector<double>& full, std::vector<double>& half) const {
  const int w = shape_.width, h = shape_.height;
  half.clear();
  for (int y = 0; y < h; y += 2) {
    const double* row0 = full.data() + std::ptrdiff_t{y} * w;
    const double* row1 = full.data() + std::ptrdiff_t{std::min(y + 1, h - 1)} * w;
    for (int x = 0; x < w; x += 2) {
      const int x1 = std::min(x + 1, w - 1);
      half.push_back(((row0[x] + row0[x1]) + (row1[x] + row1[x1])) / 4);
    }
  }
}

void PlaneQuantiser::halve_scaled(const std::vector<double>& full,
                                  std::span<const std::uint8_t> exponents,
                                  std::vector<double>& half) const {
  std::vector<double> scaled(full.size());
  for (std::size_t p = 0; p < full.size(); ++p) scaled[p] = full[p] * inverse_power_[exponents[p]];
  halve(scaled, half);
}

void PlaneQuantiser::raise_exponents(const Components& components,
                                     std::span<std::uint8_t> exponents) const {
  std::vector<double> largest(exponents.size());
  for (std::size_t c = 0; c < components.full.size(); ++c) {
    const bool half = halved(static_cast<int>(c)) && block_ > 1;
    const std::vector<double>& values = half ? components.half[c] : components.full[c];
    const int step = half ? 2 : 1;
    std::size_t i = 0;
    for (int y = 0; y < shape_.height; y += step) {
      for (int x = 0; x < shape_.width; x += step) {
        double& top = largest[block_of(x, y)];
        top = std::max(top, std::abs(values[i++]));
      }
    }
  }
  for (std::size_t i = 0; i < largest.size(); ++i) {
    exponents[i] = std::max(exponents[i], least_exponent(largest[i], bit_depth_));
  }
}

bool PlaneQuantiser::quantise(const Components& components, int component, const Step& step,
                              std::span<const std::uint8_t> exponents,
                              std::vector<std::uint16_t>& out) const {
  const auto c = static_cast<std::size_t>(component);
  const bool half = halved(component);
  const bool torn = half && block_ == 1 && !exponents.empty();
  std::vector<double> means;
  if (torn) halve_scaled(components.full[c], exponents, means);
  const std::vector<double>& values = torn ? means : half ? components.half[c] : components.full[c];
  const int top = mantissa_top(bit_depth_), zero = mantissa_zero(bit_depth_);
  const int stride = half ? 2 : 1;
  bool fits = true;
  out.clear();
  std::size_t i = 0;
  for (int y = 0; y < shape_.height; y += stride) {
    for (int x = 0; x < shape_.width; x += stride) {
      double q = (values[i++] - step.middle) / step.scale;
      if (!exponents.empty() && !torn) q *= inverse_power_[exponents[block_of(x, y)]];
      const double rounded = std::round(q);
      fits = fits && std::abs(rounded) <= top;
      const double clamped = std::clamp<double>(rounded, -top, top);
      out.push_back(static_cast<std::uint16_t>(zero + static_cast<int>(clamped)));
    }
  }
  return fits;
}

RangeScan::RangeScan(PlaneSplit split, const CodingOptions& resolved)
    : split_(std::move(split)),
      options_(resolved),
      quantiser_(split_.shape(), resolved),
      ranges_(static_cast<std::size_t>(split_.tiles())) {}

Result<RangeScan> RangeScan::create(PlaneSplit split, const CodingOptions& options) {
  RELIT_ASSIGN(const CodingOptions resolved, resolve(options));
  RELIT_TRY(plan_layers(split, resolved, {}));
  return RangeScan(std::move(split), resolved);
}

Result<RangeScan> RangeScan::create(const TransferShape& shape, const CodingOptions& options) {
  CodingOptions colour = options;
  colour.planes = Planes::kColour;
  RELIT_ASSIGN(const CodingOptions resolved, resolve(colour));
  return create(PlaneSplit::colour(shape, resolved), resolved);
}

Status RangeScan::add_frame(const TransferFrame& frame) {
  RELIT_TRY(split_.begin_frame(frame, frame_count_));
  const bool held = options_.exponent_block > 0 && hold_frames() > 1;
  const std::size_t blocks = quantiser_.blocks();
  if (held && begins_hold(frame_count_)) exponents_.emplace_back(ranges_.size() * blocks);
  for (std::size_t tile = 0; tile < ranges_.size(); ++tile) {
    split_.split(static_cast<int>(tile), scratch_.full);
    quantiser_.halve_chroma(scratch_);
    if (held) {
      quantiser_.raise_exponents(scratch_,
                                 std::span(exponents_.back()).subspan(tile * blocks, blocks));
    }
    if (options_.exponent_block > 0) continue;
    for (std::size_t c = 0; c < scratch_.full.size(); ++c) {
      const std::vector<double>& values =
          quantiser_.halved(static_cast<int>(c)) ? scratch_.half[c] : scratch_.full[c];
      const auto [least, most] = std::minmax_element(values.begin(), values.end());
      Range& range = ranges_[tile][c];
      range.least = frame_count_ == 0 ? *least : std::min(range.least, *least);
      range.most = frame_count_ == 0 ? *most : std::max(range.most, *most);
    }
  }
  ++frame_count_;
  return {};
}

std::vector<std::array<double, 3>> RangeScan::wanted_middles() const {
  std::vector<std::array<double, 3>> middles(ranges_.size());
  if (options_.exponent_block > 0 || !options_.centred) return middles;
  for (std::size_t tile = 0; tile < ranges_.size(); ++tile) {
    if (!split_.centred(static_cast<int>(tile))) continue;
    for (std::size_t c = 0; c < 3; ++c)
      middles[tile][c] = (ranges_[tile][c].least + ranges_[tile][c].most) / 2;
  }
  return middles;
}

std::vector<Rgb> RangeScan::mean() const { return split_.mean(wanted_middles()); }

std::vector<std::vector<PlaneQuantiser::Step>> RangeScan::steps() const {
  const auto components = static_cast<std::size_t>(split_.components());
  std::vector<std::vector<PlaneQuantiser::Step>> steps(
      ranges_.size(), std::vector<PlaneQuantiser::Step>(components));
  if (options_.exponent_block > 0) return steps;
  // The mean as it is written, in float, so that rounding it costs no accuracy.
  const std::vector<std::array<double, 3>> middles = split_.middles(wanted_middles(), mean());
  double unit = 0;
  for (std::size_t tile = 0; tile < ranges_.size(); ++tile) {
    const double weight = options_.uniform_steps ? 1 : split_.weight(static_cast<int>(tile));
    for (std::size_t c = 0; c < components; ++c) {
      const Range& range = ranges_[tile][c];
      steps[tile][c] = {middles[tile][c], 1 / weight};
      const double reach = std::max(std::abs(range.most - middles[tile][c]),
                                    std::abs(range.least - middles[tile][c]));
      unit = std::max(unit, reach * weight / mantissa_top(*options_.bit_depth));
    }
  }
  if (unit == 0) unit = 1;
  for (auto& tile : steps) {
    for (PlaneQuantiser::Step& step : tile) {
      step.scale = std::max(static_cast<float>(step.scale * unit), FLT_MIN);
    }
  }
  return steps;
}

int RangeScan::hold_frames() const {
  return options_.exponent_hold == 0 ? options_.segment_frames
                                     : std::min(options_.exponent_hold, options_.segment_frames);
}

bool RangeScan::begins_hold(std::uint64_t frame) const {
  const auto segment = static_cast<std::uint64_t>(options_.segment_frames);
  return frame % segment % static_cast<std::uint64_t>(hold_frames()) == 0;
}

std::size_t RangeScan::hold_index(std::uint64_t frame) const {
  const auto segment = static_cast<std::uint64_t>(options_.segment_frames);
  const auto hold = static_cast<std::uint64_t>(hold_frames());
  const std::uint64_t holds_a_segment = (segment + hold - 1) / hold;
  return static_cast<std::size_t>(frame / segment * holds_a_segment + frame % segment / hold);
}

std::span<const std::uint8_t> RangeScan::held_exponents(std::uint64_t frame, int tile) const {
  if (options_.exponent_block == 0 || hold_frames() == 1) return {};
  return std::span(exponents_[hold_index(frame)])
      .subspan(static_cast<std::size_t>(tile) * quantiser_.blocks(), quantiser_.blocks());
}

}  // namespace relit::bake
