// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>

#include "media/body.hpp"
#include "media/exact_math.hpp"
#include "media/sash.hpp"

namespace relit::media {
namespace {

constexpr int kPoints = kTailJoints + 1;
constexpr int kSubsteps = 40;  // between two keys: half a millisecond each
constexpr int kWarmUp = 12;  // clips until the motion repeats; each damps what remains of the start
constexpr double kGravity = 9.81;
constexpr double kDrag = 3.6;   // 1/s, of the cloth's own motion
constexpr double kWind = 0.30;  // share of the walking speed that blows: the body shelters the rest
constexpr double kClearance =
    0.014;                          // of the chain from the thigh: the cloth's pleats and thickness
constexpr double kFriction = 0.05;  // of the sliding speed, lost in one substep
constexpr double kStiffness = 45.0;  // of the springs between segments, 1/s²

struct Chain {
  int first = 0;
  double segment = 0;
  std::array<glm::dvec3, kPoints> now, before;
};

// What drives the chains at one instant.
struct Drive {
  glm::dvec3 pelvis;
  glm::dquat pelvis_turn;
  glm::dvec3 hip, thigh_axis;
};

Drive drive_at(const std::vector<Pose>& poses, std::size_t key, double f) {
  const WorldPose a = to_world(poses[key % poses.size()]),
                  b = to_world(poses[(key + 1) % poses.size()]);
  const auto axis = [](const WorldPose& w) {
    return w.rotation[kThighL] * glm::dvec3(0.0, -1.0, 0.0);
  };
  const glm::dquat other = glm::dot(a.rotation[kPelvis], b.rotation[kPelvis]) < 0.0
                               ? -b.rotation[kPelvis]
                               : b.rotation[kPelvis];
  return {glm::mix(a.origin[kPelvis], b.origin[kPelvis], f),
          glm::normalize(a.rotation[kPelvis] * (1.0 - f) + other * f),
          glm::mix(a.origin[kThighL], b.origin[kThighL], f),
          glm::normalize(glm::mix(axis(a), axis(b), f))};
}

// Pushes a point out of the left thigh and brakes what slides along it.
void keep_out(const Drive& drive, glm::dvec3& now, glm::dvec3& before) {
  const glm::dvec3 to = now - drive.hip;
  const double along = std::clamp(glm::dot(to, drive.thigh_axis), 0.0, kBody.thigh + 0.05);
  const glm::dvec3 off = to - along * drive.thigh_axis;
  const double distance = glm::length(off), wanted = thigh_radius(along) + kClearance;
  if (distance >= wanted || distance < 1e-6) return;
  const glm::dvec3 outward = off / distance;
  now += (wanted - distance) * outward;
  const glm::dvec3 velocity = now - before;
  const double normal = glm::dot(velocity, outward);
  const glm::dvec3 sliding = velocity - normal * outward;
  before = now - sliding * (1.0 - kFriction) - std::max(normal, 0.0) * outward;
}

// Springs that straighten the cloth; what pushes one point pushes its neighbours back.
std::array<glm::dvec3, kPoints> bending(const Drive& drive, const Chain& chain) {
  std::array<glm::dvec3, kPoints> out{};
  for (std::size_t k = 1; k + 1 < kPoints; ++k) {
    const glm::dvec3 bend = kStiffness * (chain.now[k - 1] - 2.0 * chain.now[k] + chain.now[k + 1]);
    out[k - 1] -= bend;
    out[k] += 2.0 * bend;
    out[k + 1] -= bend;
  }
  const glm::dvec3 hang =
      drive.pelvis_turn * glm::normalize(tail_facing(chain.first) * 0.3 - glm::dvec3(0, 1, 0));
  out[1] += 2.0 * kStiffness * (chain.now[0] + hang * chain.segment - chain.now[1]);
  return out;
}

void step_chain(const Drive& drive, double wind, double dt, Chain& chain) {
  chain.now[0] = drive.pelvis + drive.pelvis_turn * tail_root(chain.first);
  const auto springs = bending(drive, chain);
  for (std::size_t k = 1; k < kPoints; ++k) {
    const glm::dvec3 velocity = (chain.now[k] - chain.before[k]) / dt;
    const glm::dvec3 force = springs[k] + glm::dvec3(0.0, -kGravity, 0.0) +
                             kDrag * (glm::dvec3(0.0, 0.0, -kWind * wind) - velocity);
    const glm::dvec3 next = chain.now[k] + (velocity + force * dt) * dt;
    chain.before[k] = chain.now[k];
    chain.now[k] = next;
  }
  for (int iteration = 0; iteration < 12; ++iteration) {
    for (std::size_t k = 1; k < kPoints; ++k) {
      const glm::dvec3 link = chain.now[k] - chain.now[k - 1];
      const glm::dvec3 correction = link * (1.0 - chain.segment / glm::length(link));
      if (k == 1) {
        chain.now[k] -= correction;
      } else {
        chain.now[k] -= 0.5 * correction;
        chain.now[k - 1] += 0.5 * correction;
      }
    }
  }
  for (std::size_t k = 1; k < kPoints; ++k) keep_out(drive, chain.now[k], chain.before[k]);
}

// The way a segment's cloth faces: as the knot does, but where the thigh is close, away from it.
glm::dvec3 facing_at(const Drive& drive, const glm::dvec3& middle, int first) {
  const glm::dvec3 own = drive.pelvis_turn * tail_facing(first);
  const glm::dvec3 to = middle - drive.hip;
  const double along = glm::dot(to, drive.thigh_axis);
  const glm::dvec3 off = to - along * drive.thigh_axis;
  const double distance = glm::length(off);
  const double gap = distance - thigh_radius(std::clamp(along, 0.0, kBody.thigh)) - kClearance;
  const double near = smooth_step(0.06, 0.005, gap) * smooth_step(-0.03, 0.06, along);
  return glm::normalize(glm::mix(own, off / std::max(distance, 1e-6), near));
}

// Directions of the segments become joint rotations.
void write_tail(const Drive& drive, int first, const std::array<glm::dvec3, kPoints>& points,
                Pose& pose) {
  glm::dquat parent = pose.local[kPelvis];
  const glm::dvec3 up(0.0, 1.0, 0.0), rest_side = glm::cross(up, tail_facing(first));
  const glm::dquat rest = from_axes(rest_side, up, glm::cross(rest_side, up));
  for (std::size_t k = 0; k < kTailJoints; ++k) {
    const glm::dvec3 y = glm::normalize(points[k] - points[k + 1]);
    const glm::dvec3 x =
        glm::normalize(glm::cross(y, facing_at(drive, 0.5 * (points[k] + points[k + 1]), first)));
    const glm::dquat world =
        glm::normalize(from_axes(x, y, glm::cross(x, y)) * glm::conjugate(rest));
    pose.local[static_cast<std::size_t>(first) + k] =
        glm::normalize(glm::conjugate(parent) * world);
    parent = world;
  }
}

}  // namespace

void swing_tails(const Walk& walk, std::vector<Pose>& poses) {
  const double dt = 1.0 / (walk.rate_hz * kSubsteps);
  for (const int first : {static_cast<int>(kFrontTail), static_cast<int>(kSideTail)}) {
    Chain chain{.first = first,
                .segment = first == kFrontTail ? kBody.front_tail_segment : kBody.side_tail_segment,
                .now = {},
                .before = {}};
    const Drive start = drive_at(poses, 0, 0.0);
    for (std::size_t k = 0; k < kPoints; ++k) {
      chain.now[k] = start.pelvis + start.pelvis_turn * tail_root(first) +
                     glm::dvec3(0.0, -chain.segment * static_cast<double>(k), 0.0);
    }
    chain.before = chain.now;
    std::vector<std::array<glm::dvec3, kPoints>> record;
    for (int lap = 0; lap <= kWarmUp; ++lap) {
      record.clear();
      for (std::size_t key = 0; key < poses.size(); ++key) {
        record.push_back(chain.now);
        for (int sub = 1; sub <= kSubsteps; ++sub) {
          step_chain(drive_at(poses, key, static_cast<double>(sub) / kSubsteps), walk.speed(), dt,
                     chain);
        }
      }
    }
    // What is left of the difference between two laps is spread over the whole clip.
    for (std::size_t key = 0; key < poses.size(); ++key) {
      const double f = static_cast<double>(key) / static_cast<double>(poses.size());
      std::array<glm::dvec3, kPoints> points = record[key];
      for (std::size_t k = 0; k < kPoints; ++k) points[k] += f * (record[0][k] - chain.now[k]);
      write_tail(drive_at(poses, key, 0.0), first, points, poses[key]);
    }
  }
}

}  // namespace relit::media
