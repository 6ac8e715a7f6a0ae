// SPDX-License-Identifier: MIT
#pragma once

/// The integers behind Playback.
namespace relit::player {

__extension__ typedef __int128 Int128;

inline constexpr int kSpeedBits = 32;
inline constexpr Int128 kSecondUnits = Int128{1'000'000'000} << kSpeedBits;  ///< in 2^-32 ns

[[nodiscard]] constexpr Int128 floor_div(Int128 a, Int128 b) { return a / b - (a % b < 0 ? 1 : 0); }
[[nodiscard]] constexpr Int128 ceil_div(Int128 a, Int128 b) { return -floor_div(-a, b); }

}  // namespace relit::player
