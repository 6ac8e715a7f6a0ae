// SPDX-License-Identifier: MIT
#include "bake_minimal/progress.hpp"

#include <unistd.h>

#include <cmath>
#include <cstdio>

namespace relit::bake {
namespace {

std::string duration_text(double seconds) {
  char text[32];
  const auto whole = static_cast<long>(std::lround(seconds));
  if (whole < 60) {
    std::snprintf(text, sizeof text, "%ld s", whole);
  } else {
    std::snprintf(text, sizeof text, "%ld min %02ld s", whole / 60, whole % 60);
  }
  return text;
}

}  // namespace

Progress::Progress(bool quiet) : quiet_(quiet), terminal_(::isatty(STDERR_FILENO) == 1) {}

// A stage that ended early leaves its line where it is; what follows starts on one of its own.
Progress::~Progress() {
  if (open_ && terminal_ && !quiet_) std::fputc('\n', stderr);
}

void Progress::start(std::string stage, std::uint64_t total, std::string unit) {
  stage_ = std::move(stage), unit_ = std::move(unit);
  total_ = total, done_ = 0, open_ = true;
  started_ = shown_ = std::chrono::steady_clock::now();
  show(false);
}

void Progress::advance(std::uint64_t done) {
  done_ = done;
  const auto now = std::chrono::steady_clock::now();
  if (now - shown_ < std::chrono::milliseconds(100)) return;
  shown_ = now;
  show(false);
}

void Progress::finish() {
  done_ = total_;
  show(true);
  open_ = false;
}

double Progress::elapsed_s() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - started_).count();
}

void Progress::show(bool last) {
  if (quiet_ || (!terminal_ && !last)) return;
  const double elapsed = elapsed_s();
  const double rate = elapsed > 0 ? static_cast<double>(done_) / elapsed : 0;
  std::string tail;
  if (last) {
    tail = "in " + duration_text(elapsed);
  } else if (done_ > 0 && elapsed > 0.5) {
    tail = duration_text(static_cast<double>(total_ - done_) / rate) + " left";
  }
  std::fprintf(
      stderr, "%s%-8s %5.1f %%  %llu/%llu %ss  %.2f/s  %s%s", terminal_ ? "\r\033[K" : "",
      stage_.c_str(),
      total_ == 0 ? 100.0 : 100.0 * static_cast<double>(done_) / static_cast<double>(total_),
      static_cast<unsigned long long>(done_), static_cast<unsigned long long>(total_),
      unit_.c_str(), rate, tail.c_str(), last ? "\n" : "");
  std::fflush(stderr);
}

}  // namespace relit::bake
