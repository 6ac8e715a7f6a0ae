// SPDX-License-Identifier: MIT
#include "media/gait.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "media/exact_math.hpp"

namespace relit::media {
namespace {

constexpr double kToeOut = 6.0 * kDegree;
constexpr double kFootSpread = 0.072;   // of the ankles from the middle
constexpr double kHeelStrikeZ = 0.292;  // of the flat foot's ankle from the pelvis
constexpr double kClearance = 0.030;

double wave(double phase, double peak) { return exact_cos(kTau * (phase - peak)); }
double twice(double phase, double peak) { return exact_cos(2.0 * kTau * (phase - peak)); }

double fraction(double x) { return x - std::floor(x); }

struct Key {
  double at, value, slope;
};

double hermite(const Key& a, const Key& b, double x) {
  const double h = b.at - a.at, t = (x - a.at) / h, u = 1.0 - t;
  return a.value * u * u * (1.0 + 2.0 * t) + b.value * t * t * (3.0 - 2.0 * t) +
         h * t * u * (a.slope * u - b.slope * t);
}

// Pitch of the foot, toes down, over a stride that begins with its heel strike.
double foot_pitch(double phase) {
  static constexpr std::array<Key, 8> kKeys{{{0.0, -19.0, 120.0},
                                             {0.10, 0.0, 0.0},
                                             {0.33, 0.0, 0.0},
                                             {0.50, 17.0, 205.0},
                                             {0.64, 52.0, 170.0},
                                             {0.70, 57.0, -30.0},
                                             {0.86, -2.0, -290.0},
                                             {1.0, -19.0, 120.0}}};
  const double p = fraction(phase);
  std::size_t i = 0;
  while (i + 2 < kKeys.size() && p >= kKeys[i + 1].at) ++i;
  return hermite(kKeys[i], kKeys[i + 1], p) * kDegree;
}

struct Arc {
  glm::dvec2 centre;  // (z, y) from the ankle
  double radius;
  double from;  // pitch at which contact reaches this arc
};

std::array<Arc, 3> sole_arcs() {
  const Proportions& b = kBody;
  const double ground = -b.ankle_height;
  const double s = exact_sin(b.rocker_angle), c = exact_cos(b.rocker_angle);
  const glm::dvec2 rocker(b.rocker_start, ground + b.rocker_radius);
  const glm::dvec2 toe = rocker + (b.rocker_radius - b.toe_radius) * glm::dvec2(s, -c);
  return {Arc{{b.heel_centre, ground + b.heel_radius}, b.heel_radius, -1e9},
          Arc{rocker, b.rocker_radius, 0.0}, Arc{toe, b.toe_radius, b.rocker_angle}};
}

// Ankle of a foot in stance; the ground under its flat foot's ankle is at `planted`.
glm::dvec3 stance_ankle(const Walk& walk, double phase, double side) {
  const glm::dvec2 ankle = roll_sole(foot_pitch(phase)).ankle;
  const double planted = kHeelStrikeZ - walk.stride_m * phase;
  const double out = side * kToeOut;
  return {side * kFootSpread + ankle.x * exact_sin(out), ankle.y,
          planted + ankle.x * exact_cos(out)};
}

// Quintic through position, velocity and acceleration at both ends of 0..1.
double quintic(const std::array<double, 3>& a, const std::array<double, 3>& b, double t) {
  const double d = b[0] - a[0] - a[1] - 0.5 * a[2], v = b[1] - a[1] - a[2], w = b[2] - a[2];
  const double c3 = 10.0 * d - 4.0 * v + 0.5 * w, c4 = -15.0 * d + 7.0 * v - w,
               c5 = 6.0 * d - 3.0 * v + 0.5 * w;
  return a[0] + t * (a[1] + t * (0.5 * a[2] + t * (c3 + t * (c4 + t * c5))));
}

glm::dvec3 swing_ankle(const Walk& walk, double phase, double side) {
  const double length = 1.0 - walk.stance, t = (phase - walk.stance) / length;
  constexpr double kStep = 1e-3;
  const auto ends = [&](int axis, double at, double direction) {
    const auto p = [&](double k) {
      return stance_ankle(walk, at + direction * k * kStep, side)[axis];
    };
    const double v = (-1.5 * p(0) + 2.0 * p(1) - 0.5 * p(2)) / kStep * direction;
    const double a = (p(0) - 2.0 * p(1) + p(2)) / (kStep * kStep);
    return std::array<double, 3>{p(0), v * length, a * length * length};
  };
  glm::dvec3 out;
  for (const int axis : {0, 2})
    out[axis] = quintic(ends(axis, walk.stance, -1.0), ends(axis, 0.0, 1.0), t);
  const double bump = t * (1.0 - t);
  out.x -= side * 0.012 * 16.0 * bump * bump;
  out.y = roll_sole(foot_pitch(phase)).ankle.y + kClearance * 16.0 * bump * bump;
  return out;
}

struct Foot {
  glm::dvec3 ankle;
  glm::dquat rotation;
};

Foot foot_at(const Walk& walk, double phase, double side) {
  const double p = fraction(phase);
  return {p <= walk.stance ? stance_ankle(walk, p, side) : swing_ankle(walk, p, side),
          turn_about(1, side * kToeOut) * turn_about(0, foot_pitch(p))};
}

struct Legs {
  glm::dquat thigh, shin;  // in the world
  double stretch = 0;      // of the leg's length
};

// Two links from hip to ankle, the knee forward in the plane of the foot's heading.
Legs solve_leg(const glm::dvec3& hip, const Foot& foot, double side) {
  const double a = kBody.thigh, b = kBody.shin;
  const glm::dvec3 to = foot.ankle - hip;
  const double reach = glm::length(to), d = std::min(reach, 0.9999 * (a + b));
  const glm::dvec3 down = to / reach;
  const glm::dvec3 heading(exact_sin(side * 0.6 * kToeOut), 0.0, exact_cos(side * 0.6 * kToeOut));
  const glm::dvec3 x = glm::normalize(glm::cross(-down, heading));
  const glm::dvec3 forward = glm::cross(x, -down);
  const double along = (a * a + d * d - b * b) / (2.0 * d);
  const double rise = std::sqrt(std::max(a * a - along * along, 0.0));
  const glm::dvec3 thigh_y = -(along * down + rise * forward) / a;
  const glm::dvec3 shin_y = -((d - along) * down - rise * forward) / b;
  return {from_axes(x, thigh_y, glm::cross(x, thigh_y)),
          from_axes(x, shin_y, glm::cross(x, shin_y)), reach / (a + b)};
}

glm::dquat euler(double yaw, double pitch, double roll) {
  return turn_about(1, yaw * kDegree) * turn_about(2, roll * kDegree) *
         turn_about(0, pitch * kDegree);
}

struct Trunk {
  glm::dvec3 pelvis;
  glm::dquat pelvis_turn, chest_turn, head_turn;
};

// Phases are those of the left leg; its heel strikes at 0, the right one's at 0.5.
Trunk trunk_at(const Walk& walk, double time_s, double pelvis_height) {
  const double p = time_s / walk.stride_s, slow = time_s / walk.duration_s();
  Trunk out;
  out.pelvis = {0.020 * wave(p, 0.31), pelvis_height - 0.019 * twice(p, 0.055),
                0.008 * twice(p, 0.185)};
  out.pelvis_turn = euler(-6.5 * wave(p, 0.0), 2.5 + 1.0 * twice(p, 0.05), 4.2 * wave(p, 0.20));
  out.chest_turn = euler(6.5 * wave(p, 0.03), 3.2 + 1.2 * twice(p, 0.10), -1.8 * wave(p, 0.22));
  out.head_turn = euler(3.0 + 13.0 * wave(slow, 0.30) + 1.2 * wave(p, 0.06),
                        1.5 + 1.0 * twice(p, 0.16), -2.0 * wave(slow, 0.36) - 0.6 * wave(p, 0.25));
  return out;
}

// The arm swings against the leg of its side; elbow and hand follow late.
void pose_arm(const Walk& walk, double time_s, bool left, Pose& pose) {
  const double side = left ? 1.0 : -1.0;
  const double p = time_s / walk.stride_s + (left ? 0.0 : 0.5);
  const double vary = 1.0 + 0.07 * side * wave(time_s / walk.duration_s(), 0.15);
  const double shoulder = -1.0 + 21.0 * vary * wave(p, 0.52);
  const double elbow = 23.0 + 13.0 * vary * wave(p, 0.60) + 3.0 * twice(p, 0.62);
  const double hand = 6.0 + 7.0 * wave(p, 0.67);
  const auto arm = static_cast<std::size_t>(left ? kUpperArmL : kUpperArmR);
  pose.local[arm] = turn_about(0, -shoulder * kDegree) * turn_about(2, side * 9.5 * kDegree) *
                    turn_about(1, -side * (14.0 + 6.0 * wave(p, 0.55)) * kDegree);
  pose.local[arm + 1] = turn_about(0, -elbow * kDegree);
  pose.local[arm + 2] = turn_about(1, -side * 12.0 * kDegree) * turn_about(0, -hand * kDegree) *
                        turn_about(2, -side * 4.0 * kDegree);
}

double max_stretch(const Walk& walk, double pelvis_height) {
  double worst = 0.0;
  for (int k = 0; k < 240; ++k) {
    const double time_s = walk.stride_s * k / 240.0;
    const Trunk trunk = trunk_at(walk, time_s, pelvis_height);
    for (const double side : {1.0, -1.0}) {
      const glm::dvec3 hip = trunk.pelvis + trunk.pelvis_turn * glm::dvec3(side * kBody.hip_half,
                                                                           -kBody.hip_drop, 0.0);
      const Foot foot = foot_at(walk, time_s / walk.stride_s + (side > 0.0 ? 0.0 : 0.5), side);
      worst = std::max(worst, solve_leg(hip, foot, side).stretch);
    }
  }
  return worst;
}

}  // namespace

SoleContact roll_sole(double toe_down) {
  const auto arcs = sole_arcs();
  std::size_t i = 0;
  while (i + 1 < arcs.size() && toe_down >= arcs[i + 1].from) ++i;
  // Along the ground a rolling centre moves by radius × angle; the arcs before have added theirs.
  double centre_z = i == 0 ? arcs[0].centre.x + arcs[0].radius * toe_down : arcs[1].centre.x;
  if (i > 0) centre_z += arcs[1].radius * std::min(toe_down, kBody.rocker_angle);
  if (i > 1) centre_z += arcs[2].radius * (toe_down - kBody.rocker_angle);
  const double s = exact_sin(toe_down), c = exact_cos(toe_down);
  const glm::dvec2 local = arcs[i].centre;
  const glm::dvec2 turned(c * local.x + s * local.y, -s * local.x + c * local.y);
  return {.ankle = glm::dvec2(centre_z, arcs[i].radius) - turned};
}

double sole_back() { return kBody.heel_centre - kBody.heel_radius; }

double sole_front() { return sole_arcs()[2].centre.x + kBody.toe_radius; }

double sole_height(double z) {
  const auto arcs = sole_arcs();
  const auto arc_height = [&](const Arc& arc) {
    const double dz = z - arc.centre.x;
    return arc.centre.y - std::sqrt(std::max(arc.radius * arc.radius - dz * dz, 0.0)) +
           kBody.ankle_height;
  };
  const double rocker_end =
      kBody.rocker_start + kBody.rocker_radius * exact_sin(kBody.rocker_angle);
  if (z < kBody.heel_centre) return arc_height(arcs[0]);
  if (z < kBody.rocker_start) return 0.0;
  return arc_height(z < rocker_end ? arcs[1] : arcs[2]);
}

Pose walk_pose(const Walk& walk, double time_s, double pelvis_height) {
  Pose pose = rest_pose();
  const Trunk trunk = trunk_at(walk, time_s, pelvis_height);
  pose.pelvis = trunk.pelvis;
  pose.local[kPelvis] = trunk.pelvis_turn;
  const glm::dquat bend = glm::conjugate(trunk.pelvis_turn) * trunk.chest_turn;
  const glm::dquat half = glm::normalize(bend + glm::dquat(1.0, 0.0, 0.0, 0.0));
  pose.local[kWaist] = half;
  pose.local[kChest] = glm::conjugate(half) * bend;
  const glm::dquat look = glm::conjugate(trunk.chest_turn) * trunk.head_turn;
  const glm::dquat half_look = glm::normalize(look + glm::dquat(1.0, 0.0, 0.0, 0.0));
  pose.local[kNeck] = half_look;
  pose.local[kHead] = glm::conjugate(half_look) * look;
  pose_arm(walk, time_s, true, pose);
  pose_arm(walk, time_s, false, pose);
  for (const bool left : {true, false}) {
    const double side = left ? 1.0 : -1.0;
    const auto leg = static_cast<std::size_t>(left ? kThighL : kThighR);
    const glm::dvec3 hip = trunk.pelvis + trunk.pelvis_turn * skeleton()[leg].offset;
    const Foot foot = foot_at(walk, time_s / walk.stride_s + (left ? 0.0 : 0.5), side);
    const Legs solved = solve_leg(hip, foot, side);
    pose.local[leg] = glm::conjugate(trunk.pelvis_turn) * solved.thigh;
    pose.local[leg + 1] = glm::conjugate(solved.thigh) * solved.shin;
    pose.local[leg + 2] = glm::conjugate(solved.shin) * foot.rotation;
  }
  return pose;
}

double find_pelvis_height(const Walk& walk) {
  double low = 0.80, high = kBody.pelvis_height;
  for (int k = 0; k < 40; ++k) {
    const double middle = 0.5 * (low + high);
    (max_stretch(walk, middle) <= 0.994 ? low : high) = middle;
  }
  return low;
}

}  // namespace relit::media
