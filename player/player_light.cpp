// SPDX-License-Identifier: MIT
#include "player/player_light.hpp"

#include <cmath>
#include <utility>

#include "decoders/sh_constants.hpp"

namespace relit::player {

float exposure_for(const decoders::Light& light) {
  const auto& rgb = light.sh.front();
  const double luminance = (0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]) * decoders::kBand0;
  return luminance > 0 ? static_cast<float>(0.8 / luminance) : 1.0f;
}

PlayerLight::PlayerLight(LightField field)
    : field_(std::move(field)), auto_exposure_(exposure_for(field_.mean())) {}

Result<PlayerLight> PlayerLight::create() {
  const double level = 1 / decoders::kBand0;
  RELIT_ASSIGN(LightField field, LightField::steady({{{level, level, level}}}));
  return PlayerLight(std::move(field));
}

void PlayerLight::set(LightField field, std::shared_ptr<const decoders::Environment> environment,
                      double rotation_rad) {
  field_ = std::move(field);
  auto_exposure_ = exposure_for(field_.mean());
  environment_ = std::move(environment);
  rotation_rad_ = rotation_rad;
  turn_rad_ = 0;
  ++generation_;
  stale_ = true;
}

Status PlayerLight::turn(double angle_rad) {
  if (!std::isfinite(angle_rad))
    return fail(ErrorCode::kInvalid, "the angle by which to turn a light is not finite");
  turned_ |= angle_rad != turn_rad_;
  turn_rad_ = angle_rad;
  return {};
}

void PlayerLight::set_position(const glm::vec3& position) {
  stale_ |= field_.varies_in_space() && position != position_;
  position_ = position;
}

bool PlayerLight::sample(double time_s) {
  stale_ |= field_.varies_in_time() && time_s != sampled_s_;
  if (!stale_ && !turned_) return false;
  if (stale_) {
    field_.sample(time_s, position_, unturned_);
    ++unturned_generation_;
  }
  now_ = unturned_;
  if (turn_rad_ != 0) decoders::rotate_light_y(now_, turn_rad_);
  sampled_s_ = time_s;
  stale_ = turned_ = false;
  return true;
}

}  // namespace relit::player
