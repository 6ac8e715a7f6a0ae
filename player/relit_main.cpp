// SPDX-License-Identifier: MIT
#include <array>
#include <iostream>

#include "player/command.hpp"

extern "C" {
#include <libavutil/log.h>
}

using namespace relit::player;

int main(int argc, char** argv) {
  CLI::App app("Plays relightable animation.", "relit");
  app.set_version_flag("--version", "relit " RELIT_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Exit status: 0 success, 1 the input is bad, 2 usage or environment, 3 finished with "
      "something lost.");
  struct Entry {
    const char* name;
    Command run;
  };
  const std::array<Entry, 13> commands{{{"info", add_info(app)},
                                        {"plan", add_plan(app)},
                                        {"dump", add_dump(app)},
                                        {"light", add_light(app)},
                                        {"render", add_render(app)},
                                        {"play", add_play(app)},
                                        {"stream", add_stream(app)},
                                        {"validate", add_validate(app)},
                                        {"recover", add_recover(app)},
                                        {"remux", add_remux(app)},
                                        {"concat", add_concat(app)},
                                        {"export", add_export(app)},
                                        {"import", add_import(app)}}};
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error, std::cout, std::cerr) == 0 ? kSuccess : kUsage;
  }
  // The libraries' own messages say nothing that an error of ours does not.
  av_log_set_level(AV_LOG_QUIET);
  for (const Entry& entry : commands) {
    if (app.got_subcommand(entry.name)) return entry.run();
  }
  return kUsage;
}
