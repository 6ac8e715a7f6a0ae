// SPDX-License-Identifier: MIT
// Compiled as strict C99 with every warning an error: relit.h needs nothing before it, every struct
// can be declared with its size, and the numbers that never change are what they were.
#include "player/relit.h"

typedef char
    relit_results_keep_their_numbers[RELIT_OK == 0 && RELIT_IO == 1 && RELIT_TRUNCATED == 2 &&
                                             RELIT_CORRUPT == 3 && RELIT_UNSUPPORTED == 4 &&
                                             RELIT_LIMIT == 5 && RELIT_INVALID == 6 &&
                                             RELIT_NOT_FOUND == 7 && RELIT_OUT_OF_MEMORY == 8 &&
                                             RELIT_ENVIRONMENT == 9 && RELIT_CANCELLED == 10
                                         ? 1
                                         : -1];
typedef char relit_paths_keep_their_numbers[RELIT_PATH_AUTO == 0 && RELIT_PATH_CPU == 1 &&
                                                    RELIT_PATH_TEXTURE == 2 && RELIT_PATH_FUSED == 3
                                                ? 1
                                                : -1];

relit_result relit_header_in_c(const char* path);
relit_result relit_header_in_c(const char* path) {
  relit_open_options options;
  relit_view view;
  relit_moment moment = {sizeof moment, 0, 0, 0, 0, 0, 0, 0, 0};
  relit_player* player = NULL;
  relit_result result = relit_open_options_default(&options, sizeof options);
  if (result == RELIT_OK) result = relit_view_default(&view, sizeof view);
  if (result == RELIT_OK) result = relit_open(path, &options, &player);
  if (result == RELIT_OK) result = relit_update(player, 0, &moment);
  if (result == RELIT_OK) result = relit_draw(player, &view);
  relit_close(player);
  return result;
}
