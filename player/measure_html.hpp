// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "player/measure.hpp"

namespace relit::player {

/// A report as one page: plots, pictures, the table, the machine and the command. Well-formed as
/// XML too, and without anything from outside. The same report gives the same text.
[[nodiscard]] std::string measure_html(const MeasureReport& report);

/// RFC 4648.
[[nodiscard]] std::string base64(std::span<const std::uint8_t> bytes);

}  // namespace relit::player
