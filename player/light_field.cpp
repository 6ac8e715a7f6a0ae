// SPDX-License-Identifier: MIT
#include "player/light_field.hpp"

#include <algorithm>
#include <cmath>

namespace relit::player {
namespace {

std::string key_name(std::size_t key) { return "keys[" + std::to_string(key) + "]"; }

Status check_grid(const ProbeGrid& grid) {
  std::size_t count = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string place = "[" + std::to_string(axis) + "]";
    if (!std::isfinite(grid.origin[axis]))
      return fail(ErrorCode::kInvalid, "probes.origin" + place + " is not finite");
    if (!(grid.spacing[axis] > 0) || !std::isfinite(grid.spacing[axis])) {
      return fail(ErrorCode::kInvalid, "probes.spacing" + place + " is " +
                                           std::to_string(grid.spacing[axis]) +
                                           "; probes lie more than 0 m apart");
    }
    if (grid.size[axis] < 1) {
      return fail(ErrorCode::kInvalid, "probes.size" + place + " is " +
                                           std::to_string(grid.size[axis]) +
                                           "; there is at least one probe along each axis");
    }
    const auto size = static_cast<std::size_t>(grid.size[axis]);
    if (size > LightField::kMostProbes / count) {
      return fail(ErrorCode::kLimit,
                  "probes.size: more than " + std::to_string(LightField::kMostProbes) + " probes");
    }
    count *= size;
  }
  return {};
}

Status check_times(const LightFieldParts& parts) {
  const auto& times = parts.times_s;
  if (times.size() > LightField::kMostKeys) {
    return fail(ErrorCode::kLimit,
                "keys: more than " + std::to_string(LightField::kMostKeys) + " of them");
  }
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (!std::isfinite(times[i]))
      return fail(ErrorCode::kInvalid, key_name(i) + ".time_s is not finite");
    if (i > 0 && !(times[i] > times[i - 1])) {
      return fail(ErrorCode::kInvalid, key_name(i) + ".time_s is " + std::to_string(times[i]) +
                                           ", and that of the key before " +
                                           std::to_string(times[i - 1]) + "; times ascend");
    }
  }
  const double span_s = times.empty() ? 0.0 : times.back() - times.front();
  if (!std::isfinite(span_s)) return fail(ErrorCode::kInvalid, "keys: times too far apart");
  if (parts.period_s != 0 && !(parts.period_s >= span_s && std::isfinite(parts.period_s))) {
    return fail(ErrorCode::kInvalid, "period_s is " + std::to_string(parts.period_s) +
                                         "; it is finite, and no less than the " +
                                         std::to_string(span_s) + " s that the keys span");
  }
  return {};
}

Status check_lights(const LightFieldParts& parts) {
  const std::size_t probes = parts.grid.count();
  const std::size_t keys = std::max<std::size_t>(parts.times_s.size(), 1);
  if (keys * probes > LightField::kMostLights) {
    return fail(ErrorCode::kLimit, std::to_string(keys) + " keys of " + std::to_string(probes) +
                                       " probes; a field has at most " +
                                       std::to_string(LightField::kMostLights) + " lights");
  }
  if (parts.lights.size() != keys * probes) {
    return fail(ErrorCode::kInvalid, std::to_string(parts.lights.size()) + " lights; " +
                                         std::to_string(keys) + " keys of " +
                                         std::to_string(probes) + " probes have " +
                                         std::to_string(keys * probes));
  }
  const std::size_t rows = parts.lights[0].sh.size();
  for (std::size_t i = 0; i < parts.lights.size(); ++i) {
    const auto name = [&] {
      return "the light of key " + std::to_string(i / probes) + ", probe " +
             std::to_string(i % probes);
    };
    const decoders::Light& light = parts.lights[i];
    if (light.order() < 0 || light.sh.size() != rows) {
      return fail(ErrorCode::kInvalid, name() + " has " + std::to_string(light.sh.size()) +
                                           " rows; all lights have 1, 4, 9 or 16, as the first");
    }
    for (const auto& row : light.sh) {
      if (!std::ranges::all_of(row, [](double value) { return std::isfinite(value); }))
        return fail(ErrorCode::kInvalid, name() + " is not finite");
    }
  }
  return {};
}

}  // namespace

std::size_t ProbeGrid::count() const {
  return static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
         static_cast<std::size_t>(size[2]);
}

Result<LightField> LightField::steady(decoders::Light light) {
  LightFieldParts parts;
  parts.lights.push_back(std::move(light));
  return create(std::move(parts));
}

Result<LightField> LightField::create(LightFieldParts parts) {
  RELIT_TRY(check_grid(parts.grid));
  RELIT_TRY(check_times(parts));
  RELIT_TRY(check_lights(parts));
  return LightField(std::move(parts));
}

int LightField::order() const { return parts_.lights[0].order(); }

/// Two keys, and how much of the second.
struct LightField::Blend {
  std::size_t from = 0, to = 0;
  double weight = 0;
};

LightField::Blend LightField::keys_at(double time_s) const {
  const auto& times = parts_.times_s;
  if (times.size() < 2) return {};
  const double first = times.front();
  const double period = parts_.period_s > 0 ? parts_.period_s : times.back() - first;
  if (std::isnan(time_s) || (parts_.loop && std::isinf(time_s))) time_s = 0;
  if (parts_.loop) {
    double passed = std::fmod(time_s - first, period);
    if (passed < 0) passed += period;
    time_s = first + (passed < period ? passed : 0.0);
  }
  const auto after = std::ranges::upper_bound(times, time_s);
  if (after == times.begin()) return {};
  Blend blend;
  blend.from = blend.to = static_cast<std::size_t>(after - times.begin()) - 1;
  const bool last = after == times.end();
  if (parts_.step || (last && !parts_.loop)) return blend;
  const double begin = times[blend.from];
  const double end = last ? first + period : *after;
  blend.to = last ? 0 : blend.from + 1;
  if (end > begin) blend.weight = std::clamp((time_s - begin) / (end - begin), 0.0, 1.0);
  return blend;
}

void LightField::add_key(std::size_t key, double weight, const glm::vec3& position,
                         decoders::Light& out) const {
  const ProbeGrid& grid = parts_.grid;
  std::array<std::size_t, 3> low{};
  std::array<double, 3> part{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double place = static_cast<double>(position[static_cast<glm::length_t>(axis)]);
    if (std::isnan(place)) place = 0;
    const auto last = static_cast<double>(grid.size[axis] - 1);
    const double cell = std::clamp((place - grid.origin[axis]) / grid.spacing[axis], 0.0, last);
    low[axis] = static_cast<std::size_t>(cell);
    part[axis] = cell - std::floor(cell);
  }
  const auto columns = static_cast<std::size_t>(grid.size[0]);
  const auto rows = static_cast<std::size_t>(grid.size[1]);
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const std::array<std::size_t, 3> step{corner & 1, (corner >> 1) & 1, corner >> 2};
    double share = weight;
    for (std::size_t axis = 0; axis < 3; ++axis)
      share *= step[axis] == 1 ? part[axis] : 1 - part[axis];
    if (share == 0) continue;  // among them all beyond the border
    const std::size_t probe =
        ((low[2] + step[2]) * rows + low[1] + step[1]) * columns + low[0] + step[0];
    const decoders::Light& light = parts_.lights[key * grid.count() + probe];
    for (std::size_t n = 0; n < light.sh.size(); ++n) {
      for (std::size_t c = 0; c < 3; ++c) out.sh[n][c] += share * light.sh[n][c];
    }
  }
}

void LightField::sample(double time_s, const glm::vec3& position, decoders::Light& out) const {
  const Blend blend = keys_at(time_s);
  out.sh.assign(parts_.lights[0].sh.size(), {});
  if (blend.weight < 1) add_key(blend.from, 1 - blend.weight, position, out);
  if (blend.weight > 0) add_key(blend.to, blend.weight, position, out);
}

decoders::Light LightField::at(double time_s, const glm::vec3& position) const {
  decoders::Light light;
  sample(time_s, position, light);
  return light;
}

decoders::Light LightField::mean() const {
  decoders::Light mean;
  mean.sh.resize(parts_.lights[0].sh.size());
  const auto count = static_cast<double>(parts_.lights.size());
  for (const decoders::Light& light : parts_.lights) {
    for (std::size_t n = 0; n < mean.sh.size(); ++n) {
      for (std::size_t c = 0; c < 3; ++c) mean.sh[n][c] += light.sh[n][c] / count;
    }
  }
  return mean;
}

void LightField::transform(int order, double rotate_rad, bool window) {
  const auto rows = static_cast<std::size_t>(decoders::coefficient_count(order));
  for (decoders::Light& light : parts_.lights) {
    if (light.sh.size() > rows) light.sh.resize(rows);
    decoders::rotate_light_y(light, rotate_rad);
    if (window) decoders::window_light(light);
  }
}

}  // namespace relit::player
