// SPDX-License-Identifier: MIT
#include <cstdio>

#include "player/command.hpp"
#include "player/remux.hpp"

namespace relit::player {
namespace {

struct Arguments {
  std::string source, output, frames;
  RemuxOptions options;
  std::size_t layers = 0;
  double from = 0, to = 0;
  bool has_layers = false, has_from = false, has_to = false, no_copies = false;
};

Result<RemuxOptions> options_of(const Arguments& arguments) {
  RemuxOptions options = arguments.options;
  options.copies = !arguments.no_copies;
  if (arguments.has_layers) options.layers = arguments.layers;
  if (!arguments.frames.empty()) {
    RELIT_ASSIGN(const FrameRange range, parse_frames(arguments.frames, "--frames", UINT64_MAX));
    options.frames = RemuxOptions::Frames{range.first, range.last};
  }
  if (arguments.has_from || arguments.has_to) {
    options.seconds = RemuxOptions::Seconds{arguments.from, std::nullopt};
    if (arguments.has_to) options.seconds->to = arguments.to;
    if (arguments.has_to && arguments.to <= arguments.from)
      return fail(ErrorCode::kInvalid, "remux: --to must lie behind --from");
  }
  return options;
}

Result<RemuxReport> remux_file(const Arguments& arguments) {
  RELIT_ASSIGN(const RemuxOptions options, options_of(arguments));
  RELIT_ASSIGN(RewriteSource source, open_rewrite(arguments.source));
  RELIT_ASSIGN(const auto sink, container::FileSink::create(arguments.output));
  auto done = remux(source, *sink, options);
  if (!done) return done;
  RELIT_TRY(sink->commit());
  return done;
}

int run(const Arguments& arguments) {
  const auto done = remux_file(arguments);
  if (!done) return report(done.error());
  if (done->kept_frames)
    std::fprintf(stderr, "relit: kept frames %llu to %llu, from segment border to segment border\n",
                 static_cast<unsigned long long>(done->kept_frames->first),
                 static_cast<unsigned long long>(done->kept_frames->last));
  return kSuccess;
}

}  // namespace

Command add_remux(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("remux", "write parts of a file as a file of their own, as they are");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("source", arguments->source, "path, - or http(s)://")->required();
  command->add_option("output", arguments->output, "the new file")->required();
  command
      ->add_option("--clip", arguments->options.clips,
                   "keep this clip, by name or number; may be repeated")
      ->allow_extra_args(false);
  auto* layers =
      command->add_option("--layers", arguments->layers, "keep the first so many of each model");
  command->add_option("--tracks", arguments->options.tracks, "keep these tracks: 1,2,5")
      ->delimiter(',')
      ->allow_extra_args(false);
  auto* frames = command->add_option("--frames", arguments->frames, "A-B: keep these frames");
  auto* from = command->add_option("--from", arguments->from, "keep what is shown from then on, s")
                   ->check(CLI::NonNegativeNumber)
                   ->excludes(frames);
  auto* to = command->add_option("--to", arguments->to, "keep what is shown before, s")
                 ->check(CLI::NonNegativeNumber)
                 ->excludes(frames);
  command->add_flag("--no-copies", arguments->no_copies,
                    "do not store the static records a second time");
  command->footer(
      "Ranges reach out to segment borders, and start anew with frame 0. Nothing is encoded "
      "again.\n"
      "Example:\n  relit remux man.relit preview.relit --layers 1 --from 0.5 --to 1");
  return [arguments, layers, from, to] {
    arguments->has_layers = layers->count() > 0;
    arguments->has_from = from->count() > 0;
    arguments->has_to = to->count() > 0;
    return run(*arguments);
  };
}

}  // namespace relit::player
