// SPDX-License-Identifier: MIT
#include "player/prefetcher.hpp"

#include "tests/allocations/counter.hpp"
#include "tests/player/prefetch_clip.hpp"

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;

namespace {

/// Plays laps and returns how many allocations there were in the last of them.
std::uint64_t allocations_of_a_lap(Prefetcher& clip, int laps) {
  const std::uint64_t count = clip.clip().frame_count;
  std::uint64_t frames = 0;
  for (int lap = 0; lap < laps; ++lap) {
    if (lap + 1 == laps) relit::test::count_allocations();
    for (std::uint64_t k = 0; k < count; ++k) {
      clip.want(k);
      const auto came = clip.wait(k, kPatience_s);
      if (came && *came && clip.frame(k) != nullptr) ++frames;
    }
  }
  const std::uint64_t allocations = relit::test::counted_allocations();
  CHECK(frames == count * static_cast<std::uint64_t>(laps));
  return allocations;
}

}  // namespace

TEST_CASE("the counter counts") {
  relit::test::count_allocations();
  auto something = std::make_unique<int>(1);
  CHECK(relit::test::counted_allocations() > 0);
  CHECK(something != nullptr);
}

TEST_CASE("in the steady state a prefetcher allocates nothing, on any thread") {
  const auto file = read_bytes(shipped_clip());
  for (const int threads : {1, 2}) {
    PrefetchOptions options;
    options.loop = true;
    options.impatient = false;
    options.ring_bytes = std::size_t{1} << 20;
    options.packet_bytes = std::size_t{1} << 18;
    auto clip = prefetch(memory_source(file), options, threads);
    // Buffers grow to what the largest segment needs while they change hands.
    std::uint64_t least = allocations_of_a_lap(*clip, 8);
    for (int tries = 0; least > 0 && tries < 12; ++tries) {
      least = std::min(least, allocations_of_a_lap(*clip, 2));
    }
    CHECK(least == 0);
  }
}
