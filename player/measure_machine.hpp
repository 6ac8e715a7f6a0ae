// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "player/measure.hpp"

namespace relit::player {

/// The words of this program's command line; empty where the system does not tell.
[[nodiscard]] std::vector<std::string> command_words();
/// The same as a shell takes them.
[[nodiscard]] std::string shell_text(const std::vector<std::string>& words);

/// Processor, system and version; GL of every backend that can be opened, which go to `backends`.
[[nodiscard]] MeasuredMachine describe_machine(std::vector<Backend>& backends);

}  // namespace relit::player
