// SPDX-License-Identifier: MIT
#include "decoders/codec_private.hpp"
#include "tests/allocations/counter.hpp"
#include "tests/test.hpp"

using namespace relit;

TEST_CASE("checking a packet takes no memory, however many units it has") {
  std::vector<std::uint8_t> obus, units;
  for (int i = 0; i < 1000; ++i) {
    obus.insert(obus.end(), {0x32, 0});             // a frame OBU of no bytes
    units.insert(units.end(), {0, 0, 0, 1, 0x65});  // a slice of its header alone
  }
  test::count_allocations();
  const bool av1 = decoders::check_packet("av1", obus).has_value();
  const bool h264 = decoders::check_packet("h264", units).has_value();
  const std::uint64_t allocations = test::counted_allocations();
  CHECK(av1);
  CHECK(h264);
  CHECK(allocations == 0);
}
