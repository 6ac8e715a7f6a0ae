// SPDX-License-Identifier: MIT
// Counts what operator new gives out, on all threads. libavcodec and zstd allocate with malloc,
// which does not count.
#include "player/prefetcher.hpp"

#include <atomic>
#include <cstdlib>
#include <new>

#include "tests/player/prefetch_clip.hpp"

namespace {

std::atomic<bool> counting{false};
std::atomic<std::uint64_t> allocations{0};

void* allocate(std::size_t bytes, std::size_t alignment) {
  if (counting) ++allocations;
  const std::size_t rounded = (std::max<std::size_t>(bytes, 1) + alignment - 1) & ~(alignment - 1);
  return alignment <= alignof(std::max_align_t) ? std::malloc(rounded)
                                                : std::aligned_alloc(alignment, rounded);
}

void* must_allocate(std::size_t bytes, std::size_t alignment) {
  void* memory = allocate(bytes, alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t n) { return must_allocate(n, alignof(std::max_align_t)); }
void* operator new(std::size_t n, std::align_val_t a) {
  return must_allocate(n, static_cast<std::size_t>(a));
}
void* operator new(std::size_t n, const std::nothrow_t&) noexcept {
  return allocate(n, alignof(std::max_align_t));
}
void* operator new(std::size_t n, std::align_val_t a, const std::nothrow_t&) noexcept {
  return allocate(n, static_cast<std::size_t>(a));
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;

namespace {

/// Plays laps and returns how many allocations there were in the last of them.
std::uint64_t allocations_of_a_lap(Prefetcher& clip, int laps) {
  const std::uint64_t count = clip.clip().frame_count;
  std::uint64_t frames = 0;
  for (int lap = 0; lap < laps; ++lap) {
    if (lap + 1 == laps) {
      allocations = 0;
      counting = true;
    }
    for (std::uint64_t k = 0; k < count; ++k) {
      clip.want(k);
      const auto came = clip.wait(k, kPatience_s);
      if (came && *came && clip.frame(k) != nullptr) ++frames;
    }
  }
  counting = false;
  CHECK(frames == count * static_cast<std::uint64_t>(laps));
  return allocations;
}

}  // namespace

TEST_CASE("the counter counts") {
  counting = true;
  auto something = std::make_unique<int>(1);
  counting = false;
  CHECK(allocations > 0);
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
