// SPDX-License-Identifier: MIT
#include "player/look.hpp"

#include <charconv>
#include <cmath>
#include <glm/glm.hpp>

namespace relit::player {
namespace {

Result<std::optional<double>> parse_exposure(const std::string& text) {
  if (text == "auto") return std::optional<double>();
  double stops = 0;
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, stops);
  if (error == std::errc() && rest == end && std::abs(stops) <= 60)
    return std::optional<double>(stops);
  return fail(
      ErrorCode::kInvalid,
      "--exposure " + text + ": it must be auto, or stops such as -1.5 (radiance × 2^stops)");
}

Result<gles::ToneMap> parse_tone_map(const std::string& text) {
  if (text == "linear") return gles::ToneMap::kLinear;
  if (text == "filmic") return gles::ToneMap::kFilmic;
  if (text == "neutral") return gles::ToneMap::kNeutral;
  return fail(ErrorCode::kInvalid, "--tone-map " + text + ": it must be neutral, filmic or linear");
}

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

Result<Look> parse_look(const LookOptions& options) {
  Look look;
  RELIT_ASSIGN(look.exposure_stops, parse_exposure(options.exposure));
  RELIT_ASSIGN(look.backdrop, parse_background(options.background));
  look.backdrop.blur_rad = static_cast<float>(glm::radians(options.background_blur_deg));
  RELIT_ASSIGN(look.tone_map, parse_tone_map(options.tone_map));
  return look;
}

gles::View look_at(const Player& player, const Look& look, const OrbitCamera& camera,
                   const ViewSize& size) {
  const container::ClipRecord& clip = player.contents().clips[player.moment().clip];
  const auto& low = clip.bounds_min;
  const auto& high = clip.bounds_max;
  const CameraMatrices matrices =
      camera_matrices(camera, {low[0], low[1], low[2]}, {high[0], high[1], high[2]}, size.aspect());
  gles::View view;
  view.view = matrices.view, view.projection = matrices.projection;
  view.width = size.width, view.height = size.height;
  view.tone_map = look.tone_map;
  view.exposure = look.exposure_stops ? static_cast<float>(std::exp2(*look.exposure_stops))
                                      : player.auto_exposure();
  return view;
}

}  // namespace relit::player
