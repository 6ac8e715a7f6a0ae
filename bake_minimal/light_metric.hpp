// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

namespace relit::bake {

/// How much an error of transfer shows: for one colour channel the mean of (Σ_n L_n e_n)² over
/// lights is Σ_nm e_n W_nm e_m with W_nm the mean of L_n L_m, [(order+1)²][(order+1)²] row by row.
///
/// The lights are an ensemble of our own: an even sky of which a third to two thirds have gone into
/// one distant source, whose direction is anywhere above and a little below the horizon, of mean
/// radiance 1 and windowed as environments are. That is about what interiors and open skies are
/// made of, and it knows nothing of the lights by which results are judged. Symmetric under turns
/// about +Y, positive definite.
[[nodiscard]] std::vector<double> light_metric(int order);

}  // namespace relit::bake
