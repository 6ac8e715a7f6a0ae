// SPDX-License-Identifier: MIT
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "container/base/result.hpp"

namespace relit::player {

/// Threads that several players share. What runs on them are strands: work that goes on in small
/// steps, one at a time and in order, on whichever thread is free. Strands take turns, a step each,
/// so that none starves. Nothing is allocated when work is handed over. Any thread, unless said
/// otherwise.
class WorkerPool {
 public:
  class Strand;

  /// Starts 1 to 64 threads. Errors: kInvalid, kEnvironment where the system has no more threads.
  static Result<std::shared_ptr<WorkerPool>> create(int threads);
  /// Joins the threads; no strand is left then, since each keeps its pool. Not on one of its
  /// threads: the last strand must not go within a step.
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  /// One a processor, as far as create() takes them.
  [[nodiscard]] static int default_threads();
  [[nodiscard]] int threads() const { return static_cast<int>(threads_.size()); }

 private:
  WorkerPool() = default;
  void run();
  void enqueue(Strand& strand);  ///< with the mutex held
  void remove(Strand& strand);   ///< with the mutex held

  std::mutex mutex_;
  std::condition_variable work_;
  std::condition_variable idle_;  ///< some strand's step has ended
  Strand* first_ = nullptr;       ///< those that wait for their turn
  Strand* last_ = nullptr;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

/// One line of work of a pool.
class WorkerPool::Strand {
 public:
  /// `step` does a little work and returns whether there is more to do at once. It never waits for
  /// another strand. It is called by one thread at a time, each call after the one before; it does
  /// not throw.
  Strand(std::shared_ptr<WorkerPool> pool, std::function<bool()> step);
  /// As close().
  ~Strand();
  Strand(const Strand&) = delete;
  Strand& operator=(const Strand&) = delete;

  /// There is work: step() will be called, also if it is just running and sees nothing of it.
  void wake();
  /// Waits until step() has returned, if it runs, and lets it run no more. Not within step().
  void close();

 private:
  friend class WorkerPool;
  enum class State { kIdle, kQueued, kRunning, kRunningAgain, kClosed };

  std::shared_ptr<WorkerPool> pool_;
  std::function<bool()> step_;
  State state_ = State::kIdle;
  bool closing_ = false;
  Strand* next_ = nullptr;
  Strand* previous_ = nullptr;
};

}  // namespace relit::player
