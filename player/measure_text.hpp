// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "player/measure.hpp"

/// A report for people's terminals and for other programs. MEASURE.md has the columns and the
/// schema. The same report gives the same text.
namespace relit::player {

[[nodiscard]] std::string measure_table(const MeasureReport& report);
/// RFC 4180, a line a point, a header in front; what was not measured is empty, an infinite PSNR is
/// "inf".
[[nodiscard]] std::string measure_csv(const MeasureReport& report);
/// What was not measured is null, an infinite PSNR too (`exact` says which).
[[nodiscard]] nlohmann::ordered_json measure_json(const MeasureReport& report);

/// A number in a table: so many digits after the point, whatever the locale; "–" where there is
/// none, "∞" where it is infinite.
[[nodiscard]] std::string fixed(double value, int digits);
[[nodiscard]] std::string fixed(std::optional<double> value, int digits);

}  // namespace relit::player
