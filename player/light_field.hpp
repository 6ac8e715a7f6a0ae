// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "decoders/sh.hpp"

/// Light that varies with time and place (Xu et al. 2008, figure 6: the position of the character
/// estimates its environment's light).
namespace relit::player {

/// A regular grid of places, +x varying fastest, then +y, then +z.
struct ProbeGrid {
  std::array<double, 3> origin{};          ///< of probe (0, 0, 0), metres
  std::array<double, 3> spacing{1, 1, 1};  ///< > 0, metres
  std::array<int, 3> size{1, 1, 1};        ///< probes along each axis, at least 1
  [[nodiscard]] std::size_t count() const;
  bool operator==(const ProbeGrid&) const = default;
};

/// What a field is made of.
struct LightFieldParts {
  ProbeGrid grid;
  std::vector<double> times_s;  ///< of the keys, ascending; empty: one key that holds always
  /// [key][probe], all of the same order.
  std::vector<decoders::Light> lights;
  bool step = false;  ///< a key's light holds until the next one, instead of blending into it
  bool loop = false;
  /// With `loop`: after how long the first key comes again, at least last − first time; between
  /// the last key and that it blends over (or holds). 0: last − first time.
  double period_s = 0;
};

/// Light coefficients over time and place. Blending is linear in the coefficients: radiance is
/// linear in them, and so is everything made from radiance here, so a blend of coefficients is
/// exactly the light of both scenes, each dimmed by its weight, as in a cross-fade of photographs.
class LightField {
 public:
  static constexpr std::size_t kMostKeys = 4096;
  static constexpr std::size_t kMostProbes = 4096;
  static constexpr std::size_t kMostLights = 16384;  ///< keys × probes

  /// Errors: kInvalid, saying which part, for numbers that are not finite, lights of other than 1,
  /// 4, 9 or 16 rows or of different orders, times that do not ascend, spacing that is not
  /// positive, a period that is too short, or counts that do not fit; kLimit beyond the above.
  static Result<LightField> create(LightFieldParts parts);
  /// One light, always and everywhere. Errors: as create().
  static Result<LightField> steady(decoders::Light light);

  /// The light at a time and place, into `out`, which keeps its memory: no allocation once it has
  /// been used with this field. Before the first key, and after the last one if it does not loop,
  /// the nearest holds; outside of the grid the nearest place on its border counts. Between probes
  /// trilinear. A time or place that is not a number counts as 0. Any thread.
  void sample(double time_s, const glm::vec3& position, decoders::Light& out) const;
  [[nodiscard]] decoders::Light at(double time_s, const glm::vec3& position) const;

  /// The mean of all its lights: what an exposure for all of it is chosen from.
  [[nodiscard]] decoders::Light mean() const;
  [[nodiscard]] int order() const;
  [[nodiscard]] bool varies_in_time() const { return parts_.times_s.size() > 1; }
  [[nodiscard]] bool varies_in_space() const { return parts_.grid.count() > 1; }
  [[nodiscard]] const LightFieldParts& parts() const { return parts_; }

  /// The same field with all lights turned about +Y, windowed and cut to an order, as LightOptions
  /// says. Places stay where they are.
  void transform(int order, double rotate_rad, bool window);

 private:
  explicit LightField(LightFieldParts parts) : parts_(std::move(parts)) {}
  struct Blend;
  [[nodiscard]] Blend keys_at(double time_s) const;
  void add_key(std::size_t key, double weight, const glm::vec3& position,
               decoders::Light& out) const;

  LightFieldParts parts_;
};

/// The field as the .json that load_light() reads: the same bytes for the same field, and the same
/// doubles when read again. A field of one light is what light_json() writes.
[[nodiscard]] std::string light_field_json(const LightField& field);

}  // namespace relit::player
