// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "decoders/sh.hpp"
#include "player/light_field.hpp"
#include "player/light_file.hpp"
#include "tests/fuzz/fuzz.hpp"

/// Hostile lights: the first byte says whether the rest is an .hdr, an .exr or a .json. What is
/// accepted has the pixels it should; a .json is finite everywhere and always, and is read again
/// from what is written of it.
namespace {

using namespace relit;
using namespace relit::fuzz;

/// A light may be refused for its values too.
template <class R>
bool check_light(const Result<R>& result) {
  if (!result && result.error().code == ErrorCode::kInvalid) {
    require(!result.error().message.empty());
    return false;
  }
  return check(result);
}

void check_environment(const Result<decoders::Environment>& picture) {
  if (!check_light(picture)) return;
  require(picture->width > 0 && picture->height > 0);
  const std::size_t pixels =
      static_cast<std::size_t>(picture->width) * static_cast<std::size_t>(picture->height);
  require(picture->rgb.size() == 3 * pixels);
  constexpr std::size_t kMostPixels = 1 << 14;
  if (pixels > kMostPixels) return;
  const auto light = decoders::project_environment(*picture, 3);
  if (!check_light(light)) return;
  require(light->sh.size() == 16);
  for (const auto& row : light->sh)
    for (const double value : row) require(std::isfinite(value));
}

void check_json(Input bytes) {
  const auto field = player::read_light_field(bytes);
  if (!check_light(field)) return;
  require(field->order() >= 0 && field->order() <= 3);
  require(field->parts().lights.size() <= player::LightField::kMostLights);
  decoders::Light light;
  for (const double time_s : {0.0, -1.0, 0.3, 1e30, std::nan("")}) {
    for (const float place : {0.0f, 0.7f, -1e30f, std::nanf("")}) {
      field->sample(time_s, {place, 1, place}, light);
      require(light.order() == field->order());
      for (const auto& row : light.sh)
        for (const double value : row) require(std::isfinite(value));
    }
  }
  const std::string text = player::light_field_json(*field);
  const auto again =
      player::read_light_field({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  require(again.has_value() && player::light_field_json(*again) == text);
  require(again->parts().times_s == field->parts().times_s);
  require(again->parts().grid == field->parts().grid);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Cursor input({data, size});
  const unsigned format = input.u8();
  const Input bytes = input.rest();
  std::vector<std::string> warnings;
  switch (format) {
    case 'h':
      check_environment(player::read_hdr(bytes));
      break;
    case 'e':
      check_environment(player::read_exr(bytes, warnings));
      break;
    case 'j':
      check_json(bytes);
      break;
    default:
      break;
  }
  return 0;
}
