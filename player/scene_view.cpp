// SPDX-License-Identifier: MIT
#include "player/scene_view.hpp"

#include <charconv>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "decoders/sh_constants.hpp"

namespace relit::player {
namespace {

double luminance(const std::array<double, 3>& rgb) {
  return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

// The exposure under which a white surface in the mean of the light comes out a little below white.
float auto_exposure(const decoders::Light& light) {
  const double mean = luminance(light.sh.front()) * decoders::kBand0;
  return mean > 0 ? static_cast<float>(0.8 / mean) : 1.0f;
}

// The area that the box from `low` to `high` takes in the picture, as a rectangle.
double covered_pixels(const gles::View& view, const std::array<float, 3>& low,
                      const std::array<float, 3>& high) {
  glm::vec2 least(1e9f), most(-1e9f);
  for (unsigned corner = 0; corner < 8; ++corner) {
    const glm::vec4 at((corner & 1u) != 0 ? high[0] : low[0], (corner & 2u) != 0 ? high[1] : low[1],
                       (corner & 4u) != 0 ? high[2] : low[2], 1);
    const glm::vec4 clip = view.projection * view.view * at;
    if (!(clip.w > 0)) return static_cast<double>(view.width) * view.height;
    least = glm::min(least, glm::vec2(clip) / clip.w);
    most = glm::max(most, glm::vec2(clip) / clip.w);
  }
  const glm::vec2 seen = glm::clamp(most, -1.0f, 1.0f) - glm::clamp(least, -1.0f, 1.0f);
  return 0.25 * static_cast<double>(seen.x) * static_cast<double>(seen.y) * view.width *
         view.height;
}

bool is_color(const std::string& text) {
  return text.size() == 7 && text[0] == '#' &&
         text.find_first_not_of("0123456789abcdefABCDEF", 1) == std::string::npos;
}

}  // namespace

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

std::vector<std::uint8_t> decoded_layers(const ClipReader& clip, int layers) {
  std::vector<std::uint8_t> decoded(clip.layers().size(), 1);
  for (std::size_t l = 0; l < decoded.size(); ++l) {
    if (layers >= 0 && l >= static_cast<std::size_t>(layers)) decoded[l] = 0;
  }
  return decoded;
}

Result<std::unique_ptr<SceneView>> SceneView::create(const ClipReader& clip,
                                                     const gles::Device& device,
                                                     const ViewOptions& options) {
  std::unique_ptr<SceneView> scene(new SceneView(clip, options));
  const std::string& background = options.background;
  if (background != "light" && background != "sh" && background != "none" &&
      !is_color(background)) {
    return fail(
        ErrorCode::kInvalid,
        "--background " + background + ": it must be light, sh, none or a colour such as #202428");
  }
  RELIT_ASSIGN(scene->view_.tone_map, parse_tone_map(options.tone_map));
  RELIT_ASSIGN(scene->relighter_,
               Relighter::create(clip.model(), clip.layers(), {&device, options.composite}));
  RELIT_ASSIGN(scene->character_, Character::create(clip.contents(), clip.meshes(), device));
  return scene;
}

Status SceneView::fold(const decoders::Light& light) {
  return relighter_->set_light(light, decoded_layers(clip_, options_.layers));
}

Status SceneView::set_light(const LoadedLight& light) {
  RELIT_ASSIGN(const std::optional<double> stops, parse_exposure(options_.exposure));
  view_.exposure = stops ? static_cast<float>(std::exp2(*stops)) : auto_exposure(light.light);
  relighter_->set_exposure(view_.exposure);
  RELIT_TRY(fold(light.light));
  return set_background(light);
}

Status SceneView::vary_light(const decoders::Light& light) {
  RELIT_TRY(fold(light));
  if (options_.background != "light" && options_.background != "sh") return {};
  LoadedLight seen;
  seen.light = light;
  return set_background(seen);
}

Status SceneView::set_background(const LoadedLight& light) {
  gles::Background background;
  std::vector<std::array<float, 3>> harmonics;
  gles::BackgroundRenderer& renderer = character_->renderer().background();
  renderer.set_rotation(0);
  const std::string& kind = options_.background;
  if (kind == "light" && light.environment) {
    background.kind = gles::Background::Kind::kEnvironment;
    background.environment = {light.environment->width, light.environment->height,
                              light.environment->rgb};
    background.blur_rad = static_cast<float>(glm::radians(options_.background_blur_deg));
    background.max_side = 512;
    renderer.set_rotation(static_cast<float>(light.environment_rotation_rad));
  } else if (kind == "light" || kind == "sh") {
    background.kind = gles::Background::Kind::kHarmonics;
    for (const auto& row : light.light.sh) {
      harmonics.push_back(
          {static_cast<float>(row[0]), static_cast<float>(row[1]), static_cast<float>(row[2])});
    }
    background.harmonics = harmonics;
  } else if (is_color(kind)) {
    background.kind = gles::Background::Kind::kColor;
    for (std::size_t c = 0; c < 3; ++c) {
      background.top[c] =
          static_cast<float>(std::stoi(kind.substr(1 + 2 * c, 2), nullptr, 16)) / 255.0f;
    }
  }
  return renderer.set(background);
}

Status SceneView::set_frame(const ClipFrame& frame) {
  frame_ = &frame;
  RELIT_TRY(relighter_->composite({&frame.planes}));
  return character_->pose(frame.pose);
}

Status SceneView::draw(const OrbitCamera& camera, int width, int height) {
  const auto& low = clip_.clip().bounds_min;
  const auto& high = clip_.clip().bounds_max;
  const double aspect = static_cast<double>(width) / height;
  const CameraMatrices matrices =
      camera_matrices(camera, {low[0], low[1], low[2]}, {high[0], high[1], high[2]}, aspect);
  view_.view = matrices.view, view_.projection = matrices.projection;
  view_.width = width, view_.height = height;
  gles::CharacterRenderer& renderer = character_->renderer();
  const double covered = covered_pixels(view_, low, high);
  if (frame_ != nullptr && relighter_->wants_measuring(covered)) {
    for (bool chosen = false; !chosen;) {
      RELIT_ASSIGN(chosen, relighter_->measure({&frame_->planes}, renderer, view_));
    }
  }
  return relighter_->draw(renderer, view_);
}

}  // namespace relit::player
