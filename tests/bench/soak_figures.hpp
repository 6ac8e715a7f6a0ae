// SPDX-License-Identifier: MIT
#pragma once

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

// Sanitizers have an allocator of their own, which mallinfo2() does not see.
extern "C" std::size_t __sanitizer_get_current_allocated_bytes() __attribute__((weak));

namespace relit::soak {

inline bool sanitized() { return __sanitizer_get_current_allocated_bytes != nullptr; }

/// What the process holds at a moment.
struct Holding {
  double heap_bytes = 0, resident_bytes = 0;
  int threads = 0;  ///< without those to which a driver has given names
  int descriptors = 0;
};

inline std::string line_of(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

inline std::vector<std::string> entries_of(const std::string& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.push_back(entry.path().filename());
  return names;
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
  const std::string name = line_of("/proc/self/comm");
  for (const std::string& task : entries_of("/proc/self/task"))
    now.threads += line_of("/proc/self/task/" + task + "/comm") == name ? 1 : 0;
  now.descriptors = static_cast<int>(entries_of("/proc/self/fd").size()) - 1;  // the folder's own
  return now;
}

/// The `share`th least of the samples from `begin` to `end`, shares of their number.
inline double part_of(const std::vector<Holding>& samples, double Holding::*what, double share,
                      double begin, double end) {
  const auto count = static_cast<double>(samples.size());
  std::vector<double> values;
  for (auto i = static_cast<std::size_t>(begin * count); i < static_cast<std::size_t>(end * count);
       ++i)
    values.push_back(samples[i].*what);
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

/// The same in the second and in the last quarter. The first one fills caches.
struct Quarters {
  double second = 0, last = 0;
  [[nodiscard]] double growth() const { return last - second; }
};
inline Quarters quarters_of(const std::vector<Holding>& samples, double Holding::*what,
                            double share) {
  return {part_of(samples, what, share, 0.25, 0.5), part_of(samples, what, share, 0.75, 1)};
}

}  // namespace relit::soak
