// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace relit::bake {

/// The number of threads that `requested` means: itself, or one per processor for 0.
[[nodiscard]] inline int thread_count(int requested) {
  if (requested > 0) return requested;
  return static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

/// Calls function(i) for 0 <= i < count on up to `threads` threads, the caller's among them. Which
/// thread takes which i is left open: the results may depend on i alone.
template <class Function>
void parallel_for(int threads, std::size_t count, const Function& function) {
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < count; i = next++) function(i);
  };
  std::vector<std::thread> helpers;
  const std::size_t extra =
      std::min<std::size_t>(static_cast<std::size_t>(std::max(threads, 1)), count);
  for (std::size_t t = 1; t < extra; ++t) helpers.emplace_back(work);
  work();
  for (std::thread& helper : helpers) helper.join();
}

}  // namespace relit::bake
