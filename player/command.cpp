// SPDX-License-Identifier: MIT
#include "player/command.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <numbers>

#include "decoders/sh_constants.hpp"

namespace relit::player {

int report(const Error& error) {
  std::fprintf(stderr, "relit: %s\n", error.message.c_str());
  switch (error.code) {
    case ErrorCode::kInvalid:
    case ErrorCode::kEnvironment:
    case ErrorCode::kOutOfMemory:
    case ErrorCode::kNotFound:
      return kUsage;
    default:
      return kBadInput;
  }
}

int report_in(const std::string& file, const Error& error) {
  return report({error.code, file + ": " + error.message});
}

void warn(const std::string& sentence) {
  std::fprintf(stderr, "relit: warning: %s\n", sentence.c_str());
}

void add_source_options(Options command, SourceArguments& arguments, const std::string& help) {
  command.add("source", arguments.name, help).required();
  command
      .add("--http-header", arguments.http_headers,
           "\"Name: value\", sent with every request of http(s); repeatable")
      .expected(1, 1);
}

Result<std::unique_ptr<container::ByteSource>> open_source(const SourceArguments& arguments,
                                                           bool sparing) {
  SourceOptions options;
  options.http_headers = arguments.http_headers;
  options.sparing = sparing;
  options.warn = &warn;
  return open_source(arguments.name, options);
}

Result<ClipReader> open_clip(const SourceArguments& arguments, const ClipOptions& options) {
  RELIT_ASSIGN(auto bytes, open_source(arguments, options.spares_bytes()));
  return ClipReader::open(std::move(bytes), source_name(arguments.name), options);
}

int report_loss(const PlaybackLoss& loss) {
  if (!loss.any()) return kSuccess;
  std::fprintf(
      stderr,
      "relit: damaged: %llu records dropped, %llu segments missing, %llu frames show older "
      "light; first: %s\n",
      static_cast<unsigned long long>(loss.records), static_cast<unsigned long long>(loss.segments),
      static_cast<unsigned long long>(loss.frames), loss.first.c_str());
  return kWithLosses;
}

void add_light_options(Options command, LightArguments& arguments) {
  command.add("--rotate-light", arguments.rotate_deg, "turn the light about +Y, degrees added to φ")
      .shows_default();
  command.flag("--light-window", arguments.window, "window the bands against ringing");
}

Result<LoadedLight> load_light(const LightArguments& arguments, int order) {
  LightOptions options;
  options.order = order;
  options.rotate_rad = arguments.rotate_deg * std::numbers::pi / 180;
  options.window = arguments.window;
  RELIT_ASSIGN(LoadedLight light, load_light(arguments.path, options));
  for (const std::string& warning : light.warnings) warn(warning);
  const double least =
      *std::min_element(light.minimum_radiance.begin(), light.minimum_radiance.end());
  const double mean = light.light.sh.front()[1] * decoders::kBand0;
  if (least < -1e-6 * std::max(mean, 1e-30) && !arguments.window) {
    std::fprintf(stderr,
                 "relit: warning: %s: rings down to a radiance of %.3g (mean %.3g): an order-%d "
                 "light cannot follow it; "
                 "--light-window smooths it\n",
                 arguments.path.c_str(), least, mean, light.light.order());
  }
  return light;
}

void add_look_options(Options command, LookOptions& look, std::string& camera) {
  command.add("--camera", camera, "orbit:AZIMUTH,ELEVATION[,DISTANCE], degrees and metres");
  command.add("--exposure", look.exposure, "auto, or stops: radiance × 2^stops").shows_default();
  command.add("--tone-map", look.tone_map, "neutral, filmic or linear").shows_default();
  command.add("--background", look.background, "light, sh, none (transparent) or #rrggbb")
      .shows_default();
  command
      .add("--background-blur", look.background_blur_deg, "soft focus of the background, degrees")
      .range(0.0, 90.0);
}

Result<FrameRange> parse_frames(const std::string& text, const char* option, std::uint64_t count) {
  FrameRange range;
  const char* end = text.data() + text.size();
  auto [at, error] = std::from_chars(text.data(), end, range.first);
  range.last = range.first;
  if (error == std::errc() && at != end && *at == '-') {
    const auto second = std::from_chars(at + 1, end, range.last);
    at = second.ptr, error = second.ec;
    range.single = false;
  }
  if (error != std::errc() || at != end || range.last < range.first) {
    return fail(ErrorCode::kInvalid, std::string(option) + " " + text + ": the form is 7 or 0-99");
  }
  if (range.last >= count) {
    return fail(ErrorCode::kNotFound, std::string(option) + " " + text + ": the clip has " +
                                          std::to_string(count) + " frames, 0 to " +
                                          std::to_string(count - 1));
  }
  return range;
}

}  // namespace relit::player
