// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include "container/byte_source.hpp"
#include "player/clip_reader.hpp"
#include "tests/fuzz/fuzz.hpp"

/// Playing a hostile file: shared by the fuzzers that do it with and without memory.
namespace relit::fuzz {

struct Playing {
  bool planes = true;
  bool backwards = false;
  bool ticks = false;  ///< frames by their ticks
  int layers = -1;
};

/// Whether the pictures of the file are small and few enough to be decoded thousands of times a
/// minute. True for files that cannot be opened.
bool quick_to_play(Input file);

/// Opens the file and decodes planes and poses of its frames; checks sizes and numbers. Returns the
/// first error.
Status play(Input file, const Playing& how);

}  // namespace relit::fuzz
