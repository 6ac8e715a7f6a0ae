// SPDX-License-Identifier: MIT
#pragma once

#include <dirent.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

// Sanitizers have an allocator of their own, which mallinfo2() does not see.
extern "C" std::size_t __sanitizer_get_current_allocated_bytes() __attribute__((weak));

namespace relit::soak {

inline bool sanitized() { return __sanitizer_get_current_allocated_bytes != nullptr; }

/// What the process holds at a moment.
struct Holding {
  double heap_bytes = 0, resident_bytes = 0;
  int threads = 0, descriptors = 0;
};

inline int entries_of(const char* folder) {
  DIR* directory = opendir(folder);
  int count = 0;
  for (const dirent* entry = directory ? readdir(directory) : nullptr; entry != nullptr;
       entry = readdir(directory))
    count += std::strcmp(entry->d_name, ".") != 0 && std::strcmp(entry->d_name, "..") != 0 ? 1 : 0;
  if (directory != nullptr) closedir(directory);
  return count;
}

inline Holding holding() {
  Holding now;
  if (sanitized()) {
    now.heap_bytes = static_cast<double>(__sanitizer_get_current_allocated_bytes());
  } else {
    malloc_trim(0);  // what is resident is to be what is held
    const struct mallinfo2 info = mallinfo2();
    now.heap_bytes = static_cast<double>(info.uordblks) + static_cast<double>(info.hblkhd);
  }
  long size_pages = 0, resident_pages = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "r")) {
    if (std::fscanf(file, "%ld %ld", &size_pages, &resident_pages) != 2) resident_pages = 0;
    std::fclose(file);
  }
  now.resident_bytes =
      static_cast<double>(resident_pages) * static_cast<double>(sysconf(_SC_PAGESIZE));
  now.threads = entries_of("/proc/self/task");
  now.descriptors = entries_of("/proc/self/fd") - 1;  // that of the folder itself
  return now;
}

/// Of the samples from `begin` to `end`, shares of their number.
inline double median_of(const std::vector<Holding>& samples, double Holding::*what, double begin,
                        double end) {
  const auto count = static_cast<double>(samples.size());
  std::vector<double> values;
  for (auto i = static_cast<std::size_t>(begin * count); i < static_cast<std::size_t>(end * count);
       ++i)
    values.push_back(samples[i].*what);
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// How much more is held in the last quarter than in the second one. The first one fills caches.
inline double growth_of(const std::vector<Holding>& samples, double Holding::*what) {
  return median_of(samples, what, 0.75, 1) - median_of(samples, what, 0.25, 0.5);
}

}  // namespace relit::soak
