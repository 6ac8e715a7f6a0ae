// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include "player/measure.hpp"

/// Parts of `relit measure`'s page.
namespace relit::player {

/// measure_page.css.
extern const std::string_view kMeasurePageStyle;

/// All points, a row each. What is the same for all of them stands above the table.
[[nodiscard]] std::string measure_html_table(const MeasureReport& report);

}  // namespace relit::player
