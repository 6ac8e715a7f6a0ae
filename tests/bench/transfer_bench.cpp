// SPDX-License-Identifier: MIT
// transfer_bench CHARACTER.glb [RUNS]: how fast the baker traces, over how fast Embree alone traces
// the same rays: same origins, same directions in the same packets, no shading, nothing summed.
// Pairs of runs in turn; the figure is the median of the ratios, so that a noisy machine cancels
// out.
#include <embree3/rtcore.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "bake_minimal/bake.hpp"
#include "bake_minimal/parallel.hpp"

using namespace relit;
using namespace relit::bake;

namespace {

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

glm::vec3 at(const std::vector<glm::vec3>& v, const std::uint32_t* i, const TexelSample& s) {
  return (1 - s.b1 - s.b2) * v[i[0]] + s.b1 * v[i[1]] + s.b2 * v[i[2]];
}

// The rays of a frame, as the tracer makes them.
struct Rays {
  std::vector<glm::vec3> positions, origins, normals, faces;
  std::vector<std::uint32_t> indices;
  std::vector<glm::vec3> directions;

  Rays(const PreparedBake& prepared, const BakePoser& poser, const TransferOptions& options)
      : positions(poser.positions().begin(), poser.positions().end()),
        directions(sphere_directions(options.directions, options.seed)) {
    const TraceGeometry geometry = trace_geometry(prepared.packed);
    indices = geometry.indices;
    glm::vec3 low(1e30f), high(-1e30f);
    for (const glm::vec3& p : positions) low = glm::min(low, p), high = glm::max(high, p);
    const std::vector<glm::vec3> vertex_normals(poser.normals().begin(), poser.normals().end());
    for (const TexelSample& s : prepared.samples) {
      const std::uint32_t* i = &indices[3 * std::size_t{s.triangle}];
      const glm::vec3 face = glm::normalize(
          glm::cross(positions[i[1]] - positions[i[0]], positions[i[2]] - positions[i[0]]));
      faces.push_back(face);
      normals.push_back(glm::normalize(at(vertex_normals, i, s)));
      origins.push_back(at(positions, i, s) + 2e-5f * glm::length(high - low) * face);
    }
    positions.emplace_back(0.0f);
  }
};

// Builds the tree and traces; the sum of hits keeps the compiler honest.
std::uint64_t embree_alone(RTCDevice device, const Rays& rays, int threads) {
  RTCScene scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                             rays.positions.data(), 0, sizeof(glm::vec3),
                             rays.positions.size() - 1);
  rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, rays.indices.data(),
                             0, 3 * sizeof(std::uint32_t), rays.indices.size() / 3);
  rtcCommitGeometry(mesh);
  rtcAttachGeometry(scene, mesh);
  rtcReleaseGeometry(mesh);
  rtcCommitScene(scene);
  std::atomic<std::uint64_t> hits{0};
  constexpr std::size_t kBlock = 64;
  parallel_for(threads, (rays.origins.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    std::uint64_t found = 0;
    for (std::size_t s = block * kBlock; s < std::min(rays.origins.size(), (block + 1) * kBlock);
         ++s) {
      for (std::size_t d = 0; d < rays.directions.size(); d += 8) {
        alignas(32) int valid[8];
        RTCRayHit8 packet;
        int any = 0;
        for (std::size_t i = 0; i < 8; ++i) {
          const glm::vec3& dir = rays.directions[d + i];
          valid[i] =
              glm::dot(dir, rays.normals[s]) > 0 && glm::dot(dir, rays.faces[s]) > 0 ? -1 : 0;
          any |= valid[i];
          packet.ray.org_x[i] = rays.origins[s].x, packet.ray.org_y[i] = rays.origins[s].y,
          packet.ray.org_z[i] = rays.origins[s].z;
          packet.ray.dir_x[i] = dir.x, packet.ray.dir_y[i] = dir.y, packet.ray.dir_z[i] = dir.z;
          packet.ray.tnear[i] = 0, packet.ray.tfar[i] = std::numeric_limits<float>::infinity();
          packet.ray.time[i] = 0, packet.ray.mask[i] = ~0u, packet.ray.id[i] = 0,
          packet.ray.flags[i] = 0;
          packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID,
          packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
        }
        if (any == 0) continue;
        rtcIntersect8(valid, scene, &context, &packet);
        for (std::size_t i = 0; i < 8; ++i)
          found += valid[i] != 0 && packet.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
      }
    }
    hits += found;
  });
  rtcReleaseScene(scene);
  return hits;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: transfer_bench CHARACTER.glb [RUNS]\n");
    return 2;
  }
  const int runs = argc > 2 ? std::atoi(argv[2]) : 7;
  BakeOptions options;
  options.input = argv[1];
  auto prepared = prepare_bake(options);
  if (!prepared) {
    std::fprintf(stderr, "transfer_bench: %s\n", prepared.error().message.c_str());
    return 1;
  }
  auto poser = BakePoser::create(*prepared);
  auto tracer =
      TransferTracer::create(trace_geometry(prepared->packed), prepared->samples, options.transfer);
  if (!poser || !tracer || !poser->pose(prepared->frames / 3)) return 1;
  const Rays rays(*prepared, *poser, options.transfer);
  std::vector<float> transfer(27 * prepared->samples.size());
  std::vector<std::uint8_t> buried(prepared->samples.size());
  const int threads = thread_count(0);
  RTCDevice device = rtcNewDevice("threads=1");
  std::vector<double> ratios;
  double million_rays = 0;
  std::uint64_t hits = 0;
  for (int run = 0; run < runs; ++run) {
    const double t0 = now_s();
    if (!tracer->trace(poser->positions(), poser->normals(), transfer, buried)) return 1;
    const double t1 = now_s();
    hits = embree_alone(device, rays, threads);
    const double t2 = now_s();
    ratios.push_back((t2 - t1) / (t1 - t0));
    million_rays = static_cast<double>(tracer->rays()) * 1e-6;
  }
  rtcReleaseDevice(device);
  std::sort(ratios.begin(), ratios.end());
  std::printf(
      "%s: %.1f million rays a frame, %.0f %% of them hit; baker's speed over Embree's alone: "
      "median %.2f "
      "(%.2f to %.2f in %d pairs)\n",
      argv[1], million_rays, 100 * static_cast<double>(hits) / (1e6 * million_rays),
      ratios[ratios.size() / 2], ratios.front(), ratios.back(), runs);
  return 0;
}
