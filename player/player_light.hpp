// SPDX-License-Identifier: MIT
#pragma once

#include <glm/glm.hpp>
#include <memory>

#include "container/base/result.hpp"
#include "decoders/sh.hpp"
#include "player/light_field.hpp"

namespace relit::player {

/// Radiance × this: a white surface in the mean of the light is a little below white. 1: no light.
[[nodiscard]] float exposure_for(const decoders::Light& light);

/// The light of a player: what was set, how it is turned, and what shines at the moment.
class PlayerLight {
 public:
  /// White, radiance 1 from everywhere.
  static Result<PlayerLight> create();

  /// Takes a light and its picture, which may be null; `rotation_rad` turns the picture as the
  /// light was turned already.
  void set(LightField field, std::shared_ptr<const decoders::Environment> environment,
           double rotation_rad);
  /// Turns both about +Y from how they were set. Errors: kInvalid where not finite.
  Status turn(double angle_rad);
  void set_position(const glm::vec3& position);

  /// Brings now() up to a time. True: it has changed since the last call.
  bool sample(double time_s);
  [[nodiscard]] const decoders::Light& now() const { return now_; }
  /// The same before it was turned by turn().
  [[nodiscard]] const decoders::Light& unturned() const { return unturned_; }
  /// Whether it changes with time by itself.
  [[nodiscard]] bool varies() const { return field_.varies_in_time(); }

  /// Counts every set(): whether a picture of the light has to be made again.
  [[nodiscard]] unsigned generation() const { return generation_; }
  /// Counts the changes of unturned(): the same for its harmonics.
  [[nodiscard]] unsigned unturned_generation() const { return unturned_generation_; }
  [[nodiscard]] const decoders::Environment* environment() const { return environment_.get(); }
  [[nodiscard]] double environment_rotation_rad() const { return rotation_rad_ + turn_rad_; }
  [[nodiscard]] double turn_rad() const { return turn_rad_; }

  /// exposure_for() the whole light.
  [[nodiscard]] float auto_exposure() const { return auto_exposure_; }

 private:
  explicit PlayerLight(LightField field);

  LightField field_;
  std::shared_ptr<const decoders::Environment> environment_;
  double rotation_rad_ = 0, turn_rad_ = 0;
  glm::vec3 position_{0.0f};
  decoders::Light unturned_, now_;
  double sampled_s_ = 0;
  float auto_exposure_ = 1;
  unsigned generation_ = 0, unturned_generation_ = 0;
  bool stale_ = true, turned_ = false;
};

}  // namespace relit::player
