// SPDX-License-Identifier: MIT
#include "gles/image.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace relit::gles {
namespace {

float decode(float c) { return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f); }

float encode(float c) {
  return c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1.0f / 2.4f) - 0.055f;
}

// Linear light by sRGB byte, and alpha by byte.
const std::array<float, 256>& decode_table() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> t{};
    for (std::size_t i = 0; i < t.size(); ++i) t[i] = decode(static_cast<float>(i) / 255.0f);
    return t;
  }();
  return table;
}

std::uint8_t to_byte(float value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0f, 1.0f) * 255.0f + 0.5f);
}

// The source texels of one target texel on one axis.
struct Taps {
  int first = 0;
  std::vector<float> weights;  // sum 1
};

std::vector<Taps> make_taps(int from, int to, bool smooth) {
  std::vector<Taps> taps(static_cast<std::size_t>(to));
  const double ratio = static_cast<double>(from) / to;
  for (int i = 0; i < to; ++i) {
    Taps& tap = taps[static_cast<std::size_t>(i)];
    const double centre = (i + 0.5) * ratio;
    if (!smooth) {
      tap.first = std::min(from - 1, static_cast<int>(centre));
      tap.weights = {1.0f};
    } else if (ratio <= 1) {
      const double at = centre - 0.5;
      tap.first = static_cast<int>(std::floor(at));
      const auto f = static_cast<float>(at - tap.first);
      tap.weights = {1 - f, f};
    } else {
      const double low = i * ratio;
      const double high = (i + 1) * ratio;
      tap.first = static_cast<int>(std::floor(low));
      for (int s = tap.first; s < high - 1e-9; ++s)
        tap.weights.push_back(
            static_cast<float>((std::min<double>(high, s + 1) - std::max<double>(low, s)) / ratio));
    }
  }
  return taps;
}

int at_edge(int i, int size, bool wraps) {
  return wraps ? (i % size + size) % size : std::clamp(i, 0, size - 1);
}

}  // namespace

std::vector<std::uint8_t> resample(const ImageView& image, const ResampleOptions& o) {
  const auto width = static_cast<std::size_t>(o.width);
  const auto source_width = static_cast<std::size_t>(image.width);
  const std::vector<Taps> columns = make_taps(image.width, o.width, o.smooth);
  const std::vector<Taps> rows = make_taps(image.height, o.height, o.smooth);
  const std::array<float, 256>& linear = decode_table();
  std::vector<std::uint8_t> out(width * static_cast<std::size_t>(o.height) * 4);
  std::vector<float> line(source_width * 4);
  for (std::size_t y = 0; y < rows.size(); ++y) {
    // Vertically first, into one line of linear light.
    std::fill(line.begin(), line.end(), 0.0f);
    for (std::size_t t = 0; t < rows[y].weights.size(); ++t) {
      const int row = at_edge(rows[y].first + static_cast<int>(t), image.height, o.wrap_y);
      const std::uint8_t* source =
          image.rgba.data() + static_cast<std::size_t>(row) * source_width * 4;
      const float weight = rows[y].weights[t];
      for (std::size_t i = 0; i < line.size(); ++i)
        line[i] +=
            weight * (i % 4 == 3 ? static_cast<float>(source[i]) / 255.0f : linear[source[i]]);
    }
    for (std::size_t x = 0; x < width; ++x) {
      float sum[4] = {};
      for (std::size_t t = 0; t < columns[x].weights.size(); ++t) {
        const int column = at_edge(columns[x].first + static_cast<int>(t), image.width, o.wrap_x);
        for (std::size_t c = 0; c < 4; ++c)
          sum[c] += columns[x].weights[t] * line[static_cast<std::size_t>(column) * 4 + c];
      }
      std::uint8_t* target = out.data() + (y * width + x) * 4;
      for (std::size_t c = 0; c < 3; ++c) target[c] = to_byte(encode(sum[c]));
      target[3] = to_byte(sum[3]);
    }
  }
  return out;
}

int power_of_two_above(int size) {
  return static_cast<int>(std::bit_ceil(static_cast<unsigned>(size)));
}

}  // namespace relit::gles
