// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <functional>
#include <memory>

namespace relit::player {

/// Stops a source that waits for bytes: whoever opens the source hands it poll() of one of these
/// (SourceOptions::interrupt), and whoever plays it raises the flag. All functions from any thread.
class Interrupt {
 public:
  void raise() { raised_.store(true, std::memory_order_relaxed); }
  void clear() { raised_.store(false, std::memory_order_relaxed); }
  [[nodiscard]] bool raised() const { return raised_.load(std::memory_order_relaxed); }

  /// True while the flag is up; keeps the flag alive.
  [[nodiscard]] static std::function<bool()> poll(std::shared_ptr<const Interrupt> interrupt) {
    return [flag = std::move(interrupt)] { return flag->raised(); };
  }

 private:
  std::atomic<bool> raised_{false};
};

}  // namespace relit::player
