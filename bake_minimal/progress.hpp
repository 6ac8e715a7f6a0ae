// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace relit::bake {

/// One line on a terminal that says how far a stage is, at what rate, and how long it will take;
/// silent where standard error is no terminal, but for a line when a stage ends.
class Progress {
 public:
  /// `quiet` shows nothing at all.
  explicit Progress(bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Begins a stage of `total` steps of one `unit` ("frame").
  void start(std::string stage, std::uint64_t total, std::string unit);
  void advance(std::uint64_t done);
  /// Ends the stage and leaves its line standing.
  void finish();

 private:
  void show(bool last);
  [[nodiscard]] double elapsed_s() const;

  bool quiet_, terminal_, open_ = false;
  std::string stage_, unit_;
  std::uint64_t total_ = 0, done_ = 0;
  std::chrono::steady_clock::time_point started_, shown_;
};

}  // namespace relit::bake
