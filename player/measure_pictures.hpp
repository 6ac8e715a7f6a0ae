// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include "player/measure.hpp"
#include "player/measure_point.hpp"

namespace relit::player {

/// Draws one frame of the reference and of chosen points into the report: those on the front of
/// bytes, then others, at most `most`, from the best to the worst. Each is the point's light map as
/// its path gave it, drawn by the first backend, so that nothing but light differs. Without GL
/// there are none. `report` has its points and its machine's backends; `picture_frame` of it says
/// which frame. Errors: those of drawing.
[[nodiscard]] Status add_pictures(const MeasureReference& reference,
                                  std::span<const MeasureLight> lights, Backend backend,
                                  std::size_t most, MeasureReport& report);

/// Which points are worth a picture, from the best to the worst: none twice that differs only in
/// what cannot be seen.
[[nodiscard]] std::vector<std::size_t> picture_points(const MeasureReport& report,
                                                      std::size_t most);

/// How far two pictures, RGBA, are apart: ink where they differ, the more the stronger, `gain`
/// times the largest difference of a pixel's three channels; a faint silhouette where either is
/// opaque.
void draw_difference(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b, double gain,
                     std::span<std::uint8_t> out);

}  // namespace relit::player
