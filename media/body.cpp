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

constexpr double kBack = kPi;  // seams are cut where the camera seldom looks

// A ball and the half angle of the mouths it sits in: the wider, the less the joint can bend.
struct Socket {
  double radius, rim_degrees;
};

constexpr Socket kShoulder{0.050, 58.0}, kElbow{0.037, 59.0}, kWrist{0.0245, 60.0};
constexpr Socket kHip{0.069, 57.0}, kKnee{0.048, 54.0}, kAnkle{0.034, 55.0};
constexpr Socket kNeckLow{0.044, 62.0}, kNeckHigh{0.038, 66.0};

// Two rings of a mouth around a ball at `centre`: one inside the ball, one just outside.
// `direction` is the way along y from the ball into the part.
std::array<Ring, 2> mouth(double centre, const Socket& socket, double direction) {
  const double s = exact_sin(socket.rim_degrees * kDegree),
               c = exact_cos(socket.rim_degrees * kDegree);
  const auto ring = [&](double share) {
    const double r = share * socket.radius * s;
    return Ring{
        .y = centre + direction * share * socket.radius * c, .rx = r, .front = r, .back = r};
  };
  return {ring(0.94), ring(1.06)};
}

// A limb hangs along -y from its ball at the origin.
struct LimbRow {
  double below, rx, front, back, cz;
};

LimbRow round_row(double below, double radius) { return {below, radius, radius, radius, 0.0}; }

std::vector<Ring> limb_rings(const Socket& upper, const std::vector<LimbRow>& profile,
                             const Socket& lower, double length) {
  const auto head = mouth(0.0, upper, -1.0), foot = mouth(-length, lower, 1.0);
  std::vector<Ring> rings(head.begin(), head.end());
  for (const LimbRow& r : profile) {
    rings.push_back({.y = -r.below, .rx = r.rx, .front = r.front, .back = r.back, .cz = r.cz});
  }
  rings.insert(rings.end(), foot.rbegin(), foot.rend());
  return rings;
}

const std::vector<LimbRow>& thigh_profile() {
  static const std::vector<LimbRow> rows{{0.049, 0.0660, 0.0665, 0.0655, 0.000},
                                         {0.070, 0.0725, 0.0740, 0.0715, 0.001},
                                         {0.110, 0.0765, 0.0790, 0.0740, 0.003},
                                         {0.165, 0.0745, 0.0775, 0.0710, 0.004},
                                         {0.245, 0.0635, 0.0660, 0.0610, 0.003},
                                         {0.315, 0.0530, 0.0540, 0.0520, 0.001},
                                         round_row(0.350, 0.0490),
                                         round_row(0.369, 0.0455)};
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

// Of the ball only what can be seen: from the upper pole (or below it) to under the lip of its own
// part.
Surface ball(const char* name, int joint, const Socket& socket, double from_degrees) {
  Surface s{
      .name = name, .joint = joint, .matter = Matter::kWalnut, .columns = 18, .texel_weight = 0.8};
  const double radius = socket.radius, to_degrees = 187.0 - socket.rim_degrees;
  s.tolerance_m = 0.0015;
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
  Surface s{.name = name, .joint = joint, .columns = 20, .tolerance_m = 0.0012, .step_m = 0.035};
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

void add_hand(double side, int joint, std::vector<Surface>& out) {
  const auto head = mouth(0.0, kWrist, -1.0);
  std::vector<Ring> palm(head.begin(), head.end());
  const double in = -side;
  for (const Ring& r : {Ring{-0.026, 0.0205, 0.0245, 0.0245, in * 0.000, 0.000, 2.1},
                        Ring{-0.048, 0.0195, 0.0335, 0.0325, in * 0.001, 0.000, 2.3},
                        Ring{-0.080, 0.0175, 0.0375, 0.0360, in * 0.003, 0.001, 2.4},
                        Ring{-0.112, 0.0150, 0.0350, 0.0340, in * 0.008, 0.002, 2.4},
                        Ring{-0.142, 0.0125, 0.0290, 0.0280, in * 0.015, 0.003, 2.3},
                        Ring{-0.165, 0.0095, 0.0205, 0.0200, in * 0.022, 0.004, 2.2},
                        Ring{-0.176, 0.0, 0.0, 0.0, in * 0.025, 0.004, 2.0}}) {
    palm.push_back(r);
  }
  out.push_back(limb("hand", joint, palm, {}));
  const auto thumb = loft({{0.0, 0.0, 0.0, 0.0},
                           {-0.004, 0.0065, 0.0065, 0.0065},
                           {-0.018, 0.0105, 0.0105, 0.0105},
                           {-0.040, 0.0108, 0.0108, 0.0108},
                           {-0.060, 0.0088, 0.0088, 0.0088},
                           {-0.072, 0.0, 0.0, 0.0}},
                          kBack);
  const glm::dquat turn = turn_about(0, -30.0 * kDegree) * turn_about(2, -side * 14.0 * kDegree);
  Surface t{.name = "thumb", .joint = joint, .columns = 12};
  t.point = [=](double at, double angle) {
    return turn * thumb(at, angle) + glm::dvec3(in * 0.006, -0.034, 0.022);
  };
  out.push_back(t);
}

void add_arm(bool left, std::vector<Surface>& out) {
  const int arm = left ? kUpperArmL : kUpperArmR;
  out.push_back(ball("shoulder ball", arm, kShoulder, 0.0));
  out.push_back(limb("upper arm", arm,
                     limb_rings(kShoulder,
                                {round_row(0.038, 0.0480),
                                 {0.060, 0.0500, 0.0505, 0.0495, 0.000},
                                 {0.095, 0.0485, 0.0500, 0.0470, 0.001},
                                 {0.150, 0.0415, 0.0430, 0.0400, 0.001},
                                 {0.205, 0.0350, 0.0350, 0.0350, 0.000},
                                 round_row(0.236, 0.0340),
                                 round_row(0.254, 0.0340)},
                                kElbow, kBody.upper_arm),
                     {0.2145}));
  out.push_back(ball("elbow ball", arm + 1, kElbow, 0.0));
  out.push_back(limb("forearm", arm + 1,
                     limb_rings(kElbow,
                                {round_row(0.030, 0.0350),
                                 {0.048, 0.0370, 0.0370, 0.0365, 0.000},
                                 {0.078, 0.0370, 0.0375, 0.0360, 0.001},
                                 {0.122, 0.0320, 0.0325, 0.0310, 0.001},
                                 {0.168, 0.0255, 0.0255, 0.0255, 0.000},
                                 round_row(0.198, 0.0232),
                                 round_row(0.215, 0.0232)},
                                kWrist, kBody.forearm),
                     {0.1875}));
  out.push_back(ball("wrist ball", arm + 2, kWrist, 0.0));
  out.back().columns = 16;
  add_hand(left ? 1.0 : -1.0, arm + 2, out);
}

void add_leg(bool left, std::vector<Surface>& out) {
  const int leg = left ? kThighL : kThighR;
  out.push_back(ball("hip ball", leg, kHip, 45.0));
  out.push_back(
      limb("thigh", leg, limb_rings(kHip, thigh_profile(), kKnee, kBody.thigh), {0.3285}));
  out.push_back(ball("knee ball", leg + 1, kKnee, 0.0));
  out.push_back(limb("shin", leg + 1,
                     limb_rings(kKnee,
                                {{0.039, 0.0440, 0.0445, 0.0440, 0.000},
                                 {0.063, 0.0485, 0.0475, 0.0515, -0.002},
                                 {0.108, 0.0510, 0.0470, 0.0590, -0.006},
                                 {0.163, 0.0475, 0.0430, 0.0550, -0.007},
                                 {0.228, 0.0390, 0.0370, 0.0430, -0.004},
                                 {0.288, 0.0320, 0.0320, 0.0330, -0.001},
                                 round_row(0.328, 0.0300),
                                 round_row(0.352, 0.0302)},
                                kAnkle, kBody.shin),
                     {0.3165}));
  out.push_back(ball("ankle ball", leg + 2, kAnkle, 0.0));
  out.push_back(foot("foot", leg + 2, left ? 1.0 : -1.0));
}

void add_head(std::vector<Surface>& out) {
  out.push_back(ball("neck ball", kNeck, kNeckLow, 62.0));
  out.push_back(ball("head ball", kHead, kNeckHigh, 56.0));
  const auto low = mouth(0.0, kNeckLow, 1.0), high = mouth(kBody.head_rise, kNeckHigh, -1.0);
  out.push_back(limb("neck", kNeck,
                     {low[0],
                      low[1],
                      {0.034, 0.0400, 0.0400, 0.0400},
                      {0.048, 0.0355, 0.0355, 0.0355},
                      {0.060, 0.0350, 0.0350, 0.0350},
                      high[1],
                      high[0]},
                     {}));
  const auto chin = mouth(0.0, kNeckHigh, 1.0);
  Surface head = limb("head", kHead,
                      {chin[0],
                       chin[1],
                       {0.0215, 0.045, 0.055, 0.042, 0, 0.006},
                       {0.038, 0.057, 0.076, 0.058, 0, 0.006},
                       {0.068, 0.0695, 0.088, 0.077, 0, 0.004},
                       {0.108, 0.0780, 0.0925, 0.092, 0, 0.002},
                       {0.148, 0.0795, 0.0915, 0.098, 0, 0},
                       {0.186, 0.0700, 0.0800, 0.088, 0, -0.002},
                       {0.212, 0.0470, 0.0540, 0.060, 0, -0.004},
                       {0.2245, 0.0, 0.0, 0.0, 0, -0.005}},
                      {});
  head.columns = 28;
  head.grain = {.angle = 1.35, .pith_m = 0.19, .offset_m = 0.37};
  out.push_back(head);
}

void add_trunk(std::vector<Surface>& out) {
  Surface pelvis = limb("pelvis", kPelvis,
                        {{0.066, 0.098, 0.074, 0.074, 0, 0, 2.2},
                         {0.040, 0.116, 0.083, 0.085, 0, 0, 2.2},
                         {0.012, 0.135, 0.092, 0.099, 0, 0, 2.3},
                         {-0.026, 0.150, 0.096, 0.109, 0, 0, 2.4},
                         {-0.062, 0.151, 0.091, 0.107, 0, 0, 2.4},
                         {-0.094, 0.131, 0.077, 0.091, 0, 0, 2.3},
                         {-0.119, 0.086, 0.056, 0.063, 0, 0, 2.1},
                         {-0.129, 0.0, 0.0, 0.0, 0, 0, 2.0}},
                        {});
  pelvis.columns = 28;
  pelvis.grain = {.angle = 1.2, .pith_m = 0.26, .offset_m = 0.05};
  out.push_back(pelvis);
  Surface chest = limb("chest", kChest,
                       {{0.006, 0.086, 0.072, 0.071, 0, 0, 2.1},
                        {0.040, 0.101, 0.082, 0.079, 0, 0, 2.1},
                        {0.100, 0.122, 0.099, 0.091, 0, 0.002, 2.2},
                        {0.170, 0.143, 0.113, 0.100, 0, 0.003, 2.3},
                        {0.230, 0.161, 0.114, 0.102, 0, 0.002, 2.3},
                        {0.278, 0.171, 0.102, 0.098, 0, 0, 2.3},
                        {0.311, 0.164, 0.085, 0.088, 0, 0, 2.2},
                        {0.333, 0.132, 0.067, 0.071, 0, 0, 2.1},
                        {0.347, 0.086, 0.054, 0.057, 0, 0, 2.0},
                        {0.355, 0.053, 0.046, 0.047, 0, 0, 2.0},
                        {0.357, 0.0405, 0.0405, 0.0405, 0, 0, 2.0}},
                       {});
  chest.columns = 32;
  chest.step_m = 0.045;
  chest.grain = {.angle = 1.9, .pith_m = 0.30, .offset_m = 0.2};
  out.push_back(chest);
  add_head(out);
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
      .name = "base plate", .matter = Matter::kPlaster, .unroll = Unroll::kDisc, .columns = 64};
  top.tolerance_m = 0.0022;
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
      .name = "base underside", .matter = Matter::kPlaster, .unroll = Unroll::kDisc, .columns = 64};
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
