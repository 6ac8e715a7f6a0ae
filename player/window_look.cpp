// SPDX-License-Identifier: MIT
#include "player/window_look.hpp"

#include <charconv>
#include <glm/glm.hpp>

namespace relit::player {
namespace {

Result<Backdrop> parse_background(const std::string& text) {
  Backdrop backdrop;
  if (text == "light") {
    backdrop.kind = Backdrop::Kind::kLight;
  } else if (text == "sh") {
    backdrop.kind = Backdrop::Kind::kHarmonics;
  } else if (text == "none") {
    backdrop.kind = Backdrop::Kind::kTransparent;
  } else if (text.size() == 7 && text[0] == '#') {
    backdrop.kind = Backdrop::Kind::kColor;
    unsigned rgb = 0;
    const char* end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data() + 1, end, rgb, 16);
    if (error == std::errc() && rest == end) {
      for (unsigned c = 0; c < 3; ++c)
        backdrop.color[c] = static_cast<float>((rgb >> (16 - 8 * c)) & 0xFFu) / 255.0f;
      return backdrop;
    }
    return fail(ErrorCode::kInvalid, "--background " + text + ": #rrggbb takes six hex digits");
  } else {
    return fail(ErrorCode::kInvalid, "--background " + text +
                                         ": it must be light, sh, none or a colour such as "
                                         "#202428");
  }
  return backdrop;
}

}  // namespace

Result<WindowLook> parse_look(const ViewOptions& options) {
  WindowLook look;
  RELIT_ASSIGN(look.exposure_stops, parse_exposure(options.exposure));
  RELIT_ASSIGN(look.backdrop, parse_background(options.background));
  look.backdrop.blur_rad = static_cast<float>(glm::radians(options.background_blur_deg));
  RELIT_ASSIGN(look.tone_map, parse_tone_map(options.tone_map));
  return look;
}

}  // namespace relit::player
