// SPDX-License-Identifier: MIT
#include "media/body.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "media/exact_math.hpp"
#include "media/gait.hpp"
#include "media/skeleton.hpp"

namespace relit::media {
namespace {

constexpr double kShoulderBall = 0.050, kElbowBall = 0.036, kWristBall = 0.024;
constexpr double kHipBall = 0.062, kKneeBall = 0.047, kAnkleBall = 0.034;
constexpr double kNeckBall = 0.040, kHeadBall = 0.034;
constexpr double kRim = 50.0 * kDegree;  // half angle of the mouth in which a ball sits
constexpr double kBack = kPi;            // seams are cut where the camera seldom looks

// Two rings of a mouth around a ball at `centre`: one inside the ball, one just outside.
// `direction` is the way along y from the ball into the part.
std::array<Ring, 2> mouth(double centre, double ball, double direction) {
  const double s = exact_sin(kRim), c = exact_cos(kRim);
  const auto ring = [&](double share) {
    const double r = share * ball * s;
    return Ring{.y = centre + direction * share * ball * c, .rx = r, .front = r, .back = r};
  };
  return {ring(0.93), ring(1.09)};
}

// A limb hangs along -y from its ball at the origin; `profile` rows are {below, rx, front, back,
// cz}.
struct LimbRow {
  double below, rx, front, back, cz;
};

std::vector<Ring> limb_rings(double ball, const std::vector<LimbRow>& profile, double next_ball,
                             double length) {
  const auto head = mouth(0.0, ball, -1.0);
  std::vector<Ring> rings(head.begin(), head.end());
  for (const LimbRow& r : profile) {
    rings.push_back({.y = -r.below, .rx = r.rx, .front = r.front, .back = r.back, .cz = r.cz});
  }
  if (next_ball > 0.0) {
    const auto foot = mouth(-length, next_ball, 1.0);
    rings.insert(rings.end(), foot.rbegin(), foot.rend());
  }
  return rings;
}

const std::vector<LimbRow>& thigh_profile() {
  static const std::vector<LimbRow> rows{
      {0.058, 0.0640, 0.065, 0.064, 0.000}, {0.078, 0.0725, 0.074, 0.071, 0.001},
      {0.115, 0.0770, 0.079, 0.074, 0.003}, {0.170, 0.0745, 0.077, 0.071, 0.004},
      {0.250, 0.0635, 0.066, 0.061, 0.003}, {0.320, 0.0530, 0.054, 0.052, 0.001},
      {0.350, 0.0495, 0.050, 0.0495, 0.0},  {0.366, 0.0470, 0.047, 0.047, 0.0}};
  return rows;
}

Surface limb(const char* name, int joint, std::vector<Ring> rings, std::vector<double> inlays) {
  Surface s{.name = name, .joint = joint};
  s.point = loft(std::move(rings), kBack);
  for (const double below : inlays) {
    s.bands.push_back(
        {find_height(s.point, -below), find_height(s.point, -below - 0.0045), Matter::kWalnut});
  }
  return s;
}

Surface ball(const char* name, int joint, double radius, double from_degrees, double to_degrees) {
  Surface s{
      .name = name, .joint = joint, .matter = Matter::kWalnut, .columns = 18, .texel_weight = 0.8};
  s.tolerance_m = 0.0011;
  s.narrowest = 0.45;
  s.point = [=](double t, double angle) {
    const double polar = (from_degrees + (to_degrees - from_degrees) * t) * kDegree;
    const double r = radius * exact_sin(polar);
    return glm::dvec3(r * exact_sin(angle + kBack), radius * exact_cos(polar),
                      r * exact_cos(angle + kBack));
  };
  s.grain.pith_m = 0.05;
  return s;
}

// Piecewise cubic through (x, y) with slopes of the chords around: for the outlines of the foot.
double along_curve(const std::vector<glm::dvec2>& points, double x) {
  std::size_t i = 0;
  while (i + 2 < points.size() && x > points[i + 1].x) ++i;
  const auto slope = [&](std::size_t k) {
    const std::size_t a = k > 0 ? k - 1 : 0, b = std::min(k + 1, points.size() - 1);
    return (points[b].y - points[a].y) / (points[b].x - points[a].x);
  };
  const double h = points[i + 1].x - points[i].x, t = std::clamp((x - points[i].x) / h, 0.0, 1.0),
               u = 1.0 - t;
  return points[i].y * u * u * (1 + 2 * t) + points[i + 1].y * t * t * (3 - 2 * t) +
         h * t * u * (slope(i) * u - slope(i + 1) * t);
}

double round_end(double distance, double length) {
  const double a = 1.0 - std::min(distance / length, 1.0);
  return std::sqrt(std::max(1.0 - a * a, 0.0));
}

// Swept from heel to toe; its lower outline is exactly the curve that rolls on the ground.
Surface foot(const char* name, int joint, double side) {
  static const std::vector<glm::dvec2> kTop{{-0.068, 0.056}, {-0.035, 0.066}, {0.0, 0.070},
                                            {0.03, 0.068},   {0.07, 0.057},   {0.11, 0.048},
                                            {0.14, 0.0445},  {0.17, 0.043}};
  static const std::vector<glm::dvec2> kHalf{{-0.068, 0.028}, {-0.035, 0.030}, {0.0, 0.031},
                                             {0.05, 0.036},   {0.095, 0.0425}, {0.13, 0.043},
                                             {0.155, 0.039},  {0.17, 0.034}};
  Surface s{.name = name, .joint = joint, .columns = 22, .tolerance_m = 0.0006, .step_m = 0.035};
  s.narrowest = 0.5;
  s.point = [side](double t, double angle) {
    const double z0 = sole_back(), z1 = sole_front();
    const double z = z0 + (z1 - z0) * 0.5 * (1.0 - exact_cos(kPi * t));
    const double low = sole_height(z), ends = sole_height(t < 0.5 ? z0 : z1);
    const double top =
        ends + (along_curve(kTop, z) - ends) * round_end(z - z0, 0.04) * round_end(z1 - z, 0.045);
    const double half = along_curve(kHalf, z) * round_end(z - z0, 0.036) * round_end(z1 - z, 0.055);
    const double middle = low + 0.40 * (top - low);
    const double x = exact_sin(angle), y = -exact_cos(angle);
    const double n = y < 0.0 ? 3.6 : 2.3;
    const double k = exact_pow(exact_pow(std::abs(x), n) + exact_pow(std::abs(y), n), -1.0 / n);
    const double bend = -side * 0.010 * smooth_step(0.02, 0.17, z);
    return glm::dvec3(half * k * x + bend,
                      middle + k * y * (y < 0.0 ? middle - low : top - middle) - kBody.ankle_height,
                      z);
  };
  s.grain = {.angle = 0.4 + side, .pith_m = 0.09};
  return s;
}

void add_arm(bool left, std::vector<Surface>& out) {
  const double side = left ? 1.0 : -1.0;
  const int arm = left ? kUpperArmL : kUpperArmR;
  out.push_back(ball("shoulder ball", arm, kShoulderBall, 0.0, 136.0));
  out.push_back(limb("upper arm", arm,
                     limb_rings(kShoulderBall,
                                {{0.048, 0.0465, 0.0465, 0.0465, 0.0},
                                 {0.070, 0.0490, 0.050, 0.048, 0.0},
                                 {0.110, 0.0465, 0.048, 0.045, 0.001},
                                 {0.165, 0.0400, 0.041, 0.039, 0.001},
                                 {0.215, 0.0350, 0.035, 0.035, 0.0},
                                 {0.242, 0.0345, 0.0345, 0.0345, 0.0},
                                 {0.254, 0.0330, 0.033, 0.033, 0.0}},
                                kElbowBall, kBody.upper_arm),
                     {0.2185}));
  out.push_back(ball("elbow ball", arm + 1, kElbowBall, 0.0, 136.0));
  out.push_back(limb("forearm", arm + 1,
                     limb_rings(kElbowBall,
                                {{0.034, 0.0335, 0.0335, 0.0335, 0.0},
                                 {0.052, 0.0370, 0.037, 0.036, 0.0},
                                 {0.080, 0.0375, 0.038, 0.036, 0.001},
                                 {0.125, 0.0325, 0.033, 0.031, 0.001},
                                 {0.170, 0.0260, 0.026, 0.026, 0.0},
                                 {0.200, 0.0235, 0.0235, 0.0235, 0.0},
                                 {0.213, 0.0232, 0.0232, 0.0232, 0.0},
                                 {0.219, 0.0220, 0.022, 0.022, 0.0}},
                                kWristBall, kBody.forearm),
                     {0.1905}));
  out.push_back(ball("wrist ball", arm + 2, kWristBall, 0.0, 136.0));
  out.back().columns = 14;
  const auto head = mouth(0.0, kWristBall, -1.0);
  std::vector<Ring> palm(head.begin(), head.end());
  const double in = -side;
  for (const Ring& r : {Ring{-0.026, 0.0200, 0.0240, 0.0240, in * 0.000, 0.000, 2.1},
                        Ring{-0.048, 0.0195, 0.0340, 0.0330, in * 0.001, 0.000, 2.3},
                        Ring{-0.080, 0.0175, 0.0385, 0.0370, in * 0.003, 0.001, 2.4},
                        Ring{-0.112, 0.0150, 0.0360, 0.0350, in * 0.007, 0.002, 2.4},
                        Ring{-0.142, 0.0125, 0.0300, 0.0290, in * 0.013, 0.003, 2.3},
                        Ring{-0.165, 0.0095, 0.0215, 0.0210, in * 0.019, 0.004, 2.2},
                        Ring{-0.176, 0.0, 0.0, 0.0, in * 0.022, 0.004, 2.0}}) {
    palm.push_back(r);
  }
  out.push_back(limb("hand", arm + 2, palm, {}));
  const auto thumb = loft({{0.0, 0.0, 0.0, 0.0},
                           {-0.004, 0.0065, 0.0065, 0.0065},
                           {-0.018, 0.0105, 0.0105, 0.0105},
                           {-0.040, 0.0108, 0.0108, 0.0108},
                           {-0.060, 0.0088, 0.0088, 0.0088},
                           {-0.072, 0.0, 0.0, 0.0}},
                          kBack);
  const glm::dquat turn = turn_about(0, -30.0 * kDegree) * turn_about(2, -side * 14.0 * kDegree);
  Surface t{.name = "thumb", .joint = arm + 2, .columns = 12};
  t.point = [=](double at, double angle) {
    return turn * thumb(at, angle) + glm::dvec3(in * 0.006, -0.034, 0.022);
  };
  out.push_back(t);
}

void add_leg(bool left, std::vector<Surface>& out) {
  const int leg = left ? kThighL : kThighR;
  out.push_back(ball("hip ball", leg, kHipBall, 45.0, 136.0));
  out.push_back(
      limb("thigh", leg, limb_rings(kHipBall, thigh_profile(), kKneeBall, kBody.thigh), {0.3285}));
  out.push_back(ball("knee ball", leg + 1, kKneeBall, 0.0, 136.0));
  out.push_back(limb("shin", leg + 1,
                     limb_rings(kKneeBall,
                                {{0.043, 0.0450, 0.046, 0.045, 0.000},
                                 {0.065, 0.0490, 0.048, 0.052, -0.002},
                                 {0.110, 0.0510, 0.047, 0.059, -0.006},
                                 {0.165, 0.0475, 0.043, 0.055, -0.007},
                                 {0.230, 0.0390, 0.037, 0.043, -0.004},
                                 {0.290, 0.0318, 0.032, 0.033, -0.001},
                                 {0.330, 0.0305, 0.0305, 0.0305, 0.0},
                                 {0.350, 0.0312, 0.0312, 0.0312, 0.0},
                                 {0.359, 0.0300, 0.0300, 0.0300, 0.0}},
                                kAnkleBall, kBody.shin),
                     {0.3195}));
  out.push_back(ball("ankle ball", leg + 2, kAnkleBall, 0.0, 128.0));
  out.push_back(foot("foot", leg + 2, left ? 1.0 : -1.0));
}

void add_trunk(std::vector<Surface>& out) {
  Surface pelvis = limb("pelvis", kPelvis,
                        {{0.066, 0.108, 0.080, 0.080, 0, 0, 2.2},
                         {0.040, 0.126, 0.088, 0.090, 0, 0, 2.2},
                         {0.010, 0.140, 0.095, 0.101, 0, 0, 2.3},
                         {-0.030, 0.151, 0.097, 0.109, 0, 0, 2.4},
                         {-0.068, 0.151, 0.091, 0.106, 0, 0, 2.4},
                         {-0.100, 0.130, 0.076, 0.090, 0, 0, 2.3},
                         {-0.124, 0.084, 0.055, 0.062, 0, 0, 2.1},
                         {-0.134, 0.0, 0.0, 0.0, 0, 0, 2.0}},
                        {});
  pelvis.columns = 32;
  pelvis.grain = {.angle = 1.0, .pith_m = 0.22};
  out.push_back(pelvis);
  Surface chest = limb("chest", kChest,
                       {{0.010, 0.098, 0.080, 0.078, 0, 0, 2.2},
                        {0.045, 0.110, 0.087, 0.084, 0, 0, 2.2},
                        {0.110, 0.128, 0.101, 0.094, 0, 0.002, 2.3},
                        {0.180, 0.145, 0.112, 0.100, 0, 0.003, 2.4},
                        {0.235, 0.159, 0.112, 0.101, 0, 0.002, 2.4},
                        {0.280, 0.165, 0.101, 0.097, 0, 0, 2.4},
                        {0.312, 0.152, 0.084, 0.087, 0, 0, 2.3},
                        {0.334, 0.118, 0.065, 0.070, 0, 0, 2.2},
                        {0.347, 0.076, 0.051, 0.054, 0, 0, 2.1},
                        {0.354, 0.050, 0.043, 0.044, 0, 0, 2.0},
                        {0.356, 0.0375, 0.0375, 0.0375, 0, 0, 2.0}},
                       {});
  chest.columns = 36;
  chest.step_m = 0.04;
  chest.grain = {.angle = 2.6, .pith_m = 0.24, .offset_m = 0.2};
  out.push_back(chest);
  out.push_back(ball("neck ball", kNeck, kNeckBall, 45.0, 118.0));
  const auto low = mouth(0.0, kNeckBall, 1.0), high = mouth(kBody.head_rise, kHeadBall, -1.0);
  out.push_back(limb("neck", kNeck,
                     {low[0],
                      low[1],
                      {0.038, 0.0345, 0.0345, 0.0345},
                      {0.049, 0.0315, 0.0315, 0.0315},
                      {0.058, 0.0310, 0.0310, 0.0310},
                      high[1],
                      high[0]},
                     {}));
  out.push_back(ball("head ball", kHead, kHeadBall, 43.0, 150.0));
  const auto chin = mouth(0.0, kHeadBall, 1.0);
  Surface head = limb("head", kHead,
                      {chin[0],
                       chin[1],
                       {0.0265, 0.037, 0.050, 0.034, 0, 0.008},
                       {0.043, 0.054, 0.077, 0.052, 0, 0.006},
                       {0.075, 0.0685, 0.091, 0.073, 0, 0.004},
                       {0.115, 0.0775, 0.094, 0.090, 0, 0.002},
                       {0.155, 0.0785, 0.092, 0.097, 0, 0},
                       {0.195, 0.067, 0.079, 0.086, 0, -0.002},
                       {0.221, 0.043, 0.051, 0.056, 0, -0.004},
                       {0.2325, 0.0, 0.0, 0.0, 0, -0.005}},
                      {});
  head.columns = 28;
  head.grain = {.angle = 0.7, .pith_m = 0.16, .offset_m = 0.37};
  out.push_back(head);
}

}  // namespace

std::vector<Surface> body_surfaces() {
  std::vector<Surface> out;
  add_trunk(out);
  for (const bool left : {true, false}) add_arm(left, out);
  for (const bool left : {true, false}) add_leg(left, out);
  // No two parts come from the same place of the trunk.
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (out[i].grain.offset_m != 0.0) continue;
    out[i].grain.offset_m = 0.137 * static_cast<double>(i);
    out[i].grain.angle += 2.4 * static_cast<double>(i);
  }
  return out;
}

std::vector<Surface> base_surfaces() {
  constexpr double kRadius = 0.85, kRound = 0.014, kThick = 0.045;
  constexpr double kFlat = kRadius - kRound, kArc = 0.5 * kPi * kRound, kWall = kThick - kRound;
  constexpr double kLength = kFlat + kArc + kWall;
  Surface top{
      .name = "base plate", .matter = Matter::kPlaster, .unroll = Unroll::kDisc, .columns = 72};
  top.tolerance_m = 0.0015;
  top.step_m = 0.3;
  top.texel_weight = 0.6;
  top.point = [](double t, double angle) {
    const double s = t * kLength;
    double r = s, y = 0.0;
    if (s > kFlat + kArc) {
      r = kRadius;
      y = -kRound - (s - kFlat - kArc);
    } else if (s > kFlat) {
      r = kFlat + kRound * exact_sin((s - kFlat) / kRound);
      y = -kRound * (1.0 - exact_cos((s - kFlat) / kRound));
    }
    return glm::dvec3(r * exact_sin(angle + kBack), y, r * exact_cos(angle + kBack));
  };
  top.bands = {{0.748 / kLength, 0.752 / kLength, Matter::kWalnut},
               {0.764 / kLength, 0.780 / kLength, Matter::kWalnut}};
  top.grain = {.angle = 0.3, .pith_m = 0.9};
  Surface bottom{
      .name = "base underside", .matter = Matter::kPlaster, .unroll = Unroll::kDisc, .columns = 72};
  bottom.step_m = 1.0;
  bottom.texel_weight = 0.06;
  bottom.point = [](double t, double angle) {
    return glm::dvec3(t * kRadius * exact_sin(angle + kBack), -kThick,
                      t * kRadius * exact_cos(angle + kBack));
  };
  return {top, bottom};
}

double thigh_radius(double below_hip_m) {
  const auto& rows = thigh_profile();
  if (below_hip_m <= rows.front().below) return rows.front().front;
  for (std::size_t i = 0; i + 1 < rows.size(); ++i) {
    if (below_hip_m > rows[i + 1].below) continue;
    const double f = (below_hip_m - rows[i].below) / (rows[i + 1].below - rows[i].below);
    return rows[i].front + rows[i].cz +
           f * (rows[i + 1].front + rows[i + 1].cz - rows[i].front - rows[i].cz);
  }
  return rows.back().front;
}

}  // namespace relit::media
