// SPDX-License-Identifier: MIT
#include "bake_minimal/transfer.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "bake_minimal/parallel.hpp"
#include "decoders/sh.hpp"

namespace relit::bake {
namespace {

constexpr int kLanes = 8;
constexpr int kMaxCoefficients = 16;
constexpr std::size_t kBlock = 64;  // samples that a thread takes at a time
constexpr float kOffset = 2e-5f;  // of the scene's diagonal: lifts rays off the surface they leave

// Directions of one packet, and the basis functions there, lane by lane.
struct DirectionGroup {
  alignas(32) float x[kLanes], y[kLanes], z[kLanes];
  alignas(32) float basis[kMaxCoefficients][kLanes];
  alignas(32) float present[kLanes];  // 0 for the lanes beyond the last direction
};

// A ray that met a lit surface: ρ(hit) cos θ times the quadrature weight, and where to find T(hit).
struct Hit {
  std::uint32_t sample;
  float r, g, b;
};

struct BlockHits {
  std::vector<Hit> hits;
  std::vector<std::uint32_t> end;  // of each sample's hits
};

// [3][coefficients], padded so that the inner loops are of one length.
struct Vector3 {
  float c[3][kMaxCoefficients];
};

// Interleaves the bits of two 16-bit numbers: neighbours on the square stay neighbours on the line.
std::uint32_t morton(std::uint32_t x, std::uint32_t y) {
  std::uint32_t code = 0;
  for (int bit = 0; bit < 16; ++bit) {
    code |= ((x >> bit) & 1u) << (2 * bit) | ((y >> bit) & 1u) << (2 * bit + 1);
  }
  return code;
}

// Place of a direction on the octahedral map's Morton curve.
std::uint32_t curve_position(const glm::vec3& d) {
  const float sum = std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
  float u = d.x / sum, v = d.z / sum;
  if (d.y < 0) {
    const float folded_u = (1 - std::abs(v)) * (u < 0 ? -1.0f : 1.0f);
    v = (1 - std::abs(u)) * (v < 0 ? -1.0f : 1.0f);
    u = folded_u;
  }
  const auto grid = [](float t) {
    return static_cast<std::uint32_t>(std::clamp((t * 0.5f + 0.5f) * 65535.0f, 0.0f, 65535.0f));
  };
  return morton(grid(u), grid(v));
}

glm::dquat random_rotation(std::uint64_t seed) {
  // The engine's output is fixed by the standard; its distributions are not.
  std::mt19937_64 engine(seed);
  const auto uniform = [&] { return static_cast<double>(engine() >> 11) * 0x1.0p-53; };
  const double u = uniform(), a = 2 * std::numbers::pi * uniform(),
               b = 2 * std::numbers::pi * uniform();
  return {std::sqrt(u) * std::cos(b), std::sqrt(1 - u) * std::sin(a),
          std::sqrt(1 - u) * std::cos(a), std::sqrt(u) * std::sin(b)};
}

}  // namespace

std::vector<glm::vec3> sphere_directions(int count, std::uint64_t seed) {
  const glm::dquat turn = random_rotation(seed);
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  std::vector<glm::vec3> directions;
  directions.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const double y = 1 - (2.0 * i + 1) / count;
    const double r = std::sqrt(1 - y * y), phi = golden * i;
    directions.emplace_back(turn * glm::dvec3(r * std::cos(phi), y, r * std::sin(phi)));
  }
  std::stable_sort(
      directions.begin(), directions.end(),
      [](const glm::vec3& a, const glm::vec3& b) { return curve_position(a) < curve_position(b); });
  return directions;
}

struct TransferTracer::Impl {
  TraceGeometry geometry;
  std::vector<TexelSample> samples;
  TransferOptions options;
  int coefficients = 0;
  std::vector<DirectionGroup> groups;
  std::vector<std::int32_t> sample_of_texel;
  std::vector<std::uint32_t> opaque, masked;  // triangles that rays can meet, by Embree geometry
  RTCDevice device = nullptr;

  // Of the frame in hand.
  std::vector<glm::vec3> positions;  // padded by one vertex for Embree's 16-byte loads
  std::vector<glm::vec3> face_normals;
  std::vector<Vector3> increment, next_increment, total;
  std::vector<BlockHits> blocks;
  RTCScene scene = nullptr;
  float offset = 0;  // of a ray's origin from its surface, metres
  std::uint64_t ray_count = 0;

  ~Impl() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }

  void prepare_directions();
  void prepare_triangles();
  Status prepare_frame(std::span<const glm::vec3> frame_positions);
  void attach(const std::vector<std::uint32_t>& triangles, bool with_filter);
  std::uint64_t trace_block(std::size_t block, std::span<const glm::vec3> normals,
                            std::span<std::uint8_t> buried);
  struct Point;
  void trace_sample(const Point& point, Vector3& direct, BlockHits& out, std::uint64_t& rays,
                    bool& is_buried) const;
  bool resolve_hit(const RTCRayHit8& packet, int lane, float weight, Hit& hit) const;
  void bounce();
  glm::vec4 albedo_at(std::uint32_t triangle, float b1, float b2) const;
  std::uint32_t met_triangle(unsigned geometry_id, unsigned primitive) const {
    return (geometry_id == 0 ? opaque : masked)[primitive];
  }
  template <class T>
  T interpolate(const std::vector<T>& values, std::uint32_t triangle, float b1, float b2) const {
    const std::uint32_t* i = &geometry.indices[3 * std::size_t{triangle}];
    return (1 - b1 - b2) * values[i[0]] + b1 * values[i[1]] + b2 * values[i[2]];
  }
  static void filter(const RTCFilterFunctionNArguments* arguments);
};

struct TransferTracer::Impl::Point {
  glm::vec3 origin;
  glm::vec3 normal;
  glm::vec3 face_normal;
};

void TransferTracer::Impl::prepare_directions() {
  const std::vector<glm::vec3> directions = sphere_directions(options.directions, options.seed);
  groups.resize((directions.size() + kLanes - 1) / kLanes);
  std::array<float, kMaxCoefficients> y{};
  for (std::size_t i = 0; i < groups.size() * kLanes; ++i) {
    DirectionGroup& group = groups[i / kLanes];
    const std::size_t lane = i % kLanes;
    const glm::vec3 d = directions[std::min(i, directions.size() - 1)];
    decoders::evaluate_sh(options.order, d,
                          std::span(y).first(static_cast<std::size_t>(coefficients)));
    group.x[lane] = d.x, group.y[lane] = d.y, group.z[lane] = d.z;
    for (std::size_t n = 0; n < kMaxCoefficients; ++n) group.basis[n][lane] = y[n];
    group.present[lane] = i < directions.size() ? 1.0f : 0.0f;
  }
}

void TransferTracer::Impl::prepare_triangles() {
  const std::size_t count = geometry.indices.size() / 3;
  for (std::uint32_t t = 0; t < count; ++t) {
    // The two sides of a sheet coincide: rays meet one, and resolve_hit() finds out which.
    const bool second_side = geometry.other_side[t] != kNoOtherSide && geometry.other_side[t] < t;
    if (second_side) continue;
    (geometry.surfaces[geometry.surface[t]].masked ? masked : opaque).push_back(t);
  }
  sample_of_texel.assign(
      static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height), -1);
  for (std::size_t s = 0; s < samples.size(); ++s) {
    sample_of_texel[samples[s].texel] = static_cast<std::int32_t>(s);
  }
}

glm::vec4 TransferTracer::Impl::albedo_at(std::uint32_t triangle, float b1, float b2) const {
  const HitSurface& surface = geometry.surfaces[geometry.surface[triangle]];
  const glm::vec4 color =
      geometry.colors.empty() ? glm::vec4(1.0f) : interpolate(geometry.colors, triangle, b1, b2);
  const glm::vec2 uv = surface.image != nullptr ? interpolate(geometry.albedo_uv, triangle, b1, b2)
                                                : glm::vec2(0.0f);
  return surface_albedo(surface, uv, color);
}

// Masked texels let light through.
void TransferTracer::Impl::filter(const RTCFilterFunctionNArguments* arguments) {
  const Impl& impl = *static_cast<const Impl*>(arguments->geometryUserPtr);
  for (unsigned i = 0; i < arguments->N; ++i) {
    if (arguments->valid[i] != -1) continue;
    const unsigned primitive = RTCHitN_primID(arguments->hit, arguments->N, i);
    const std::uint32_t triangle = impl.masked[primitive];
    const float alpha = impl.albedo_at(triangle, RTCHitN_u(arguments->hit, arguments->N, i),
                                       RTCHitN_v(arguments->hit, arguments->N, i))
                            .w;
    if (alpha < impl.geometry.surfaces[impl.geometry.surface[triangle]].alpha_cutoff) {
      arguments->valid[i] = 0;
    }
  }
}

void TransferTracer::Impl::attach(const std::vector<std::uint32_t>& triangles, bool with_filter) {
  RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, positions.data(),
                             0, sizeof(glm::vec3), positions.size() - 1);
  auto* indices = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(std::uint32_t), triangles.size()));
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    std::copy_n(&geometry.indices[3 * std::size_t{triangles[t]}], 3, indices + 3 * t);
  }
  if (with_filter) {
    rtcSetGeometryUserData(mesh, this);
    rtcSetGeometryIntersectFilterFunction(mesh, &Impl::filter);
  }
  rtcCommitGeometry(mesh);
  rtcAttachGeometryByID(scene, mesh, with_filter ? 1 : 0);
  rtcReleaseGeometry(mesh);
}

Status TransferTracer::Impl::prepare_frame(std::span<const glm::vec3> frame_positions) {
  for (std::size_t v = 0; v < frame_positions.size(); ++v) {
    const glm::vec3& p = frame_positions[v];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
      return fail(ErrorCode::kInvalid, "posed vertex " + std::to_string(v) +
                                           " is not finite; check the animation's keys and scales");
    }
  }
  positions.assign(frame_positions.begin(), frame_positions.end());
  positions.emplace_back(0.0f);
  face_normals.resize(geometry.indices.size() / 3);
  for (std::size_t t = 0; t < face_normals.size(); ++t) {
    const std::uint32_t* i = &geometry.indices[3 * t];
    const glm::dvec3 n = glm::cross(glm::dvec3(positions[i[1]]) - glm::dvec3(positions[i[0]]),
                                    glm::dvec3(positions[i[2]]) - glm::dvec3(positions[i[0]]));
    const double length = glm::length(n);
    face_normals[t] = length > 0 ? glm::vec3(n / length) : glm::vec3(0.0f);
  }
  if (scene != nullptr) rtcReleaseScene(scene);
  scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  if (!opaque.empty()) attach(opaque, false);
  if (!masked.empty()) attach(masked, true);
  rtcCommitScene(scene);
  RTCBounds bounds;
  rtcGetSceneBounds(scene, &bounds);
  offset = kOffset * glm::length(glm::vec3(bounds.upper_x, bounds.upper_y, bounds.upper_z) -
                                 glm::vec3(bounds.lower_x, bounds.lower_y, bounds.lower_z));
  return {};
}

bool TransferTracer::Impl::resolve_hit(const RTCRayHit8& packet, int lane, float weight,
                                       Hit& hit) const {
  std::uint32_t triangle = met_triangle(packet.hit.geomID[lane], packet.hit.primID[lane]);
  float b1 = packet.hit.u[lane], b2 = packet.hit.v[lane];
  const glm::vec3 d(packet.ray.dir_x[lane], packet.ray.dir_y[lane], packet.ray.dir_z[lane]);
  if (glm::dot(face_normals[triangle], d) > 0) {
    const std::uint32_t behind = geometry.other_side[triangle];
    if (behind == kNoOtherSide) return false;
    // The same corner has another number on the other side; corners are told apart by position.
    const std::uint32_t* from = &geometry.indices[3 * std::size_t{triangle}];
    const std::uint32_t* to = &geometry.indices[3 * std::size_t{behind}];
    const float weights[3] = {1 - b1 - b2, b1, b2};
    float moved[3] = {0, 0, 0};
    bool taken[3] = {false, false, false};
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) {
        if (taken[b] || positions[from[a]] != positions[to[b]]) continue;
        taken[b] = true;
        moved[b] = weights[a];
        break;
      }
    }
    triangle = behind, b1 = moved[1], b2 = moved[2];
  }
  const glm::vec2 uv = interpolate(geometry.lightmap_uv, triangle, b1, b2);
  const int x =
      std::clamp(static_cast<int>(uv.x * static_cast<float>(options.width)), 0, options.width - 1);
  const int y = std::clamp(static_cast<int>(uv.y * static_cast<float>(options.height)), 0,
                           options.height - 1);
  const std::int32_t sample =
      sample_of_texel[static_cast<std::size_t>(y) * static_cast<std::size_t>(options.width) +
                      static_cast<std::size_t>(x)];
  const glm::vec4 albedo = albedo_at(triangle, b1, b2);
  hit = {static_cast<std::uint32_t>(std::max(sample, 0)), weight * albedo.x, weight * albedo.y,
         weight * albedo.z};
  return sample >= 0;
}

void TransferTracer::Impl::trace_sample(const Point& point, Vector3& direct, BlockHits& out,
                                        std::uint64_t& rays, bool& is_buried) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  const float quadrature = 4.0f / static_cast<float>(options.directions);  // (1/π) · 4π / count
  alignas(32) float sum[kMaxCoefficients][kLanes] = {};
  alignas(32) int valid[kLanes];
  alignas(32) float weight[kLanes];
  std::uint64_t traced = 0, backs = 0;
  for (const DirectionGroup& group : groups) {
    int any = 0;
    for (int i = 0; i < kLanes; ++i) {
      const float cosine =
          point.normal.x * group.x[i] + point.normal.y * group.y[i] + point.normal.z * group.z[i];
      const float above = point.face_normal.x * group.x[i] + point.face_normal.y * group.y[i] +
                          point.face_normal.z * group.z[i];
      const bool up = cosine > 0 && above > 0 && group.present[i] > 0;
      valid[i] = up ? -1 : 0;
      weight[i] = up ? cosine : 0;
      any |= valid[i];
    }
    if (any == 0) continue;
    RTCRayHit8 packet;
    for (int i = 0; i < kLanes; ++i) {
      packet.ray.org_x[i] = point.origin.x, packet.ray.org_y[i] = point.origin.y,
      packet.ray.org_z[i] = point.origin.z;
      packet.ray.dir_x[i] = group.x[i], packet.ray.dir_y[i] = group.y[i],
      packet.ray.dir_z[i] = group.z[i];
      packet.ray.tnear[i] = 0, packet.ray.tfar[i] = std::numeric_limits<float>::infinity();
      packet.ray.time[i] = 0, packet.ray.mask[i] = ~0u, packet.ray.id[i] = 0,
      packet.ray.flags[i] = 0;
      packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID,
      packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    rtcIntersect8(valid, scene, &context, &packet);
    for (int i = 0; i < kLanes; ++i) {
      if (valid[i] == 0) continue;
      ++traced;
      if (packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
      Hit hit;
      const std::uint32_t met = met_triangle(packet.hit.geomID[i], packet.hit.primID[i]);
      const bool black = geometry.other_side[met] == kNoOtherSide &&
                         face_normals[met].x * group.x[i] + face_normals[met].y * group.y[i] +
                                 face_normals[met].z * group.z[i] >
                             0;
      backs += black;
      if (!black && options.bounces > 0 && resolve_hit(packet, i, quadrature * weight[i], hit)) {
        out.hits.push_back(hit);
      }
      weight[i] = 0;
    }
    for (int n = 0; n < coefficients; ++n) {
      for (int i = 0; i < kLanes; ++i) sum[n][i] += weight[i] * group.basis[n][i];
    }
  }
  for (int n = 0; n < coefficients; ++n) {
    const float value = quadrature * std::accumulate(sum[n], sum[n] + kLanes, 0.0f);
    for (auto& channel : direct.c) channel[n] = value;
  }
  rays += traced;
  is_buried = 2 * backs > traced;
}

std::uint64_t TransferTracer::Impl::trace_block(std::size_t block,
                                                std::span<const glm::vec3> normals,
                                                std::span<std::uint8_t> buried) {
  std::uint64_t rays = 0;
  BlockHits& out = blocks[block];
  out.hits.clear(), out.end.clear();
  const std::size_t last = std::min(samples.size(), (block + 1) * kBlock);
  for (std::size_t s = block * kBlock; s < last; ++s) {
    const TexelSample& sample = samples[s];
    const std::uint32_t* i = &geometry.indices[3 * std::size_t{sample.triangle}];
    const float b0 = 1 - sample.b1 - sample.b2;
    Point point;
    point.face_normal = face_normals[sample.triangle];
    const glm::vec3 n = b0 * normals[i[0]] + sample.b1 * normals[i[1]] + sample.b2 * normals[i[2]];
    const float length = glm::length(n);
    // Cancelled or missing vertex normals leave the face's; a collapsed face leaves the vertices'.
    point.normal = length > 1e-6f && std::isfinite(length) ? n / length : point.face_normal;
    if (point.face_normal == glm::vec3(0.0f)) point.face_normal = point.normal;
    point.origin =
        interpolate(positions, sample.triangle, sample.b1, sample.b2) + offset * point.face_normal;
    Vector3& direct = increment[s];
    direct = {};
    bool is_buried = false;
    trace_sample(point, direct, out, rays, is_buried);
    out.end.push_back(static_cast<std::uint32_t>(out.hits.size()));
    total[s] = direct;
    if (!buried.empty()) buried[s] = is_buried ? 1 : 0;
  }
  return rays;
}

// One more bounce: gathers the last one's increment where the rays ended (Fatahalian, A.1, erratum
// 4: the hit's transfer vector is added as it is, and each pass uses the increment of the pass
// before).
void TransferTracer::Impl::bounce() {
  parallel_for(thread_count(options.threads), blocks.size(), [&](std::size_t block) {
    const BlockHits& in = blocks[block];
    std::size_t h = 0;
    for (std::size_t k = 0; k < in.end.size(); ++k) {
      const std::size_t s = block * kBlock + k;
      Vector3 gathered{};
      for (; h < in.end[k]; ++h) {
        const Hit& hit = in.hits[h];
        const Vector3& source = increment[hit.sample];
        for (int n = 0; n < kMaxCoefficients; ++n) gathered.c[0][n] += hit.r * source.c[0][n];
        for (int n = 0; n < kMaxCoefficients; ++n) gathered.c[1][n] += hit.g * source.c[1][n];
        for (int n = 0; n < kMaxCoefficients; ++n) gathered.c[2][n] += hit.b * source.c[2][n];
      }
      next_increment[s] = gathered;
      for (std::size_t c = 0; c < 3; ++c) {
        for (int n = 0; n < kMaxCoefficients; ++n) total[s].c[c][n] += gathered.c[c][n];
      }
    }
  });
  std::swap(increment, next_increment);
}

TransferTracer::TransferTracer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
TransferTracer::TransferTracer(TransferTracer&&) noexcept = default;
TransferTracer& TransferTracer::operator=(TransferTracer&&) noexcept = default;
TransferTracer::~TransferTracer() = default;

Result<TransferTracer> TransferTracer::create(TraceGeometry geometry,
                                              std::vector<TexelSample> samples,
                                              const TransferOptions& options) {
  const std::size_t triangles = geometry.indices.size() / 3;
  const bool fits = geometry.surface.size() == triangles &&
                    geometry.other_side.size() == triangles &&
                    geometry.albedo_uv.size() == geometry.lightmap_uv.size();
  if (!fits) return fail(ErrorCode::kInvalid, "trace geometry: arrays of different lengths");
  if (options.order < 0 || options.order > 3) {
    return fail(ErrorCode::kInvalid,
                "order " + std::to_string(options.order) + ": it must be 0 to 3");
  }
  if (options.directions < 8 || options.directions > 1 << 20) {
    return fail(ErrorCode::kInvalid,
                "samples " + std::to_string(options.directions) + ": it must be 8 to 1048576");
  }
  if (options.bounces < 0 || options.bounces > 64) {
    return fail(ErrorCode::kInvalid,
                "bounces " + std::to_string(options.bounces) + ": it must be 0 to 64");
  }
  auto impl = std::make_unique<Impl>();
  impl->geometry = std::move(geometry);
  impl->samples = std::move(samples);
  impl->options = options;
  impl->coefficients = decoders::coefficient_count(options.order);
  // One thread builds the tree: with several its shape, and so the choice between coincident
  // triangles, would vary.
  impl->device = rtcNewDevice("threads=1");
  if (impl->device == nullptr)
    return fail(ErrorCode::kEnvironment, "Embree does not start on this processor");
  impl->prepare_directions();
  impl->prepare_triangles();
  const std::size_t count = impl->samples.size();
  impl->increment.resize(count), impl->next_increment.resize(count), impl->total.resize(count);
  impl->blocks.resize((count + kBlock - 1) / kBlock);
  return TransferTracer(std::move(impl));
}

Status TransferTracer::trace(std::span<const glm::vec3> positions,
                             std::span<const glm::vec3> normals, std::span<float> transfer,
                             std::span<std::uint8_t> buried) {
  Impl& impl = *impl_;
  const std::size_t count = impl.samples.size();
  const std::size_t vertices = impl.geometry.lightmap_uv.size();
  if (positions.size() != vertices || normals.size() != vertices ||
      transfer.size() != count * 3 * static_cast<std::size_t>(impl.coefficients) ||
      (!buried.empty() && buried.size() != count)) {
    return fail(ErrorCode::kInvalid, "trace: spans of the wrong length");
  }
  RELIT_TRY(impl.prepare_frame(positions));
  std::atomic<std::uint64_t> rays{0};
  parallel_for(thread_count(impl.options.threads), impl.blocks.size(),
               [&](std::size_t block) { rays += impl.trace_block(block, normals, buried); });
  impl.ray_count = rays;
  for (int b = 0; b < impl.options.bounces; ++b) impl.bounce();
  for (std::size_t n = 0; n < static_cast<std::size_t>(impl.coefficients); ++n) {
    for (std::size_t c = 0; c < 3; ++c) {
      float* out = transfer.data() + (n * 3 + c) * count;
      for (std::size_t s = 0; s < count; ++s) out[s] = impl.total[s].c[c][n];
    }
  }
  return {};
}

std::span<const TexelSample> TransferTracer::samples() const { return impl_->samples; }
const TransferOptions& TransferTracer::options() const { return impl_->options; }
std::uint64_t TransferTracer::rays() const { return impl_->ray_count; }

}  // namespace relit::bake
