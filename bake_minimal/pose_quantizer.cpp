// SPDX-License-Identifier: MIT
#include "bake_minimal/pose_quantizer.hpp"

#include <algorithm>
#include <cmath>

#include "bake_minimal/stream_encoder.hpp"

namespace relit::bake {
namespace {

constexpr double kLeastOmitted = 0.35;
constexpr double kLeastStep = 1e-30;  // a subnormal float would lose its digits

struct Range {
  double low = 0;
  double high = 0;
};

Range range_of(std::span<const double> values) {
  if (values.empty()) return {};
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return {*low, *high};
}

/// Rounds one component; `top` is the largest integer.
std::vector<std::uint16_t> round_component(std::span<const double> values, double least_step,
                                           double top, float& offset, float& step) {
  const Range range = range_of(values);
  offset = static_cast<float>(range.low);
  step = static_cast<float>(std::max({(range.high - range.low) / top, least_step, kLeastStep}));
  std::vector<std::uint16_t> words;
  words.reserve(values.size());
  for (const double v : values) {
    const double steps = std::clamp((v - offset) / step, 0.0, top);
    words.push_back(static_cast<std::uint16_t>(std::lround(steps)));
  }
  return words;
}

int largest_component(const glm::dvec4& q) {
  int best = 0;
  for (int i = 1; i < 4; ++i) {
    if (std::abs(q[i]) > std::abs(q[best])) best = i;
  }
  return best;
}

/// Which component each frame leaves out.
std::vector<int> choose_omitted(std::span<const glm::dvec4> rotations) {
  int best = 0;
  double best_least = 0;
  for (int i = 0; i < 4; ++i) {
    double least = 1;
    for (const glm::dvec4& q : rotations) least = std::min(least, std::abs(q[i]));
    if (least > best_least) {
      best = i;
      best_least = least;
    }
  }
  std::vector<int> omitted(rotations.size(), best);
  if (best_least >= kLeastOmitted) return omitted;
  int current = rotations.empty() ? 0 : largest_component(rotations[0]);
  for (std::size_t t = 0; t < rotations.size(); ++t) {
    if (std::abs(rotations[t][current]) < kLeastOmitted) current = largest_component(rotations[t]);
    omitted[t] = current;
  }
  return omitted;
}

}  // namespace

QuantizedChannel quantize_linear(std::span<const std::vector<double>> values, double least_step) {
  QuantizedChannel out;
  for (std::size_t c = 0; c < values.size(); ++c) {
    out.words.push_back(round_component(values[c], least_step, 65535, out.offset[c], out.step[c]));
  }
  return out;
}

bool constant_within(std::span<const std::vector<double>> values, double step) {
  return std::all_of(values.begin(), values.end(), [&](const std::vector<double>& component) {
    const Range range = range_of(component);
    return range.high - range.low <= step;
  });
}

double middle(std::span<const double> values) {
  const Range range = range_of(values);
  return range.low + (range.high - range.low) / 2;
}

QuantizedChannel quantize_rotation(std::span<const glm::dvec4> rotations, double step) {
  const std::vector<int> omitted = choose_omitted(rotations);
  std::array<std::vector<double>, 3> kept;
  for (std::size_t t = 0; t < rotations.size(); ++t) {
    const glm::dvec4 q = rotations[t] * (rotations[t][omitted[t]] < 0 ? -1.0 : 1.0);
    for (int i = 0, slot = 0; i < 4; ++i) {
      if (i != omitted[t]) kept[static_cast<std::size_t>(slot++)].push_back(q[i]);
    }
  }
  QuantizedChannel out;
  for (std::size_t c = 0; c < 3; ++c) {
    out.words.push_back(round_component(kept[c], std::max(step, kFinestRotationStep), 32767,
                                        out.offset[c], out.step[c]));
  }
  for (std::size_t t = 0; t < rotations.size(); ++t) {
    const auto index = static_cast<unsigned>(omitted[t]);
    out.words[0][t] = static_cast<std::uint16_t>(out.words[0][t] | (index & 1u) << 15);
    out.words[1][t] = static_cast<std::uint16_t>(out.words[1][t] | (index >> 1) << 15);
  }
  return out;
}

void make_continuous(std::span<glm::dvec4> rotations) {
  for (std::size_t t = 1; t < rotations.size(); ++t) {
    if (glm::dot(rotations[t - 1], rotations[t]) < 0) rotations[t] = -rotations[t];
  }
}

std::vector<std::uint8_t> encode_pose_packet(std::span<const std::uint16_t> values,
                                             const decoders::PosePacketShape& shape) {
  constexpr int kTrialLevel = 3;
  constexpr int kFinalLevel = 19;
  const std::size_t count = shape.values * shape.frames;
  std::vector<std::uint8_t> best;
  std::size_t best_size = 0;
  for (unsigned candidate = 0; candidate < 8; ++candidate) {
    const auto mode = static_cast<std::uint8_t>(candidate);
    if (!decoders::valid_pose_mode(mode, shape.kind)) continue;
    std::vector<std::uint8_t> bytes(decoders::pose_packet_bytes(shape));
    bytes[0] = mode;
    for (std::size_t t = 0; t < shape.frames; ++t) {
      for (std::size_t v = 0; v < shape.values; ++v) {
        const unsigned prediction = decoders::predict_pose_value(mode, shape, values.data(), t, v);
        const unsigned residual = (values[t * shape.values + v] - prediction) & 0xffffu;
        const unsigned zigzag =
            ((residual << 1) ^ ((residual & 0x8000u) != 0 ? 0xffffu : 0u)) & 0xffffu;
        const std::size_t at = 1 + decoders::pose_residual_index(shape, t, v);
        bytes[at] = static_cast<std::uint8_t>(zigzag & 255);
        bytes[at + count] = static_cast<std::uint8_t>(zigzag >> 8);
      }
    }
    const std::size_t size = deflate(bytes, kTrialLevel).size();
    if (best.empty() || size < best_size) {
      best = std::move(bytes);
      best_size = size;
    }
  }
  return deflate(best, kFinalLevel);
}

}  // namespace relit::bake
