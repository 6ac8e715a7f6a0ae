// SPDX-License-Identifier: MIT
#include "player/plane_needs.hpp"

#include <numeric>

#include "tests/test.hpp"

namespace relit::player {
namespace {

/// Layers of so many planes of scale 1/128 and 8 bits: values from -1 to 1.
std::vector<container::LayerRecord> layers(std::initializer_list<int> planes) {
  std::vector<container::LayerRecord> out;
  for (const int count : planes) {
    container::LayerRecord& layer = out.emplace_back();
    layer.bit_depth = 8;
    layer.planes.resize(static_cast<std::size_t>(count));
    for (container::PlaneRecord& plane : layer.planes) plane.scale = 1.0f / 128;
  }
  return out;
}

using Bytes = std::vector<std::uint8_t>;
Bytes bytes(std::span<const std::uint8_t> span) { return {span.begin(), span.end()}; }

}  // namespace

TEST_CASE("planes without a weight are not needed, nor layers of nothing else") {
  const auto records = layers({2, 3, 1});
  PlaneNeeds needs(records);
  const std::vector<Rgb> weights{{0, 0, 0}, {0, 0.5f, 0}, {}, {}, {}, {0, 0, -1}};
  FoldedLight light;
  light.weights = weights;
  needs.update(light, {}, 0);
  CHECK(bytes(needs.planes()) == Bytes{0, 1, 0, 0, 0, 1});
  CHECK(bytes(needs.layers()) == Bytes{1, 0, 1});
}

TEST_CASE("a lower quality keeps planes from the front") {
  const auto records = layers({2, 3, 1});
  PlaneNeeds needs(records);
  const std::vector<Rgb> weights(6, Rgb{1, 1, 1});
  FoldedLight light;
  light.weights = weights;
  for (const int kept : {0, 1, 2, 4, 6, 100, -1}) {
    needs.update(light, {kept, false}, 0);
    const int most = kept < 0 || kept > 6 ? 6 : kept;
    CHECK(std::accumulate(needs.planes().begin(), needs.planes().end(), 0) == most);
    if (most > 0) CHECK(needs.planes()[static_cast<std::size_t>(most) - 1] == 1);
  }
  needs.update(light, {2, false}, 0);
  CHECK(bytes(needs.layers()) == Bytes{1, 0, 0});
}

TEST_CASE("faint planes are left out while all of them together cannot be seen") {
  const auto records = layers({4});
  PlaneNeeds needs(records);
  // With exposure 1 and magnitude 1 there is room for 0.5/255/25.84 = 7.588e-5 in all.
  const std::vector<Rgb> weights{{0.5f, 0, 0}, {4e-5f, 0, 0}, {0, 3e-5f, 0}, {0, 0, -2e-5f}};
  FoldedLight light;
  light.weights = weights;
  needs.update(light, {}, 1);
  // 2e-5 + 3e-5 fit, 4e-5 more do not.
  CHECK(bytes(needs.planes()) == Bytes{1, 1, 0, 0});
  needs.update(light, {}, 2);  // room for 3.794e-5
  CHECK(bytes(needs.planes()) == Bytes{1, 1, 1, 0});
  light.magnitude = 10;
  needs.update(light, {}, 1);
  CHECK(bytes(needs.planes()) == Bytes{1, 1, 1, 1});
  light.magnitude = 1;
  needs.update(light, {}, 0);  // not known
  CHECK(bytes(needs.planes()) == Bytes{1, 1, 1, 1});
  needs.update(light, {}, 1e-6f);
  CHECK(bytes(needs.planes()) == Bytes{0, 0, 0, 0});
  CHECK(bytes(needs.layers()) == Bytes{0});
}

TEST_CASE("planes with exponents have no bound, and a prediction is always needed") {
  auto records = layers({1, 1});
  records[0].has_exponents = true;
  PlaneNeeds needs(records);
  const std::vector<Rgb> weights{{1e-9f, 0, 0}, {1e-9f, 0, 0}};
  FoldedLight light;
  light.weights = weights;
  needs.update(light, {}, 1);
  CHECK(bytes(needs.planes()) == Bytes{1, 0});
  light.prediction_plane = 1;
  needs.update(light, {}, 1);
  CHECK(bytes(needs.planes()) == Bytes{1, 1});
}

}  // namespace relit::player
