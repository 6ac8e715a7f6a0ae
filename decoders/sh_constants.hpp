// SPDX-License-Identifier: MIT
#pragma once

/// The factors of the orthonormal harmonics' polynomials in x, y and z.
namespace relit::decoders {

inline constexpr double kBand0 = 0.28209479177387814347;    // √(1/(4π))
inline constexpr double kBand1 = 0.48860251190291992159;    // √(3/(4π))
inline constexpr double kBand2Xy = 1.09254843059207907055;  // √(15/(4π))
inline constexpr double kBand2Zz = 0.31539156525252000603;  // √(5/(16π))
inline constexpr double kBand3M3 = 0.59004358992664351035;  // √(35/(32π))
inline constexpr double kBand3M2 = 2.89061144264055405539;  // √(105/(4π))
inline constexpr double kBand3M1 = 0.45704579946446573616;  // √(21/(32π))
inline constexpr double kBand3M0 = 0.37317633259011539141;  // √(7/(16π))

}  // namespace relit::decoders
