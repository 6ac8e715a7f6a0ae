// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "player/picture_writer.hpp"

namespace relit::player {
namespace {

constexpr int kBits = 5;  // of each channel in the histogram
constexpr int kCells = 1 << (3 * kBits);

struct Cell {
  std::array<std::uint8_t, 3> color;
  std::uint32_t count;
};

struct Box {
  std::size_t begin, end;  // cells
  double spread;           // population times the widest side, squared: which box to split next
  int axis;
};

Box make_box(const std::vector<Cell>& cells, std::size_t begin, std::size_t end) {
  Box box{begin, end, 0, 0};
  double population = 0;
  std::array<int, 3> low{255, 255, 255}, high{0, 0, 0};
  for (std::size_t i = begin; i < end; ++i) {
    population += cells[i].count;
    for (std::size_t c = 0; c < 3; ++c) {
      low[c] = std::min<int>(low[c], cells[i].color[c]);
      high[c] = std::max<int>(high[c], cells[i].color[c]);
    }
  }
  // The eye sees green best and blue least.
  constexpr std::array<double, 3> kWeight{1.0, 1.2, 0.7};
  double widest = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double side = kWeight[c] * (high[c] - low[c]);
    if (side > widest) widest = side, box.axis = static_cast<int>(c);
  }
  box.spread = std::sqrt(population) * widest * widest;
  return box;
}

std::size_t split_point(const std::vector<Cell>& cells, const Box& box) {
  std::uint64_t total = 0, seen = 0;
  for (std::size_t i = box.begin; i < box.end; ++i) total += cells[i].count;
  for (std::size_t i = box.begin; i < box.end; ++i) {
    seen += cells[i].count;
    if (2 * seen >= total) return std::clamp(i + 1, box.begin + 1, box.end - 1);
  }
  return box.begin + 1;
}

std::vector<Box> median_cut(std::vector<Cell>& cells) {
  std::vector<Box> boxes{make_box(cells, 0, cells.size())};
  while (boxes.size() < 256) {
    const auto widest = std::max_element(
        boxes.begin(), boxes.end(), [](const Box& a, const Box& b) { return a.spread < b.spread; });
    if (widest->spread <= 0 || widest->end - widest->begin < 2) break;
    const Box box = *widest;
    const auto axis = static_cast<std::size_t>(box.axis);
    std::sort(
        cells.begin() + static_cast<std::ptrdiff_t>(box.begin),
        cells.begin() + static_cast<std::ptrdiff_t>(box.end), [axis](const Cell& a, const Cell& b) {
          return a.color[axis] != b.color[axis] ? a.color[axis] < b.color[axis] : a.color < b.color;
        });
    const std::size_t middle = split_point(cells, box);
    *widest = make_box(cells, box.begin, middle);
    boxes.push_back(make_box(cells, middle, box.end));
  }
  return boxes;
}

std::uint32_t mean_color(const std::vector<Cell>& cells, const Box& box) {
  std::array<std::uint64_t, 3> sum{};
  std::uint64_t count = 0;
  for (std::size_t i = box.begin; i < box.end; ++i) {
    for (std::size_t c = 0; c < 3; ++c) sum[c] += std::uint64_t{cells[i].color[c]} * cells[i].count;
    count += cells[i].count;
  }
  const auto mean = [&](std::size_t c) {
    return static_cast<std::uint32_t>((sum[c] + count / 2) / count);
  };
  return 0xff000000u | mean(0) << 16 | mean(1) << 8 | mean(2);
}

std::size_t cell_of(const std::uint8_t* p) {
  constexpr int kShift = 8 - kBits;
  return static_cast<std::size_t>((p[0] >> kShift) << (2 * kBits) | (p[1] >> kShift) << kBits |
                                  p[2] >> kShift);
}

std::uint8_t nearest(const std::array<std::uint32_t, 256>& palette, std::size_t used,
                     const std::array<int, 3>& color) {
  std::size_t best = 0;
  int distance = 1 << 30;
  for (std::size_t k = 0; k < used; ++k) {
    const int dr = static_cast<int>(palette[k] >> 16 & 255) - color[0];
    const int dg = static_cast<int>(palette[k] >> 8 & 255) - color[1];
    const int db = static_cast<int>(palette[k] & 255) - color[2];
    const int d = 3 * dr * dr + 4 * dg * dg + 2 * db * db;
    if (d < distance) distance = d, best = k;
  }
  return static_cast<std::uint8_t>(best);
}

}  // namespace

void quantize_to_palette(std::span<const std::uint8_t> rgba, int width, PalettePicture& out) {
  const std::size_t pixels = rgba.size() / 4;
  std::vector<std::array<std::uint64_t, 4>> sums(kCells);
  for (std::size_t i = 0; i < pixels; ++i) {
    auto& sum = sums[cell_of(&rgba[4 * i])];
    for (std::size_t c = 0; c < 3; ++c) sum[c] += rgba[4 * i + c];
    ++sum[3];
  }
  std::vector<Cell> cells;
  for (const auto& sum : sums) {
    if (sum[3] == 0) continue;
    Cell cell{};
    for (std::size_t c = 0; c < 3; ++c) cell.color[c] = static_cast<std::uint8_t>(sum[c] / sum[3]);
    cell.count = static_cast<std::uint32_t>(sum[3]);
    cells.push_back(cell);
  }
  const std::vector<Box> boxes = median_cut(cells);
  for (std::size_t k = 0; k < boxes.size(); ++k) out.palette[k] = mean_color(cells, boxes[k]);

  // Ordered dither: unlike error diffusion it stands still from picture to picture.
  constexpr int kBayer[4][4] = {{0, 8, 2, 10}, {12, 4, 14, 6}, {3, 11, 1, 9}, {15, 7, 13, 5}};
  std::vector<std::int16_t> cache(kCells * 16, -1);
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::size_t x = i % static_cast<std::size_t>(width),
                      y = i / static_cast<std::size_t>(width);
    const int threshold = kBayer[y % 4][x % 4];
    const std::size_t key = cell_of(&rgba[4 * i]) * 16 + static_cast<std::size_t>(threshold);
    if (cache[key] < 0) {
      std::array<int, 3> color;
      for (std::size_t c = 0; c < 3; ++c)
        color[c] = std::clamp(rgba[4 * i + c] + threshold - 7, 0, 255);
      cache[key] = nearest(out.palette, boxes.size(), color);
    }
    out.indices[i] = static_cast<std::uint8_t>(cache[key]);
  }
}

}  // namespace relit::player
