// SPDX-License-Identifier: MIT
#include <cstdio>

#include "player/command.hpp"
#include "player/remux.hpp"

namespace relit::player {
namespace {

struct RemuxArguments {
  std::string source, output, frames;
  RemuxOptions options;
  std::size_t layers = 0;
  double from = 0, to = 0;
  bool has_layers = false, has_from = false, has_to = false, no_copies = false;
};

Result<RemuxOptions> options_of(const RemuxArguments& arguments) {
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

Result<RemuxReport> remux_file(const RemuxArguments& arguments) {
  RELIT_ASSIGN(const RemuxOptions options, options_of(arguments));
  RELIT_ASSIGN(RewriteSource source, open_rewrite(arguments.source));
  RELIT_ASSIGN(const auto sink, container::FileSink::create(arguments.output));
  auto done = remux(source, *sink, options);
  if (!done) return done;
  RELIT_TRY(sink->commit());
  return done;
}

int run_remux(const RemuxArguments& arguments) {
  const auto done = remux_file(arguments);
  if (!done) return report(done.error());
  if (done->kept_frames)
    std::fprintf(stderr, "relit: kept frames %llu to %llu, from segment border to segment border\n",
                 static_cast<unsigned long long>(done->kept_frames->first),
                 static_cast<unsigned long long>(done->kept_frames->last));
  return kSuccess;
}

}  // namespace

void add_remux(CommandLine& line) {
  Options command = line.add("remux", "write parts of a file as a file of their own, as they are");
  const auto arguments = std::make_shared<RemuxArguments>();
  command.add("source", arguments->source, "path, - or http(s)://").required();
  command.add("output", arguments->output, "the new file").required();
  command
      .add("--clip", arguments->options.clips, "keep this clip, by name or number; may be repeated")
      .one_each();
  Option layers =
      command.add("--layers", arguments->layers, "keep the first so many of each model");
  command.add("--tracks", arguments->options.tracks, "keep these tracks: 1,2,5")
      .delimiter(',')
      .one_each();
  Option frames = command.add("--frames", arguments->frames, "A-B: keep these frames");
  Option from = command.add("--from", arguments->from, "keep what is shown from then on, s")
                    .not_negative()
                    .excludes(frames);
  Option to = command.add("--to", arguments->to, "keep what is shown before, s")
                  .not_negative()
                  .excludes(frames);
  command.flag("--no-copies", arguments->no_copies,
               "do not store the static records a second time");
  command.footer(
      "Ranges reach out to segment borders, and start anew with frame 0. Nothing is encoded "
      "again.\n"
      "Example:\n  relit remux man.relit preview.relit --layers 1 --from 0.5 --to 1");
  command.runs([arguments, layers, from, to] {
    arguments->has_layers = layers.given();
    arguments->has_from = from.given();
    arguments->has_to = to.given();
    return run_remux(*arguments);
  });
}

}  // namespace relit::player
