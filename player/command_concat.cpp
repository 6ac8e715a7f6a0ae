// SPDX-License-Identifier: MIT
#include <algorithm>

#include "player/command.hpp"
#include "player/concat.hpp"
#include "player/source.hpp"

namespace relit::player {
namespace {

struct ConcatArguments {
  std::vector<std::string> sources;
  std::string output;
};

Status join(const ConcatArguments& arguments) {
  if (std::ranges::count(arguments.sources, "-") > 1)
    return fail(ErrorCode::kInvalid, "concat: standard input can be read only once");
  std::vector<RewriteSource> sources;
  for (const std::string& name : arguments.sources) {
    RELIT_ASSIGN(RewriteSource source, open_rewrite(name));
    sources.push_back(std::move(source));
  }
  RELIT_ASSIGN(const auto sink, container::FileSink::create(arguments.output));
  RELIT_TRY(concat(sources, *sink));
  return sink->commit();
}

int run_concat(const ConcatArguments& arguments) {
  const Status joined = join(arguments);
  return joined ? kSuccess : report(joined.error());
}

}  // namespace

void add_concat(CommandLine& line) {
  Options command =
      line.add("concat", "join files of one character into one file with all their clips");
  const auto arguments = std::make_shared<ConcatArguments>();
  command.add("sources", arguments->sources, "paths, - or http(s)://").required().expected(2, 1024);
  command.add("-o,--output", arguments->output, "the new file").required();
  command.footer(
      "Meshes, materials, images and skeleton must be the same; nothing is encoded again.\n"
      "Clips whose name is taken get \" 2\", \" 3\", ...\n"
      "Example:\n  relit concat walk.relit turn.relit walk.relit -o scene.relit");
  command.runs([arguments] { return run_concat(*arguments); });
}

}  // namespace relit::player
