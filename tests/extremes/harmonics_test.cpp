// SPDX-License-Identifier: MIT
// Spherical harmonics of every order: turned, cut off, and through every composite.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "player/player_light.hpp"
#include "tests/extremes/lit_clip.hpp"
#include "tests/results.hpp"

using namespace relit;
using namespace relit::test;
using decoders::Light;

namespace {

glm::dvec3 random_direction(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
}

/// L_n = Y_n(direction): a sun of irradiance 1, projected by definition.
Light sun(int order, const glm::dvec3& direction) {
  std::array<double, 16> y{};
  decoders::evaluate_sh(order, direction, y);
  Light light;
  for (int n = 0; n < decoders::coefficient_count(order); ++n) {
    const double value = y[static_cast<std::size_t>(n)];
    light.sh.push_back({value, value, value});
  }
  return light;
}

double distance(const Light& a, const Light& b) {
  double squares = 0;
  for (std::size_t n = 0; n < a.sh.size(); ++n) {
    const double d = a.sh[n][0] - b.sh[n][0];
    squares += d * d;
  }
  return std::sqrt(squares);
}
double length(const Light& light) {
  Light zero;
  zero.sh.resize(light.sh.size());
  return distance(light, zero);
}

// A turn is three maps of the coefficients, each of sums of two products whose lengths are √2 times
// that of the sum at most. The factors of a map are rounded from irrationals, u = 2^-53 each, which
// repeats in every turn: 3 · √2 u. The products and the sum are rounded by 3 u besides, which walks
// at random: 3 · 3 · √2 u a turn, of which a million make a thousand; six times that is not seen.
double turn_bound(double turns) {
  return std::exp2(-53) * std::sqrt(2.0) * (3 * turns + 6 * 9 * std::sqrt(turns));
}

/// Radiance of a sun's order-N harmonics at the angle of which t is the cosine: Σ w_l (2l+1)/4π
/// P_l.
double zonal(int order, bool window, double t) {
  const std::array<double, 4> legendre{1, t, (3 * t * t - 1) / 2, (5 * t * t - 3) * t / 2};
  double sum = 0;
  for (int l = 0; l <= order; ++l) {
    const double w = window ? (1 + std::cos(std::numbers::pi * l / 5)) / 2 : 1;
    sum += w * (2 * l + 1) / (4 * std::numbers::pi) * legendre[static_cast<std::size_t>(l)];
  }
  return sum;
}

/// Its least value: at an end, or where the derivative, a t² + b t + c, is zero.
double least_zonal(int order, bool window) {
  std::vector<double> places{-1, 1};
  const auto w = [&](int l) {
    if (l > order) return 0.0;
    return (2 * l + 1) * (window ? (1 + std::cos(std::numbers::pi * l / 5)) / 2 : 1);
  };
  const double a = 7.5 * w(3), b = 3 * w(2), c = w(1) - 1.5 * w(3);
  if (a != 0) {
    const double root = std::sqrt(std::max(b * b - 4 * a * c, 0.0));
    places.insert(places.end(), {(-b + root) / (2 * a), (-b - root) / (2 * a)});
  } else if (b != 0) {
    places.push_back(-c / b);
  }
  double least = zonal(order, window, 1);
  for (const double t : places)
    if (t >= -1 && t <= 1) least = std::min(least, zonal(order, window, t));
  return least;
}

}  // namespace

TEST_CASE("a million small turns neither fade nor distort a light") {
  constexpr int kTurns = 1'000'000;
  for (int order = 1; order <= 3; ++order) {
    const Light light = random_light(order, 1, 31);
    Light turned = light;
    for (int i = 0; i < kTurns; ++i)
      decoders::rotate_light_y(turned, 2 * std::numbers::pi / kTurns);
    Worst decay, apart;
    decay.add(std::abs(length(turned) / length(light) - 1), turn_bound(kTurns));
    apart.add(distance(turned, light) / length(light), turn_bound(kTurns));
    const std::string name = "order " + std::to_string(order) + ", 10^6 turns by 2π/10^6";
    hold(name + ", change of length", "√2 u' (3 + 54/√turns) a turn", decay);
    hold(name + ", distance from the start", "√2 u' (3 + 54/√turns) a turn", apart);
  }
}

TEST_CASE("the player's turns do not add up") {
  const Light light = random_light(3, 1, 32);
  auto once = take(player::PlayerLight::create()), often = take(player::PlayerLight::create());
  for (player::PlayerLight* each : {&once, &often}) {
    each->set(take(player::LightField::steady(light)), nullptr, 0);
    each->sample(0);
  }
  for (int i = 1; i <= 100'000; ++i) {
    require(often.turn(1.25 * i / 100'000));
    often.sample(0);
  }
  require(once.turn(1.25));
  once.sample(0);
  hold_exact("the player's light in 10^5 turns and in one", "turned from how it was set",
             often.now().sh != once.now().sh);
}

TEST_CASE("a turned sun is the sun's projection from where it has turned to") {
  std::mt19937 random(33);
  std::uniform_real_distribution<double> any(-10, 10);
  for (int order = 0; order <= 3; ++order) {
    Worst worst;
    for (int i = 0; i < 10'000; ++i) {
      const double angle = any(random);
      const glm::dvec3 d = random_direction(random);
      const glm::dvec3 to(d.x * std::cos(angle) - d.z * std::sin(angle), d.y,
                          d.x * std::sin(angle) + d.z * std::cos(angle));
      Light turned = sun(order, d);
      decoders::rotate_light_y(turned, angle);
      // Besides the turn: Y_n of both directions, 6 roundings each of values below 3, and `to` is
      // off by 4 u, where Y_n climbs by 7 at most (see tests/decoders/sh_test.cpp): 64 u of 1, in
      // 16 coefficients √16 times that.
      const double bound = turn_bound(1) * length(turned) + 4 * 64 * std::exp2(-53);
      worst.add(distance(turned, sun(order, to)), bound);
    }
    hold("order " + std::to_string(order) + ", 10^4 suns turned, against their projections",
         "√2 u' 57 of its length + 256 u'", worst);
  }
}

TEST_CASE("ringing is found, and told, for every order") {
  std::mt19937 random(34);
  for (int order = 0; order <= 3; ++order) {
    for (const bool window : {false, true}) {
      const double least = least_zonal(order, window);
      Worst worst;
      for (int i = 0; i < 20; ++i) {
        Light light = sun(order, i == 0   ? glm::dvec3(0, 1, 0)
                                 : i == 1 ? glm::dvec3(0, 0, -1)
                                          : random_direction(random));
        if (window) decoders::window_light(light);
        // Y_n are values below 3 of 6 roundings, L_n likewise, then products and 16 sums: 30 u' of
        // Σ |L_n Y_n|, the peak at most. Where the valley is found to δ, f'' δ²/2 comes on top, f''
        // < 10: nothing for δ of 1e-8.
        const double bound = 30 * std::exp2(-53) * zonal(order, false, 1) + 5e-16;
        worst.add(std::abs(decoders::minimum_radiance(light)[0] - least), bound);
      }
      char share[16];
      std::snprintf(share, sizeof share, "%.3f", least / zonal(order, window, 1));
      hold("least radiance of an order-" + std::to_string(order) + " sun" +
               (window ? ", windowed" : "") + ", " + share + " of its peak",
           "30 u' of the peak + 5e-16", worst);
    }
  }
}

TEST_CASE("every order is composited on every path, and negative radiance with it") {
  for (int order = 0; order <= 3; ++order) {
    for (const bool exponents : {false, true}) {
      const LitClip::Shape shape{order, 32, 32, exponents ? 8 : 10, exponents};
      const LitClip clip(shape, exponents ? 1.0f : 1.0f / 512, random_samples(shape, 35));
      std::vector<Light> lights{sun(order, glm::dvec3(0.36, 0.48, 0.8)),
                                random_light(order, 1, 36)};
      lights.push_back(lights[0]);
      decoders::window_light(lights[2]);
      double least = 0;
      for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 32; ++x)
          for (const LitClip::Term& term : clip.at(lights[0], x, y))
            least = std::min(least, term.value);
      CHECK(least < 0);
      Observed observed;
      composite_everywhere(clip, lights, observed);
      hold("order " + std::to_string(order) +
               (exponents ? ", 8 bits with exponents" : ", 10 bits") + ", of the largest S",
           observed);
    }
  }
}
