// SPDX-License-Identifier: MIT
#include "media/sash.hpp"

#include <algorithm>
#include <cmath>

#include "media/exact_math.hpp"

namespace relit::media {
namespace {

constexpr double kKnotAngle = 40.0 * kDegree;

std::uint8_t sash_index(int joint) {
  const auto& list = sash_joints();
  return static_cast<std::uint8_t>(std::find(list.begin(), list.end(), joint) - list.begin());
}

Influence wrap_influence(const glm::dvec3& p) {
  const double chest = smooth_step(1.07, 1.15, p.y), pelvis = 1.0 - smooth_step(1.01, 1.09, p.y);
  Influence out;
  out.joints = {sash_index(kPelvis), sash_index(kWaist), sash_index(kChest), 0};
  const double waist = std::max(1.0 - chest - pelvis, 0.0), sum = chest + pelvis + waist;
  out.weights = {static_cast<float>(pelvis / sum), static_cast<float>(waist / sum),
                 static_cast<float>(chest / sum), 0.0f};
  return out;
}

// Height of the folds over the cloth's mean surface: they run around the body and gather at the
// knot.
double wrap_folds(double height, double angle) {
  const double from_knot = angle - kKnotAngle, away = 0.5 - 0.5 * exact_cos(from_knot);
  const double gather = 0.55 + 0.45 * away;
  const double p = (height - 0.42) * 4.6 / gather + 0.42 * exact_sin(from_knot) +
                   0.16 * exact_sin(2.0 * angle + 1.1) +
                   0.10 * exact_sin(3.0 * angle + 5.0 * height);
  const double crest = exact_sin(kTau * p) + 0.32 * exact_sin(2.0 * kTau * p + 0.9);
  const double over =
      smooth_step(-0.05, 0.05, height - 0.47 - 0.24 * exact_sin(0.5 * from_knot + 0.4));
  const double middle = smooth_step(0.0, 0.12, height) * smooth_step(1.0, 0.88, height);
  return middle * (0.0042 * crest * (0.75 + 0.25 * exact_sin(2.0 * angle + 0.4)) + 0.0055 * over);
}

Surface wrap() {
  static const auto body = loft({{0.988, 0.1470, 0.106, 0.1110, 0, 0, 2.2},
                                 {1.030, 0.1335, 0.101, 0.1030, 0, 0, 2.2},
                                 {1.072, 0.1230, 0.096, 0.0950, 0, 0, 2.2},
                                 {1.110, 0.1195, 0.096, 0.0925, 0, 0, 2.2},
                                 {1.148, 0.1240, 0.100, 0.0955, 0, 0, 2.2},
                                 {1.176, 0.1285, 0.104, 0.0985, 0, 0, 2.2}},
                                0.0);
  Surface s{.name = "sash", .matter = Matter::kCloth, .columns = 60, .tolerance_m = 0.0014};
  s.point = [](double t, double angle) {
    constexpr double kLip = 0.07;
    const double a = angle + kPi;
    const double height = std::clamp((t - kLip) / (1.0 - 2.0 * kLip), 0.0, 1.0);
    const double lip = std::max({0.0, (kLip - t) / kLip, (t - 1.0 + kLip) / kLip});
    glm::dvec3 p = body(height, a);
    const glm::dvec3 out = glm::normalize(glm::dvec3(p.x, 0.0, p.z));
    p += out * (wrap_folds(height, a) - 0.020 * (1.0 - std::sqrt(std::max(1.0 - lip * lip, 0.0))));
    p.y += (t < 0.5 ? -1.0 : 1.0) * 0.006 * exact_sin(kPi * std::min(lip, 1.0) * 0.9) -
           0.012 * exact_cos(a - kKnotAngle);
    return p;
  };
  s.influence = [](const glm::dvec3& p, double) { return wrap_influence(p); };
  return s;
}

Surface knot() {
  Surface s{.name = "knot", .matter = Matter::kCloth, .columns = 18, .tolerance_m = 0.0012};
  s.narrowest = 0.45;
  s.point = [](double t, double angle) {
    const double polar = kPi * t, sp = exact_sin(polar), cp = exact_cos(polar);
    const double a = angle + kPi;
    // Two loops pulled tight across each other.
    const double groove = 1.0 + 0.10 * exact_sin(2.0 * a + 2.6 * cp) * sp;
    const glm::dvec3 local(0.033 * groove * sp * exact_sin(a), 0.029 * groove * cp,
                           0.025 * groove * sp * exact_cos(a));
    const double s40 = exact_sin(kKnotAngle), c40 = exact_cos(kKnotAngle);
    return glm::dvec3(0.098 + c40 * local.x + s40 * local.z, 1.026 + local.y + 0.2 * local.x,
                      0.094 - s40 * local.x + c40 * local.z);
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
  Surface s{.name = front ? "long tail" : "short tail", .matter = Matter::kCloth, .columns = 26};
  s.tolerance_m = 0.0012;
  s.step_m = 0.04;
  s.point = [=](double t, double angle) {
    const double along = std::min(t / kClose, 1.0);
    const double x = exact_sin(angle), z = exact_cos(angle + kPi);
    const double half = 0.017 + 0.026 * smooth_step(0.0, 0.45, along) + 0.012 * along;
    const double pleat =
        (0.0085 - 0.0035 * along) * exact_cos(1.45 * kPi * x + phase + 0.7 * along);
    const double curl = 2.0 * (half * x) * (half * x) * along;
    const double closed =
        std::sqrt(std::max(1.0 - std::max((t - kClose) / (1.0 - kClose), 0.0), 0.0));
    const double face = (z < 0.0 ? -1.0 : 1.0) * 0.0032 * exact_pow(std::abs(z), 0.6) * closed;
    const double down = length * t + slant * x * smooth_step(0.5, 1.0, along);
    return root + across * (half * x) - glm::dvec3(0.0, down, 0.0) + facing * (pleat - curl + face);
  };
  s.bands = {{0.915, 0.930, Matter::kTrim}, {0.945, 0.985, Matter::kTrim}};
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
