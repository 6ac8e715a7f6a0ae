// SPDX-License-Identifier: MIT
#include <cstdint>
#include <string>
#include <vector>

#include "decoders/sh.hpp"
#include "player/light.hpp"
#include "player/light_file.hpp"
#include "tests/fuzz/fuzz.hpp"

/// Hostile lights: the first byte says whether the rest is an .hdr, an .exr or a .json. What is
/// accepted has the pixels it should, and a .json is read again from what is written of it.
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
  const auto light = player::read_light_json(bytes);
  if (!check_light(light)) return;
  require(light->order() >= 0 && light->order() <= 3);
  const auto text = player::light_json(*light);
  require(text.has_value());
  const auto again =
      player::read_light_json({reinterpret_cast<const std::uint8_t*>(text->data()), text->size()});
  require(again.has_value() && again->sh == light->sh);
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
