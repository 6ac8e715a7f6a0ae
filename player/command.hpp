// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "player/clip_reader.hpp"
#include "player/command_line.hpp"
#include "player/light.hpp"
#include "player/look.hpp"
#include "player/source.hpp"

/// What the commands of `relit` share. Messages go to standard error, data and JSON to standard
/// output.
namespace relit::player {

enum ExitStatus : int {
  kSuccess = 0,
  kBadInput = 1,    ///< the file, the light or the network
  kUsage = 2,       ///< the command line or the machine
  kWithLosses = 3,  ///< finished, but something was lost to damage
};

/// Prints the error and returns the exit status it means.
int report(const Error& error);
/// The same, with the name of the file it is about in front.
int report_in(const std::string& file, const Error& error);

/// To standard error.
void warn(const std::string& sentence);

/// SRC and --http-header.
struct SourceArguments {
  std::string name;
  std::vector<std::string> http_headers;
};
/// `help` describes SRC.
void add_source_options(Options command, SourceArguments& arguments, const std::string& help);
/// Opens SRC as the user named it; warnings go to standard error.
[[nodiscard]] Result<std::unique_ptr<container::ByteSource>> open_source(
    const SourceArguments& arguments, bool sparing);
[[nodiscard]] Result<ClipReader> open_clip(const SourceArguments& arguments,
                                           const ClipOptions& options);

/// Says what was lost, if anything, and returns kSuccess or kWithLosses.
int report_loss(const PlaybackLoss& loss);

/// --light, --rotate-light and --light-window.
struct LightArguments {
  std::string path;
  double rotate_deg = 0;
  bool window = false;
};
void add_light_options(Options command, LightArguments& arguments);
/// Loads the light and warns of negative radiance.
[[nodiscard]] Result<LoadedLight> load_light(const LightArguments& arguments, int order);

/// --camera, --exposure, --tone-map, --background and --background-blur.
void add_look_options(Options command, LookOptions& look, std::string& camera);

/// "7", "0-99": frames first..last of a clip of `count` frames.
struct FrameRange {
  std::uint64_t first = 0, last = 0;
  bool single = true;
};
[[nodiscard]] Result<FrameRange> parse_frames(const std::string& text, const char* option,
                                              std::uint64_t count);

/// Each adds its command to the command line.
void add_info(CommandLine& line);
void add_plan(CommandLine& line);
void add_dump(CommandLine& line);
void add_light(CommandLine& line);
void add_render(CommandLine& line);
void add_play(CommandLine& line);
void add_stream(CommandLine& line);
void add_validate(CommandLine& line);
void add_recover(CommandLine& line);
void add_remux(CommandLine& line);
void add_concat(CommandLine& line);
void add_export(CommandLine& line);
void add_import(CommandLine& line);
void add_measure(CommandLine& line);

}  // namespace relit::player
