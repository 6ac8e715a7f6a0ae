// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

/// Counts what operator new gives out, on all threads. libavcodec, zstd and GL drivers allocate
/// with malloc, which does not count.
namespace relit::test {

void count_allocations();
/// Stops, and returns how many there were since count_allocations().
std::uint64_t counted_allocations();

}  // namespace relit::test
