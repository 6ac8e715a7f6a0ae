// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdint>

#include "container/record_codec.hpp"
#include "tests/fuzz/fuzz.hpp"

/// Hostile payloads of records. The first byte says which record, the rest are the bytes. What is
/// accepted must be valid and be written back as it was.
namespace {

using namespace relit;
using namespace relit::container;
using namespace relit::fuzz;

template <class R>
void round_trip(const Result<R>& parsed, Input input) {
  if (!check(parsed)) return;
  require(std::ranges::equal(serialize(*parsed), input));
  require(validate(*parsed).has_value());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const Input input(data + 1, size - 1);
  switch (data[0]) {
    case 'h':
      round_trip(parse_header(input), input);
      break;
    case 'c':
      round_trip(parse_clip(input), input);
      break;
    case 'i':
      round_trip(parse_image(input), input);
      break;
    case 'm':
      round_trip(parse_material(input), input);
      break;
    case 'g':
      round_trip(parse_mesh(input), input);
      break;
    case 's':
      round_trip(parse_skeleton(input), input);
      break;
    case 'p':
      round_trip(parse_pose_track(input), input);
      break;
    case 'a':
      round_trip(parse_model(input), input);
      break;
    case 'l':
      round_trip(parse_layer(input), input);
      break;
    case 'S':
      round_trip(parse_segment(input), input);
      break;
    case 'C':
      round_trip(parse_chunk(input), input);
      break;
    case 'I':
      round_trip(parse_index(input), input);
      break;
    case 'E':
      round_trip(parse_end(input), input);
      break;
    default:
      break;
  }
  return 0;
}
