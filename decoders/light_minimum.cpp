// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "decoders/sh.hpp"

namespace relit::decoders {
namespace {

constexpr int kRows = 48;
constexpr int kColumns = 96;
constexpr double kStep = std::numbers::pi / kRows;

glm::dvec3 sample_direction(int row, int column) {
  const double theta = kStep * (row + 0.5);
  const double phi = kStep * column;
  return {std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)};
}

/// Walks down from `position`, a step at a time along the tangents; the step doubles while it helps
/// and halves where no neighbour is lower. At the end the slope is below curvature × 1e-9, so the
/// value is right to the square of that.
double descend(const Light& light, std::size_t channel, glm::dvec3 position) {
  double least = radiance(light, position)[channel];
  double step = kStep;
  for (int round = 0; round < 4000 && step > 1e-9; ++round) {
    const glm::dvec3 aside = std::abs(position.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0);
    const glm::dvec3 u = glm::normalize(glm::cross(position, aside));
    const glm::dvec3 v = glm::cross(position, u);
    const glm::dvec3 centre = position;
    for (const glm::dvec3& direction : {u, -u, v, -v}) {
      const glm::dvec3 candidate = glm::normalize(centre + step * direction);
      const double value = radiance(light, candidate)[channel];
      if (value < least) {
        least = value;
        position = candidate;
      }
    }
    step = position == centre ? step / 2 : std::min(2 * step, kStep);
  }
  return least;
}

using Grid = std::vector<double>;

double at(const Grid& grid, int row, int column) {
  return grid[static_cast<std::size_t>(row * kColumns + (column + kColumns) % kColumns)];
}

/// Not above its neighbours; of equal samples side by side only the first, so that a flat light
/// does not make a valley of every sample.
bool is_valley(const Grid& grid, int row, int column) {
  const double here = at(grid, row, column);
  return here < at(grid, row, column - 1) && here <= at(grid, row, column + 1) &&
         (row == 0 || here < at(grid, row - 1, column)) &&
         (row + 1 == kRows || here <= at(grid, row + 1, column));
}

double minimum_of(const Light& light, std::size_t channel) {
  Grid grid;
  grid.reserve(std::size_t{kRows} * kColumns);
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      grid.push_back(radiance(light, sample_direction(row, column))[channel]);
    }
  }
  // The valleys of a cubic are far wider than the grid. The lowest sample is followed in any case:
  // a light that is the same all around has no valley in the sense above.
  const auto lowest = static_cast<int>(std::min_element(grid.begin(), grid.end()) - grid.begin());
  double least = descend(light, channel, sample_direction(lowest / kColumns, lowest % kColumns));
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      if (!is_valley(grid, row, column)) continue;
      least = std::min(least, descend(light, channel, sample_direction(row, column)));
    }
  }
  return least;
}

}  // namespace

std::array<double, 3> minimum_radiance(const Light& light) {
  return {minimum_of(light, 0), minimum_of(light, 1), minimum_of(light, 2)};
}

}  // namespace relit::decoders
