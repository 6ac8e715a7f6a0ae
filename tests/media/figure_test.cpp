// SPDX-License-Identifier: MIT
#include "media/figure.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "media/body.hpp"
#include "media/sash.hpp"
#include "tests/test.hpp"

namespace {

using namespace relit::media;

const Figure& figure() {
  static const Figure made = make_figure();
  return made;
}

std::vector<glm::dvec3> pose_patch(const Patch& patch, const WorldPose& world) {
  static const WorldPose rest = to_world(rest_pose());
  std::vector<glm::dvec3> out;
  for (const Vertex& v : patch.vertices) {
    const glm::dvec3 p(v.position);
    if (!patch.skinned) {
      const auto j = static_cast<std::size_t>(std::max(patch.joint, 0));
      out.push_back(patch.joint < 0 ? p : world.origin[j] + world.rotation[j] * p);
      continue;
    }
    glm::dvec3 sum(0.0);
    for (std::size_t k = 0; k < 4; ++k) {
      const auto j = static_cast<std::size_t>(sash_joints()[v.influence.joints[k]]);
      sum += static_cast<double>(v.influence.weights[k]) *
             (world.origin[j] + world.rotation[j] * (p - rest.origin[j]));
    }
    out.push_back(sum);
  }
  return out;
}

const Patch& find_patch(const std::string& name, int joint) {
  for (const Patch& patch : figure().patches) {
    if (patch.name == name && patch.joint == joint) return patch;
  }
  FAIL("no patch " << name);
  return figure().patches.front();
}

// Depth of the deepest vertex inside a thigh.
double depth_in_thigh(const std::vector<glm::dvec3>& points, const WorldPose& world,
                      std::size_t thigh) {
  const glm::dvec3 axis = world.rotation[thigh] * glm::dvec3(0.0, -1.0, 0.0);
  double deepest = 0.0;
  for (const glm::dvec3& p : points) {
    const double along = glm::dot(p - world.origin[thigh], axis);
    if (along < 0.06 || along > kBody.thigh - 0.06) continue;
    const double off = glm::length(p - world.origin[thigh] - along * axis);
    deepest = std::max(deepest, thigh_radius(along) - off);
  }
  return deepest;
}

nlohmann::json glb_json(const std::vector<std::uint8_t>& glb) {
  REQUIRE(glb.size() > 20);
  std::uint32_t length = 0;
  std::memcpy(&length, glb.data() + 12, 4);
  REQUIRE(20 + std::size_t{length} <= glb.size());
  return nlohmann::json::parse(glb.begin() + 20,
                               glb.begin() + 20 + static_cast<std::ptrdiff_t>(length));
}

}  // namespace

TEST_CASE("feet never sink into the ground nor slide over it") {
  // A contact rolls: a point 1 mm above the ground, turning at up to 5 rad/s, moves 0.1 mm in a
  // frame against the ground. Where a frame ends with the foot lifted by less than 1 mm it has
  // swung for part of that frame: the toe leaves with the ground's speed and gains at most 30 m/s²,
  // 6 mm over a whole frame and 0.7 mm over a third.
  constexpr double kNear = 0.001, kSlip = 0.00085;
  const double frame = 1.0 / figure().walk.rate_hz, ground = -figure().walk.speed() * frame;
  for (const int joint : {static_cast<int>(kFootL), static_cast<int>(kFootR)}) {
    const Patch& foot = find_patch("foot", joint);
    std::vector<glm::dvec3> before;
    double lowest = 1.0, slip = 0.0;
    int contacts = 0;
    for (const Pose& key : figure().keys) {
      const auto now = pose_patch(foot, to_world(key));
      for (std::size_t v = 0; v < now.size(); ++v) {
        lowest = std::min(lowest, now[v].y);
        if (before.empty() || now[v].y > kNear || before[v].y > kNear) continue;
        ++contacts;
        slip = std::max(
            {slip, std::abs(now[v].z - before[v].z - ground), std::abs(now[v].x - before[v].x)});
      }
      before = now;
    }
    CAPTURE(joint, lowest, slip);
    CHECK(contacts > 500);
    CHECK(lowest > -1e-5);
    CHECK(slip < kSlip);
  }
}

TEST_CASE("the walk closes exactly and lasts at least two seconds") {
  const auto& keys = figure().keys;
  CHECK(figure().walk.duration_s() >= 2.0);
  REQUIRE(keys.size() ==
          static_cast<std::size_t>(std::lround(figure().walk.duration_s() * 50.0)) + 1);
  CHECK(keys.front().pelvis == keys.back().pelvis);
  double largest = 0.0;
  for (std::size_t j = 0; j < kJointCount; ++j) {
    CHECK(std::abs(glm::dot(keys.front().local[j], keys.back().local[j])) > 1.0 - 1e-14);
    for (std::size_t k = 1; k < keys.size(); ++k) {
      largest = std::max(largest, 1.0 - glm::dot(keys[k].local[j], keys[k - 1].local[j]));
    }
  }
  // No joint turns by more than 20 degrees in a frame, across the seam of the loop either.
  CHECK(largest < 1.0 - std::cos(0.5 * 20.0 * 3.14159265 / 180.0));
}

TEST_CASE("hands and sash stay outside the thighs") {
  // The cloth's chain keeps 14 mm away; its pleats, curl and thickness take up to 20 mm beside the
  // chain.
  double hand = 0.0, cloth = 0.0;
  for (const Pose& key : figure().keys) {
    const WorldPose world = to_world(key);
    for (const Patch& patch : figure().patches) {
      const bool is_hand = patch.name == "hand" || patch.name == "thumb" || patch.name == "forearm";
      const bool is_cloth = patch.name == "long tail" || patch.name == "short tail";
      if (!is_hand && !is_cloth) continue;
      const auto points = pose_patch(patch, world);
      for (const std::size_t thigh : {std::size_t{kThighL}, std::size_t{kThighR}}) {
        double& worst = is_hand ? hand : cloth;
        worst = std::max(worst, depth_in_thigh(points, world, thigh));
      }
    }
  }
  CAPTURE(hand, cloth);
  CHECK(hand == 0.0);
  CHECK(cloth < 0.008);
}

TEST_CASE("surfaces are closed to the eye: normals agree with their triangles") {
  std::size_t triangles = 0;
  for (const Patch& patch : figure().patches) {
    triangles += patch.triangles.size();
    for (const auto& t : patch.triangles) {
      const Vertex &a = patch.vertices[t[0]], &b = patch.vertices[t[1]], &c = patch.vertices[t[2]];
      const glm::dvec3 face =
          glm::cross(glm::dvec3(b.position - a.position), glm::dvec3(c.position - a.position));
      const glm::dvec3 normal(a.normal + b.normal + c.normal);
      CAPTURE(patch.name);
      REQUIRE(std::abs(glm::length(a.normal) - 1.0f) < 1e-5f);
      REQUIRE(glm::dot(face, normal) >= -1e-3 * glm::length(face));
    }
  }
  CHECK(triangles > 8000);
  CHECK(triangles <= 16000);
}

TEST_CASE("light-map coordinates lie inside the atlas and never overlap") {
  constexpr int kSize = 1024;
  std::vector<int> owner(std::size_t{kSize} * kSize, -1);
  int charts = 0;
  std::size_t covered = 0, doubled = 0;
  for (const Patch& patch : figure().patches) {
    for (const auto& t : patch.triangles) {
      std::array<glm::dvec2, 3> p;
      for (std::size_t k = 0; k < 3; ++k)
        p[k] = glm::dvec2(patch.vertices[t[k]].lightmap) * double{kSize};
      const auto edge = [](glm::dvec2 a, glm::dvec2 b, glm::dvec2 q) {
        return (b.x - a.x) * (q.y - a.y) - (b.y - a.y) * (q.x - a.x);
      };
      if (edge(p[0], p[1], p[2]) < 0.0) std::swap(p[1], p[2]);
      const auto low = glm::floor(glm::min(glm::min(p[0], p[1]), p[2]));
      const auto high = glm::ceil(glm::max(glm::max(p[0], p[1]), p[2]));
      REQUIRE((low.x >= 0.0 && low.y >= 0.0 && high.x <= kSize && high.y <= kSize));
      for (int y = static_cast<int>(low.y); y < static_cast<int>(high.y); ++y) {
        for (int x = static_cast<int>(low.x); x < static_cast<int>(high.x); ++x) {
          const glm::dvec2 q(x + 0.5, y + 0.5);
          // Strictly inside by a thousandth of a texel: shared edges belong to nobody.
          double inside = 1.0;
          for (std::size_t k = 0; k < 3; ++k) {
            const glm::dvec2 a = p[k], b = p[(k + 1) % 3];
            inside = std::min(inside, edge(a, b, q) - 1e-3 * glm::length(b - a));
          }
          if (inside <= 0.0) continue;
          int& cell = owner[static_cast<std::size_t>(y) * kSize + static_cast<std::size_t>(x)];
          ++(cell >= 0 ? doubled : covered);
          cell = charts;
        }
      }
    }
    ++charts;
  }
  CHECK(doubled == 0);
  CHECK(covered > owner.size() * 55 / 100);
  // Two texels of 128 are sixteen here: no other chart within them, along rows and columns.
  std::size_t close = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x + 16 < kSize; ++x) {
      const auto at = [&](int u, int v) {
        return owner[static_cast<std::size_t>(v) * kSize + static_cast<std::size_t>(u)];
      };
      for (const auto& [a, b] :
           {std::pair(at(x, y), at(x + 15, y)), std::pair(at(y, x), at(y, x + 15))}) {
        if (a >= 0 && b >= 0 && a != b) ++close;
      }
    }
  }
  CHECK(close == 0);
}

TEST_CASE("the glTF file is complete and the same every time") {
  const auto wood = make_wood_png();
  const auto glb = write_glb(figure(), wood);
  REQUIRE(glb == write_glb(make_figure(), make_wood_png()));
  CHECK(wood.size() < 400'000);
  const auto root = glb_json(glb);
  CHECK(root["animations"][0]["name"] == "walk");
  CHECK(root["materials"].size() == static_cast<std::size_t>(Matter::kCount));
  CHECK(root["skins"][0]["joints"].size() == sash_joints().size());
  for (const auto& mesh : root["meshes"]) {
    for (const auto& primitive : mesh["primitives"]) {
      const auto& position =
          root["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()];
      for (const auto& [name, index] : primitive["attributes"].items()) {
        CAPTURE(mesh["name"], name);
        CHECK(root["accessors"][index.get<std::size_t>()]["count"] == position["count"]);
      }
      CHECK(primitive["attributes"].contains("TEXCOORD_1"));
    }
  }
}
