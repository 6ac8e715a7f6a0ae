// SPDX-License-Identifier: MIT
#include "player/command.hpp"

extern "C" {
#include <libavutil/log.h>
}

using namespace relit::player;

int main(int argc, char** argv) {
  CommandLine line("Plays relightable animation.", "relit", "relit " RELIT_VERSION);
  line.footer(
      "Exit status: 0 success, 1 the input is bad, 2 usage or environment, 3 finished with "
      "something lost.");
  add_info(line);
  add_plan(line);
  add_dump(line);
  add_light(line);
  add_render(line);
  add_play(line);
  add_stream(line);
  add_validate(line);
  add_recover(line);
  add_remux(line);
  add_concat(line);
  add_export(line);
  add_import(line);
  add_measure(line);
  // The libraries' own messages say nothing that an error of ours does not.
  av_log_set_level(AV_LOG_QUIET);
  return line.run(argc, argv);
}
