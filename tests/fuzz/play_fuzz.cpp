// SPDX-License-Identifier: MIT
#include <cstdint>

#include "tests/fuzz/file_mutator.hpp"
#include "tests/fuzz/playing.hpp"

/// Hostile files, played: the first byte says how, the rest is the file.

using namespace relit;
using namespace relit::fuzz;

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  return mutate_file(data, size, max_size, seed, 1);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Cursor input({data, size});
  const unsigned how = input.u8();
  const Input file = input.rest();
  if (!quick_to_play(file)) return 0;
  Playing playing;
  playing.planes = (how & 1) == 0;
  playing.backwards = (how & 2) != 0;
  playing.ticks = (how & 4) != 0;
  playing.layers = (how & 8) != 0 ? 1 : -1;
  const Status status = play(file, playing);
  // A file may lack what is asked of it.
  if (!status && status.error().code != ErrorCode::kNotFound) check(status);
  return 0;
}
