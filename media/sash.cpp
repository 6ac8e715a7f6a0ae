// SPDX-License-Identifier: MIT
#include "media/sash.hpp"

#include <algorithm>
#include <cmath>

#include "media/exact_math.hpp"

namespace relit::media {
namespace {

std::uint8_t sash_index(int joint) {
  const auto& list = sash_joints();
  return static_cast<std::uint8_t>(std::find(list.begin(), list.end(), joint) - list.begin());
}

Influence wrap_influence(const glm::dvec3& p) {
  const double chest = smooth_step(1.06, 1.13, p.y), pelvis = 1.0 - smooth_step(1.01, 1.09, p.y);
  Influence out;
  out.joints = {sash_index(kPelvis), sash_index(kWaist), sash_index(kChest), 0};
  const double waist = std::max(1.0 - chest - pelvis, 0.0), sum = chest + pelvis + waist;
  out.weights = {static_cast<float>(pelvis / sum), static_cast<float>(waist / sum),
                 static_cast<float>(chest / sum), 0.0f};
  return out;
}

// One fold of cloth across: a round back and a steeper front.
double fold(double p) { return exact_sin(kTau * p) + 0.38 * exact_sin(2.0 * kTau * p + 0.8); }

// Height of the folds over the cloth's mean surface. The cloth goes round twice: the outer turn,
// below an edge that slopes around the body, lies over the inner one, and both gather at the knot.
double wrap_folds(double height, double angle) {
  const double from_knot = angle - kKnotAngle, away = 0.5 - 0.5 * exact_cos(from_knot);
  const double slope = exact_sin(from_knot), gather = 0.62 + 0.38 * away;
  const double edge = 0.56 + 0.26 * slope + 0.03 * exact_sin(3.0 * angle);
  const double outer = smooth_step(0.035, -0.025, height - edge);
  const double p = (height - 0.35) / gather;
  const double below = fold(2.3 * p + 0.62 * slope + 0.10 * exact_sin(3.0 * angle + 0.5) + 0.2);
  const double above = fold(2.7 * p - 0.55 * slope + 0.12 * exact_sin(2.0 * angle + 2.1) + 0.55);
  const double depth = 0.0040 * (0.8 + 0.35 * exact_sin(2.0 * angle + 0.4 + 3.0 * height));
  const double hem = smooth_step(0.0, 0.10, height) * smooth_step(1.0, 0.90, height);
  return hem * depth * (above + outer * (below - above)) +
         0.0060 * outer * smooth_step(0.0, 0.06, height);
}

Surface wrap() {
  static const auto body = loft({{0.980, 0.1450, 0.1040, 0.1110, 0, 0, 2.2},
                                 {1.015, 0.1300, 0.0960, 0.0985, 0, 0, 2.2},
                                 {1.055, 0.1130, 0.0890, 0.0880, 0, 0, 2.15},
                                 {1.090, 0.1060, 0.0865, 0.0840, 0, 0, 2.1},
                                 {1.125, 0.1095, 0.0900, 0.0865, 0, 0, 2.1},
                                 {1.155, 0.1160, 0.0955, 0.0905, 0, 0, 2.15}},
                                0.0);
  Surface s{.name = "sash", .matter = Matter::kCloth, .columns = 44, .tolerance_m = 0.0024};
  s.point = [](double t, double angle) {
    constexpr double kLip = 0.06;
    const double a = angle + kPi;
    const double height = std::clamp((t - kLip) / (1.0 - 2.0 * kLip), 0.0, 1.0);
    const double lip = std::max({0.0, (kLip - t) / kLip, (t - 1.0 + kLip) / kLip});
    glm::dvec3 p = body(height, a);
    const glm::dvec3 out = glm::normalize(glm::dvec3(p.x, 0.0, p.z));
    p += out * (wrap_folds(height, a) - 0.018 * (1.0 - std::sqrt(std::max(1.0 - lip * lip, 0.0))));
    p.y += (t < 0.5 ? -1.0 : 1.0) * 0.006 * exact_sin(kPi * std::min(lip, 1.0) * 0.8) -
           0.010 * exact_cos(a - kKnotAngle);
    return p;
  };
  s.influence = [](const glm::dvec3& p, double) { return wrap_influence(p); };
  return s;
}

// A bun of twisted cloth, swept along the way the sash goes round.
Surface knot() {
  Surface s{.name = "knot", .matter = Matter::kCloth, .columns = 20, .tolerance_m = 0.0018};
  s.narrowest = 0.45;
  s.point = [](double t, double angle) {
    const double along = -exact_cos(kPi * t), girth = exact_sin(kPi * t);
    const double a = angle + kPi;
    const double twist = 1.0 + 0.085 * exact_sin(4.0 * a + 5.0 * along) +
                         0.05 * exact_sin(7.0 * a + 6.0 * along + 1.0);
    const double pinch = 1.0 - 0.16 * exact_exp(-12.0 * (along + 0.15) * (along + 0.15));
    const double r = exact_pow(girth, 0.85) * twist * pinch;
    const glm::dvec3 local(0.040 * along, 0.031 * r * exact_cos(a) - 0.014 * along * along,
                           0.026 * r * exact_sin(a));
    const double s40 = exact_sin(kKnotAngle), c40 = exact_cos(kKnotAngle);
    return glm::dvec3(0.096 + c40 * local.x + s40 * local.z, 1.028 + local.y - 0.25 * local.x,
                      0.098 - s40 * local.x + c40 * local.z);
  };
  s.influence = [](const glm::dvec3&, double) {
    Influence out;
    out.joints = {sash_index(kPelvis), 0, 0, 0};
    return out;
  };
  return s;
}

// Weights pass from joint to joint around the ends of the segments.
Influence tail_influence(int first, double along) {
  const double place = std::clamp(along * kTailJoints - 0.5, 0.0, kTailJoints - 1.0);
  const int k = std::min(static_cast<int>(place), kTailJoints - 2);
  const double f = smooth_step(0.0, 1.0, place - k);
  Influence out;
  out.joints = {sash_index(first + k), sash_index(first + k + 1), 0, 0};
  out.weights = {static_cast<float>(1.0 - f), static_cast<float>(f), 0.0f, 0.0f};
  return out;
}

Surface tail(int first) {
  constexpr double kClose = 0.985;  // beyond it the two faces come together
  const bool front = first == kFrontTail;
  const double length = kTailJoints * (front ? kBody.front_tail_segment : kBody.side_tail_segment);
  const double slant = front ? 0.020 : -0.016, phase = front ? 0.5 : 2.1;
  const glm::dvec3 root = tail_root(first) + glm::dvec3(0.0, kBody.pelvis_height, 0.0),
                   facing = tail_facing(first);
  const glm::dvec3 across = glm::cross(glm::dvec3(0.0, 1.0, 0.0), facing);
  Surface s{.name = front ? "long tail" : "short tail", .matter = Matter::kCloth, .columns = 22};
  s.tolerance_m = 0.0018;
  s.step_m = 0.04;
  s.point = [=](double t, double angle) {
    const double along = std::min(t / kClose, 1.0);
    const double x = exact_sin(angle), z = exact_cos(angle + kPi);
    const double half = 0.016 + 0.018 * smooth_step(0.0, 0.45, along) + 0.013 * along;
    const double pleat =
        (0.0085 - 0.0035 * along) * exact_cos(1.45 * kPi * x + phase + 0.7 * along);
    const double curl = 2.0 * (half * x) * (half * x) * along;
    const double closed =
        std::sqrt(std::max(1.0 - std::max((t - kClose) / (1.0 - kClose), 0.0), 0.0));
    const double face = (z < 0.0 ? -1.0 : 1.0) * 0.0032 * exact_pow(std::abs(z), 0.6) * closed;
    const double down = length * t + slant * x * smooth_step(0.5, 1.0, along);
    return root + across * (half * x) - glm::dvec3(0.0, down, 0.0) + facing * (pleat - curl + face);
  };
  s.bands = {{0.920, 0.932, Matter::kTrim}, {0.948, 0.985, Matter::kTrim}};
  s.influence = [=](const glm::dvec3&, double t) { return tail_influence(first, t); };
  return s;
}

}  // namespace

const std::vector<int>& sash_joints() {
  static const std::vector<int> joints = [] {
    std::vector<int> out{kPelvis, kWaist, kChest};
    for (int k = kFrontTail; k < kJointCount; ++k) out.push_back(k);
    return out;
  }();
  return joints;
}

std::vector<Surface> sash_surfaces() { return {wrap(), knot(), tail(kFrontTail), tail(kSideTail)}; }

}  // namespace relit::media
