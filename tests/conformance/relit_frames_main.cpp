// SPDX-License-Identifier: MIT
// relit-frames FILE: the decoded frames of a file as JSON, for tests/conformance/run.py.
#include <cstdio>

#include "tests/conformance/frames.hpp"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: relit-frames FILE\n");
    return 2;
  }
  auto source = relit::container::FileSource::open(argv[1]);
  if (!source) {
    std::fprintf(stderr, "relit-frames: %s\n", source.error().message.c_str());
    return 1;
  }
  const auto frames = relit::conformance::decode_frames(std::move(*source));
  if (!frames) {
    std::fprintf(stderr, "relit-frames: %s: %s\n", argv[1], frames.error().message.c_str());
    return 1;
  }
  std::printf("%s\n", frames->dump().c_str());
  return 0;
}
